"""The control laws one equation at a time: funnels, error transform, sampled roots, APPC, PD, backstepping."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from cubli_ros import appc, funnel, sampled_appc
from cubli_ros.appc_controller import OUTSIDE_RATE, AppcController, AppcParameters, AppcState
from cubli_ros.attitude import cardan_rates
from cubli_ros.backstepping import backstepping
from cubli_ros.backstepping_controller import BacksteppingParameters
from cubli_ros.pd import proportional_derivative
from cubli_ros.pd_controller import PdParameters
from flight_graph.components.component import kinds_of
from flight_math import Quaternion, Vec3, same, sincos
from flight_math.values import view
from tests.cubli.records import made

ANGLES = Vec3(-0.3, 0.25, 0.35)
OMEGA = Vec3(0.02, -0.03, 0.01)


def rate_matrix(angles):
    return np.array([cardan_rates(sincos(Vec3(*angles)), Vec3(*column)) for column in np.eye(3)]).T


def test_performance_bound():
    assert funnel.performance_bound(0.0, 0.4, 0.008, -0.29) == 0.4
    assert math.isclose(funnel.performance_bound(3.0, 0.4, 0.008, -0.29), 0.392 * math.exp(-0.87) + 0.008)


def test_transformed_error_as_printed_and_capped():
    for xi in (-0.9, -0.1, 0.0, 0.5, 1.5):
        assert funnel.transformed_error(xi) == xi / (1.0 - xi * xi)
    cap = 0.9
    slope = (1.0 + cap * cap) / (1.0 - cap * cap) ** 2
    value = cap / (1.0 - cap * cap)
    assert funnel.capped_error(0.5, cap) == funnel.transformed_error(0.5)
    for xi in (0.95, 1.0, 7.0):
        assert math.isclose(funnel.capped_error(xi, cap), value + slope * (xi - cap))
        assert funnel.capped_error(-xi, cap) == -funnel.capped_error(xi, cap)


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
    assert funnel.switching_sign(Vec3(-2.0, 0.0, 1e-300), 0.0).parts() == (-1.0, 0.0, 1.0)
    np.testing.assert_allclose(funnel.switching_sign(Vec3(0.004, 0.0, -9.0), 0.01), np.tanh([0.4, 0.0, -900.0]), rtol=1e-15)


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
    p, x = made(AppcParameters, rho_a_inf=0.008, l_a=-0.29), made(AppcState, start_bound=0.4)
    bound = funnel.performance_bound(2.0, 0.4, 0.008, -0.29)
    error = Vec3(0.97 * bound, -0.99 * bound, 3.0 * bound)
    for _ in range(2):  # the second time there is nothing to widen
        funnel.rearm(p, x, 2.0, error)
        assert x.rearmed == 2
        np.testing.assert_allclose(x.start_bound, [0.4, 0.99 * bound / 0.75, 4.0 * bound])
        np.testing.assert_array_equal(x.start_time, [0.0, 2.0, 2.0])
    np.testing.assert_allclose(funnel.attitude_bound(p, x, 2.0), [bound, 0.99 * bound / 0.75, 4.0 * bound])


@pytest.mark.parametrize("smoothing", [0.0, 0.01])
def test_explicit_law_is_equations_10_to_16(smoothing):
    reference, reference_rate = np.array([0.01, -0.02, 0.0]), np.array([0.001, 0.0, 0.002])
    rho_a, rho_u = np.array([0.4, 0.5, 0.6]), np.array([0.1, 0.11, 0.12])
    lambda_a, lambda_u = np.array([0.041, 0.03, 0.02]), np.array([0.04, 0.05, 0.06])
    k_a, k_u, v_a, v_u = np.full(3, 0.01), np.full(3, 0.02), np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.2, 0.1])
    p = made(AppcParameters, smoothing=smoothing, lambda_a=lambda_a, lambda_u=lambda_u, k_a=k_a, k_u=k_u)
    x = made(AppcState, adaptive_a=v_a, adaptive_u=v_u)
    xi_a = (ANGLES - Vec3(*reference)) / Vec3(*rho_a)
    eps_a, delta = appc.attitude_loop(p, x, sincos(ANGLES), xi_a, Vec3(*reference_rate))
    eps_u, acceleration = appc.rate_loop(p, x, (OMEGA - delta) / Vec3(*rho_u))

    def sign(x):
        return np.tanh(x / smoothing) if smoothing else np.sign(x)

    xi = (np.array(ANGLES) - reference) / rho_a
    eps = xi / (1.0 - xi**2)
    gamma = np.linalg.solve(rate_matrix(ANGLES), reference_rate - lambda_a * eps - sign(eps) * k_a * v_a)
    np.testing.assert_allclose(eps_a, eps, rtol=1e-14)
    np.testing.assert_allclose(delta, gamma, rtol=1e-12)
    xi = (np.array(OMEGA) - gamma) / rho_u
    eps = xi / (1.0 - xi**2)
    np.testing.assert_allclose(eps_u, eps, rtol=1e-11)
    np.testing.assert_allclose(acceleration, -lambda_u * eps - sign(eps) * k_u * v_u, rtol=1e-11)


def test_implicit_law_holds_one_sample_ahead():
    """Demanded acceleration, taken for one sample, brings the rate error to the value for which eq. (16) demands it."""
    h = 0.01  # [s]
    rho_a, rho_u, gain, k, v = 0.4, 0.1, 0.041, 0.01, 0.2
    p = made(AppcParameters, h, lambda_a=gain, lambda_u=gain, k_a=k, k_u=k, l_a=-1e-300, l_u=-1e-300, rho_u0=rho_u)
    x = made(AppcState, adaptive_a=v, adaptive_u=v, start_bound=rho_a)
    for omega in (OMEGA, 40.0 * OMEGA):
        _, _, acceleration = sampled_appc.sampled_law(p, x, 0.0, ANGLES, sincos(ANGLES), omega)
        delta, acceleration, omega = map(np.array, (x.virtual_rate, acceleration, omega))
        predicted = np.array(ANGLES) + h * rate_matrix(ANGLES) @ omega
        demand = rate_matrix(predicted) @ delta
        xi = (predicted + h * demand) / rho_a
        np.testing.assert_allclose(demand, -gain * xi / (1.0 - xi * xi) - k * v * np.sign(xi), rtol=1e-9)
        xi = (omega + h * acceleration - delta) / rho_u
        assert np.abs(xi).max() < 1.0
        np.testing.assert_allclose(acceleration, -gain * xi / (1.0 - xi * xi) - k * v * np.sign(xi), rtol=1e-8)


def test_dead_zone_takes_the_error_to_zero():
    h, rho, k, v = 0.01, 0.1, 0.01, 0.2
    p, x = made(AppcParameters, h, lambda_u=0.041, k_u=k), made(AppcState, adaptive_u=v)
    omega = Vec3(1e-5, -1e-5, 0.0)
    epsilon, acceleration = sampled_appc.implicit_rate_loop(p, x, omega, same(0.0), same(rho))
    np.testing.assert_array_equal(epsilon, 0.0)
    np.testing.assert_allclose(omega + h * acceleration, 0.0, atol=1e-20)
    edge = k * v * h / rho  # the two branches meet here
    b = Vec3(edge, edge * (1.0 + 1e-12), 0.0)
    below, above, _ = sampled_appc.implicit_feedback(h, b, same(rho), same(0.041), same(k * v))[1]
    assert math.isclose(below, above, rel_tol=1e-9)


def test_torque_demand():
    inertia = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 5.0]])
    gravity = Vec3(0.1, 0.2, -0.3)
    demand = appc.torque_demand(made(AppcParameters, inertia=inertia.tolist(), feed_forward=0.5), OMEGA, gravity)
    np.testing.assert_allclose(demand, inertia @ np.array(OMEGA) - 0.5 * np.array(gravity), rtol=1e-14)


class Records:
    """A controller's own records, and a firing with an attitude at rest."""

    def __init__(self, component, angles, rates=(0.0, 0.0, 0.0), **values):
        self.p, self.x = made(component.parameters, **values), made(component.state)
        self.component = component
        self.ports = {}
        for name, signal in {**component.inputs, **component.outputs}.items():
            self.ports[name] = view(signal.new()[1][0], kinds_of(signal))
        attitude = self.ports["attitude"]
        attitude.header.stamp.sec = 1
        attitude.orientation = Quaternion(*Rotation.from_euler("XYZ", angles).as_quat())
        attitude.angular_velocity = Vec3(*rates)
        if component.start is not None:
            component.start(self.p, self.x)

    def fire(self, t=0.0):
        self.component.kernel(round(1e9 * t), self.p, self.x, *self.ports.values())
        return self


