"""Reference numbers of the model and its dynamics, from an independent implementation (8 decimal places)."""

import numpy as np

from spacerobot_ros.dynamics import composite_parameters
from spacerobot_ros.inertial_parameters import prior
from tests.spacerobot.spacerobot_cases import Signals, forward, inertia_matrices, inverse, random_robot, regress, tree_at
from tests.spacerobot.spacerobot_loop import ROBOT, THETA_0

W = np.array([0.1, -0.2, 0.3])  # [rad/s]
THD = np.array([0.4, -0.3, 0.2, -0.1])  # [rad/s]


def close(got, expected):
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-8)


def test_mass_and_center_of_mass():
    composite = np.zeros(50)
    composite_parameters(tree_at(ROBOT, THETA_0), ROBOT.pi, composite)
    close(composite[9], 36.6)
    close(composite[6:9] / 36.6, [0.022387978, 0.031287130, 0.115355810])


def test_reduced_mass_matrix():
    _, m = inertia_matrices(ROBOT, THETA_0)
    diagonal = [3.739603273, 3.483605090, 1.221861165, 0.363191106, 1.537135098, 0.425652568, 0.049130157]
    close(np.diag(m), diagonal)
    close([m[0, 4], m[0, 5], m[1, 3], m[4, 5]], [2.018956372, 0.922000150, -0.838451013, 0.700639363])
    eigenvalues = [0.038395852, 0.082090044, 0.127318305, 0.402905262, 0.914919963, 4.003602818, 5.250946214]
    close(np.linalg.eigvalsh(m), eigenvalues)


def test_gain_of_the_loop_through_a_delayed_accelerometer():
    h, m = inertia_matrices(ROBOT, THETA_0)
    coupling = h[3:, :3] @ np.linalg.solve(h[:3, :3], h[:3, 3:])
    rho = np.abs(np.linalg.eigvals(coupling @ np.linalg.inv(m))).max()
    assert abs(rho - 0.164443048) < 1e-7


def test_forward_dynamics():
    wrench = np.concatenate([np.zeros(3), [0.05, -0.04, 0.03, 0.02, -0.01, 0.015, -0.005]])
    close(forward(ROBOT, THETA_0, W, THD, wrench)[:3], [0.004046176, 0.011113485, 0.013782067])


def test_inverse_dynamics_with_the_base_acceleration_from_the_force_rows():
    al, thdd = np.array([0.01, 0.02, -0.03]), np.array([0.05, -0.06, 0.07, -0.08])
    force = inverse(ROBOT, THETA_0, W, W, al, np.zeros(3), THD, THD, thdd)[:3]
    wrench = inverse(ROBOT, THETA_0, W, W, al, -force / 36.6, THD, THD, thdd)
    assert np.abs(wrench[:3]).max() < 1e-15  # [N]
    expected = [0.495376277, -0.266884874, 0.016741225, 0.113363556, 0.287376822, 0.205686623, -0.026005557]
    close(wrench[3:], expected)


def test_priors():
    close(prior(ROBOT.pi, 0.2, 5)[:3], [0.859835033, 0.011487538, -0.015931769])
    close(prior(ROBOT.pi, 0.2, 1)[49], 1.906940035)
    z = np.random.default_rng(7).standard_normal(50)
    variance = prior(ROBOT.pi, 0.2, 7, "variance") - ROBOT.pi
    np.testing.assert_allclose(variance**2, 0.2 / 3 * np.abs(ROBOT.pi) * z**2, rtol=1e-9)


def test_regressor_times_parameters_is_inverse_dynamics_with_reference_velocities():
    rng = np.random.default_rng(4)
    for robot in [ROBOT] * 50 + [random_robot(rng, 1 + k % 10) for k in range(20)]:
        s, r = Signals(rng, robot), Signals(rng, robot)
        signals = (s.theta, s.w, r.w, r.al, r.a, s.thd, r.thd, r.thdd)
        got = regress(robot, *signals) @ robot.pi
        expected = inverse(robot, *signals)
        assert np.abs(got - expected).max() < 1e-13 * np.abs(expected).max()


def test_mass_matrix_rate_minus_twice_coriolis_is_skew():
    """S = M_dot - 2 C: largest |S + S^T| over 500 states, relative to the largest |M_dot| (central difference 1e-6)."""
    rng = np.random.default_rng(5)
    worst, scale, zero = 0.0, 0.0, np.zeros(3)
    for _ in range(500):
        s = Signals(rng, ROBOT)
        c = np.zeros((7, 7))
        for j in range(7):
            unit = np.eye(7)[j]
            c[:, j] = inverse(ROBOT, s.theta, s.w, unit[:3], zero, zero, s.thd, unit[3:], np.zeros(4))[3:]
        ahead = inertia_matrices(ROBOT, s.theta + 1e-6 * s.thd)[0][3:, 3:]
        behind = inertia_matrices(ROBOT, s.theta - 1e-6 * s.thd)[0][3:, 3:]
        rate = (ahead - behind) / 2e-6
        skew = rate - 2.0 * c
        worst = max(worst, np.abs(skew + skew.T).max())
        scale = max(scale, np.abs(rate).max())
    assert worst / scale < 1e-8
