"""Sensors that watch each other: consistent without a fault; each failure found in the right sensor, and lived with."""

import numpy as np
import pytest
from scipy.stats import chi2

from spacerobot_ros.robust_state_estimator import RobustEstimatorParameters
from tests.faults_spacerobot.runs import attitude_error, between, fly, rate_error, times

STATUS = "spacerobot/state_status"
JOINTS = "joint_sensors.joints"


def flags(record):
    """Which sensors are admitted: gyro, star tracker, encoders, joint rates, (m, 10)."""
    return np.column_stack([record[f"{name}_admitted"] for name in ("gyro", "star_tracker", "encoder", "joint_rate")])


def joint_errors(recording):
    """Largest errors of the joint angles [rad] and rates [rad/s], (4,) each."""
    estimate, truth = recording["spacerobot/joint_estimate"], recording["spacerobot/truth"]
    return np.abs(estimate["position"] - truth["joints"]).max(axis=0), np.abs(
        estimate["velocity"] - truth["joint_rates"]).max(axis=0)


def test_gates_are_quantiles_of_chi_square():
    values = RobustEstimatorParameters.defaults()
    assert values["attitude_gate"] == pytest.approx(chi2.isf(1e-6, 3), abs=0.05)
    assert values["joint_gate"] == pytest.approx(chi2.isf(1e-6, 1), abs=0.05)


def test_without_a_fault_nothing_is_refused_and_residuals_are_as_wide_as_said():
    """Mean squares of the normalised residuals: chi-square over its degrees of freedom, within six standard deviations."""
    recording = fly()
    status = recording[STATUS]
    assert status["refused"].sum() == 0.0 and flags(status).min() == 1.0 and status["healthy"].min() == 1.0
    tracker = between(recording, STATUS, 1.0)["innovation"][::5, 0] ** 2
    assert tracker.mean() == pytest.approx(1.0, abs=6.0 * np.sqrt(2.0 / (3 * len(tracker))))
    encoders = between(recording, STATUS, 1.0)["innovation"][:, 1:] ** 2
    assert 0.75 < encoders.mean() < 1.0 + 6.0 * np.sqrt(2.0 / encoders.size)  # the rate's changes widen it a little
    error = attitude_error(recording)[100:]
    assert np.sqrt(np.mean(error**2)) < 1.3 * np.sqrt(3.0) * status["attitude_sigma"][-1]


def test_a_minute_without_the_star_tracker():
    """The estimate stays valid on the gyro alone, says how uncertain it is, and takes the tracker back at once."""
    recording = fly("star_tracker.measured", "drop", from_s=10, for_s=60, over=(("duration_s", 75),))
    blind, error = between(recording, STATUS, 10.0, 70.0), attitude_error(recording)
    assert blind["valid"].min() == 1.0 and blind["star_tracker_age"][-1] == pytest.approx(60.0, abs=0.2)
    sigma = recording[STATUS]["attitude_sigma"]
    assert np.diff(blind["attitude_sigma"][10:]).min() > 0.0
    assert (error[500:3500] < 4.5 * np.sqrt(3.0) * sigma[500:3500]).all() and error.max() < 1e-3
    noise = 5e-5 * np.sqrt(0.02 * 60.0)  # [rad] the random walk of the gyro's noise alone
    assert noise < sigma[3499] < 0.01
    back = between(recording, STATUS, 71.0)
    assert back["star_tracker_admitted"].min() == 1.0 and back["attitude_sigma"].max() < 2e-5 and error[-100:].max() < 1e-4


def test_no_star_tracker_from_the_start_is_no_valid_estimate():
    recording = fly("star_tracker.measured", "drop", from_s=0, over=(("duration_s", 4),))
    assert recording[STATUS]["valid"].max() == 0.0 and recording[STATUS]["rates_valid"][10:].min() == 1.0
    assert recording["spacerobot/mode"]["mode"][-1] == 1.0  # hold needs the rates alone


