"""Parameter estimators: least squares against its batch solution, the other laws against their formulas."""

import numpy as np
import pytest
from scipy.linalg import expm

from flight_graph.errors import FlightError
from flight_math import Vec3
from sim_nodes.spacerobot.dynamics import step
from spacerobot_ros import natural_adaptation
from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.excitation import accumulate, singular_values
from spacerobot_ros.filtered_regressor import NOT_FINITE, READY, STARTED, Filter, Rows, filter_step, momentum_regressor
from spacerobot_ros.inertial_parameters import prior, pseudo_inertia, smallest_pseudo_inertia_eigenvalues
from spacerobot_ros.lyapunov_law import adaptation_gain, lyapunov_update
from tests.spacerobot.spacerobot_cases import Signals, forward, plant_of, random_robot, regress, tree_at
from tests.spacerobot.spacerobot_loop import FILTERED, HARMONIC, LYAPUNOV, RLS, ROBOT, Sampling, initial_state, run

pytestmark = pytest.mark.xdist_group("the robot's loop")  # compiled once

PI = ROBOT.pi


class LeastSquares:
    def __init__(self, diagonal, start, forgetting=1.0):
        self.pi, self.diagonal, self.forgetting = start.copy(), diagonal, forgetting
        self.g = np.diag(diagonal)

    def update(self, y, measurement, first_row=0):
        return rls.update(y[first_row:], measurement[first_row:], self.forgetting, self.pi, self.g, self.diagonal)


