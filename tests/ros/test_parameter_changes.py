"""Parameters that are set while a graph runs, by ROS and by the scenario's events: the bag verifies, and says when each was set."""

import json
import os

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader

from flight_graph.recordings.recording import open_run
from tests.graph import toy
from tests.ros.processes import finish, flight, running, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("live faults")]
DOMAIN = 120 + os.getpid() % 80


@pytest.fixture
def client(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    from tests.ros.test_nodes import Client
    made = Client()
    yield made
    made.close()


@pytest.mark.parametrize("events", [None, [{"at_s": 0.5, "set": {"controller.kp": 0.7}}]])
def test_what_ros_sets_is_in_the_bag_which_is_run_again_from_itself(tmp_path, client, events):
    """With events of the scenario, one of them behind what is set."""
    late = [] if events is None else [{"at_s": 2000.0, "set": {"controller.kp": 0.6}}]
    data = toy.scenario(**({} if events is None else {"events": events + late}))
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(data))
    bag = tmp_path / "bag"
    with running("run", tmp_path / "toy.yaml", "--trust", "--engine", "ros", "--duration", 20000, "--out", bag, cwd=tmp_path,
                 ROS_DOMAIN_ID=str(DOMAIN)) as process:
        until(lambda: _size(bag) > 20_000, 60.0, "messages in the bag")
        assert client.set("/controller", "kd", 0.25).successful
        assert client.set("/plant", "inertia", 3.0).successful
        refused = client.set("/controller", "kd", 11.0)
        assert not refused.successful and "11" in refused.reason
        assert client.get("/controller", "kd") == 0.25
        before = _size(bag)
        until(lambda: _size(bag) > before + 200_000, 60.0, "messages behind what was set")
        finish(process)
    with next(bag.glob("*.mcap")).open("rb") as file:
        found = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
    told = {key: (value, entry["at_s"]) for text in found["flight_graph.set"].values()
            for entry in [json.loads(text)] for key, value in entry["set"].items()}
    assert {key: value for key, (value, _) in told.items()} == {"controller.kd": 0.25, "plant.inertia": 3.0}
    verified = flight("verify", bag, "--trust", cwd=tmp_path)
    assert verified.returncode == 0 and "equal, byte for byte" in verified.stdout, verified.stdout + verified.stderr
    _, scenario, signals = open_run(bag, trust=True)
    at = told["controller.kd"][1]
    imu, command = signals["toy/imu"], signals["toy/command"]
    gains = {t: -(c + kp * a) / w for t, c, a, w, kp in _samples(scenario, imu, command, events, at)}
    assert all(gain == pytest.approx(0.25 if t >= at else 0.8, rel=1e-4) for t, gain in gains.items()) and len(gains) > 50


def _size(bag) -> int:
    return sum(path.stat().st_size for path in bag.glob("*.mcap")) if bag.exists() else 0


def _samples(scenario, imu, command, events, at):
    """(time, effort, angle, rate, kp) of the commands around a time whose rate is not small."""
    epoch = scenario.epoch_ns

    def times(record):
        return (record["header"]["stamp"]["sec"].astype(np.int64) * 10**9 + record["header"]["stamp"]["nanosec"] - epoch) / 1e9
    sensed = {round(t * 1e3): row for t, row in zip(times(imu), imu)}
    for t, row in zip(times(command), command):
        seen = sensed.get(round(t * 1e3))
        if seen is not None and abs(t - at) < 1.0 and abs(seen["angular_velocity"][0]) > 1e-6:
            kp = 0.5 if events is None or t < 0.5 else 0.7
            yield t, row["effort"][0], seen["linear_acceleration"][0], seen["angular_velocity"][0], kp


def test_events_of_a_scenario_give_the_same_bytes_as_nodes(tmp_path):
    data = toy.scenario(duration_s=1.0, events=[{"at_s": 0.3333, "set": {"controller.kp": 0.9, "plant.inertia": 3.0}},
                                                {"at_s": 0.5, "set": {"sensor.sigma": 0.1}}])
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(data))
    done = flight("run", tmp_path / "toy.yaml", "--trust", "--engine", "ros", "--out", tmp_path / "bag", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    verified = flight("verify", tmp_path / "bag", "--trust", cwd=tmp_path)
    assert verified.returncode == 0 and "equal, byte for byte" in verified.stdout, verified.stdout + verified.stderr
    replayed = flight("replay", tmp_path / "bag", "--component", "controller", "--trust", cwd=tmp_path)
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
