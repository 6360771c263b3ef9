"""The catalogue of the scenario cubli_faults: what it holds, what it must not raise, and the same bits in every engine."""

import numpy as np
import pytest

from flight_graph import runs
from flight_graph.bags.diff import diff
from flight_graph.graphs.scenario import load
from tests.faults_rover.rover_runs import Run


def test_it_has_its_size_and_no_case_twice():
    cases = load("cubli_faults").file.vary["cases"]
    names = [case["name"] for case in cases]
    assert len(cases) >= 31 and len(set(names)) == len(names) and "none" in names
    units = {case.get("faults.fault.unit") or case["faults.fault.at"].partition(".")[0] for case in cases}
    assert units >= {"imu", "star_tracker", "wheels", "controller", "estimator", "modes", "wheel_monitor"}


@pytest.mark.parametrize("seed", range(4))
def test_without_fault_nothing_is_said(seed):
    bias = np.random.default_rng(seed).normal(0.0, 1e-3, 3).tolist()
    run = Run(settings={"seed": 50 + seed, "imu.gyro_bias": bias})
    assert run.metrics["false_alarms"] == 0 and run.metrics["end"] == "balanced" and run.metrics["mode_changes"] == 0
    assert run.metrics["normal_force_min"] > 0.95 and run.metrics["friction_ratio_max"] < 0.3


@pytest.mark.parametrize("at, kind, keys, by, unit", [
    ("imu.imu", "drop", {}, "gyro_doubtful", "imu"),
    ("star_tracker.measured", "drop", {}, "tracker_lost", "star_tracker"),
    ("star_tracker.measured.quaternion[0]", "bias", {"value": 3e-3}, "tracker_isolated", "star_tracker"),
    ("plant.parameters.wheel_runaway[1]", "stuck", {"value": 2e-4, "unit": "wheels"}, "wheel_failed", "wheels"),
    ("controller", "crash", {}, "law_lost", "controller"),
    ("estimator", "crash", {}, "estimator_lost", "estimator"),
    ("modes", "crash", {}, "manager_lost", "modes"),
    ("wheel_monitor", "crash", {}, "wheel_monitor_lost", "wheel_monitor"),
])
def test_each_unit_is_blamed_for_its_own_fault(at, kind, keys, by, unit):
    found = Run(at, kind, {}, from_s=17.0, **keys).metrics
    assert found["fault_detected_by"] == by and found["fault_isolated"] and found["false_alarms"] == 0
    assert found["is_safe"] and found["lift_off_s"] is None
    assert found["fault_detection_delay_s"] < 10.0


def test_a_drifting_tracker_passes_for_a_biased_gyro():
    """What falls short, named: two sensors that drift apart slowly do not say which of them does."""
    found = Run("star_tracker.measured.quaternion[1]", "drift", {}, from_s=17.0, value=2e-4).metrics
    assert found["fault_detected_by"] == "gyro_biased" and found["fault_isolated"] is False
    assert found["is_safe"]


OVERRIDES = {"duration_s": 6.0, "faults.fault.at": "plant.parameters.wheel_runaway[1]", "faults.fault.type": "stuck",
             "faults.fault.value": 2e-4, "faults.fault.unit": "wheels", "faults.fault.from_s": 3.0}


@pytest.mark.ros
def test_nodes_and_the_compiled_loop_make_the_same_bag(tmp_path):
    scenario = load("cubli_faults", OVERRIDES)
    compiled = runs.execute(scenario, "compiled", out=tmp_path / "compiled")
    nodes = runs.execute(scenario, "ros", out=tmp_path / "ros")
    results = diff(compiled.bag, nodes.bag)
    assert results and all(result.equal for result in results), "\n".join(map(str, results))
