"""The landing's reference numbers through the scenarios; the numbers come from an independent implementation.

Those of fixed rates, gravity errors and stress cases are for the same 10 Hz loop. Those of the runs without constraint
terms and of the baselines are for the continuous law: sampling at 10 Hz moves them by the tolerances given here.
"""

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid

from flight_math import DualVector, Vec3
from lander_ros.twistor import from_pose, site_velocity


def near(found, expected):
    for name, (value, tolerance) in expected.items():
        assert found[name] is not None, name
        assert abs(found[name] - value) <= tolerance, f"{name} = {found[name]}, expected {value} +- {tolerance}"


def test_nominal(fly):
    found, recording = fly("lander_nominal")
    near(found, {
        "touchdown_time_s": (1561.8, 0.11), "lateral_m": (0.0194, 6e-5), "speed_mps": (0.0039, 6e-5),
        "attitude_deg": (0.188, 6e-4), "delta_v_mps": (6.1835, 6e-5), "torque_impulse_Nms": (21.1, 0.06),
        "clearance_min_m": (17.3, 0.06), "los_max_deg": (18.0, 1e-6), "force_peak_N": (19.54, 0.005),
        "torque_peak_Nm": (8.89, 0.005), "speed_max_mps": (0.770, 5e-4), "potential_initial_J": (36240.5615, 1e-3),
        "lyapunov_initial_J": (36275.5628, 1e-3), "lyapunov_final_J": (0.009, 5e-4)})
    assert found["landed"] == found["success"] == 1
    assert found["clearance_violation_s"] == found["los_violation_s"] == found["saturated_s"] == 0.0
    truth = recording["lander/truth"]
    r_60, r_300 = truth["site_position"][600], truth["site_position"][3000]
    half_a_sample = 0.05 * 0.78  # [m] at cruise speed: these two are of the continuous law
    np.testing.assert_allclose(r_60, (-863.576057, 431.001341, 334.390541), rtol=0, atol=half_a_sample)
    np.testing.assert_allclose(r_300, (-702.1729, 349.2776, 297.0126), rtol=0, atol=half_a_sample)
    assert abs(math.degrees(truth["view_angle"][3000]) - 7.8468) < 0.01
    first = recording["lander/cmd_wrench"][0]["wrench"]
    np.testing.assert_allclose(first["force"], (3.149924, -2.243487, -19.542525), rtol=0, atol=1e-5)
    np.testing.assert_allclose(first["torque"], (-8.891298, -3.964580, -1.102267), rtol=0, atol=1e-5)


def test_lyapunov_function_of_the_nominal_run(fly):
    """It falls at every sample, and what it loses is what the damping takes."""
    found, recording = fly("lander_nominal")
    assert found["lyapunov_rise_J"] < 0.0
    values = recording["lander/constraints"][: 15618]
    slope = np.gradient(values["lyapunov"], 0.1)[5:-5]  # [s]
    mean = values["lyapunov_rate_formula"][5:-5]
    # the held wrench makes the slope differ by a few per cent at most where L changes at all
    assert np.abs(slope - mean).max() < 0.02 * np.abs(mean).max()
    lost = trapezoid(values["lyapunov_rate_formula"], dx=0.1)
    assert abs(values["lyapunov"][-1] - values["lyapunov"][0] - lost) < 2e-3 * abs(lost)


def test_touchdown_is_held(fly):
    """From the contact trigger to the end of the run, the truth does not move, and says so."""
    _, recording = fly("lander_nominal")
    truth = recording["lander/truth"]
    after = truth[truth["landed"] == 1.0]
    assert len(after) == 17000 - 15618
    assert (after["site_position"] == after["site_position"][0]).all() and (after["rates"] == after["rates"][0]).all()
    assert after["site_position"][0, 2] <= 0.1 < truth["site_position"][15617, 2]


def test_topics_agree_with_each_other(fly):
    """Odometry, twistor, truth vector and constraint telemetry describe the same state."""
    _, recording = fly("lander_nominal")
    for row in (0, 4321, 15000):
        odometry, truth = recording["lander/truth/odom"][row], recording["lander/truth"][row]
        pose, twist = odometry["pose"]["pose"], odometry["twist"]["twist"]
        twistor = recording["lander/twistor"][row]
        expected = from_pose(pose["position"], pose["orientation"])
        np.testing.assert_allclose(twistor["twistor"], [*expected.real, 0.0, *expected.dual, 0.0], rtol=1e-14)
        motor = np.array([*twist["angular"], 0.0, *twist["linear"], 0.0])
        np.testing.assert_array_equal(twistor["motor"], motor)
        velocity = site_velocity(DualVector(Vec3(*motor[:3]), Vec3(*motor[4:7])), pose["orientation"])
        np.testing.assert_allclose(velocity, truth["site_velocity"], rtol=0, atol=1e-15)
        constraints = recording["lander/constraints"][row]
        assert abs(constraints["clearance"] - truth["clearance"]) < 1e-9
        assert abs(constraints["view_angle"] - truth["view_angle"]) < 1e-7
        assert abs(constraints["twistor_norm"] - math.tan(math.acos(abs(pose["orientation"][3])) / 2.0)) < 1e-9


