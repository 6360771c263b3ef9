"""The control laws one equation at a time: funnels, error transform, sampled roots, APPC, PD, backstepping."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from cubli_ros import appc, funnel
from cubli_ros.attitude import cardan_rates
from cubli_ros.backstepping import backstepping
from cubli_ros.pd import proportional_derivative

ANGLES = np.array([-0.3, 0.25, 0.35])
OMEGA = np.array([0.02, -0.03, 0.01])


def rate_matrix(angles):
    return np.array([cardan_rates(angles, *column) for column in np.eye(3)]).T


def test_performance_bound():
    assert funnel.performance_bound(0.0, 0.4, 0.008, -0.29) == 0.4
    assert math.isclose(funnel.performance_bound(3.0, 0.4, 0.008, -0.29), 0.392 * math.exp(-0.87) + 0.008)


def test_transformed_error_as_printed_and_capped():
    for xi in (-0.9, -0.1, 0.0, 0.5, 1.5):
        assert funnel.transformed_error(xi, 1.0) == xi / (1.0 - xi * xi)
    cap = 0.9
    slope = (1.0 + cap * cap) / (1.0 - cap * cap) ** 2
    value = cap / (1.0 - cap * cap)
    assert funnel.transformed_error(0.5, cap) == funnel.transformed_error(0.5, 1.0)
    for xi in (0.95, 1.0, 7.0):
        assert math.isclose(funnel.transformed_error(xi, cap), value + slope * (xi - cap))
        assert funnel.transformed_error(-xi, cap) == -funnel.transformed_error(xi, cap)


@settings(max_examples=100, deadline=None)
@given(st.floats(1e-5, 0.1), st.floats(1e-3, 10.0), st.floats(1e-3, 1.0))
def test_matched_cap_is_where_the_sampled_slope_is_one(period, gain, bound):
    cap = funnel.matched_cap(period, gain, bound, 0.98)
    slope = period * gain / bound * (1.0 + cap * cap) / (1.0 - cap * cap) ** 2
    if cap == 0.0:
        assert slope >= 1.0 - 1e-9
    elif cap == 0.98:
        assert slope <= 1.0 + 1e-9
    else:
        assert math.isclose(slope, 1.0, rel_tol=1e-6)


def test_switching_sign():
    assert [funnel.switching_sign(x, 0.0) for x in (-2.0, 0.0, 1e-300)] == [-1.0, 0.0, 1.0]
    assert math.isclose(funnel.switching_sign(0.004, 0.01), math.tanh(0.4))


@settings(max_examples=300, deadline=None)
@given(st.floats(-1e12, 1e12) | st.floats(-1.1, 1.1), st.floats(-10.0, 3.0))
def test_implicit_root_exists_for_every_error(b, exponent):
    c = 10.0**exponent
    epsilon = funnel.implicit_transformed_error(b, c)
    x = funnel.normalised_error(epsilon)
    assert abs(x) <= 1.0
    assert math.isclose(x + c * epsilon, b, rel_tol=1e-13, abs_tol=1e-15)
    assert funnel.implicit_transformed_error(-b, c) == -epsilon
    if 1e-6 < abs(b) < 10.0 and c > 1e-6:
        root = brentq(lambda y: y + c * y / (1.0 - y * y) - abs(b), 0.0, 1.0 - 1e-16, xtol=1e-16, rtol=1e-14)
        assert math.isclose(abs(x), root, rel_tol=1e-9)


def test_rearm_widens_only_a_bound_that_is_nearly_left():
    final, rate = np.full(3, 0.008), np.full(3, -0.29)
    start_bound, start_time = np.array([0.4, 0.4, 0.4]), np.zeros(3)
    bound = funnel.performance_bound(2.0, 0.4, 0.008, -0.29)
    error = np.array([0.97 * bound, -0.99 * bound, 3.0 * bound])
    assert funnel.rearm(2.0, error, final, rate, start_bound, start_time) == 2
    np.testing.assert_allclose(start_bound, [0.4, 0.99 * bound / 0.75, 4.0 * bound])
    np.testing.assert_array_equal(start_time, [0.0, 2.0, 2.0])
    assert funnel.rearm(2.0, error, final, rate, start_bound, start_time) == 0
    out = np.empty(3)
    appc.attitude_bounds(2.0, start_bound, start_time, final, rate, out)
    np.testing.assert_allclose(out, [bound, *start_bound[1:]])


@pytest.mark.parametrize("smoothing", [0.0, 0.01])
def test_explicit_law_is_equations_10_to_16(smoothing):
    reference, reference_rate = np.array([0.01, -0.02, 0.0]), np.array([0.001, 0.0, 0.002])
    rho_a, rho_u = np.array([0.4, 0.5, 0.6]), np.array([0.1, 0.11, 0.12])
    lambda_a, lambda_u = np.array([0.041, 0.03, 0.02]), np.array([0.04, 0.05, 0.06])
    k_a, k_u, v_a, v_u = np.full(3, 0.01), np.full(3, 0.02), np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.2, 0.1])
    out = [np.empty(3) for _ in range(8)]
    e_a, xi_a, eps_a, delta, e_u, xi_u, eps_u, acceleration = out
    one = np.ones(3)
    appc.attitude_loop(
        ANGLES, reference, reference_rate, rho_a, lambda_a, k_a, v_a, smoothing, one, e_a, xi_a, eps_a, delta
    )
    appc.rate_loop(OMEGA, delta, rho_u, lambda_u, k_u, v_u, smoothing, one, e_u, xi_u, eps_u, acceleration)

    def sign(x):
        return np.tanh(x / smoothing) if smoothing else np.sign(x)

    xi = (ANGLES - reference) / rho_a
    eps = xi / (1.0 - xi**2)
    gamma = np.linalg.solve(rate_matrix(ANGLES), reference_rate - lambda_a * eps - sign(eps) * k_a * v_a)
    np.testing.assert_allclose(xi_a, xi, rtol=1e-14)
    np.testing.assert_allclose(delta, gamma, rtol=1e-12)
    xi = (OMEGA - gamma) / rho_u
    eps = xi / (1.0 - xi**2)
    np.testing.assert_allclose(e_u, OMEGA - gamma, rtol=1e-12)
    np.testing.assert_allclose(eps_u, eps, rtol=1e-11)
    np.testing.assert_allclose(acceleration, -lambda_u * eps - sign(eps) * k_u * v_u, rtol=1e-11)


def test_implicit_law_holds_one_sample_ahead():
    """Demanded acceleration, taken for one sample, brings the rate error to the value for which eq. (16) demands it."""
    h = 0.01  # [s]
    rho_a, rho_u = np.full(3, 0.4), np.full(3, 0.1)
    gain, k, v = np.full(3, 0.041), np.full(3, 0.01), np.full(3, 0.2)
    zero = np.zeros(3)
    predicted, eps_a, delta, eps_u, acceleration = (np.empty(3) for _ in range(5))
    for omega in (OMEGA, 40.0 * OMEGA):
        appc.implicit_attitude_loop(ANGLES, omega, zero, zero, rho_a, gain, k, v, h, predicted, eps_a, delta)
        np.testing.assert_allclose(predicted, ANGLES + h * rate_matrix(ANGLES) @ omega, rtol=1e-14)
        demand = rate_matrix(predicted) @ delta
        x = (predicted + h * demand) / rho_a
        np.testing.assert_allclose(demand, -gain * x / (1.0 - x * x) - k * v * np.sign(x), rtol=1e-9)
        appc.implicit_rate_loop(omega, delta, rho_u, gain, k, v, h, eps_u, acceleration)
        x = (omega + h * acceleration - delta) / rho_u
        assert np.abs(x).max() < 1.0
        np.testing.assert_allclose(acceleration, -gain * x / (1.0 - x * x) - k * v * np.sign(x), rtol=1e-8)


def test_dead_zone_takes_the_error_to_zero():
    h, rho, k, v = 0.01, np.full(3, 0.1), np.full(3, 0.01), np.full(3, 0.2)
    omega, delta = np.array([1e-5, -1e-5, 0.0]), np.zeros(3)
    epsilon, acceleration = np.empty(3), np.empty(3)
    appc.implicit_rate_loop(omega, delta, rho, np.full(3, 0.041), k, v, h, epsilon, acceleration)
    np.testing.assert_array_equal(epsilon, 0.0)
    np.testing.assert_allclose(omega + h * acceleration, 0.0, atol=1e-20)
    edge = k[0] * v[0] * h  # the two branches meet here
    below = appc.implicit_feedback(edge / rho[0], rho[0], 0.041, k[0] * v[0], h)[1]
    above = appc.implicit_feedback(edge / rho[0] * (1.0 + 1e-12), rho[0], 0.041, k[0] * v[0], h)[1]
    assert math.isclose(below, above, rel_tol=1e-9)


def test_torque_and_limit():
    inertia = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 5.0]])
    demand, out = np.empty(3), np.empty(3)
    gravity = np.array([0.1, 0.2, -0.3])
    appc.torque_demand(inertia, OMEGA, gravity, 0.5, demand)
    np.testing.assert_allclose(demand, inertia @ OMEGA - 0.5 * gravity, rtol=1e-14)
    assert appc.limit_torque(np.array([0.1, -0.3, 0.0]), 0.2, out)
    np.testing.assert_array_equal(out, [0.1, -0.2, 0.0])
    assert not appc.limit_torque(np.array([0.2, -0.2, 0.0]), 0.2, out)


def test_adaptation_stands_still_outside_the_funnel_or_when_clipped():
    eta, epsilon, xi = np.full(3, 0.005), np.array([2.0, -3.0, 4.0]), np.array([0.5, -0.6, 1.1])
    v = np.array([0.1, 0.1, 0.1])
    appc.adapt(0.01, eta, epsilon, xi, False, 0.10012, v)
    np.testing.assert_allclose(v, [0.1001, 0.10012, 0.1], rtol=1e-14)
    appc.adapt(0.01, eta, epsilon, xi, True, 1.0, v)
    np.testing.assert_allclose(v, [0.1001, 0.10012, 0.1], rtol=1e-14)


def test_proportional_derivative():
    out = np.empty(3)
    kp, kd, inertia = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.6, 0.7]), np.diag([0.1, 0.2, 0.3])
    proportional_derivative(ANGLES, OMEGA, kp, kd, inertia, out)
    np.testing.assert_allclose(out, inertia @ (-kp * ANGLES - kd * OMEGA), rtol=1e-14)


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(-0.8, 0.8)] * 6))
def test_backstepping_makes_its_lyapunov_function_fall(values):
    """V' = -c1 |e|^2 - c2 |omega - alpha|^2, with V differentiated numerically along the motion."""
    angles, omega = np.array(values[:3]), np.array(values[3:])
    c1, c2, inertia = 0.7, 1.9, 0.013
    m_g = np.array([1e-3, -2e-3, 5e-4])
    u, alpha = np.empty(3), np.empty(3)

    def lyapunov(angles, omega):
        backstepping(angles, angles, omega, c1, c2, inertia * np.eye(3), m_g, u, alpha)
        return 0.5 * angles @ angles + 0.5 * (omega - alpha) @ (omega - alpha)

    lyapunov(angles, omega)
    expected = -c1 * angles @ angles - c2 * (omega - alpha) @ (omega - alpha)
    angle_slope, omega_slope = rate_matrix(angles) @ omega, (m_g + u) / inertia
    np.testing.assert_allclose(alpha, -c1 * np.linalg.solve(rate_matrix(angles), angles), atol=1e-12)
    h = 1e-5
    change = lyapunov(angles + h * angle_slope, omega + h * omega_slope)
    change -= lyapunov(angles - h * angle_slope, omega - h * omega_slope)
    assert math.isclose(change / (2.0 * h), expected, rel_tol=1e-5, abs_tol=1e-7)
