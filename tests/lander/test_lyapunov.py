"""The stability argument, on the running loop: gradient, dL/dt, energy balance; and the feed-forward behind it."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from flight_graph.kernel import kernel
from lander_ros.landing_law import (
    LandingLaw,
    landing_law,
    lyapunov,
    lyapunov_rate,
    lyapunov_rate_of_wrench,
)
from lander_ros.potential import potential, potential_gradient_twistor
from lander_ros.twistor import from_pose
from lander_ros.twistor_kinematics import conjugate_wrench
from sim_nodes.lander_descent import command
from sim_nodes.lander_dynamics import (
    STATES,
    advance,
    approach_attitude,
    attitude_matrix,
    body_velocity,
    normalise_attitude,
    state_rate,
)
from tests.lander.reference_landing import record, start_state

few = settings(max_examples=40, deadline=None)
starts = st.tuples(
    st.floats(20.0, 1200.0), st.floats(-3.1, 3.1), st.floats(5.0, 400.0), st.floats(-3.0, 3.0), st.floats(0.0, 0.48)
)


def pose(reference, start):
    """A pose with the given horizontal range [m], azimuth, clearance [m], yaw and view error [rad]."""
    horizontal, azimuth, d, yaw, error = start
    x, y = horizontal * math.cos(azimuth), horizontal * math.sin(azimuth)
    height = (27.0 * (x * x + 1.2 * y * y + 100.0)) ** (1 / 3) - 2700.0 ** (1 / 3)
    r = np.array([x, y, d - 1.5 + height])
    return r, approach_attitude(r, yaw, error, azimuth)


def rate_of_the_plant(reference, state, at, p):
    """dL/dt by the chain rule on the plant's own state rate."""
    rate, matrix = np.zeros(STATES), np.zeros((3, 3))
    state_rate(reference.body, reference.plant, state, at.force, at.torque, 0.0, matrix, rate)
    attitude_matrix(state, matrix)
    alpha_rate = matrix.T @ rate[3:6] - np.cross(at.w, at.alpha)
    return (
        at.gradient[:3] @ at.w
        + at.gradient[3:] @ at.alpha
        + p.force_weight * p.mass * at.alpha @ alpha_rate
        + p.torque_weight * at.w @ p.inertia @ rate[10:13]
    )


@few
@given(starts)
def test_gradient_by_gamma_equals_the_laws(reference, start):
    """(1/4) Gamma dU/dB through the printed Jacobian and the printed grad f2, against the form used in flight."""
    r, q = pose(reference, start)
    b, by_b, wrench, gradient = from_pose(r, q), np.zeros(8), np.zeros(8), np.zeros(6)
    u = potential_gradient_twistor(reference.law, b, np.zeros((8, 3)), np.zeros((2, 8)), by_b)
    conjugate_wrench(b, by_b, np.zeros((8, 8)), wrench)
    u_t, u_r, u_1, u_2, _, _ = potential(reference.law, r, q, np.zeros((3, 3)), gradient)
    np.testing.assert_allclose(u, u_t + u_r + u_1 + u_2, rtol=1e-12)
    scale = np.abs(by_b).max() * np.abs(b).max()  # the printed way cancels terms of this size
    np.testing.assert_allclose(wrench[[0, 1, 2, 4, 5, 6]], gradient, rtol=0.0, atol=1e-13 * scale + 1e-12)
    assert wrench[3] == 0.0


@few
@given(starts)
def test_gradient_is_the_derivative_of_the_potential(reference, start):
    """Central differences of U along motions of the pose."""
    r, q = pose(reference, start)
    gradient, unused, work = np.zeros(6), np.zeros(6), np.zeros((3, 3))
    potential(reference.law, r, q, work, gradient)
    from scipy.spatial.transform import Rotation

    turn, step = Rotation.from_quat(q), 1e-5

    def energy(w, alpha):
        moved = r + turn.apply(np.array(alpha))
        return sum(potential(reference.law, moved, (turn * Rotation.from_rotvec(w)).as_quat(), work, unused)[:4])

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
        state = row[:STATES].copy()
        at = reference.evaluate(state)
        assert at.clipped == 0
        formula = lyapunov_rate(reference.law, at.alpha, at.w)
        worst = max(worst, abs(rate_of_the_plant(reference, state, at, reference.law) / formula - 1.0))
    assert worst < 1e-9


