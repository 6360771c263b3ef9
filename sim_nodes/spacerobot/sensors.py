"""Sensors of the space robot as components, and the same quantities without any error.

White noise per sample and axis from counter-based draws; a standard deviation of zero switches a source off.
"""

import math

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, Vec3, field
from flight_graph.timebase import SECOND
from flight_math import gaussian, kernel, stack_array
from msg_schemas import spacerobot
from sim_nodes.sensors.inertial import write_imu
from sim_nodes.sensors.star_tracker import measured_attitude
from sim_nodes.sensors.white_noise import white_noise

GYRO_DRAW, ACCELEROMETER_DRAW = 0, 3  # [-] first of three draw indices each


@kernel
def noisy(p, t_ns, first_draw, sigma, values, measured):
    """Fill ``measured`` with ``values`` (m,) and sigma times standard normal draws; nothing is drawn for sigma = 0."""
    for i in range(len(values)):
        measured[i] = values[i]
        if sigma > 0.0:
            measured[i] += sigma * gaussian(p.seed, t_ns, first_draw + i)


class ImuParameters(Parameters):
    gyro_sigma: float = field(5e-5, unit="rad/s", ge=0, doc="white noise of a sample")
    gyro_bias: Vec3 = field(0.0, unit="rad/s", doc="constant bias")
    accelerometer_sigma: float = field(1e-4, unit="m/s^2", ge=0, doc="white noise of a sample")
    accelerometer_bias: Vec3 = field(0.0, unit="m/s^2", doc="constant bias")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_imu(t_ns, p, x, truth, imu):
    """Angular velocity and specific force at the base's origin (free fall: the inertial acceleration)."""
    rates = truth.rates + p.gyro_bias + white_noise(p.seed, t_ns, GYRO_DRAW, p.gyro_sigma)
    specific_force = (truth.acceleration + p.accelerometer_bias
                      + white_noise(p.seed, t_ns, ACCELEROMETER_DRAW, p.accelerometer_sigma))
    write_imu(p, rates, specific_force, imu)


class StarTrackerParameters(Parameters):
    sigma: float = field(2e-5, unit="rad", ge=0, doc="noise of a measurement about each base axis")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_star_tracker(t_ns, p, x, truth, measured):
    """True attitude, turned by a small angle about base axes."""
    measured.quaternion = measured_attitude(t_ns, p, truth.attitude)


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
    n = len(truth.joints)
    angles, rates, torques = stack_array(n), stack_array(n), stack_array(n)
    noisy(p, t_ns, 0, p.encoder_sigma, truth.joints, angles)
    noisy(p, t_ns, n, p.rate_sigma, truth.joint_rates, rates)
    noisy(p, t_ns, 2 * n, p.torque_sigma, truth.joint_torque, torques)
    since = t_ns / SECOND - p.torque_fault_time
    if p.torque_fault_time >= 0.0 and 0.0 <= since < p.torque_fault_duration:
        torques[n - 1] = math.nan
    joints.position, joints.velocity, joints.effort = angles, rates, torques
    base.wrench.torque = truth.base_torque + white_noise(p.seed, t_ns, 3 * n, p.torque_sigma)


@kernel
def copy_truth(t_ns, p, x, inputs, outputs):
    """The true state in the form of an estimate."""
    truth = inputs.truth
    odometry, joints, accelerations = outputs.odometry, outputs.joints, outputs.accelerations
    odometry.pose.pose.orientation, odometry.twist.twist.angular = truth.attitude, truth.rates
    joints.position, joints.velocity, joints.effort = truth.joints, truth.joint_rates, truth.joint_torque
    accelerations.translation, accelerations.angular = truth.acceleration, truth.angular_acceleration
    accelerations.joints, accelerations.known = truth.joint_accelerations, 1.0
    outputs.torque.wrench.torque = truth.base_torque


def sensors(topics: spacerobot.Topics) -> tuple[type[Component], ...]:
    """Inertial measurement unit, star tracker, joint sensors and the perfect state of a robot with these topics."""

    class SpaceRobotImu(Component):
        """Gyro and accelerometer of the space robot's base.

        Promises: angular velocity [rad/s] and specific force [m/s^2] at the base's origin, base axes, with constant
        biases and white noise that is a function of seed and time alone.

        Bad input: truth that has not come reads as zero. It tests nothing: faults are put on its output.
        """

        parameters = ImuParameters
        inputs, outputs = {"truth": topics.truth}, {"imu": topics.imu}
        rate_hz = 50.0
        kernel = sample_imu

    class SpaceRobotStarTracker(Component):
        """Star tracker of the space robot's base.

        Promises: the true attitude (x, y, z, w, base to inertial), turned by a small random angle about base axes.

        Bad input: it tests nothing: faults are put on its output.
        """

        parameters = StarTrackerParameters
        inputs, outputs = {"truth": topics.truth}, {"measured": topics.star_tracker}
        rate_hz = 10.0
        kernel = sample_star_tracker

    class SpaceRobotJointSensors(Component):
        """Encoders, rate and torque sensors of the joints, and the torque sensor of the base.

        Promises: angles [rad], rates [rad/s] and torques [N m] of the joints and the torque on the base [N m], with
        white noise.

        Bad input: it tests nothing. With `torque_fault_time` the last joint's torque reads NaN for a time, so that its
        readers can be tried.
        """

        parameters = JointSensorParameters
        inputs, outputs = {"truth": topics.truth}, {"joints": topics.joint_state, "base": topics.base_torque}
        rate_hz = 50.0
        kernel = sample_joints

    class SpaceRobotPerfectState(Component):
        """The true state in place of sensors and estimator: ideal feedback, accelerations included.

        Promises: the true state under the topics of the estimator: what a law does with ideal feedback.

        Bad input: truth that has not come reads as zero.
        """

        inputs = {"truth": topics.truth}
        outputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                   "torque": topics.torque_estimate}
        rate_hz = 50.0
        kernel = copy_truth

    return SpaceRobotImu, SpaceRobotStarTracker, SpaceRobotJointSensors, SpaceRobotPerfectState


SpaceRobotImu, SpaceRobotStarTracker, SpaceRobotJointSensors, SpaceRobotPerfectState = sensors(spacerobot.MINI)
