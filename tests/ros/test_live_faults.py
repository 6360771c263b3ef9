"""Faults injected while a graph runs: by the command and by any client of parameters; the bag verifies, what is wrong is said."""

import json
import os

import pytest
import yaml
from mcap.reader import make_reader

from flight_graph.graphs.fault_scores import scores
from flight_graph.recordings.recording import open_run
from tests.graph import toy
from tests.ros.processes import finish, flight, running, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("live faults")]
DOMAIN = str(120 + os.getpid() % 80)


def fault(*arguments, cwd):
    done = flight("fault", *arguments, cwd=cwd, ROS_DOMAIN_ID=DOMAIN)
    assert "Traceback" not in done.stderr, done.stderr
    return done


def test_injected_faults_begin_for_all_at_once_and_the_bag_is_run_again_from_itself(tmp_path):
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(toy.scenario(live_faults=3)))
    bag = tmp_path / "bag"
    with running("run", tmp_path / "toy.yaml", "--trust", "--engine", "ros", "--duration", 20000, "--out", bag, "--json",
                 cwd=tmp_path, ROS_DOMAIN_ID=DOMAIN) as process:
        until(lambda: (bag / "RECORDING").exists(), 60.0, "the recorder")
        made = json.loads(fault("sensor.imu.angular_velocity[1]", "bias", 0.5, "--for", 3, "--json", cwd=tmp_path).stdout)
        assert (made["id"], made["type"], made["value"], made["for_s"]) == ("live_1", "bias", 0.5, 3.0)
        hung = json.loads(fault("controller", "hang", "--for", 0.4, "--json", cwd=tmp_path).stdout)
        assert hung["from_s"] > made["from_s"] > 0.0
        for wrong, said in ((("sensor.imu.angular_velocty[1]", "bias", 1), "did you mean 'angular_velocity'"),
                            (("--clear", "live_9"), "no injected fault called 'live_9'")):
            done = fault(*wrong, cwd=tmp_path)
            assert done.returncode == 2 and said in done.stderr, done.stderr
        listed = json.loads(fault("--list", "--json", cwd=tmp_path).stdout)["faults"]
        assert [one["id"] for one in listed] == ["live_1", "live_2"]
        status, _, err = finish(process)
    assert status == 2 and "interrupted" in err, err
    with next(bag.glob("*.mcap")).open("rb") as file:
        found = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
    assert [json.loads(text)["id"] for text in found["flight_graph.injected"].values()] == ["live_1", "live_2"]
    verified = flight("verify", bag, "--trust", cwd=tmp_path)
    assert verified.returncode == 0 and "equal, byte for byte" in verified.stdout, verified.stdout + verified.stderr
    _, scenario, signals = open_run(bag, trust=True)
    assert scores(scenario, signals)["fault_onset_s"] == pytest.approx(made["from_s"], abs=0.006)


def test_without_a_graph_the_command_says_so(tmp_path):
    done = flight("fault", "controller", "hang", cwd=tmp_path, ROS_DOMAIN_ID=DOMAIN, FLIGHT_TIMEOUT_S="1")
    assert done.returncode == 2 and f"there is no node /faults on ROS domain {DOMAIN}" in done.stderr, done.stderr
    done = flight("fault", "controller", cwd=tmp_path)
    assert done.returncode == 2 and "name a place and what happens there" in done.stderr
