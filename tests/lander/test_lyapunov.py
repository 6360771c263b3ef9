"""The stability argument, on the running loop: gradient, dL/dt, energy balance; and the feed-forward behind it."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flight_math import DualVector, Quaternion, Vec3, kernel, rk4
from lander_ros.landing_law import LandingLaw, landing_law, lyapunov, lyapunov_rate, lyapunov_rate_of_wrench
from lander_ros.potential import potential, potential_gradient_twistor
from lander_ros.twistor import from_pose
from lander_ros.twistor_kinematics import conjugate_wrench
from sim_nodes.lander.descent import command
from sim_nodes.lander.dynamics import attitude_matrix, motor, rate_under, unit_attitude
from sim_nodes.lander.start import approach_attitude
from tests.lander.reference_landing import matrix, record, start_motion

few = settings(max_examples=40, deadline=None)
starts = st.tuples(
    st.floats(20.0, 1200.0), st.floats(-3.1, 3.1), st.floats(5.0, 400.0), st.floats(-3.0, 3.0), st.floats(0.0, 0.48)
)


def pose(reference, start):
    """A pose with the given horizontal range [m], azimuth, clearance [m], yaw and view error [rad]."""
    horizontal, azimuth, d, yaw, error = start
    x, y = horizontal * math.cos(azimuth), horizontal * math.sin(azimuth)
    height = (27.0 * (x * x + 1.2 * y * y + 100.0)) ** (1 / 3) - 2700.0 ** (1 / 3)
    r = Vec3(x, y, d - 1.5 + height)
    return r, approach_attitude(r, yaw, error, azimuth)


def rate_of_the_plant(reference, motion, at, p):
    """dL/dt by the chain rule on the plant's own rates."""
    truth = reference.truth
    rate = rate_under(truth, truth, motion, at.g, at.wrench, 0.0)
    w, alpha, inertia = np.array(at.motor.real), np.array(at.motor.dual), matrix(p.inertia)
    alpha_rate = matrix(attitude_matrix(motion.attitude)).T @ np.array(rate.velocity) - np.cross(w, alpha)
    return (np.dot(at.gradient.real, w) + np.dot(at.gradient.dual, alpha)
            + p.force_weight * p.mass * alpha @ alpha_rate + p.torque_weight * w @ inertia @ np.array(rate.rates))


@few
@given(starts)
def test_gradient_by_gamma_equals_the_laws(reference, start):
    """(1/4) Gamma dU/dB through the printed Jacobian and the printed grad f2, against the form used in flight."""
    r, q = pose(reference, start)
    b = from_pose(r, q)
    u, by_b = potential_gradient_twistor(reference.law, b)
    terms, _, _, gradient = potential(reference.law, r, q)
    np.testing.assert_allclose(u, sum(terms), rtol=1e-12)
    scale = np.abs(by_b.parts()).max() * np.abs(b.parts()).max()  # the printed way cancels terms of this size
    wrench = conjugate_wrench(b, by_b)
    np.testing.assert_allclose(wrench.parts(), gradient.parts(), rtol=0.0, atol=1e-13 * scale + 1e-12)


@few
@given(starts)
def test_gradient_is_the_derivative_of_the_potential(reference, start):
    """Central differences of U along motions of the pose."""
    r, q = pose(reference, start)
    gradient = potential(reference.law, r, q)[3].parts()
    turn, step = Rotation.from_quat(q), 1e-5

    def energy(w, alpha):
        moved = Vec3(*(np.array(r) + turn.apply(np.array(alpha))))
        turned = Quaternion(*(turn * Rotation.from_rotvec(w)).as_quat())
        return sum(potential(reference.law, moved, turned)[0])

    for i in range(3):
        e = step * np.eye(3)[i]
        torque = (energy(e, [0, 0, 0]) - energy(-e, [0, 0, 0])) / (2 * step)
        force = (energy([0, 0, 0], e) - energy([0, 0, 0], -e)) / (2 * step)
        np.testing.assert_allclose(torque, gradient[i], rtol=1e-5, atol=5e-5)
        np.testing.assert_allclose(force, gradient[3 + i], rtol=1e-5, atol=5e-5)


def test_rate_of_the_running_loop_is_its_formula(reference, nominal):
    """dL/dt = -k_a D_v |alpha|^2 - k_w D_w |w|^2 to 1e-9 along the nominal descent, from the plant's own rates."""
    worst = 0.0
    for row in nominal[2][::20]:
        motion = start_motion(row[0:3], row[3:6], row[6:10], np.degrees(row[10:13]))
        at = reference.evaluate(motion)
        assert at.clipped == 0
        formula = lyapunov_rate(reference.law, at.motor)
        worst = max(worst, abs(rate_of_the_plant(reference, motion, at, reference.law) / formula - 1.0))
    assert worst < 1e-9


