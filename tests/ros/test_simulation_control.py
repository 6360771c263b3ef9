"""A run of nodes under control: it stands, steps, goes on, is taken back and ended by services, and its bags say so."""

import json
import os
import time

import pytest
import yaml
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.graphs.scenario import load
from flight_graph.ros.launch_description import node_table
from flight_graph.timebase import J2000
from tests.graph import toy
from tests.ros.processes import finish, running, start, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("live faults")]
DOMAIN = 120 + os.getpid() % 80
TICK_MS = 5


class Operator:
    """Who controls the run: calls the services of std_srvs, and hears /clock with a node on simulation time."""

    def __init__(self, client):
        self.client, self.heard = client, client.listen(Clock, "/clock")
        client.node.set_parameters([Parameter("use_sim_time", value=True)])

    def call(self, name):
        return self.client.call(Trigger, f"/simulation/{name}", Trigger.Request())

    def done(self, name) -> str:
        answer = self.call(name)
        assert answer.success, answer.message
        return answer.message

    def refused(self, name) -> str:
        answer = self.call(name)
        assert not answer.success
        return answer.message

    def state(self) -> dict:
        return json.loads(self.done("state"))

    def set(self, name, value):
        answer = self.client.set("/simulation", name, value)
        assert answer.successful, answer.reason

    def motion(self) -> dict:
        """Where the plant is."""
        return json.loads(self.done("entities"))["plant"]

    def stamps_ms(self, count: int) -> list[int]:
        """Stamps of /clock since the start [ms], once so many have come."""
        self.client.spin_until(lambda: len(self.heard) >= count, what=f"{count} messages of /clock")
        return [(one.clock.sec * 10**9 + one.clock.nanosec - J2000) // 10**6 for one in self.heard]

    def now_ms(self) -> int:
        """Time of the node on simulation time."""
        return (self.client.node.get_clock().now().nanoseconds - J2000) // 10**6


@pytest.fixture
def operator(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    from tests.ros.test_nodes import Client
    client = Client()
    yield Operator(client)
    client.close()


def started(folder, *arguments):
    """A controlled run of the toy, which stands at its start, into folder/bag."""
    data = toy.scenario()
    data["components"]["plant"]["use"] = f"{toy.__file__}:Drifter"
    (folder / "toy.yaml").write_text(yaml.safe_dump(data))
    return running("run", folder / "toy.yaml", "--trust", "--engine", "ros", "--control", "--out", folder / "bag", "--json",
                   *arguments, cwd=folder, ROS_DOMAIN_ID=str(DOMAIN))


def ended(process) -> dict:
    """What a run that ends by itself prints."""
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    return json.loads(out)


def entries(bag) -> list[dict]:
    """What was done to a run, by its bag."""
    return [json.loads(text) for text in read_bag(bag).metadata["flight_graph.control"].values()]


def test_a_run_stands_steps_is_taken_back_and_leaves_bags_that_verify(tmp_path, operator):
    """Behind all that, from its start again, it leaves the bytes of a run that nobody touched."""
    with started(tmp_path) as process:
        assert operator.state() == {"state": "stopped", "t_s": 0.0, "stands": True, "rate": 0.0, "segment": 0}
        assert operator.refused("step") == "the run is stopped; steps are made where it is paused"
        assert operator.done("pause") == "the run is paused; t = 0 s"
        operator.set("steps", 5)
        assert operator.done("step") == "5 steps; t = 0.025 s"
        assert operator.stamps_ms(5) == [0, 5, 10, 15, 20]
        assert operator.done("pause") == "the run is paused already; t = 0.025 s"
        assert operator.client.set("/controller", "kd", 0.25).successful
        assert operator.done("step") == "5 steps; t = 0.05 s"
        assert operator.stamps_ms(10) == [*range(0, 50, TICK_MS)]  # none between the steps
        operator.client.spin_until(lambda: operator.now_ms() == 45, what="the node's own clock")
        assert operator.client.set("/plant", "inertia", 3.0).successful
        operator.set("place", "plant.position=[0.2, 0, 0]")
        assert operator.done("place") == "plant is put elsewhere; t = 0.05 s"
        operator.set("place", "plant.velocity=[0, 0, 1]")
        operator.done("place")
        assert operator.motion() | {"orientation": 0} == {
            "t_s": 0.05, "frame": "toy_world", "position": [0.2, 0.0, 0.0], "orientation": 0, "velocity": None,
            "angular_velocity": None, "acceleration": None, "angular_acceleration": None}
        operator.set("place", "plant.position=[4, 0, 0]")
        assert operator.refused("place") == "plant: it was put beyond 3 rad"
        operator.done("step")
        assert 0.0 < 0.2 - operator.motion()["position"][0] < 1e-3 and operator.motion()["t_s"] == 0.075

        operator.set("reset_to_s", 0.08)
        assert operator.refused("reset") == "the run has come to t = 0.075 s; it cannot be taken back to t = 0.08 s"
        off = operator.client.set("/simulation", "reset_to_s", 0.0401)
        assert not off.successful and "there is no tick at t = 0.0401 s" in off.reason
        operator.set("reset_to_s", 0.055)  # between two firings of the slower nodes
        assert operator.done("reset") == "the run was taken back to t = 0.055 s; t = 0.055 s"
        assert operator.state() == {"state": "paused", "t_s": 0.055, "stands": True, "rate": 0.0, "segment": 1}
        assert 0.0 < 0.2 - operator.motion()["position"][0] < 1e-4  # it was put there before
        operator.set("place", "plant.velocity=[0, 0.5, 0]")
        operator.done("place")
        assert operator.client.set("/sensor", "sigma", 0.1).successful  # what begins at a checkpoint is set again
        operator.done("step")
        assert operator.stamps_ms(20)[14:] == [70, 55, 60, 65, 70, 75]

        assert operator.done("stop") == "the run was taken back to t = 0 s; t = 0 s"
        assert operator.state()["state"] == "stopped"
        operator.set("rate", 10.0)
        began = time.monotonic()
        operator.done("play")
        assert operator.refused("step") == "the run is playing; steps are made where it is paused"
        made = ended(process)
        assert time.monotonic() - began > 0.9 * 2.0 / 10.0  # [s]
    bags = [tmp_path / name for name in ("bag", "bag_reset_1", "bag_reset_2")]
    assert [*made["earlier_bags"], made["bag"]] == [str(bag) for bag in bags] and not made["was_ended"]
    assert entries(bags[0]) == [{"tick": 15, "t_s": 0.075, "did": "stepped", "steps": 15},
                                {"tick": 15, "t_s": 0.075, "did": "taken back to t = 0.055 s"}]
    assert entries(bags[1])[0] == {"tick": 11, "t_s": 0.055, "did": "taken back from t = 0.075 s of bag"}
    assert [one["did"] for one in entries(bags[2])] == ["taken back from t = 0.08 s of bag_reset_1", "rate 10", "played"]
    begins = read_bag(bags[1]).metadata["flight_graph.begins"]
    assert (begins["parent"], begins["tick"]) == ("bag", "11")
    put = [json.loads(text)["place"] for text in read_bag(bags[0]).metadata["flight_graph.set"].values() if "place" in text]
    assert put == [{"plant": {"position": [0.2, 0.0, 0.0], "velocity": [0.0, 0.0, 1.0]}}]
    for bag in bags:
        result = runs.verify(bag, trust=True)
        assert result.verdict == "equal", result.sentences
    runs.execute(load(str(tmp_path / "toy.yaml")), out=tmp_path / "compiled")
    assert [*read_bag(bags[2]).messages()] == [*read_bag(tmp_path / "compiled").messages()]


def test_nodes_that_a_launch_has_started_begin_again_in_their_processes(tmp_path, operator):
    """Started singly, as a launch does it; of a graph of one plant, so that it is cheap."""
    data = toy.scenario(components={"plant": {"use": f"{toy.__file__}:Drifter", "rate_hz": 200}}, connect={})
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(data))
    scenario, nodes = load(str(tmp_path / "toy.yaml")), {}
    try:
        for row in node_table(scenario, "lockstep", 1.0, str(tmp_path / "bag"), str(tmp_path / "toy.yaml"), controlled=True):
            path = tmp_path / f"{row['name']}.yaml"
            path.write_text(yaml.safe_dump({f"/**/{row['name']}": {"ros__parameters": row["parameters"]}}))
            what = row["arguments"][1:] or [row["package"], row["executable"]]
            nodes[row["name"]] = start("node", *what, "--ros-args", "-r", f"__node:={row['name']}", "--params-file", path,
                                       cwd=tmp_path, ROS_DOMAIN_ID=str(DOMAIN))
        operator.done("pause")
        operator.set("steps", 5)
        operator.set("place", "plant.velocity=[0, 0, 1]")
        operator.done("place")
        operator.done("step")
        operator.set("reset_to_s", 0.01)
        assert operator.done("reset") == "the run was taken back to t = 0.01 s; t = 0.01 s"
        assert operator.motion()["position"][2] > -0.3 + 0.009 and operator.motion()["t_s"] == 0.01
        assert not any(process.poll() for process in nodes.values())
        assert operator.done("step") == "5 steps; t = 0.035 s"
        assert operator.done("quit").startswith("the run ends")
        assert nodes["simulation"].wait(60) == 0
    finally:
        for process in nodes.values():
            finish(process)
    for bag in (tmp_path / "bag", tmp_path / "bag_reset_1"):
        result = runs.verify(bag, trust=True)
        assert result.verdict == "equal", result.sentences


def test_realtime_stands_without_falling_behind_and_takes_another_rate(tmp_path, operator):
    """Whoever is late would make good what the run has stood; who is busy can only be slower than the rate."""
    with started(tmp_path, "--pace", "realtime", "--duration", 100) as process:
        operator.done("play")
        operator.stamps_ms(10)
        operator.done("pause")
        stood = time.monotonic()
        at = operator.state()["t_s"]
        until(lambda: time.monotonic() - stood > 0.6)  # the wall's clock is what is tested
        assert operator.state()["t_s"] == at
        for rate in (1.0, 4.0):
            operator.set("rate", rate)
            operator.done("play")
            began, first = time.monotonic(), len(operator.heard)
            operator.stamps_ms(first + 80)
            assert time.monotonic() - began > 0.9 * 0.4 / rate
            operator.done("pause")
        refused = operator.client.set("/simulation", "rate", 0.0)
        assert not refused.successful and "greater than 0" in refused.reason
        assert operator.done("quit").startswith("the run ends, its bag is closed; t = ")
        assert ended(process)["was_ended"]
    stamps = operator.stamps_ms(1)
    assert stamps == sorted(set(stamps))
    assert [one["did"] for one in entries(tmp_path / "bag")] == [
        "played", "paused", "rate 1", "played", "paused", "rate 4", "played", "paused", "ended by who controls it"]
