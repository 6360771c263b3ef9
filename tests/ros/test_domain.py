"""Runs that start at the same moment: each on a domain of its own, or a sentence."""

import json
import os
import socket
import subprocess
import sys

import pytest
import yaml
from mcap.reader import make_reader

from flight_graph.errors import FlightError
from flight_graph.ros.domain import Domain
from flight_graph.ros.patience import at_least
from tests.graph import toy
from tests.ros.processes import start

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("domain")]

HOLDER = """
import sys
from flight_graph.ros.domain import Domain
with Domain(["a/b"]) as domain:
    print(domain.number, flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def unset(monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def held(**changes):
    """A process that holds the topic a/b of a domain, and that domain."""
    environment = {**os.environ, **changes}
    process = subprocess.Popen([sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                               env=environment)
    return process, int(process.stdout.readline())


def test_two_processes_never_take_the_same_domain(unset):
    holders = [held() for _ in range(3)]
    with Domain(["other"]) as own:
        numbers = [own.number, *(number for _, number in holders)]
        assert own.is_own and len(set(numbers)) == 4 and all(0 < number <= 101 for number in numbers)
    for process, _ in holders:
        process.communicate("\n")


def test_a_domain_with_an_open_port_is_not_taken(unset):
    with Domain([]) as first:
        number = first.number
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as busy:
        busy.bind(("127.0.0.1", 7400 + 250 * number + 17))
        with Domain([]) as second:
            assert second.number != number


def test_a_named_domain_with_another_graph_is_refused_by_name(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "93")
    process, number = held()
    assert number == 93
    with pytest.raises(FlightError, match=r"ROS_DOMAIN_ID=93: another run .* publishes /clock, /a/b there; .* unset"):
        Domain(["a/b", "c"])
    process.communicate("\n")
    with Domain(["a/b", "c"]) as domain:  # it goes with its process
        assert domain.number == 93 and not domain.is_own


@pytest.mark.parametrize("text", ["-1", "233", "five", "1.0"])
def test_a_domain_that_is_none_is_refused(monkeypatch, text):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(FlightError, match=f"ROS_DOMAIN_ID={text}: allowed: a whole number from 0 to 232"):
        Domain([])


def test_two_runs_at_the_same_moment(unset, tmp_path):
    """Both are complete and equal; each says on which domain it was, and its bag says so too."""
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(toy.scenario()))
    runs = [start("run", tmp_path / "toy.yaml", "--trust", "--engine", "ros", "--out", tmp_path / name, "--json", cwd=tmp_path)
            for name in "ab"]
    made = []
    for process in runs:
        out, err = process.communicate(timeout=at_least(300.0))
        assert process.returncode == 0, err
        made.append(json.loads(out))
        assert f"on ROS domain {made[-1]['ros_domain_id']}, which was free" in err
    assert len({found["ros_domain_id"] for found in made}) == 2
    payloads = []
    for found in made:
        assert found["lost"] == 0
        with next((tmp_path / found["bag"]).glob("*.mcap")).open("rb") as file:
            reader = make_reader(file)
            metadata = {record.name: record.metadata for record in reader.iter_metadata()}
            payloads.append([(channel.topic, message.data) for _, channel, message in reader.iter_messages()])
        assert metadata["flight_graph.ros"] == {"domain_id": str(found["ros_domain_id"])}
    assert payloads[0] == payloads[1]