def test_a_clipped_torque_stops_the_adaptation():
    free = Records(AppcController, (-0.3, 0.2, 0.1), torque_limit=1.0).fire()
    assert np.array(free.x.adaptive_u).min() > 0.0 and free.x.clipped == 0
    largest = max(abs(free.ports["funnel"].torque_demand))
    clipped = Records(AppcController, (-0.3, 0.2, 0.1), torque_limit=0.5 * largest).fire()
    np.testing.assert_array_equal(clipped.x.adaptive_a, 0.0)
    np.testing.assert_array_equal(clipped.x.adaptive_u, 0.0)
    assert clipped.x.clipped == 1
    demand = np.array(clipped.ports["funnel"].torque_demand)
    np.testing.assert_array_equal(clipped.ports["command"].effort, np.clip(demand, -0.5 * largest, 0.5 * largest))


def test_a_start_outside_of_the_rate_funnel_names_the_largest_gain_that_does():
    """|xi_u| of the named lambda_a is 1: just outside; a hundredth below it is inside."""
    outside = Records(AppcController, (-0.3, 0.2, 0.1), (0.02, 0.0, -0.01), lambda_a=0.2, law="explicit").fire()
    assert outside.x.fault == OUTSIDE_RATE
    named = np.array(outside.x.feasible_lambda_a)
    for share, fault in ((1.0001, OUTSIDE_RATE), (0.9999, 0)):
        again = Records(AppcController, (-0.3, 0.2, 0.1), (0.02, 0.0, -0.01), lambda_a=share * named, law="explicit").fire()
        assert again.x.fault == fault
        assert max(abs(again.ports["funnel"].rate_xi)) == pytest.approx(share, abs=1e-3)


