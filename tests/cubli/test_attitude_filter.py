"""The attitude filter against a NumPy/SciPy one written from the equations, and its consistency over many seeds."""

import math

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from scipy.spatial.transform import Rotation

from cubli_ros import attitude_filter
from cubli_ros.attitude import (
    quaternion_difference,
    quaternion_from_rotation_vector,
    quaternion_multiply,
    rotation_vector_from_quaternion,
)
from flight_graph.kernel import kernel
from flight_graph.noise import gaussian, stream_key
from sim_nodes import sensors

GYRO, WALK, STAR = 1e-4, 1e-6, 5e-5  # [rad/s], [rad/s], [rad] per sample
PERIOD = 0.01  # [s]
GATE = scipy.stats.chi2.ppf(0.999, 3)


def cross_matrix(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@pytest.mark.parametrize("rate", [(0.0, 0.0, 0.0), (0.1, -0.2, 0.05), (3.0, -2.0, 1.0), (30.0, 20.0, -10.0)])
def test_transition_is_the_matrix_exponential(rate):
    out = np.empty((6, 6))
    attitude_filter.transition(*rate, PERIOD, out)
    slope = np.zeros((6, 6))
    slope[:3, :3] = -cross_matrix(rate)
    slope[:3, 3:] = -np.eye(3)
    np.testing.assert_allclose(out, scipy.linalg.expm(slope * PERIOD), atol=1e-13)


def test_filter_equals_an_independent_one():
    generator = np.random.default_rng(4)
    q, bias = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3)
    covariance, work, innovation = np.empty((6, 6)), np.zeros((3, 6, 6)), np.empty(3)
    attitude_filter.start(q.copy(), 0.02, 1e-3, q, bias, covariance)
    rotation, own_bias, own = Rotation.identity(), np.zeros(3), np.diag([4e-4] * 3 + [1e-6] * 3)
    gyro_previous = generator.normal(0.0, 0.5, 3)
    for step in range(200):
        gyro = gyro_previous + generator.normal(0.0, 0.1, 3)
        attitude_filter.predict(q, bias, covariance, gyro_previous, gyro, PERIOD, GYRO, WALK, work)
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
            squared, accepted = attitude_filter.update(
                q, bias, covariance, measured.as_quat(), STAR, math.inf, innovation, work
            )
            y = (rotation.inv() * measured).as_rotvec()
            s = own[:3, :3] + STAR**2 * np.eye(3)
            gain = own[:, :3] @ np.linalg.inv(s)
            assert accepted
            np.testing.assert_allclose(innovation, y, atol=1e-10)
            assert math.isclose(squared, y @ np.linalg.solve(s, y), rel_tol=1e-6)
            remainder = np.eye(6) - np.hstack([gain, np.zeros((6, 3))])
            own = remainder @ own @ remainder.T + STAR**2 * gain @ gain.T
            rotation = rotation * Rotation.from_rotvec((gain @ y)[:3])
            own_bias = own_bias + (gain @ y)[3:]
        np.testing.assert_allclose(covariance, own, rtol=1e-7, atol=1e-18)
        np.testing.assert_array_equal(covariance, covariance.T)
    np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), rotation.as_matrix(), atol=1e-10)
    np.testing.assert_allclose(bias, own_bias, atol=1e-10)


def test_gate_refuses_an_outlier_and_changes_nothing():
    q, bias = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3)
    covariance, work, innovation = np.empty((6, 6)), np.zeros((3, 6, 6)), np.empty(3)
    attitude_filter.start(q.copy(), 1e-4, 1e-3, q, bias, covariance)
    before = covariance.copy()
    for measured in (Rotation.from_rotvec([0.0, 1e-2, 0.0]).as_quat(), np.full(4, np.nan)):
        squared, accepted = attitude_filter.update(q, bias, covariance, measured, STAR, GATE, innovation, work)
        assert not accepted
        assert not squared <= GATE
        np.testing.assert_array_equal(q, [0.0, 0.0, 0.0, 1.0])
        np.testing.assert_array_equal(bias, 0.0)
        np.testing.assert_array_equal(covariance, before)


