"""Foreign nodes without ROS: what a scenario may say of one, and that a run from its bag gives the bytes of the whole one."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.recordings.recorded_run import open_recorded, tapes
from flight_graph.recordings.recording import BagSignals, recorded_topics
from flight_graph.stepping.stepper import Stepper
from tests.graph import toy

ROOT = Path(__file__).resolve().parents[2]
CONTROLLER = {"use": "foreign", "rate_hz": 100, "inputs": {"attitude": "cubli/attitude"},
              "outputs": {"command": "cubli/wheel_command", "funnel": "cubli/funnel"}}


def cut_open(keep=slice(None)) -> Scenario:
    """The golden run of the rover, its controller taken for a foreign node, with so many of its messages."""
    run = open_recorded(ROOT / "bags/cubli_asteroid")
    data = run.scenario.resolved()
    data["components"]["controller"] = CONTROLLER
    made = Scenario(data, "cut.yaml")
    made.tapes = {key: (ticks[keep], records[keep]) for key, (ticks, records) in tapes(run.bag, made).items()}
    return made


def bodies(records) -> np.ndarray:
    return np.ascontiguousarray(records).view("u1")


def test_the_rest_of_the_graph_flies_again_on_recorded_answers():
    """The golden bag is of a run with the real controller: every message of all others is the same."""
    run, made = open_recorded(ROOT / "bags/cubli_asteroid"), cut_open()
    found = CompiledRun(made).run()
    topics = [topic for topic in recorded_topics(made) if topic.formatted is None]
    assert {topic.topic for topic in topics} == {topic.topic for topic in run.topics() if topic.formatted is None}
    signals = BagSignals(run.bag, run.scenario)
    for topic in topics:
        assert np.array_equal(bodies(found[topic.topic]), bodies(signals[topic.topic])), topic.topic


def test_a_stepped_run_goes_back_on_the_tape():
    run = Stepper(cut_open())
    run.until(tick=30)
    there = run.read("plant.command.effort").copy()
    assert np.array_equal(there, run.read("controller.command.effort"))
    run.step(3)
    run.back(ticks=20)
    run.until(tick=30)
    assert np.array_equal(run.read("plant.command.effort"), there)


def test_a_missing_answer_is_held():
    """Of each two answers the second is lost: the plant takes the one before it."""
    whole, half = cut_open(), cut_open(slice(None, None, 2))
    effort = CompiledRun(half).run()["cubli/truth"]["torque"]  # held over the interval before
    recorded = whole.tapes["controller", "command"][1]["effort"]
    assert np.array_equal(effort[1::2][:10], effort[2::2][:10])
    assert np.array_equal(effort[1:20:2], recorded[0:20:2])


def test_plain_python_plays_the_tape_as_well():
    program = ("from tests.graph.test_foreign_nodes import cut_open, CompiledRun, bodies; import numpy as np; made = cut_open();"
               "flight = CompiledRun(made).start(20); flight.advance(20); found = flight.logged();"
               "real = made.tapes['controller', 'command'][1]; found = found['cubli/truth']['torque'];"
               "assert np.array_equal(found[1:20], real['effort'][:19]), found")
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True,
                          env={**os.environ, "NUMBA_DISABLE_JIT": "1"})
    assert done.returncode == 0, done.stderr


def test_only_nodes_can_fly_it_and_the_sentence_says_what_else_there_is():
    made = Scenario(cut_open().resolved(), "again.yaml")
    assert made.foreign == ["controller"] and made.resolved()["components"]["controller"]["late"] == "stop"
    with pytest.raises(FlightError, match="only --engine ros can fly it, with that node running"):
        CompiledRun(made)
    run = Stepper(cut_open())
    for settings, sentence in (({"plant.mass": 2.1}, "which this reaches; what it would have answered"),
                               ({"seed": 3}, "which this reaches"), ({"duration_s": 1000.0}, "after t = .* is not in the bag")):
        with pytest.raises(FlightError, match=sentence):
            run.branch(settings)
    other = run.branch({"monitor.gravity": 0.003})  # the monitor tells the foreign node nothing
    other.until(tick=20), run.until(tick=20)
    assert np.array_equal(other.read("plant.truth.rates"), run.read("plant.truth.rates"))
    assert not np.array_equal(other.read("monitor.margins.normal_force"), run.read("monitor.margins.normal_force"))


def test_another_component_takes_its_place():
    """What was said of the foreign node goes with it."""
    made = load(ROOT / "examples/foreign/cubli_foreign.yaml", {"controller.use": "cubli_ros/pd_controller"})
    assert not made.foreign and made.graph.nodes["plant"].inputs["command"].node == "controller"


def test_it_takes_the_signals_of_the_graph():
    """Also of topics that no package declares: those of the user's own components."""
    data = toy.scenario()
    data["components"]["controller"] = {"use": "foreign", "rate_hz": 50, "inputs": {"imu": "/toy/imu"},
                                        "outputs": {"command": "toy/command"}}
    made = Scenario(data, "toy.yaml")
    assert made.graph.nodes["controller"].component.outputs["command"] is toy.COMMAND
    assert made.recorded()["controller", "command"] == 1


@pytest.mark.parametrize("change, sentence", [
    ({"rate_hz": None}, "controller.rate_hz is missing"),
    ({"inputs": None, "outputs": None}, "has inputs, outputs or both"),
    ({"outputs": {"command": "cubli/wheel_comand"}}, "did you mean 'cubli/wheel_command'"),
    ({"outputs": {"attitude": "cubli/wheel_command"}}, "attitude: inputs and outputs at once"),
    ({"outputs": {"1": "cubli/wheel_command"}}, "letters, digits and _"),
    ({"outputs": {"x": "cubli/wheel_command"}}, "^bad.yaml: components.controller.outputs: 'x' is no name for a port"),
    ({"outputs": {"command": "cubli/imu"}}, "both publish 'cubli/imu'"),
    ({"parameters": {"kp": 1}}, "parameters are its own"),
    ({"late": "zero"}, "controller.late"),
    ({"answer_within_s": 0}, "controller.answer_within_s"),
    ({"use": "cubli_ros/pd_controller"}, "of a foreign node"),
])
def test_bad_scenarios(change, sentence):
    data = cut_open().resolved()
    data["components"]["controller"] = {key: value for key, value in {**CONTROLLER, **change}.items() if value is not None}
    data["connect"] = {}
    with pytest.raises(FlightError, match=sentence):
        Scenario(data, "bad.yaml")


@pytest.mark.parametrize("key, value, sentence", [
    ("faults", [{"id": "f", "at": "controller.command.effort[0]", "type": "bias", "value": 1.0}], "which nothing here can break"),
    ("connect", {"controller.attitude": {"from": "estimator.attitude", "delay": 1}}, "takes what it takes"),
])
def test_what_a_foreign_node_cannot_have(key, value, sentence):
    data = {**cut_open().resolved(), key: value}
    with pytest.raises(FlightError, match=sentence):
        Scenario(data, "bad.yaml")
