"""Reference numbers of the landing, from an independent implementation of the same equations, with its tolerances."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flight_math import DualVector, Quaternion, Vec3
from lander_ros.constraints import clearance, clearance_gradient, view_cosine
from lander_ros.feed_forward import site_in_landing_frame
from lander_ros.landing_law import LandingLaw
from lander_ros.twistor import from_pose
from lander_ros.twistor_kinematics import conjugate_wrench
from sim_nodes.gravity.ellipsoid import EROS_LIKE_SPIN
from sim_nodes.lander.descent import Watch
from sim_nodes.lander.dynamics import site_gravity
from sim_nodes.lander.start import approach_attitude
from tests.lander.reference_landing import start_motion


def near(actual, expected, tolerance):
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=tolerance)


def history_at(history, state_rows, t):
    return history[round(t)][state_rows]


def test_site(reference):
    near(reference.rho, (12316.850195, 3770.253143, 2240.822458), 1e-5)
    position, spin = site_in_landing_frame(reference.rotation, reference.rho, EROS_LIKE_SPIN)
    near(spin, (0.0, 2.5706e-4, 2.0878e-4), 1e-8)
    defaults = LandingLaw.defaults()
    near(position, defaults["site_position"], 1e-8)
    near(spin, defaults["site_spin"], 1e-18)


def test_gravity(reference):
    g = site_gravity(reference.truth, reference.truth, Vec3(0.0, 0.0, 0.0))
    near(g, (1.34283e-3, 0.75136e-3, -4.78721e-3), 2e-8)
    near(np.linalg.norm(g), 5.028428e-3, 2e-8)
    g = site_gravity(reference.truth, reference.truth, reference.r0)
    near(g, (1.59898e-3, 0.23819e-3, -4.17809e-3), 2e-8)


def test_start(reference):
    near(np.array(reference.q0)[[3, 0, 1, 2]], (0.8686031403, -0.2692101596, -0.3612585672, 0.2062685685), 1e-9)
    twistor = from_pose(reference.r0, reference.q0)
    b, d = np.array(twistor.real), np.array(twistor.dual)
    near(b, (-0.14407027, -0.19333081, 0.11038650), 1e-8)
    near(d[[0, 2]], (-157.252111, 202.863894), 1e-5)
    # b'_2 from the listed b and r by b' = (1/4) N^T r; its own 122.018922 breaks |r| = 4 |b'|/(1 + |b|^2)
    near(d[1], 122.019022, 1e-5)
    near(4.0 * np.linalg.norm(d) / (1.0 + b @ b), np.linalg.norm(reference.r0), 1e-9)
    at = reference.evaluate(reference.start)
    near(at.d, 50.206074, 1e-5)
    near(at.c, 0.9510565163, 1e-9)
    near(view_cosine(reference.r0, reference.q0), math.cos(math.radians(18.0)), 1e-15)
    near((at.U, at.L), (36240.5615, 36275.5628), 1e-3)
    near(at.wrench.real, (3.149924, -2.243487, -19.542525), 1e-5)
    near(at.wrench.dual, (-8.891298, -3.964580, -1.102267), 1e-5)
    assert at.clipped == 0


def test_clearance_and_its_gradient(reference):
    place = Vec3(100.0, -50.0, 80.0)
    near(clearance(reference.law, place), 24.704316, 1e-6)
    near(clearance_gradient(reference.law, place), (-0.35990051, 0.21594031, 1.0), 1e-6)


def test_a_quadratic_in_the_twistor_is_no_potential(reference):
    """U = 8 b'.b' would ask for 1.7e5 N m at the start: |b'| depends on the attitude."""
    twistor = from_pose(reference.r0, reference.q0)
    wrench = conjugate_wrench(twistor, DualVector(Vec3(0.0, 0.0, 0.0), 16.0 * twistor.dual))
    near(np.linalg.norm(wrench.real), 171347.0, 1.0)


def test_nominal_descent(nominal):
    outcome, end, history = nominal
    near(history[60, :3], (-863.576057, 431.001341, 334.390541), 1e-3)
    near(history[300, :3], (-702.1729, 349.2776, 297.0126), 0.01)
    cosine = view_cosine(Vec3(*history[300, :3]), Quaternion(*history[300, 6:10]))
    near(math.degrees(math.acos(cosine)), 7.8468, 0.005)
    assert outcome.landed
    near(outcome.time, 1561.6, 0.3)
    near(outcome.delta_v, 6.1821, 0.003)
    near(math.degrees(outcome.view_max), 18.0, 1e-6)
    assert outcome.clearance_violation == outcome.view_violation == outcome.saturated == 0.0
    near((outcome.force_peak, outcome.torque_peak, outcome.speed_max), (19.54, 8.89, 0.770), 0.005)
    near(math.hypot(end.position.x, end.position.y), 0.019, 0.001)
    near(np.linalg.norm(end.velocity), 0.0039, 0.0001)
    near(math.degrees(Rotation.from_quat(end.attitude).magnitude()), 0.190, 0.001)


def test_without_the_constraint_terms_both_constraints_break(reference):
    outcome, _, _ = reference.fly_law({"terrain_gain": 0.0, "view_gain": 0.0})
    near(outcome.clearance_min, -18.634, 0.05)
    near(math.degrees(outcome.view_max), 71.14, 0.05)
    near(outcome.clearance_min_time, 1097.0, 1.0)
    near((outcome.clearance_violation, outcome.view_violation), (748.8, 1414.6), 0.3)


