"""Sensor models: without noise they return the truth; with noise its stated size, the same for one key and tick."""

import math

import numpy as np
import scipy.stats
from scipy.spatial.transform import Rotation

from flight_graph.components.component import kinds_of
from flight_math import Quaternion, Vec3, kernel
from flight_math.noise import stream_key
from flight_math.values import view
from sim_nodes.cubli.sensors import Imu, ImuParameters, StarTrackerParameters
from sim_nodes.sensors import inertial, star_tracker
from tests.cubli.records import made

OMEGA = Vec3(0.1, -0.2, 0.3)


@kernel
def record_gyro(p, x, ticks, omega, samples, biases):
    for tick in range(ticks):
        biases[tick] = x.bias
        samples[tick] = inertial.gyro(tick, p, x, omega)


@kernel
def record_star_tracker(p, ticks, attitude, samples):
    for tick in range(ticks):
        q = star_tracker.measured_attitude(tick, p, attitude)
        for i in range(4):
            samples[tick, i] = q[i]


def gyro_record(seed, ticks):
    """Samples and biases (ticks, 3) of a gyro."""
    samples, biases = np.empty((ticks, 3)), np.empty((ticks, 3))
    p = made(ImuParameters, seed=stream_key(seed, "imu"), gyro_sigma=1e-4, gyro_walk_sigma=1e-6)
    record_gyro(p, made(inertial.ImuState, bias=2e-4), ticks, OMEGA, samples, biases)
    return samples, biases


def test_without_noise():
    p, bias = made(ImuParameters, gyro_sigma=0.0, gyro_walk_sigma=0.0), np.array([2e-4, 0.0, -2e-4])
    x = made(inertial.ImuState, bias=bias)
    np.testing.assert_array_equal(inertial.gyro(5, p, x, OMEGA), np.array(OMEGA) + bias)
    np.testing.assert_array_equal(x.bias, bias)
    q = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_quat()
    measured = star_tracker.measured_attitude(5, made(StarTrackerParameters, sigma=0.0), Quaternion(*q))
    np.testing.assert_allclose(measured, q, rtol=1e-15)


def test_accelerometer_is_specific_force_of_the_centre():
    omega_dot, gravity = Vec3(0.5, -0.4, 0.3), Vec3(-1.0, -2.0, -3.0)
    ports = [view(signal.new()[1][0], kinds_of(signal)) for signal in (*Imu.inputs.values(), *Imu.outputs.values())]
    truth, _, imu = ports
    truth.rates, truth.accelerations, truth.gravity = OMEGA, omega_dot, gravity
    p = made(ImuParameters, length=0.2, gyro_sigma=0.1, accelerometer_sigma=0.0)
    Imu.kernel(5, p, made(inertial.ImuState), *ports)
    r = np.full(3, 0.1)
    np.testing.assert_allclose(imu.linear_acceleration,
                               np.cross(omega_dot, r) + np.cross(OMEGA, np.cross(OMEGA, r)) - np.array(gravity), rtol=1e-14)
    assert imu.orientation_covariance[0] == -1.0
    np.testing.assert_allclose(np.reshape(imu.angular_velocity_covariance.parts(), (3, 3)), 0.01 * np.eye(3), rtol=1e-14)
    np.testing.assert_array_equal(imu.linear_acceleration_covariance, 0.0)


def test_gyro_noise_and_random_walk():
    ticks = 20_000
    samples, biases = gyro_record(1, ticks)
    white = (samples - np.array(OMEGA) - biases) / 1e-4
    walk = np.diff(biases, axis=0) / 1e-6
    for values in (white, walk):
        assert scipy.stats.kstest(values.ravel(), "norm").pvalue > 0.01
    np.testing.assert_array_equal(biases[0], 2e-4)
    assert abs(np.corrcoef(white[1:].ravel(), walk.ravel())[0, 1]) < 4.0 / math.sqrt(walk.size)
    np.testing.assert_array_equal(gyro_record(1, ticks)[0], samples)
    assert not np.any(gyro_record(2, ticks)[0] == samples)


def test_star_tracker_noise_is_a_small_body_angle():
    ticks = 10_000
    truth = Rotation.from_rotvec([0.7, -0.2, 1.1])
    samples = np.empty((ticks, 4))
    p = made(StarTrackerParameters, seed=stream_key(1, "star_tracker"), sigma=5e-5)
    record_star_tracker(p, ticks, Quaternion(*truth.as_quat()), samples)
    angles = (truth.inv() * Rotation.from_quat(samples)).as_rotvec() / 5e-5
    assert scipy.stats.kstest(angles.ravel(), "norm").pvalue > 0.01
    np.testing.assert_allclose(np.linalg.norm(samples, axis=1), 1.0, rtol=1e-15)
