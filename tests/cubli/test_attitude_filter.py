"""The attitude filter against a NumPy/SciPy one written from the equations, and its consistency over many seeds."""

import math

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from scipy.spatial.transform import Rotation

from cubli_ros import attitude_filter
from cubli_ros.attitude_estimator import AttitudeEstimatorParameters, AttitudeEstimatorState
from flight_math import (
    Quaternion,
    Vec3,
    conjugate,
    kernel,
    quaternion_from_rotation_vector,
    rotation_vector,
    sin,
)
from flight_math.noise import stream_key
from sim_nodes.cubli.sensors import ImuParameters, StarTrackerParameters
from sim_nodes.sensors import inertial, star_tracker
from sim_nodes.sensors.white_noise import white_noise
from tests.cubli.records import made

pytestmark = pytest.mark.xdist_group("attitude filter")  # compiled once

GYRO, WALK, STAR = 1e-4, 1e-6, 5e-5  # [rad/s], [rad/s], [rad] per sample
PERIOD = 0.01  # [s]
SIGMA_ATTITUDE, SIGMA_BIAS = 5e-3, 2e-4  # [rad], [rad/s] at the start
GATE = scipy.stats.chi2.ppf(0.999, 3)


def filter_records(attitude_sigma, bias_sigma=1e-3, attitude=(0.0, 0.0, 0.0, 1.0), gate=GATE):
    """Parameters and state of a filter that has started at an attitude."""
    p = made(AttitudeEstimatorParameters, PERIOD, gyro_sigma=GYRO, gyro_walk_sigma=WALK, gate=gate,
             star_tracker_sigma=attitude_sigma, initial_bias_sigma=bias_sigma)
    x = made(AttitudeEstimatorState)
    attitude_filter.start(p, x, Quaternion(*attitude))
    p.star_tracker_sigma = STAR
    return p, x


def whole_covariance(x):
    """The blocks of the covariance as one matrix (6, 6)."""
    attitude, cross, bias = (np.reshape(block.parts(), (3, 3)) for block in (
        x.attitude_covariance, x.cross_covariance, x.bias_covariance))
    return np.block([[attitude, cross], [cross.T, bias]])