def test_adaptation_stands_still_outside_the_funnel():
    epsilon, xi = Vec3(2.0, -3.0, 4.0), Vec3(0.5, -0.6, 1.1)
    v = appc.adapted(0.01, same(0.1), same(0.005), epsilon, xi, 0.10012)
    np.testing.assert_allclose(v, [0.1001, 0.10012, 0.1], rtol=1e-14)


def test_proportional_derivative():
    kp, kd = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.6, 0.7])
    out = proportional_derivative(made(PdParameters, kp=kp, kd=kd), ANGLES, OMEGA)
    np.testing.assert_allclose(out, -kp * np.array(ANGLES) - kd * np.array(OMEGA), rtol=1e-14)


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(-0.8, 0.8)] * 6))
def test_backstepping_makes_its_lyapunov_function_fall(values):
    """V' = -c1 |e|^2 - c2 |omega - alpha|^2, with V differentiated numerically along the motion."""
    angles, omega = np.array(values[:3]), np.array(values[3:])
    c1, c2 = 0.7, 1.9
    p = made(BacksteppingParameters, c1=c1, c2=c2)

    def law(angles, omega):
        return map(np.array, backstepping(p, sincos(Vec3(*angles)), Vec3(*angles), Vec3(*omega)))

    def lyapunov(angles, omega):
        alpha, _ = law(angles, omega)
        return 0.5 * angles @ angles + 0.5 * (omega - alpha) @ (omega - alpha)

    alpha, omega_slope = law(angles, omega)
    expected = -c1 * angles @ angles - c2 * (omega - alpha) @ (omega - alpha)
    angle_slope = rate_matrix(angles) @ omega
    np.testing.assert_allclose(alpha, -c1 * np.linalg.solve(rate_matrix(angles), angles), atol=1e-12)
    h = 1e-5
    change = lyapunov(angles + h * angle_slope, omega + h * omega_slope)
    change -= lyapunov(angles - h * angle_slope, omega - h * omega_slope)
    assert math.isclose(change / (2.0 * h), expected, rel_tol=1e-5, abs_tol=1e-7)
