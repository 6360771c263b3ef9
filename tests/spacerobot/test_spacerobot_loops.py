"""The closed loop on the paper's tasks: step (Fig. 8-10) and harmonic tracking (Fig. 11-13), reference numbers.

The numbers come from an independent simulation of the same model; trends are the paper's, values the model's.
"""

import numpy as np
import pytest

from spacerobot_ros.inertial_parameters import prior, smallest_pseudo_inertia_eigenvalues
from spacerobot_ros.natural_adaptation import project
from spacerobot_ros.sampling import damping_rates, sampling_number
from tests.spacerobot.spacerobot_loop import HARMONIC, K_D0, LYAPUNOV, NATURAL, RLS, ROBOT, THETA_0, initial_state, run

pytestmark = pytest.mark.xdist_group("the robot's loop")  # compiled once

PI = ROBOT.pi
PRIOR = prior(PI, 0.2, 5)


@pytest.fixture(scope="module")
def step_true():
    return run(duration=40.0)


def test_step_first_torque(step_true):
    expected = [1.394491884, 0, 0, 0, 0.698131701, 0.261799388, 0.052359878]
    np.testing.assert_allclose(step_true.torque[0], expected, rtol=0, atol=1e-8)


def test_step_errors(step_true):
    roll = step_true.roll[[50, 100, 150, 250, 500]]
    np.testing.assert_allclose(roll, [6.724456637, 3.572172151, 1.717407398, 0.340230074, 0.004145464], atol=1e-6)
    joints = np.degrees(step_true.joints)
    np.testing.assert_allclose(joints[[50, 150], 1], [7.599970541, 2.083453855], atol=1e-6)
    np.testing.assert_allclose(joints[[50, 150], 3], [4.195081413, 0.516582528], atol=1e-6)


def test_step_settling(step_true):
    assert step_true.settling(step_true.roll, 1.0) == pytest.approx(3.70, abs=0.02)
    assert step_true.settling(step_true.attitude_norm) == pytest.approx(5.66, abs=0.02)
    assert step_true.settling(step_true.joint_largest) == pytest.approx(6.12, abs=0.02)


def test_step_keeps_momentum_and_energy_in_balance(step_true):
    assert step_true.balance[:, 0].max() < 1e-10  # [kg m/s]
    assert step_true.balance[:, 1].max() < 1e-10  # [N m s]
    assert np.abs(step_true.balance[:, 2]).max() < 1e-12  # [J]
    assert step_true.balance[:, 3].max() == pytest.approx(0.02690, abs=5e-6)  # [J]


def test_integration_step_is_fine_enough(step_true):
    fine = run(duration=40.0, step_size=0.0025)
    assert np.abs(fine.state[:21] - step_true.state[:21]).max() < 1e-10


@pytest.mark.parametrize("gain, settling", [(0.4, 10.90), (2.0, 4.42)])
def test_printed_law_settles_faster_with_larger_lambda(gain, settling):
    result = run(duration=30.0, gain=gain)
    assert result.settling(result.attitude_norm) == pytest.approx(settling, abs=0.02)
    assert result.overshoot < 1e-6  # [deg]


@pytest.mark.parametrize("gain, overshoot, first_below", [(0.4, 4.385, 1.62), (1.2, 0.702, 2.36), (2.0, 0.0, 3.98)])
def test_desired_feedforward_reading_overshoots_more_with_smaller_lambda(gain, overshoot, first_below):
    result = run(duration=30.0, gain=gain, form=3)
    assert result.overshoot == pytest.approx(overshoot, abs=2e-3)
    assert result.t[np.flatnonzero(result.roll < 1.0)[0]] == pytest.approx(first_below, abs=0.02)


def test_harmonic_with_true_parameters():
    result = run(HARMONIC, 60.0)
    assert result.rms(result.attitude_norm, 20) == pytest.approx(0.002600, rel=0.01)
    assert result.rms(result.joint_norm, 20) == pytest.approx(0.008513, rel=0.01)


