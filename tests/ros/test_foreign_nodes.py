"""Nodes that are not ours fly in a graph in lockstep: their messages are judged, recorded, and the run is made again."""

import json
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
import rclpy
import yaml

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recorded_run import open_recorded
from flight_graph.recordings.recording import BagSignals
from flight_graph.replays.verify import verify
from flight_graph.ros import shared_memory
from flight_graph.ros.patience import at_least
from flight_graph.ros.ports import LoopOnly, RawPublisher
from flight_graph.ros.stand_in import Answers
from msg_schemas import cubli
from tests.ros.processes import ROOT, environment, flight, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("foreign")]
DOMAIN = "119"
COMMAND = "/cubli/wheel_command"


@contextmanager
def beside(*command):
    """A node that is not ours, running during the block."""
    process = subprocess.Popen([sys.executable, *map(str, command)], cwd=ROOT, env=environment(ROS_DOMAIN_ID=DOMAIN),
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(timeout=at_least(5.0))
        except subprocess.TimeoutExpired:  # the middleware's exit can hang; what the node had to do is done
            process.kill()
            process.wait()
        shared_memory.clean_up()  # of a node that was killed


def fly(scenario, out, *arguments):
    return flight("run", scenario, "--engine", "ros", "--out", out, "--json", *arguments, cwd=out.parent, ROS_DOMAIN_ID=DOMAIN)


def plant_and_law(folder, **changes):
    """A scenario file of two components: the plant, and a foreign node that reads the truth."""
    file = folder / "two.yaml"
    file.write_text(yaml.safe_dump({
        "name": "two", "title": "A plant and a foreign node", "duration_s": 0.7, "components": {
            "plant": {"use": "sim_nodes/cubli_plant"},
            "controller": {"use": "foreign", "rate_hz": 100, "inputs": {"attitude": "cubli/truth/attitude"},
                           "outputs": {"command": "cubli/wheel_command"}, **changes}}}))
    return file


def test_the_tutorials_node_flies_and_its_bag_is_run_again(tmp_path):
    """The torques are those of the law as it is written, of the recorded estimates; and a changed answer is found."""
    with beside("examples/foreign/pd_node.py"):
        done = fly(ROOT / "examples/foreign/cubli_foreign.yaml", tmp_path / "bag", "--duration", "0.6")
    assert done.returncode == 0, done.stderr
    assert f"start it with ROS_DOMAIN_ID={DOMAIN}" in done.stderr
    run = open_recorded(tmp_path / "bag")
    signals = BagSignals(run.bag, run.scenario)
    attitude, command = signals["cubli/attitude"], signals["cubli/wheel_command"]
    assert run.complete and len(attitude) == len(command) == 60
    turn = 2.0 * np.sign(attitude["orientation"][:, 3:]) * attitude["orientation"][:, :3]
    expected = -0.08 / 6 * (turn + attitude["angular_velocity"])
    assert np.allclose(command["effort"], expected, rtol=1e-12) and np.abs(expected).max() > 1e-4
    result = verify(tmp_path / "bag")
    assert result.verdict == "equal" and any("60 on /cubli/wheel_command" in one for one in result.sentences)
    run.scenario.tapes["controller", "command"][1]["effort"][20, 1] += 1e-9
    again = CompiledRun(run.scenario).run()["cubli/truth"]["rates"]
    assert np.array_equal(again[:21], signals["cubli/truth"]["rates"][:21])
    assert not np.array_equal(again[21], signals["cubli/truth"]["rates"][21])


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here")
def test_firmware_in_c_beside_the_graph_gives_the_bytes_of_the_compiled_run(tmp_path):
    """The law as C, its messages as bytes: the closed loop through it is that of the component, bit for bit."""
    for file in (ROOT / "examples/foreign/firmware").iterdir():
        shutil.copy(file, tmp_path)
    made = flight("export-c", "cubli_ros/appc_controller", "--out", tmp_path / "law", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    subprocess.run(["cc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC", "-Ilaw", "firmware.c",
                    "law/appc_controller_data.c", "-Llaw", "-lappc_controller", "-o", "firmware.so"], cwd=tmp_path, check=True)
    file = plant_and_law(tmp_path, outputs={"command": "cubli/wheel_command", "funnel": "cubli/funnel"})
    with beside(tmp_path / "firmware_node.py", tmp_path / "firmware.so", "--ros-args", "-r",
                "cubli/attitude:=cubli/truth/attitude"):
        done = fly(file, tmp_path / "bag")
    assert done.returncode == 0, done.stderr
    found, data = read_bag(tmp_path / "bag"), yaml.safe_load(file.read_text())
    data["components"]["controller"] = {"use": "cubli_ros/appc_controller"}
    expected = CompiledRun(Scenario({**data, "connect": {"controller.attitude": "plant.attitude"}}, "law.yaml")).run()
    assert {"cubli/wheel_command", "cubli/funnel", "cubli/truth"} < {track.topic for track in expected.tracks}
    for track in expected.tracks:
        assert np.array_equal(track.signal.payloads(track.records), np.asarray(found.payloads(f"/{track.topic}"))), track.topic


def test_answers_that_are_late_or_wrong_are_counted_and_the_last_one_is_held(tmp_path, monkeypatch):
    """Missing, missing, wrong stamp, not a number, wrong names, two at once, then killed: the plant holds what came before.

    All of it inside of a vehicle; its bag is run again in process and as nodes.
    """
    plant_and_law(tmp_path, late="hold", answer_within_s=0.4)
    (tmp_path / "whole.yaml").write_text("{name: whole, title: a vehicle, duration_s: 0.7, include: {rover_a: two.yaml}}")
    with beside("-m", "tests.ros.foreign_node", "many", "cubli/truth/attitude", "--ros-args", "-r", "__ns:=/rover_a"):
        done = fly(tmp_path / "whole.yaml", tmp_path / "bag")
    assert done.returncode == 0, done.stderr
    counts = json.loads(done.stdout)["statistics"]["rover_a_controller_stand_in"]
    for words in ("a stamp that was not asked for", "effort of a message is not finite", "name is ['wheel',",
                  "more than one answer to one stamp"):
        assert any(words in reason for reason in counts["reasons"]), (words, counts["reasons"])
    bag = read_bag(tmp_path / "bag")
    command = f"/rover_a{COMMAND}"
    there = set((bag.stamps_ns(command) - bag.start_ns) // 10_000_000)
    assert not there & {9, 19, 29, 39, 49, *range(65, 70)}
    assert counts["late"] == 70 - len(there) and counts["refused_messages"] >= 4
    assert bag.metadata["flight_graph.outcome"][f"late {command}"] == str(counts["late"])
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    for engine in ("compiled", "ros"):
        result = runs.verify(tmp_path / "bag", engine)
        assert result.verdict == "equal" and any(f"{counts['late']} late" in one for one in result.sentences)


def test_a_late_answer_stops_the_run_where_it_may_not_be_held():
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("late", context=context, start_parameter_services=False)
    node.settings = SimpleNamespace(supervised=True, epoch_ns=0, period_ns=10_000_000, subscribers={"command": 0})
    node.component, node.stands_for, node.check_alive = SimpleNamespace(answer_within_s=0.2, late="stop"), "law", lambda: None
    answers = Answers(node, "command", cubli.COMMAND, LoopOnly())
    sender = RawPublisher(node, cubli.COMMAND.topic, cubli.COMMAND.type_name, cubli.COMMAND.role.qos)
    until(answers.subscription.publishers, 30.0, "both ends")
    payload, record = cubli.COMMAND.new()
    for nanosec in (0, 20_000_000):
        record["header"]["stamp"]["nanosec"] = nanosec
        sender.publish(payload.tobytes())
    answers.wait_for(0)
    with pytest.raises(FlightError, match="law: the foreign node is late: /cubli/wheel_command has no answer to t = 0.010000000"
                       r" s within .*; its last answer is to t = 0.000000000 s; refused 1: .* \(the first: t = 0.02"):
        answers.wait_for(10_000_000)
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_a_node_that_never_appears_is_named_with_what_it_has_to_do(tmp_path, monkeypatch):
    """By the stand-in alone, in this process."""
    from flight_graph.ros import stand_in
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    file = tmp_path / "stand_in.yaml"
    values = {"stands_for": "controller", "rate_hz": 100.0, "graph.scenario": str(plant_and_law(tmp_path)),
              "graph.pace": "lockstep", "graph.duration_s": 0.7, "graph.clock_master": False, "graph.match_s": 0.5}
    file.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}))
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    events = []
    try:
        status = stand_in.run_stand_in(["--ros-args", "--params-file", str(file)], events.append)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert status == 1 and len(events) == 2
    for words in ("a subscription of controller to /cubli/truth/attitude (sensor_msgs/msg/Imu)", "a foreign node, which is started beside this run",
                  f"ROS_DOMAIN_ID={DOMAIN}"):
        assert words in events[1]["error"]