def test_gyro_with_a_bias_comes_back_with_it():
    recording = fly("imu.imu.angular_velocity[1]", "bias", value=0.01, from_s=8)
    admitted = recording[STATUS]["gyro_admitted"]
    out = times(recording, STATUS)[admitted == 0.0]
    assert 8.0 < out[0] < 9.0 and out[-1] < 11.0 and admitted[-1] == 1.0
    assert rate_error(recording).max() < 2e-3 and attitude_error(recording).max() < 3e-4
    assert flags(recording[STATUS])[:, 1:].min() == 1.0


@pytest.mark.parametrize("type, keys", [("noise", {"value": 5e-3}), ("stuck", {}), ("spike", {"value": 0.5})])
def test_rates_without_the_gyro_come_from_the_star_tracker(type, keys):
    recording = fly("imu.imu.angular_velocity", type, from_s=8, **keys)
    assert recording[STATUS]["gyro_admitted"][-1] == (1.0 if type == "spike" else 0.0)
    assert recording[STATUS]["valid"].min() == 1.0
    assert rate_error(recording).max() < 3e-3 and attitude_error(recording).max() < 5e-4
    assert flags(recording[STATUS])[:, 1:].min() == 1.0


def test_silent_imu_is_out_in_time():
    recording = fly("imu.imu", "drop", from_s=8)
    out = times(recording, STATUS)[recording[STATUS]["gyro_admitted"] == 0.0]
    assert out[0] == pytest.approx(8.1, abs=0.03) and recording[STATUS]["valid"].min() == 1.0


@pytest.mark.parametrize("type, keys", [("bias", {"value": 0.01}), ("freeze", {}), ("noise", {"value": 1e-3})])
def test_star_tracker_that_lies_is_out(type, keys):
    at = "star_tracker.measured" if type == "freeze" else "star_tracker.measured.quaternion"
    recording = fly(at, type, from_s=8, **keys)
    admitted = flags(recording[STATUS])
    assert admitted[-1, 1] == 0.0 and np.delete(admitted, 1, axis=1).min() == 1.0
    assert attitude_error(recording).max() < 3e-4


@pytest.mark.parametrize("type, keys", [("bias", {"value": 0.02}), ("stuck", {}), ("noise", {"value": 1e-3})])
def test_encoder_that_lies_is_out_and_its_rate_goes_on(type, keys):
    recording = fly(f"{JOINTS}.position[2]", type, from_s=8, **keys)
    admitted = flags(recording[STATUS])
    assert admitted[-1, 4] == 0.0 and np.delete(admitted, 4, axis=1).min() == 1.0
    assert joint_errors(recording)[0].max() < 1e-3


def test_joint_rate_with_a_bias_comes_back_with_it():
    recording = fly(f"{JOINTS}.velocity[1]", "bias", value=0.02, from_s=8)
    admitted = flags(recording[STATUS])
    assert admitted[:, 7].min() == 0.0 and admitted[-1].min() == 1.0 and np.delete(admitted, 7, axis=1).min() == 1.0
    later = between(recording, "spacerobot/joint_estimate", 9.0)["velocity"] - between(
        recording, "spacerobot/truth", 9.0)["joint_rates"]
    assert np.abs(later).max() < 2e-3


@pytest.mark.parametrize("joint", [1, 3])
def test_a_shock_is_no_failure_of_a_sensor(joint):
    """A joint that seizes jolts rates and base; gyro, encoders and rates stay admitted."""
    recording = fly(f"plant.parameters.joint_seized[{joint}]", "stuck", value=1000.0, from_s=8)
    truth = recording["spacerobot/truth"]
    assert np.abs(np.diff(truth["joint_rates"][:, joint])).max() > 0.04  # [rad/s] in one sample
    assert flags(recording[STATUS]).min() == 1.0 and recording[STATUS]["valid"].min() == 1.0


def test_upset_of_the_gyro_bias_in_memory_is_overcome():
    """The top bit of the exponent: a bias of 1e302 rad/s."""
    recording = fly("state.state.bias[0]", "bit_flip", bit=62, from_s=8)
    assert recording[STATUS]["gyro_admitted"].min() == 0.0 and recording[STATUS]["gyro_admitted"][-1] == 1.0
    assert rate_error(recording).max() < 2e-3 and recording["spacerobot/mode"]["mode"].max() == 0.0