@few
@given(starts, st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_rate_holds_for_any_weights_and_under_saturation(reference, start, k_a, k_w):
    """With unequal weights (Appendix B needs no p_eps q = p q_eps), and clipped, by the general formula."""
    r, q = pose(reference, start)
    p = record(LandingLaw, force_weight=k_a, torque_weight=k_w)
    state = start_state(r, [0.4, -0.5, 0.3], q, [0.3, 2.0, -1.0])
    at = reference.evaluate(state, p)
    general = lyapunov_rate_of_wrench(
        p, at.r, at.q, at.alpha, at.w, at.g, at.gradient, at.force, at.torque
    )
    scale = 1e-9 * (abs(general) + np.abs(at.gradient).max())
    assert abs(rate_of_the_plant(reference, state, at, p) - general) < scale
    if at.clipped == 0:
        assert abs(general - lyapunov_rate(p, at.alpha, at.w)) < scale


@kernel
def flight_of_energy(law_p, field, plant, state, dt, steps, energies, work, vectors):
    """Continuous descent with the dissipated energy as a state: rows of ``energies`` (steps + 1, 2) are L, int D."""
    matrix, gradient = vectors[7:10], work[3, 0:6]
    for step in range(steps + 1):
        command(landing_law, law_p, field, plant, state, 1.0, matrix, vectors, gradient)
        terms = potential(law_p, state[0:3], state[6:10], vectors[4:7], gradient)
        u = terms[0] + terms[1] + terms[2] + terms[3]
        energies[step, 0] = lyapunov(law_p, u, vectors[3], state[10:13])
        energies[step, 1] = state[STATES]
        for i in range(len(state)):
            work[2, i] = state[i]
            work[1, i] = 0.0
        for k in range(4):
            stage = work[2]
            command(landing_law, law_p, field, plant, stage, 1.0, matrix, vectors, gradient)
            state_rate(field, plant, stage, vectors[0], vectors[1], 0.0, matrix, work[0])
            work[0, STATES] = -lyapunov_rate(law_p, vectors[3], stage[10:13])
            advance(state, work[0], k, dt, work[1], stage)
        normalise_attitude(state)


def test_energy_balance_of_the_nominal_descent(reference):
    """L + int D stays L_0, and L never rises, over the whole unsaturated descent."""
    steps = 15616  # [-] of 0.1 s, to touchdown
    energies = np.zeros((steps + 1, 2))
    flight_of_energy(
        reference.law,
        reference.body,
        reference.plant,
        np.append(reference.state, 0.0),
        0.1,
        steps,
        energies,
        np.zeros((4, STATES + 1)),
        np.zeros((11, 3)),
    )
    assert abs(energies[0, 0] - 36275.5628) < 1e-3
    assert abs(energies[-1, 0] - 0.009) < 5e-4
    assert np.abs(energies.sum(axis=1) - energies[0, 0]).max() < 1.2e-3
    assert np.diff(energies[:, 0]).max() < 0.0


def test_at_rest_on_the_goal_nothing_pulls(reference):
    state = start_state([0, 0, 0], [0, 0, 0], [0, 0, 0, 1], [0, 0, 0])
    at = reference.evaluate(state)
    np.testing.assert_array_equal(at.gradient, 0.0)
    assert at.U == 0.0 and at.d == 1.5
    # the feed-forward alone holds the craft: every rate of the plant vanishes
    rate = np.zeros(STATES)
    plant = reference.plant
    state_rate(reference.body, plant, state, at.force, at.torque, 0.0, np.zeros((3, 3)), rate)
    np.testing.assert_allclose(rate, 0.0, rtol=0.0, atol=1e-17)


def test_gravity_gradient_is_compensated_when_both_sides_have_it(reference):
    mu = reference.body.mu
    p = record(LandingLaw, gravity_gradient_mu=mu)
    q = np.array([0.01, 0.02, -0.01, math.sqrt(0.9994)])
    state = start_state([1, 2, 30], [0, 0, 0], q, [0, 0, 0])
    with_gradient, without = reference.evaluate(state, p), reference.evaluate(state)
    matrix, rate, alpha = np.zeros((3, 3)), np.zeros(STATES), np.zeros(3)
    body_velocity(state, matrix, alpha)
    x = matrix.T @ (reference.law.site_position + state[:3])
    expected = 3.0 * mu / np.linalg.norm(x) ** 5 * np.cross(x, reference.law.inertia @ x)
    np.testing.assert_allclose(without.torque - with_gradient.torque, expected, rtol=1e-9, atol=1e-15)
    plant = reference.plant._replace(gravity_gradient_mu=mu)
    balance = with_gradient.torque + with_gradient.gradient[:3]
    state_rate(reference.body, plant, state, with_gradient.force, balance, 0.0, matrix, rate)
    np.testing.assert_allclose(rate[10:13], 0.0, rtol=0.0, atol=1e-17)


def test_body_axes_velocity(reference):
    matrix, alpha = np.zeros((3, 3)), np.zeros(3)
    body_velocity(reference.state, matrix, alpha)
    np.testing.assert_allclose(matrix @ alpha, reference.state[3:6], rtol=0.0, atol=1e-15)