def test_goal_frame(fly):
    """The published landing-site frame is the reference site, its z axis the ellipsoid's normal, x east."""
    from scipy.spatial.transform import Rotation
    goal = fly("lander_nominal")[1]["lander/goal"][0]["pose"]
    np.testing.assert_allclose(goal["position"], (12316.850195, 3770.253143, 2240.822458), rtol=0, atol=1e-5)
    axes = Rotation.from_quat(goal["orientation"]).as_matrix()
    normal = (goal["position"] - 1.5 * axes[:, 2]) / np.array([17740.0, 6470.0, 5300.0]) ** 2
    np.testing.assert_allclose(axes[:, 2], normal / np.linalg.norm(normal), rtol=0, atol=1e-12)
    np.testing.assert_allclose(axes[2, 0], 0.0, atol=1e-15)
    assert np.cross([0.0, 0.0, 1.0], axes[:, 2]) @ axes[:, 0] > 0.0


@pytest.mark.parametrize(
    ("rate", "time", "lateral", "speed", "attitude", "delta_v", "impulse"),
    [
        (5, 1561.9, 0.0195, 0.0039, 0.187, 6.1846, 21.8),
        (2, 1562.4, 0.0197, 0.0039, 0.184, 6.1885, 24.2),
        (1, 1563.1, 0.0199, 0.0038, 0.178, 6.1946, 29.5),
        (0.5, 1564.6, 0.0202, 0.0037, 0.167, 6.2078, 56.3),
    ],
)
def test_slower_laws(fly, rate, time, lateral, speed, attitude, delta_v, impulse):
    found, _ = fly("lander_nominal", controller__rate_hz=rate)
    near(found, {"touchdown_time_s": (time, 0.11), "lateral_m": (lateral, 6e-5), "speed_mps": (speed, 6e-5),
                 "attitude_deg": (attitude, 6e-4), "delta_v_mps": (delta_v, 6e-5),
                 "torque_impulse_Nms": (impulse, 0.06), "los_max_deg": (18.0, 1e-6)})


def test_too_slow_a_law_diverges(fly):
    """Below 2 J/D_w = 3.3 s the sampled rotation is unstable; 1 Hz is the slowest rate to recommend."""
    found, _ = fly("lander_nominal", controller__rate_hz=0.25)
    assert found["landed"] == 0 and found["los_max_deg"] > 90.0 and found["abort_advised"] == 1


def test_without_constraint_terms_both_break(fly):
    found, _ = fly("lander_unconstrained")
    near(found, {"touchdown_time_s": (1508.4, 0.2), "lateral_m": (0.227, 5e-4), "clearance_min_m": (-18.634, 0.05),
                 "clearance_min_time_s": (1097.0, 1.0), "los_max_deg": (71.14, 0.05), "delta_v_mps": (6.120, 0.002),
                 "clearance_violation_s": (748.8, 0.3), "los_violation_s": (1414.6, 0.3)})
    assert found["abort_advised"] == 1 and found["level_worst"] == 2


def test_baselines_break_both(fly):
    found, _ = fly("lander_pd")
    near(found, {"touchdown_time_s": (1361.9, 0.3), "lateral_m": (0.042, 5e-4), "clearance_min_m": (-4.297, 0.05),
                 "los_max_deg": (69.79, 0.05), "delta_v_mps": (10.604, 0.02), "force_peak_N": (37.14, 0.01),
                 "speed_max_mps": (3.495, 0.005)})
    found, _ = fly("lander_pd", controller__coriolis_compensation=True)
    near(found, {"touchdown_time_s": (1186.7, 0.3), "lateral_m": (0.277, 0.001), "clearance_min_m": (-17.29, 0.06),
                 "los_max_deg": (70.46, 0.05), "delta_v_mps": (9.895, 0.006), "clearance_violation_s": (498.6, 1.0)})


def test_naive_barrier_hovers(fly):
    """Without goal weighting the craft rests where k_t z/sqrt(1 + z^2/delta^2) = K_1/(z + z_0)^2."""
    found, _ = fly("lander_nominal", controller__terrain_radius=0.0, duration_s=3500)
    assert found["landed"] == 0
    z = found["height_m"]
    assert abs(z - 24.452) < 0.01
    assert abs(z / math.sqrt(1.0 + (z / 35.0) ** 2) - 13500.0 / (z + 1.5) ** 2) < 1e-3


