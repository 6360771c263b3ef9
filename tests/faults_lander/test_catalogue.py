"""The catalogue of lander_faults: what its cases are, and how typical ones end. The whole of it: `flight sweep lander_faults`."""

from collections import Counter

import pytest

from flight_graph.graphs.scenario import load

SUITE = load("lander_faults").vary


def test_it_has_thirty_faults_and_more_of_every_unit():
    cases = {name: values for name, values in SUITE.combinations}
    assert len(cases) >= 30 and SUITE.count == 2 * len(SUITE.combinations) == 4 * len(cases)
    units = Counter(values["faults.fault.at"].replace(" <- ", ".").partition(".")[0] for values in cases.values()
                    if "faults.fault.at" in values)
    assert set(units) == {"star_tracker", "altimeter", "camera", "imu", "plant", "controller", "navigation", "gravity", "modes"}
    assert len({values.get("faults.fault.type") for values in cases.values()}) >= 12


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_nothing_acts_without_a_fault(broken, seed):
    found = broken(changes={"seed": seed} if seed > 1 else None).metrics
    assert found["false_alarms"] == 0 and found["end"] == "landed"
    assert found["final_mode"] == "descend" and found["mode_changes"] == 0


@pytest.mark.parametrize(("name", "by", "isolated", "mode"), [
    ("star_tracker_silent", "lose_star_tracker", True, "abort"),
    ("star_tracker_silent_20s", "lose_star_tracker", True, "descend"),
    ("altimeter_drift", "lose_altimeter", True, "abort"),
    ("altimeter_spikes", "doubt_altimeter", True, "descend"),
    ("camera_wrong_mark", "lose_camera", True, "abort"),
    ("gyro_offset_small", "lose_imu", True, "descend"),
    ("gyro_stuck", "doubt_imu", True, "abort"),
    ("accelerometer_offset", "feel_thrust", True, "abort"),
    ("imu_silent", "lose_imu", True, "abort"),
    ("thruster_leak_2N", "feel_thrust", True, "abort"),
    ("torque_leak", "feel_thrust", True, "abort"),
    ("controller_crash", "lose_controller", True, "abort"),
    ("navigation_crash", "lose_navigation", True, "abort"),
    ("gravity_wrong", "lose_gravity", True, "abort"),
])
def test_a_fault_at_eighty_metres_is_met(broken, name, by, isolated, mode):
    values = next(values for case, values in SUITE.combinations if case == name and values["faults.fault.from_s"] == 60)
    keys = {key.removeprefix("faults.fault."): value for key, value in values.items()}
    found = broken(keys.pop("at"), keys.pop("type"), **keys).metrics
    assert found["false_alarms"] == 0 and found["fault_detected"]
    assert (found["fault_detected_by"], found["fault_isolated"], found["final_mode"]) == (by, isolated, mode)
    assert (found["end"] == "landed") == (mode == "descend")
    assert found["is_safe"] == (name != "navigation_crash")  # without navigation it falls back in the end
