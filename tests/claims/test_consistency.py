"""The measures of the attitude filter's consistency, against linear filters whose statistics are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flight_graph.graphs.scenario import load
from papers.appc import consistency


def records(attitude, estimate, bias, covariance):
    """Records as the run's, of rotations, bias estimates (n, 3) and covariances (n, 6, 6)."""
    inside = np.zeros(len(bias), [("bias", "f8", 3), ("covariance", "f8", 36)])
    inside["bias"], inside["covariance"] = bias, covariance.reshape(-1, 36)
    made = [np.zeros(len(bias), [("orientation", "f8", 4)]) for _ in range(2)]
    for record, rotation in zip(made, (attitude, estimate)):
        record["orientation"] = rotation.as_quat()
    return inside, *made


def test_errors_that_are_drawn_from_the_covariance_have_a_chi_square_nees():
    draw = np.random.default_rng(5)
    factor = np.tril(draw.normal(size=(6, 6))) * 1e-4 + 2e-4 * np.eye(6)
    errors = draw.normal(size=(4000, 6)) @ factor.T
    estimate = Rotation.random(4000, random_state=draw)
    attitude = estimate * Rotation.from_rotvec(errors[:, :3])  # body-frame error: q_true = q dq
    bias = draw.normal(size=(4000, 3))
    inside, truth, estimated = records(attitude, estimate, bias, np.broadcast_to(factor @ factor.T, (4000, 6, 6)))
    nees = consistency.estimation_error_squared(inside, truth, estimated, bias + errors[:, 3:])
    expected = (np.linalg.solve(factor, errors.T) ** 2).sum(axis=0)
    assert nees == pytest.approx(expected, rel=1e-5)


def test_the_sign_of_a_quaternion_means_nothing():
    estimate = Rotation.random(5, random_state=1)
    attitude = estimate * Rotation.from_rotvec(np.full((5, 3), 1e-3))
    inside, truth, estimated = records(attitude, estimate, np.zeros((5, 3)), np.broadcast_to(np.eye(6), (5, 6, 6)))
    truth["orientation"][2] *= -1.0
    error, _ = consistency.attitude_and_bias_error(truth, estimated, inside, np.zeros((5, 3)))
    assert error == pytest.approx(np.full((5, 3), 1e-3), rel=1e-5)


def test_the_bias_walk_is_the_sensors_own():
    """Without white noise, and standing still, the gyro measures its bias."""
    from flight_graph.engines.compiled import CompiledRun
    scenario = load("cubli_seeds", {"imu.gyro_sigma": 0.0, "duration_s": 5.0}, 3)
    recording = CompiledRun(scenario).run()
    bias = consistency.true_bias(scenario, recording["cubli/imu"])
    measured = recording["cubli/imu"]["angular_velocity"] - recording["cubli/truth"]["rates"]
    assert bias == pytest.approx(measured, abs=1e-15)
    assert np.ptp(bias, axis=0).min() > 0.0
