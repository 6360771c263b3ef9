"""Sensors of the space robot as components, and the same quantities without any error.

White noise per sample and axis from counter-based draws; a standard deviation of zero switches a source off.
"""

import math

from cubli_ros.attitude import quaternion_from_rotation_vector, quaternion_multiply, quaternion_normalise
from flight_graph.components.component import Component
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from flight_graph.noise import gaussian
from flight_graph.timebase import SECOND
from msg_schemas import spacerobot


@kernel
def add_noise(key, tick, first_index, sigma, values):
    """values (m,) += sigma times standard normal draws; nothing is drawn for sigma = 0."""
    if sigma > 0.0:
        for i in range(values.shape[0]):
            values[i] += sigma * gaussian(key, tick, first_index + i)


class ImuParameters(Parameters):
    gyro_sigma: float = field(5e-5, unit="rad/s", ge=0, doc="white noise of a sample")
    gyro_bias: Vec3 = field(0.0, unit="rad/s", doc="constant bias")
    accelerometer_sigma: float = field(1e-4, unit="m/s^2", ge=0, doc="white noise of a sample")
    accelerometer_bias: Vec3 = field(0.0, unit="m/s^2", doc="constant bias")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_imu(t_ns, p, x, truth, imu):
    """Angular velocity and specific force at the base's origin (free fall: the inertial acceleration)."""
    for k in range(3):
        imu.angular_velocity[k] = truth.rates[k] + p.gyro_bias[k]
        imu.linear_acceleration[k] = truth.acceleration[k] + p.accelerometer_bias[k]
        imu.angular_velocity_covariance[4 * k] = p.gyro_sigma * p.gyro_sigma
        imu.linear_acceleration_covariance[4 * k] = p.accelerometer_sigma * p.accelerometer_sigma
    add_noise(p.seed, t_ns, 0, p.gyro_sigma, imu.angular_velocity)
    add_noise(p.seed, t_ns, 3, p.accelerometer_sigma, imu.linear_acceleration)
    imu.orientation[3] = 1.0
    imu.orientation_covariance[0] = -1.0  # [-] sensor_msgs/Imu: no orientation is measured


class StarTrackerParameters(Parameters):
    sigma: float = field(2e-5, unit="rad", ge=0, doc="noise of a measurement about each base axis")
    seed: int = field(0, ge=0, doc="noise stream")


class StarTrackerState(State):
    angle: Vec3
    small: Array(4)
    attitude: Array(4)
    measured: Array(4)


@kernel
def sample_star_tracker(t_ns, p, x, truth, measured):
    """True attitude, turned by a small angle about base axes."""
    for k in range(4):
        x.attitude[k] = truth.attitude[k]
    for k in range(3):
        x.angle[k] = 0.0
    add_noise(p.seed, t_ns, 0, p.sigma, x.angle[:])
    quaternion_from_rotation_vector(x.angle[0], x.angle[1], x.angle[2], x.small[:])
    quaternion_multiply(x.attitude[:], x.small[:], x.measured[:])
    quaternion_normalise(x.measured[:])
    for k in range(4):
        measured.quaternion[k] = x.measured[k]


class JointSensorParameters(Parameters):
    encoder_sigma: float = field(1e-5, unit="rad", ge=0, doc="white noise of an angle")
    rate_sigma: float = field(2e-4, unit="rad/s", ge=0, doc="white noise of a rate")
    torque_sigma: float = field(1e-3, unit="N m", ge=0, doc="white noise of a torque, joints and base")
    torque_fault_time: float = field(-1.0, unit="s", doc="when the last joint's torque reads NaN; negative: never")
    torque_fault_duration: float = field(0.1, unit="s", ge=0, doc="how long it does")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_joints(t_ns, p, x, truth, joints, base):
    """Encoders, rates and torques of the joints, and the torque on the base."""
    n = truth.joints.shape[0]
    for i in range(n):
        joints.position[i] = truth.joints[i]
        joints.velocity[i] = truth.joint_rates[i]
        joints.effort[i] = truth.joint_torque[i]
    for k in range(3):
        base.wrench.torque[k] = truth.base_torque[k]
    add_noise(p.seed, t_ns, 0, p.encoder_sigma, joints.position)
    add_noise(p.seed, t_ns, n, p.rate_sigma, joints.velocity)
    add_noise(p.seed, t_ns, 2 * n, p.torque_sigma, joints.effort)
    add_noise(p.seed, t_ns, 3 * n, p.torque_sigma, base.wrench.torque)
    since = t_ns / SECOND - p.torque_fault_time
    if p.torque_fault_time >= 0.0 and 0.0 <= since < p.torque_fault_duration:
        joints.effort[n - 1] = math.nan


@kernel
def copy_truth(t_ns, p, x, truth, odometry, joints, accelerations, torque):
    """The true state in the form of an estimate."""
    for k in range(4):
        odometry.pose.pose.orientation[k] = truth.attitude[k]
    for k in range(3):
        odometry.twist.twist.angular[k] = truth.rates[k]
        accelerations.translation[k] = truth.acceleration[k]
        accelerations.angular[k] = truth.angular_acceleration[k]
        torque.wrench.torque[k] = truth.base_torque[k]
    for i in range(truth.joints.shape[0]):
        joints.position[i] = truth.joints[i]
        joints.velocity[i] = truth.joint_rates[i]
        joints.effort[i] = truth.joint_torque[i]
        accelerations.joints[i] = truth.joint_accelerations[i]
    accelerations.known = 1.0


def sensors(topics: spacerobot.Topics) -> tuple[type[Component], ...]:
    """Inertial measurement unit, star tracker, joint sensors and the perfect state of a robot with these topics."""

    class SpaceRobotImu(Component):
        """Gyro and accelerometer of the space robot's base."""

        parameters = ImuParameters
        inputs, outputs = {"truth": topics.truth}, {"imu": topics.imu}
        rate_hz = 50.0
        kernel = sample_imu

    class SpaceRobotStarTracker(Component):
        """Star tracker of the space robot's base."""

        parameters, state = StarTrackerParameters, StarTrackerState
        inputs, outputs = {"truth": topics.truth}, {"measured": topics.star_tracker}
        rate_hz = 10.0
        kernel = sample_star_tracker

    class SpaceRobotJointSensors(Component):
        """Encoders, rate and torque sensors of the joints, and the torque sensor of the base."""

        parameters = JointSensorParameters
        inputs, outputs = {"truth": topics.truth}, {"joints": topics.joint_state, "base": topics.base_torque}
        rate_hz = 50.0
        kernel = sample_joints

    class SpaceRobotPerfectState(Component):
        """The true state in place of sensors and estimator: ideal feedback, accelerations included."""

        inputs = {"truth": topics.truth}
        outputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                   "torque": topics.torque_estimate}
        rate_hz = 50.0
        kernel = copy_truth

    return SpaceRobotImu, SpaceRobotStarTracker, SpaceRobotJointSensors, SpaceRobotPerfectState


SpaceRobotImu, SpaceRobotStarTracker, SpaceRobotJointSensors, SpaceRobotPerfectState = sensors(spacerobot.MINI)
