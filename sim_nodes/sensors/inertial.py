"""Inertial measurement unit: a gyro whose bias wanders, and an accelerometer.

p: seed, gyro_sigma and gyro_walk_sigma [rad/s], accelerometer_sigma [m/s^2], gyro_bias [rad/s]. x: `ImuState`.
"""

from flight_graph.components.records import State
from flight_math import Quaternion, Vec, Vec3, diagonal, kernel, row_by_row, same
from sim_nodes.sensors.white_noise import white_noise

GYRO_DRAW, WALK_DRAW, ACCELEROMETER_DRAW = 0, 3, 6  # [-] first of three draw indices each
UNKNOWN = Vec(9)(-1.0, *[0.0] * 8)  # [-] a covariance of sensor_msgs/Imu: what it belongs to is not known


class ImuState(State):
    """bias: of the gyro [rad/s]."""

    bias: Vec3


@kernel
def start_imu(p, x):
    """The gyro's bias starts at gyro_bias."""
    x.bias = p.gyro_bias


@kernel
def gyro(t_ns, p, x, rates):
    """Measured rates [rad/s]: rates + bias + white noise. Then the bias walks one step."""
    measured = rates + x.bias + white_noise(p.seed, t_ns, GYRO_DRAW, p.gyro_sigma)
    x.bias += white_noise(p.seed, t_ns, WALK_DRAW, p.gyro_walk_sigma)
    return measured


@kernel
def accelerometer(t_ns, p, specific_force):
    """Measured specific force [m/s^2]."""
    return specific_force + white_noise(p.seed, t_ns, ACCELEROMETER_DRAW, p.accelerometer_sigma)


@kernel
def write_imu(p, rates, specific_force, imu):
    """The message (sensor_msgs/Imu) of a sample: no orientation, rates and specific force with their covariances."""
    imu.orientation, imu.orientation_covariance = Quaternion(0.0, 0.0, 0.0, 1.0), UNKNOWN
    imu.angular_velocity, imu.linear_acceleration = rates, specific_force
    imu.angular_velocity_covariance = row_by_row(diagonal(same(p.gyro_sigma * p.gyro_sigma)))
    imu.linear_acceleration_covariance = row_by_row(diagonal(same(p.accelerometer_sigma * p.accelerometer_sigma)))