@pytest.mark.parametrize("first_row", [0, 3])
@pytest.mark.parametrize("forgetting", [1.0, 0.97])
def test_least_squares_equals_the_regularised_batch_solution(first_row, forgetting):
    rng = np.random.default_rng(0)
    start = prior(PI, 0.2, 5)
    estimator = LeastSquares(rng.uniform(0.1, 10.0, 50), start, forgetting)
    information = np.diag(1.0 / estimator.diagonal)
    right = information @ start
    for _ in range(30):
        y = rng.standard_normal((10, 50))
        measurement = y @ PI + rng.standard_normal(10)
        assert estimator.update(y, measurement, first_row) == rls.UPDATED
        information = forgetting * (information + y[first_row:].T @ y[first_row:])
        right = forgetting * (right + y[first_row:].T @ measurement[first_row:])
    np.testing.assert_allclose(estimator.pi, np.linalg.solve(information, right), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(estimator.g, np.linalg.inv(information), rtol=0, atol=1e-9 * estimator.g.max())
    np.testing.assert_array_equal(estimator.g, estimator.g.T)


@pytest.mark.parametrize("where", ["torque", "regressor"])
def test_least_squares_skips_what_is_not_finite(where):
    rng = np.random.default_rng(1)
    estimator = LeastSquares(np.full(50, 1e4), PI)
    y, measurement = rng.standard_normal((10, 50)), rng.standard_normal(10)
    estimator.update(y, measurement)
    before = estimator.pi.copy(), estimator.g.copy()
    (measurement if where == "torque" else y[7])[5] = np.nan
    assert estimator.update(y, measurement) == rls.SKIPPED
    np.testing.assert_array_equal(estimator.pi, before[0])
    np.testing.assert_array_equal(estimator.g, before[1])


def test_force_rows_that_are_not_used_may_hold_anything():
    rng = np.random.default_rng(1)
    y, measurement = rng.standard_normal((10, 50)), rng.standard_normal(10)
    y[0, 0], measurement[1] = np.nan, np.inf
    assert LeastSquares(np.full(50, 1e4), PI).update(y, measurement, 3) == rls.UPDATED


@pytest.mark.parametrize(
    "damage, code",
    [
        (lambda g: g.__setitem__((3, 7), g[3, 7] + 1.0), rls.ASYMMETRIC),
        (lambda g: g.__setitem__((4, 4), -2.0), rls.NOT_POSITIVE),
        (lambda g: g.__isub__(3.0 * np.outer(np.ones(50), np.ones(50)) * g.max()), rls.NOT_POSITIVE),
        (lambda g: g.__setitem__((2, 9), np.nan), rls.RESET),
    ],
)
def test_least_squares_repairs_and_reports_a_damaged_covariance(damage, code):
    rng = np.random.default_rng(2)
    estimator = LeastSquares(np.full(50, 1e4), prior(PI, 0.2, 5))
    for _ in range(20):
        y = rng.standard_normal((10, 50))
        estimator.update(y, y @ PI)
    damage(estimator.g)
    y = rng.standard_normal((10, 50))
    assert estimator.update(y, y @ PI) & code
    assert np.linalg.eigvalsh(estimator.g).min() > 0.0
    np.testing.assert_array_equal(estimator.g, estimator.g.T)
    assert estimator.update(y, y @ PI) == rls.UPDATED
    for _ in range(200):
        y = rng.standard_normal((10, 50))
        estimator.update(y, y @ PI)
    np.testing.assert_allclose(estimator.pi, PI, atol=1e-3)


def test_initial_covariance():
    np.testing.assert_array_equal(rls.initial_covariance(PI), 1e6 * PI * PI)
    np.testing.assert_array_equal(rls.initial_covariance(PI, "uniform"), np.full(50, 1e4))
    np.testing.assert_allclose(rls.initial_covariance(PI, "covariance"), (0.4 / 3 * PI / 1e-3) ** 2 + 1e-6)
    symmetric = np.array([1.0, 0, 0, 1, 0, 1, 0, 0, 0, 4.0])
    assert np.all(rls.initial_covariance(symmetric) > 0.0)
    with pytest.raises(FlightError, match="prior_squared, uniform, covariance"):
        rls.initial_covariance(PI, "large")


def test_lyapunov_update_is_its_formula_and_skips_what_is_not_finite():
    rng = np.random.default_rng(3)
    y, sigma = rng.standard_normal((10, 50)), rng.standard_normal(7)
    gain = adaptation_gain(PI, "prior_squared")
    pi = PI.copy()
    assert lyapunov_update(y[3:], sigma, gain, 0.02, pi)
    np.testing.assert_allclose(pi, PI + 0.02 * 5 * PI * PI * (y[3:].T @ sigma), rtol=1e-12)
    sigma[2] = np.inf
    before = pi.copy()
    assert not lyapunov_update(y[3:], sigma, gain, 0.02, pi)
    np.testing.assert_array_equal(pi, before)


def test_natural_update_against_the_matrix_exponential():
    rng = np.random.default_rng(4)
    y, sigma = rng.standard_normal((10, 50)), rng.standard_normal(7)
    got = PI.copy()
    assert natural_adaptation.natural_update(y[3:], sigma, 3.0, 0.02, 1e3, got) == 0
    basis = [pseudo_inertia(row) for row in np.eye(10)]
    for b in range(5):
        slope = (y[3:].T @ sigma)[10 * b : 10 * b + 10]
        # L of tr(L P(pi)) = slope . pi: the gradient in the ten directions of the symmetric 4x4 matrices
        gram = np.array([[np.sum(p * q) for q in basis] for p in basis])
        coefficients = np.linalg.solve(gram, slope)
        gradient = sum(c * p for c, p in zip(coefficients, basis, strict=True))
        c = np.linalg.cholesky(pseudo_inertia(PI[10 * b : 10 * b + 10]))
        expected = c @ expm(3.0 * 0.02 * c.T @ gradient @ c) @ c.T
        np.testing.assert_allclose(pseudo_inertia(got[10 * b : 10 * b + 10]), expected, rtol=1e-9, atol=1e-12)


def test_projection_makes_bodies_possible_and_leaves_good_ones():
    good = PI.copy()
    assert natural_adaptation.project(good, 1e-6) == 0
    np.testing.assert_array_equal(good, PI)
    for seed in range(50):
        pi = prior(PI, 0.4, seed)
        natural_adaptation.project(pi, 0.02)
        assert smallest_pseudo_inertia_eigenvalues(pi).min() > 0.0
        smallest = np.zeros(5)
        natural_adaptation.smallest_eigenvalues(pi, smallest)
        np.testing.assert_allclose(smallest, smallest_pseudo_inertia_eigenvalues(pi), rtol=1e-6, atol=1e-12)


def test_natural_update_leaves_an_impossible_body_alone():
    pi = PI.copy()
    pi[9] = -1.0
    before = pi.copy()
    assert natural_adaptation.natural_update(np.ones((7, 50)), np.ones(7), 3.0, 0.02, 2.0, pi) == 1
    np.testing.assert_array_equal(pi[:10], before[:10])
    assert np.any(pi[10:] != before[10:])


def momentum_rows(robot, theta, w, thd, a):
    n, p = robot.joints, 10 * (robot.joints + 1)
    rows = Rows(*np.full((3, 3 + n, p), np.nan))
    momentum_regressor(tree_at(robot, theta), Vec3(*w), thd, Vec3(*a), rows)
    return rows


@pytest.mark.parametrize("joints", [1, 4, 9])
def test_momentum_form_equals_the_equation_of_motion(joints):
    """d/dt(Y_p) + Y_g + Y_a = Y, the time derivative by central difference along the motion."""
    rng = np.random.default_rng(joints)
    robot = random_robot(rng, joints)
    s = Signals(rng, robot)
    h = 1e-6  # [s]
    sides = []
    for sign in (1.0, -1.0):
        theta = s.theta + sign * h * s.thd + 0.5 * h * h * s.thdd
        sides.append(momentum_rows(robot, theta, s.w + sign * h * s.al, s.thd + sign * h * s.thdd, s.a).momentum)
    _, rate, push = momentum_rows(robot, s.theta, s.w, s.thd, s.a)
    got = (sides[0] - sides[1]) / (2 * h) + rate + push
    expected = regress(robot, s.theta, s.w, s.w, s.al, s.a, s.thd, s.thd, s.thdd)[3:]
    assert np.abs(got - expected).max() < 1e-8 * np.abs(expected).max()


def test_filtered_regressor_predicts_the_filtered_torque():
    """Free-floating motion under torque held at 50 Hz: W pi against tau_f, to the trapezoid rule's error."""
    period, u = 0.02, np.zeros(7)
    state, wrench = initial_state(), np.zeros(10)
    kept, plant = Filter(np.zeros((2, 7, 50)), np.zeros(7), np.zeros((7, 50))), plant_of(ROBOT)
    ready, worst, codes = 0, 0.0, []
    for k in range(300):
        wrench[3:] = u
        theta, w, thd = state[13:17].copy(), state[10:13].copy(), state[17:21].copy()
        rows = momentum_rows(ROBOT, theta, w, thd, forward(ROBOT, theta, w, thd, wrench)[:3])
        reading = np.full(7, np.nan) if k == 100 else u
        ready = filter_step(Sampling(2.0, period), kept, ready, rows, reading)
        codes.append(ready)
        if ready == READY:
            worst = max(worst, np.abs(kept.filtered @ PI - kept.filtered_torque).max())
        u = 0.05 * np.sin(0.1 * k + np.arange(7.0)) * np.array([4, 4, 2, 1, 2, 1, 0.1])
        wrench[3:] = u
        for _ in range(4):
            step(plant, PI, state, wrench, Vec3(0.0, 0.0, 0.0), period / 4)
    assert codes[0] == STARTED and codes[99:103] == [READY, NOT_FINITE, STARTED, READY]
    assert worst < 2e-4  # [N m], of torques up to 0.2 N m


def sensor_noise(steps):
    """Gyro 5e-5 rad/s, joint rates 2e-4 rad/s, encoders 1e-5 rad, accelerometer 1e-4 m/s^2, torque 1e-3 N m."""
    sigma = np.concatenate([np.full(3, 5e-5), np.full(4, 2e-4), np.full(4, 1e-5), np.full(3, 1e-4), np.full(7, 1e-3)])
    return np.random.default_rng(1).standard_normal((steps, 21)) * sigma


@pytest.mark.parametrize("seed", [106, 107])
def test_with_sensor_noise_differencing_harms_and_filtering_repairs(seed):
    """Differenced accelerations make least squares worse than no update at all; the filtered regressor is better."""
    start, noise = prior(PI, 0.4, seed), sensor_noise(3000)
    none = run(HARMONIC, 60.0, prior=start, noise=noise)
    differenced = run(
        HARMONIC, 60.0, prior=start, noise=noise, estimator=RLS, acceleration_source=1, g_diagonal=np.full(50, 1e4)
    )
    filtered = run(
        HARMONIC, 60.0, prior=start, noise=noise, estimator=FILTERED,
        g_diagonal=rls.initial_covariance(PI, "covariance"),
    )  # fmt: skip
    gamma = adaptation_gain(PI, "prior_squared")
    lyapunov = run(HARMONIC, 60.0, prior=start, noise=noise, estimator=LYAPUNOV, gamma=gamma)
    att = [r.rms(r.attitude_norm, 20) for r in (none, differenced, filtered, lyapunov)]
    assert att[1] == pytest.approx(0.132, rel=0.05)  # [deg]
    assert att[1] > 1.5 * att[0]
    assert att[2] < 0.25 * att[0]
    expected = {106: (0.0547, 0.0363), 107: (0.0770, 0.0721)}[seed]
    assert (att[0], att[3]) == pytest.approx(expected, rel=0.02)


def test_excitation_in_flight_equals_the_singular_values_of_the_stack():
    rng = np.random.default_rng(5)
    scale = np.abs(PI)
    triangle, values = np.zeros((50, 50)), np.zeros(50)
    stack = []
    for _ in range(40):
        s = Signals(rng, ROBOT)
        y = regress(ROBOT, s.theta, s.w, s.w, s.al, s.a, s.thd, s.thd, s.thdd)
        assert accumulate(y[3:], scale, triangle) == 7
        stack.append(y[3:] * scale)
    expected = np.linalg.svd(np.concatenate(stack), compute_uv=False)
    singular_values(triangle, values)
    np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-12 * expected[0])
