"""The catalogue: all its faults make sense in the graph; no alarm without a fault; each kind ends where the page says."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.faults.places import place
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load, vary_case

SCENARIO = load("spacerobot_faults")
NAMES = [name for name, _ in SCENARIO.vary.combinations]
ROOT = Path(__file__).parents[2]


def case(name):
    """The scenario of a variant, at its first onset."""
    return vary_case(SCENARIO, NAMES.index(name), {})


def judged(name):
    scenario = case(name)
    recording = CompiledRun(scenario).run()
    return metrics.compute(scenario, recording)


def test_there_are_enough_faults_and_each_can_be_flown():
    assert len(set(NAMES)) > 40
    for name in sorted(set(NAMES)):
        assert case(name).faults.faults[0].unit, name


def test_without_a_fault_no_alarm():
    for seed in (1, 2, 3, 4):
        scenario = load("spacerobot_faults", {"seed": seed})
        found = metrics.compute(scenario, CompiledRun(scenario).run())
        assert found["false_alarms"] == 0 and found["final_mode"] == "track" and found["mode_changes"] == 0


@pytest.mark.parametrize("name, isolated, mode", [
    ("gyro stuck", True, "track"), ("tracker jump", True, "track"), ("encoder 3 stuck", True, "track"),
    ("joint rate 2 bias", True, "track"), ("torque sensor 2 bias", True, "track"), ("accelerometer bias", True, "track"),
    ("joint 2 seized", True, "hold"), ("joint 3 brake closes", True, "hold"), ("joint 2 friction 0.02 N m", True, "hold"),
    ("drive 2 dead", True, "hold"), ("wheel x drags", True, "hold"), ("estimator crashes", True, "free"),
    ("estimator restarts", True, "track"),
    ("law hangs", True, "track"), ("encoder 2 drift", False, "track"), ("reference frozen", None, "hold")])
def test_what_a_fault_ends_in(name, isolated, mode):
    found = judged(name)
    assert found["fault_detected"] and found["false_alarms"] == 0
    assert found["fault_isolated"] is isolated and found["final_mode"] == mode


def test_backlash_is_not_seen_in_this_slow_motion_and_does_no_harm():
    found = judged("joint 4 backlash")
    assert not found["fault_detected"] and found["final_mode"] == "track" and found["joint_rms_deg"] < 0.02


def test_a_parameter_is_named_where_an_output_has_that_name_too():
    """The plant has an output ``parameters``: its fields come first, and other names are the plant's own parameters."""
    nodes = SCENARIO.graph.nodes
    assert place("plant.parameters.joint_seized[1]", nodes, "here").kind == "a parameter"
    assert place("plant.parameters.pi[0]", nodes, "here").kind == "a field of an output"
    with pytest.raises(FlightError, match="no field called 'joint_seize'"):
        place("plant.parameters.joint_seize[1]", nodes, "here")


def digests():
    """SHA-256 of each topic's messages of 0.2 s in which joint 2 seizes while it turns: friction, doubt and monitors."""
    fault = {"at": "plant.parameters.joint_seized[1]", "type": "stuck", "value": 1000.0, "unit": "joint_2", "from_s": 0.1}
    run = CompiledRun(load("spacerobot_faults", {
        "duration_s": 0.2, "plant.initial_joint_rates": [0.0, 0.3, 0.0, 0.0],
        **{f"faults.fault.{key}": value for key, value in fault.items()}})).run()
    return {track.topic: hashlib.sha256(track.signal.payloads(track.records).tobytes()).hexdigest() for track in run.tracks}


def test_plain_python_flies_the_same_bits():
    code = "import json; from tests.faults_spacerobot.test_catalogue import digests; print(json.dumps(digests()))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=200,
                          env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads(done.stdout) == digests()