def test_harmonic_without_update():
    result = run(HARMONIC, 60.0, prior=PRIOR)
    assert result.rms(result.attitude_norm, 20) == pytest.approx(0.007119, rel=0.01)
    assert result.rms(result.prediction, 20) == pytest.approx(2.576e-3, rel=0.01)


def test_harmonic_least_squares_in_the_parameters_own_measure():
    result = run(HARMONIC, 60.0, prior=PRIOR, estimator=RLS, g_diagonal=1e6 * PI * PI)
    assert result.rms(result.attitude_norm, 20) == pytest.approx(0.002600, rel=0.01)
    assert result.rms(result.prediction, 20) < 1e-5  # [N m]
    assert result.pi_hat[0] == pytest.approx(0.907736, abs=1e-4)
    assert result.status == 0


def test_harmonic_least_squares_uniform():
    result = run(HARMONIC, 60.0, prior=PRIOR, estimator=RLS, g_diagonal=np.full(50, 1e4))
    assert result.rms(result.attitude_norm, 20) == pytest.approx(0.002554, rel=0.03)
    assert result.rms(result.prediction, 20) < 1e-4  # [N m]


@pytest.mark.parametrize("gamma, attitude", [(np.full(50, 0.3), 0.01095), (5 * PI * PI, 0.00796)])
def test_harmonic_lyapunov(gamma, attitude):
    result = run(HARMONIC, 60.0, prior=PRIOR, estimator=LYAPUNOV, gamma=gamma)
    assert result.rms(result.attitude_norm, 20) == pytest.approx(attitude, rel=0.01)


@pytest.mark.parametrize("option, attitude, joints", [(0, 0.161, 0.285), (1, 0.232, 0.400)])
def test_base_acceleration_options(option, attitude, joints):
    low = np.array([1, 1, 1, 0.5, 0.5, 0.25, 0.1])
    result = run(HARMONIC, 40.0, damping=low, option=option)
    assert result.rms(result.attitude_norm, 20) == pytest.approx(attitude, rel=0.01)
    assert result.rms(result.joint_norm, 20) == pytest.approx(joints, rel=0.01)


def test_natural_adaptation_keeps_every_body_possible():
    start = prior(PI, 0.4, 106)
    assert project(start, 0.02) > 0
    result = run(HARMONIC, 60.0, prior=start, estimator=NATURAL, damping=K_D0 / 10)
    assert smallest_pseudo_inertia_eigenvalues(result.pi_hat).min() > 0.0
    assert result.rms(result.attitude_norm, 40) < 1.0  # [deg]


def test_torque_limit_lets_the_arm_push_the_base_the_wrong_way():
    result = run(duration=40.0, limit=np.array([0.05] * 3 + [0.5] * 4))
    assert np.abs(result.torque[:, :3]).max() <= 0.05  # [N m]
    assert result.overshoot == pytest.approx(2.97, abs=0.01)
    assert result.attitude_norm.max() == pytest.approx(14.4, abs=0.05)


@pytest.mark.parametrize(
    "period, scale, number", [(0.25, 0.263, 2.09), (0.1, 0.71, 2.09), (0.05, 1.456, 2.09), (0.02, 3.734, 2.11)]
)
def test_largest_stable_gain(period, scale, number):
    """Largest stable multiple of K_D at each control period: the loop holds 5 % below it and not 5 % above."""
    assert sampling_number(ROBOT, THETA_0, scale * K_D0, 1.0, period) == pytest.approx(number, abs=0.006)
    below = run(duration=60.0, period=period, damping=0.95 * scale * K_D0)
    above = run(duration=60.0, period=period, damping=1.05 * scale * K_D0)
    assert np.abs(below.torque[-20:]).max() < 0.01 * np.abs(below.torque).max()
    assert not np.abs(above.torque[-20:]).max() < 0.01 * np.abs(above.torque).max()


def test_damping_rates():
    expected = [0.993, 1.34, 4.78, 8.48, 9.95, 14.7, 28.0]
    np.testing.assert_allclose(damping_rates(ROBOT, THETA_0, K_D0), expected, rtol=5e-3)


def test_initial_state_is_at_rest():
    state = initial_state()
    assert not state[3:6].any() and not state[10:13].any() and not state[17:].any()