@few
@given(starts, st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_rate_holds_for_any_weights_and_under_saturation(reference, start, k_a, k_w):
    """With unequal weights (Appendix B needs no p_eps q = p q_eps), and clipped, by the general formula."""
    r, q = pose(reference, start)
    p = record(LandingLaw, force_weight=k_a, torque_weight=k_w)
    motion = start_motion(r, [0.4, -0.5, 0.3], q, [0.3, 2.0, -1.0])
    at = reference.evaluate(motion, p)
    general = lyapunov_rate_of_wrench(p, at.motor, at.gradient, at.wrench - at.forward)
    scale = 1e-9 * (abs(general) + np.abs(at.gradient.parts()).max())
    assert abs(rate_of_the_plant(reference, motion, at, p) - general) < scale
    if at.clipped == 0:
        assert abs(general - lyapunov_rate(p, at.motor)) < scale


@kernel
def rate_with_energy(given, t, state):
    """Rate of the motion, and of the dissipated energy."""
    law_p, truth = given
    motion, _ = state
    wrench, _, gravity = command(landing_law, law_p, truth, motion, 1.0)
    return rate_under(truth, truth, motion, gravity, wrench, 0.0), -lyapunov_rate(law_p, motor(motion))


@kernel
def flight_of_energy(law_p, truth, motion, dt, steps, energies):
    """Continuous descent with the dissipated energy as a state: rows of ``energies`` (steps + 1, 2) are L, int D."""
    dissipated = 0.0
    for step in range(steps + 1):
        u_t, u_r, u_1, u_2 = potential(law_p, motion.position, motion.attitude)[0]
        energies[step, 0] = lyapunov(law_p, u_t + u_r + u_1 + u_2, motor(motion))
        energies[step, 1] = dissipated
        motion, dissipated = rk4(rate_with_energy, (law_p, truth), 0.0, (motion, dissipated), dt)
        motion = unit_attitude(motion)


def test_energy_balance_of_the_nominal_descent(reference):
    """L + int D stays L_0, and L never rises, over the whole unsaturated descent."""
    steps = 15616  # [-] of 0.1 s, to touchdown
    energies = np.zeros((steps + 1, 2))
    flight_of_energy(reference.law, reference.truth, reference.start, 0.1, steps, energies)
    assert abs(energies[0, 0] - 36275.5628) < 1e-3
    assert abs(energies[-1, 0] - 0.009) < 5e-4
    assert np.abs(energies.sum(axis=1) - energies[0, 0]).max() < 1.2e-3
    assert np.diff(energies[:, 0]).max() < 0.0


def rates(truth, motion, at, wrench):
    """All rates of the plant as numbers."""
    rate = rate_under(truth, truth, motion, at.g, wrench, 0.0)
    return np.array([*rate.position, *rate.velocity, *rate.attitude, *rate.rates, rate.mass])


def test_at_rest_on_the_goal_nothing_pulls(reference):
    motion = start_motion([0, 0, 0], [0, 0, 0], [0, 0, 0, 1], [0, 0, 0])
    at = reference.evaluate(motion)
    np.testing.assert_array_equal(at.gradient.parts(), 0.0)
    assert at.U == 0.0 and at.d == 1.5
    # the feed-forward alone holds the craft: every rate of the plant vanishes
    np.testing.assert_allclose(rates(reference.truth, motion, at, at.wrench), 0.0, rtol=0.0, atol=1e-17)


def test_gravity_gradient_is_compensated_when_both_sides_have_it(reference):
    mu = reference.body.mu
    p = record(LandingLaw, gravity_gradient_mu=mu)
    motion = start_motion([1, 2, 30], [0, 0, 0], [0.01, 0.02, -0.01, math.sqrt(0.9994)], [0, 0, 0])
    with_gradient, without = reference.evaluate(motion, p), reference.evaluate(motion)
    place = np.array(reference.law.site_position + motion.position)
    x = matrix(attitude_matrix(motion.attitude)).T @ place
    expected = 3.0 * mu / np.linalg.norm(x) ** 5 * np.cross(x, matrix(reference.law.inertia) @ x)
    np.testing.assert_allclose(without.wrench.dual - with_gradient.wrench.dual, expected, rtol=1e-9, atol=1e-15)
    truth = reference.truth._replace(gravity_gradient=True)
    balance = with_gradient.wrench + DualVector(Vec3(0.0, 0.0, 0.0), with_gradient.gradient.real)
    np.testing.assert_allclose(rates(truth, motion, without, balance)[10:13], 0.0, rtol=0.0, atol=1e-17)


def test_body_axes_velocity(reference):
    alpha = motor(reference.start).dual
    back = matrix(attitude_matrix(reference.start.attitude)) @ np.array(alpha)
    np.testing.assert_allclose(back, reference.start.velocity, rtol=0.0, atol=1e-15)