@pytest.mark.parametrize(
    ("scale", "time", "lateral", "speed", "attitude"),
    [(0.8, 1489.9, 0.211, 0.037, 1.62), (0.9, 1502.9, 0.159, 0.028, 1.25), (1.1, 1541.9, 0.122, 0.010, 0.47),
     (1.2, 1612.7, 0.155, 0.0008, 0.05)],
)
def test_wrong_gravity(fly, scale, time, lateral, speed, attitude):
    found, _ = fly("lander_gravity_error", gravity__scale=scale)
    near(found, {"touchdown_time_s": (time, 0.11), "lateral_m": (lateral, 6e-4), "speed_mps": (speed, 6e-4),
                 "attitude_deg": (attitude, 0.006)})


def test_over_compensated_gravity_hovers_above_a_low_trigger(fly):
    found, _ = fly("lander_gravity_error", plant__contact_height=0.1, duration_s=3000)
    assert found["landed"] == 0 and abs(found["height_m"] - 0.239) < 0.001
    under, _ = fly("lander_gravity_error", plant__contact_height=0.1, gravity__scale=0.9)
    near(under, {"lateral_m": (0.069, 0.006), "speed_mps": (0.013, 6e-4), "attitude_deg": (0.59, 0.01)})


def test_stress_cases(fly):
    found, _ = fly("lander_stress_descent")
    near(found, {"clearance_min_m": (10.23, 0.006), "saturated_s": (16.0, 0.2), "lateral_m": (0.0195, 6e-5),
                 "delta_v_mps": (8.39, 0.006)})
    assert found["level_worst"] == 1  # saturated for more than 5 s
    found, _ = fly("lander_stress_view")
    near(found, {"los_max_deg": (28.0, 0.005), "lateral_m": (0.019, 0.001), "attitude_deg": (0.188, 6e-4)})


def test_bennu(fly):
    """The site numbers reach the law from the plant; weak gravity asks for the smaller part of the impulse."""
    found, recording = fly("lander_bennu")
    assert found["success"] == 1 and found["lyapunov_rise_J"] < 0.0
    values = recording.scenario.graph.nodes["controller"].values
    radius = np.linalg.norm(values["site_position"])
    assert 249.0 < radius < 285.0
    gravity = np.linalg.norm(recording["lander/truth"]["gravity"][-1])
    assert abs(gravity / (4.892 / radius**2) - 1.0) < 0.1  # [-] within the body's oblateness of a point mass
    assert abs(np.linalg.norm(values["site_spin"]) - 4.0626e-4) < 1e-12


def test_thruster_options(fly):
    """Impulse bits switch small pulses off; propellant follows the rocket equation."""
    ideal, _ = fly("lander_nominal")
    found, recording = fly("lander_nominal", plant__specific_impulse=220.0, plant__force_impulse_bit=0.02)
    assert found["success"] == 1
    force = np.abs(recording["lander/truth"]["force"])
    assert ((force == 0.0) | (force >= 0.2 - 1e-12)).all() and (force == 0.0).any()
    # |f|_1 burns the propellant, |f|_2 the delta-v: at least the rocket equation's share
    least = 500.0 * (1.0 - math.exp(-found["delta_v_mps"] / (220.0 * 9.80665)))
    assert least < found["propellant_kg"] < math.sqrt(3.0) * least
    assert abs(found["delta_v_mps"] - ideal["delta_v_mps"]) < 0.2


def test_gravity_gradient_is_small_here(fly):
    """3 mu/R^3 (J_z - J_x) / 2 is some 1e-5 N m: the landing does not notice."""
    found, _ = fly("lander_nominal", plant__gravity_gradient=True)
    assert abs(found["attitude_deg"] - fly("lander_nominal")[0]["attitude_deg"]) < 1e-3


def test_status_follows_the_rules(fly):
    """Error where a constraint is violated, warning near it, from the truth of the unconstrained run."""
    _, recording = fly("lander_unconstrained")
    truth, status = recording["lander/truth"], recording["lander/landing_status"]
    distance = np.linalg.norm(truth["site_position"], axis=1)
    degrees = np.degrees(truth["view_angle"])
    error = (truth["clearance"] < 0.0) | ((distance > 5.0) & (degrees > 30.0))
    warning = ((distance > 20.0) & (truth["clearance"] < 5.0)) | ((distance > 5.0) & (degrees > 25.0))
    for row in range(1, len(status)):
        window = slice(5 * row - 4, 5 * row + 1)
        if truth["landed"][window].any():
            break
        expected = 2.0 if error[window].any() else 1.0 if warning[window].any() else status["level"][row]
        assert status["level"][row] == expected, row
        assert status["abort"][row] == float(error[window].any())
