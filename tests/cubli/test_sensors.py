"""Sensor models: without noise they return the truth; with noise its stated size, the same for one key and tick."""

import math

import numpy as np
import scipy.stats
from scipy.spatial.transform import Rotation

from flight_graph.kernel import kernel
from flight_graph.noise import stream_key
from sim_nodes import sensors

OMEGA = np.array([0.1, -0.2, 0.3])


@kernel
def record_gyro(key, ticks, omega, sigma, walk, bias, samples, biases):
    for tick in range(ticks):
        biases[tick] = bias
        sensors.gyro_sample(key, tick, omega, sigma, walk, bias, samples[tick])


@kernel
def record_star_tracker(key, ticks, q, sigma, samples, work):
    for tick in range(ticks):
        sensors.star_tracker_sample(key, tick, q, sigma, samples[tick], work)


def test_without_noise():
    bias, out = np.array([2e-4, 0.0, -2e-4]), np.empty(3)
    sensors.gyro_sample(1, 5, OMEGA, 0.0, 0.0, bias, out)
    np.testing.assert_array_equal(out, OMEGA + bias)
    np.testing.assert_array_equal(bias, [2e-4, 0.0, -2e-4])
    q = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_quat()
    measured = np.empty(4)
    sensors.star_tracker_sample(1, 5, q, 0.0, measured, np.empty((2, 4)))
    np.testing.assert_allclose(measured, q, rtol=1e-15)


def test_accelerometer_is_specific_force_of_the_centre():
    omega_dot, gravity = np.array([0.5, -0.4, 0.3]), np.array([-1.0, -2.0, -3.0])
    out = np.empty(3)
    sensors.accelerometer_sample(1, 5, OMEGA, omega_dot, gravity, 0.2, 0.0, out)
    r = np.full(3, 0.1)
    np.testing.assert_allclose(
        out, np.cross(omega_dot, r) + np.cross(OMEGA, np.cross(OMEGA, r)) - gravity, rtol=1e-14
    )


def test_gyro_noise_and_random_walk():
    ticks = 20_000
    samples, biases = np.empty((ticks, 3)), np.empty((ticks, 3))
    record_gyro(stream_key(1, "imu"), ticks, OMEGA, 1e-4, 1e-6, np.full(3, 2e-4), samples, biases)
    white = (samples - OMEGA - biases) / 1e-4
    walk = np.diff(biases, axis=0) / 1e-6
    for values in (white, walk):
        assert scipy.stats.kstest(values.ravel(), "norm").pvalue > 0.01
    np.testing.assert_array_equal(biases[0], 2e-4)
    assert abs(np.corrcoef(white[1:].ravel(), walk.ravel())[0, 1]) < 4.0 / math.sqrt(walk.size)
    again, other = np.empty((ticks, 3)), np.empty((ticks, 3))
    record_gyro(stream_key(1, "imu"), ticks, OMEGA, 1e-4, 1e-6, np.full(3, 2e-4), again, biases)
    np.testing.assert_array_equal(again, samples)
    record_gyro(stream_key(2, "imu"), ticks, OMEGA, 1e-4, 1e-6, np.full(3, 2e-4), other, biases)
    assert not np.any(other == samples)


def test_star_tracker_noise_is_a_small_body_angle():
    ticks = 10_000
    truth = Rotation.from_rotvec([0.7, -0.2, 1.1])
    samples = np.empty((ticks, 4))
    record_star_tracker(stream_key(1, "star_tracker"), ticks, truth.as_quat(), 5e-5, samples, np.empty((2, 4)))
    angles = (truth.inv() * Rotation.from_quat(samples)).as_rotvec() / 5e-5
    assert scipy.stats.kstest(angles.ravel(), "norm").pvalue > 0.01
    np.testing.assert_allclose(np.linalg.norm(samples, axis=1), 1.0, rtol=1e-15)