def test_baseline_breaks_both_constraints(reference):
    outcome, _, _ = reference.fly_pd()
    near(outcome.clearance_min, -4.297, 0.05)
    near(outcome.delta_v, 10.604, 0.02)
    near(math.degrees(outcome.view_max), 69.79, 0.05)
    compensated, end, _ = reference.fly_pd({"coriolis_compensation": True})
    near(compensated.clearance_min, -17.29, 0.05)
    near(compensated.time, 1186.7, 0.3)
    near(math.hypot(end.position.x, end.position.y), 0.277, 0.001)


def test_naive_barrier_hovers(reference):
    """Without goal weighting the law rests where k_t z/sqrt(1 + z^2/delta^2) = K_1/(z + z_0)^2."""
    outcome, end, _ = reference.fly_law({"terrain_radius": 0.0}, duration=3500.0)
    assert not outcome.landed
    near(end.position.z, 24.452, 0.01)
    z = end.position.z
    near(z / math.sqrt(1.0 + (z / 35.0) ** 2), 13500.0 / (z + 1.5) ** 2, 1e-3)


@pytest.mark.parametrize(
    ("rate", "time", "lateral", "attitude", "delta_v", "impulse"),
    [
        (10.0, 1561.8, 0.0194, 0.188, 6.1835, 21.1),
        (5.0, 1561.9, 0.0195, 0.187, 6.1846, 21.8),
        (2.0, 1562.4, 0.0197, 0.184, 6.1885, 24.2),
        (1.0, 1563.1, 0.0199, 0.178, 6.1946, 29.5),
        (0.5, 1564.6, 0.0202, 0.167, 6.2078, 56.3),
    ],
)
def test_fixed_rate(reference, rate, time, lateral, attitude, delta_v, impulse):
    outcome, end, _ = reference.fly_law(control_period=1.0 / rate)
    near(outcome.time, time, 0.11)
    near(math.hypot(end.position.x, end.position.y), lateral, 6e-5)
    near(math.degrees(Rotation.from_quat(end.attitude).magnitude()), attitude, 6e-4)
    near(outcome.delta_v, delta_v, 6e-5)
    near(outcome.torque_impulse, impulse, 0.06)
    near(math.degrees(outcome.view_max), 18.0, 1e-6)


def test_too_slow_a_rate_breaks_the_view_then_diverges(reference):
    slow, _, _ = reference.fly_law(control_period=3.0)
    near(math.degrees(slow.view_max), 34.9, 0.1)
    near(slow.saturated, 21.0, 0.2)
    slower, _, _ = reference.fly_law(control_period=4.0, duration=2000.0)
    assert not slower.landed and math.degrees(slower.view_max) > 90.0


@pytest.mark.parametrize(
    ("scale", "time", "lateral", "speed", "attitude"),
    [
        (0.8, 1489.9, 0.211, 0.037, 1.62),
        (0.9, 1502.9, 0.159, 0.028, 1.25),
        (1.1, 1541.9, 0.122, 0.010, 0.47),
        (1.2, 1612.7, 0.155, 0.0008, 0.05),
    ],
)
def test_gravity_error_with_a_higher_trigger(reference, scale, time, lateral, speed, attitude):
    outcome, end, _ = reference.fly_law(
        gravity_scale=scale, control_period=0.1, watch=Watch(contact_height=0.5)
    )
    near(outcome.time, time, 0.11)
    near(math.hypot(end.position.x, end.position.y), lateral, 6e-4)
    near(np.linalg.norm(end.velocity), speed, 6e-4)
    near(math.degrees(Rotation.from_quat(end.attitude).magnitude()), attitude, 0.006)


def test_over_compensated_gravity_hovers_above_the_trigger(reference):
    outcome, end, _ = reference.fly_law(gravity_scale=1.1, control_period=0.1, duration=3000.0)
    assert not outcome.landed
    near(end.position.z, 0.239, 0.001)


def test_stress_cases(reference):
    """15 m of clearance at 1 m/s straight into the funnel; and a start 2 deg inside the view cone, yawed 170 deg."""
    law = reference.law
    r = reference.r0 - Vec3(0.0, 0.0, clearance(law, reference.r0) - 15.0)
    inward = -np.array(clearance_gradient(law, reference.r0))
    rates = [0.2, -0.1, 0.15]  # [deg/s]
    q = approach_attitude(r, math.radians(25.0), math.radians(18.0), math.radians(30.0))
    start = start_motion(r, inward / np.linalg.norm(inward), q, rates)
    outcome, end, _ = reference.fly_law(start=start, control_period=0.1)
    near(outcome.clearance_min, 10.23, 0.006)
    near(outcome.saturated, 16.0, 0.2)
    near(math.hypot(end.position.x, end.position.y), 0.0195, 6e-5)
    near(outcome.delta_v, 8.39, 0.006)
    q = approach_attitude(reference.r0, math.radians(170.0), math.radians(28.0), math.radians(30.0))
    outcome, end, _ = reference.fly_law(
        start=start_motion(reference.r0, [0.3, -0.2, 0.1], q, rates), control_period=0.1
    )
    near(math.degrees(outcome.view_max), 28.0, 0.005)
    near(math.hypot(end.position.x, end.position.y), 0.019, 0.001)