def test_opposite_quaternion_is_the_same_attitude():
    results = []
    for sign in (1.0, -1.0):
        q, bias = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3)
        covariance, work, innovation = np.empty((6, 6)), np.zeros((3, 6, 6)), np.empty(3)
        attitude_filter.start(q.copy(), 0.1, 1e-3, q, bias, covariance)
        measured = sign * Rotation.from_rotvec([0.02, -0.1, 0.05]).as_quat()
        attitude_filter.update(q, bias, covariance, measured, STAR, GATE, innovation, work)
        results.append(q)
    np.testing.assert_allclose(results[0], results[1], rtol=1e-14)


@kernel
def simulate(imu_key, star_key, start_key, steps, substeps, nees, nis, counts):
    """A tumbling body (rates up to 0.2 rad/s), gyro at 100 Hz, star tracker at 4 Hz; NEES, NIS (updates,)."""
    truth = np.array([0.1, -0.2, 0.3, 0.9])
    truth /= math.sqrt(0.95)
    start = np.zeros(4)
    small, turned = np.zeros(4), np.zeros(4)
    noise = np.zeros(3)
    sigma_attitude, sigma_bias = 5e-3, 2e-4
    for i in range(3):
        noise[i] = -sigma_attitude * gaussian(start_key, 0, i)
    quaternion_from_rotation_vector(noise[0], noise[1], noise[2], small)
    quaternion_multiply(truth, small, start)
    bias_true = np.zeros(3)
    for i in range(3):
        bias_true[i] = sigma_bias * gaussian(start_key, 1, i)
    q, bias, covariance = np.zeros(4), np.zeros(3), np.zeros((6, 6))
    attitude_filter.start(start, sigma_attitude, sigma_bias, q, bias, covariance)
    work, innovation, star_work = np.zeros((3, 6, 6)), np.zeros(3), np.zeros((2, 4))
    gyro, previous, measured = np.zeros(3), np.zeros(3), np.zeros(4)
    omega, error, vector = np.zeros(3), np.zeros(6), np.zeros(3)
    updates = 0
    for step in range(steps + 1):
        t = step * PERIOD
        if step > 0:
            fine = PERIOD / substeps
            for sub in range(substeps):
                middle = t - PERIOD + (sub + 0.5) * fine
                for i in range(3):
                    omega[i] = 0.2 * math.sin(0.7 * middle + 2.0 * i)
                quaternion_from_rotation_vector(omega[0] * fine, omega[1] * fine, omega[2] * fine, small)
                quaternion_multiply(truth, small, turned)
                truth[:] = turned
        for i in range(3):
            omega[i] = 0.2 * math.sin(0.7 * t + 2.0 * i)
        sensors.gyro_sample(imu_key, step, omega, GYRO, WALK, bias_true, gyro)
        if step > 0:
            attitude_filter.predict(q, bias, covariance, previous, gyro, PERIOD, GYRO, WALK, work)
            if step % 25 == 0:
                sensors.star_tracker_sample(star_key, step, truth, STAR, measured, star_work)
                squared, accepted = attitude_filter.update(
                    q, bias, covariance, measured, STAR, 1e9, innovation, work
                )
                quaternion_difference(q, truth, small)
                rotation_vector_from_quaternion(small, vector)
                for i in range(3):
                    error[i] = vector[i]
                    error[3 + i] = bias_true[i] - bias[i]
                nees[updates] = error @ np.linalg.solve(covariance, error)
                nis[updates] = squared
                updates += 1
        previous[:] = gyro
    counts[0] = updates


def test_consistency_over_seeds():
    """NEES (6 degrees of freedom) and NIS (3) averaged over 40 runs stay within their chi-square bounds."""
    runs, steps = 40, 3000
    updates = steps // 25
    nees, nis, counts = np.empty((runs, updates)), np.empty((runs, updates)), np.zeros(1)
    for run in range(runs):
        keys = [stream_key(run, name) for name in ("imu", "star_tracker", "start")]
        simulate(*keys, steps, 4, nees[run], nis[run], counts)
    assert counts[0] == updates

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