def cross_matrix(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@pytest.mark.parametrize("rate", [(0.0, 0.0, 0.0), (0.1, -0.2, 0.05), (3.0, -2.0, 1.0), (30.0, 20.0, -10.0)])
def test_transition_is_the_matrix_exponential(rate):
    f, g = (np.reshape(block.parts(), (3, 3)) for block in attitude_filter.transition(Vec3(*rate), PERIOD))
    out = np.block([[f, g], [np.zeros((3, 3)), np.eye(3)]])
    slope = np.zeros((6, 6))
    slope[:3, :3] = -cross_matrix(rate)
    slope[:3, 3:] = -np.eye(3)
    np.testing.assert_allclose(out, scipy.linalg.expm(slope * PERIOD), atol=1e-13)


def test_filter_equals_an_independent_one():
    generator = np.random.default_rng(4)
    p, x = filter_records(0.02, gate=1e300)
    rotation, own_bias, own = Rotation.identity(), np.zeros(3), np.diag([4e-4] * 3 + [1e-6] * 3)
    gyro_previous = generator.normal(0.0, 0.5, 3)
    for step in range(200):
        gyro = gyro_previous + generator.normal(0.0, 0.1, 3)
        x.gyro_before = Vec3(*gyro_previous)
        attitude_filter.predict(p, x, Vec3(*gyro))
        rate = 0.5 * (gyro + gyro_previous) - own_bias
        rotation = rotation * Rotation.from_rotvec(rate * PERIOD)
        slope = np.zeros((6, 6))
        slope[:3, :3] = -cross_matrix(rate)
        slope[:3, 3:] = -np.eye(3)
        f = scipy.linalg.expm(slope * PERIOD)
        own = f @ own @ f.T + np.diag([(GYRO * PERIOD) ** 2] * 3 + [WALK**2] * 3)
        gyro_previous = gyro
        if step % 25 == 0:
            measured = rotation * Rotation.from_rotvec(generator.normal(0.0, 5e-3 if step else 0.02, 3))
            accepted = attitude_filter.update(p, x, Quaternion(*measured.as_quat()))
            y = (rotation.inv() * measured).as_rotvec()
            s = own[:3, :3] + STAR**2 * np.eye(3)
            gain = own[:, :3] @ np.linalg.inv(s)
            assert accepted
            np.testing.assert_allclose(x.innovation, y, atol=1e-10)
            assert math.isclose(x.innovation_squared, y @ np.linalg.solve(s, y), rel_tol=1e-6)
            remainder = np.eye(6) - np.hstack([gain, np.zeros((6, 3))])
            own = remainder @ own @ remainder.T + STAR**2 * gain @ gain.T
            rotation = rotation * Rotation.from_rotvec((gain @ y)[:3])
            own_bias = own_bias + (gain @ y)[3:]
        covariance = whole_covariance(x)
        np.testing.assert_allclose(covariance, own, rtol=1e-7, atol=1e-18)
        np.testing.assert_array_equal(covariance, covariance.T)
    np.testing.assert_allclose(Rotation.from_quat(x.quaternion).as_matrix(), rotation.as_matrix(), atol=1e-10)
    np.testing.assert_allclose(x.bias, own_bias, atol=1e-10)


def test_gate_refuses_an_outlier_and_changes_nothing():
    p, x = filter_records(1e-4)
    before = whole_covariance(x)
    for measured in (Rotation.from_rotvec([0.0, 1e-2, 0.0]).as_quat(), np.full(4, np.nan)):
        assert not attitude_filter.update(p, x, Quaternion(*measured))
        assert not x.innovation_squared <= GATE
        np.testing.assert_array_equal(x.quaternion, [0.0, 0.0, 0.0, 1.0])
        np.testing.assert_array_equal(x.bias, 0.0)
        np.testing.assert_array_equal(whole_covariance(x), before)


def test_opposite_quaternion_is_the_same_attitude():
    results = []
    for sign in (1.0, -1.0):
        p, x = filter_records(0.1)
        attitude_filter.update(p, x, Quaternion(*(sign * Rotation.from_rotvec([0.02, -0.1, 0.05]).as_quat())))
        results.append(np.array(x.quaternion))
    np.testing.assert_allclose(results[0], results[1], rtol=1e-14)


@kernel
def tumbling(t):
    """Rates [rad/s], up to 0.2."""
    return 0.2 * sin(Vec3(0.7 * t, 0.7 * t + 2.0, 0.7 * t + 4.0))


@kernel
def simulate(filter_records, gyro_records, star, start_key, steps, found):
    """A tumbling body, gyro at 100 Hz, star tracker at 4 Hz. Returns how many updates.

    found: of each update, the error (updates, 2, 3), the covariance's blocks (updates, 3, 3, 3), and NIS (updates,).
    """
    errors, blocks, nis = found
    (p, x), (gyro_p, gyro_x) = filter_records, gyro_records
    truth = Quaternion(0.1, -0.2, 0.3, 0.9) / math.sqrt(0.95)
    error = -white_noise(start_key, 0, 0, SIGMA_ATTITUDE)
    p.star_tracker_sigma = SIGMA_ATTITUDE
    attitude_filter.start(p, x, truth * quaternion_from_rotation_vector(error))
    p.star_tracker_sigma = STAR
    gyro_x.bias = white_noise(start_key, 1, 0, SIGMA_BIAS)
    updates = 0
    for step in range(steps + 1):
        t = step * PERIOD
        if step > 0:
            fine = PERIOD / 4
            for sub in range(4):
                middle = t - PERIOD + (sub + 0.5) * fine
                truth = truth * quaternion_from_rotation_vector(fine * tumbling(middle))
        rates = inertial.gyro(step, gyro_p, gyro_x, tumbling(t))
        if step > 0:
            attitude_filter.predict(p, x, rates)
            if step % 25 == 0:
                attitude_filter.update(p, x, star_tracker.measured_attitude(step, star, truth))
                errors[updates, 0] = rotation_vector(conjugate(x.quaternion) * truth)
                errors[updates, 1] = gyro_x.bias - x.bias
                blocks[updates, 0], blocks[updates, 1] = x.attitude_covariance, x.cross_covariance
                blocks[updates, 2] = x.bias_covariance
                nis[updates] = x.innovation_squared
                updates += 1
        x.gyro_before = rates
    return updates


def test_consistency_over_seeds():
    """NEES (6 degrees of freedom) and NIS (3) averaged over 40 runs stay within their chi-square bounds."""
    runs, steps = 40, 3000
    updates = steps // 25
    errors, blocks = np.empty((runs, updates, 2, 3)), np.empty((runs, updates, 3, 3, 3))
    nis = np.empty((runs, updates))
    for run in range(runs):
        keys = [stream_key(run, name) for name in ("imu", "star_tracker", "start")]
        p, x = filter_records(SIGMA_ATTITUDE, SIGMA_BIAS, gate=1e9)
        gyro = made(ImuParameters, seed=keys[0], gyro_sigma=GYRO, gyro_walk_sigma=WALK), made(inertial.ImuState)
        star = made(StarTrackerParameters, seed=keys[1], sigma=STAR)
        assert simulate((p, x), gyro, star, keys[2], steps, (errors[run], blocks[run], nis[run])) == updates
    covariance = np.block([[blocks[..., 0, :, :], blocks[..., 1, :, :]],
                           [np.swapaxes(blocks[..., 1, :, :], -1, -2), blocks[..., 2, :, :]]])
    error = errors.reshape(runs, updates, 6)
    nees = (error * np.linalg.solve(covariance, error[..., None])[..., 0]).sum(axis=-1)

    # Bounds of an average at single instants well apart, at 99.9 % each, and of the innovations altogether (white)
    for instant in (0, 10, 40, 80, updates - 1):
        low, high = scipy.stats.chi2.ppf([0.0005, 0.9995], 6 * runs) / runs
        assert low < nees[:, instant].mean() < high, instant
        low, high = scipy.stats.chi2.ppf([0.0005, 0.9995], 3 * runs) / runs
        assert low < nis[:, instant].mean() < high, instant
    low, high = scipy.stats.chi2.ppf([0.0005, 0.9995], 3 * nis.size) / nis.size
    assert low < nis.mean() < high
    share = (nis > GATE).mean()
    assert share < 0.001 + 4.0 * math.sqrt(0.001 / nis.size)
