"""State of the space robot from its sensors: attitude, rates, joints, and accelerations two ways.

Attitude: the gyro turns the quaternion (mean rate of the interval, exact for a constant one); a star tracker
measurement corrects attitude and gyro bias by fixed gains. Angular and joint accelerations are differences of the
measured rates over the sample, as they are or through a first-order low-pass; the base's acceleration is the
accelerometer's.
"""

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Choice, Parameters, State, field
from flight_math import (
    Quaternion,
    Vec,
    Vec3,
    conjugate,
    exp,
    kernel,
    normalised,
    quaternion_from_rotation_vector,
    rotation_vector,
)
from msg_schemas import spacerobot

DIFFERENCED, FILTERED = 0, 1


class StateEstimatorParameters(Parameters):
    attitude_gain: float = field(0.3, unit="1", ge=0, le=1, doc="part of a star tracker's residual that is taken")
    bias_gain: float = field(0.02, unit="1/s", ge=0, doc="part of it that goes to the gyro bias")
    accelerations: Choice("differenced", "filtered") = field("differenced", doc="differences of rates, or low-passed")
    bandwidth: float = field(5.0, unit="rad/s", gt=0, used_if={"accelerations": ["filtered"]},
                             doc="of the low-pass on accelerations")


def estimator_state(joints):
    """State of the estimator: attitude, gyro bias, the rates of the sample before, low-passed accelerations."""

    class StateEstimatorState(State):
        begun: bool
        samples: float
        attitude: Quaternion
        bias: Vec3
        rate_before: Vec3
        joint_rate_before: Vec(joints)
        acceleration: Vec3
        joint_acceleration: Vec(joints)

    return StateEstimatorState


@kernel
def turned(q, v):
    """The attitude after a turn by the rotation vector ``v`` [rad], body axes."""
    return normalised(q * quaternion_from_rotation_vector(v))


@kernel
def correct(p, x, measured):
    """Take a star tracker measurement; the first one is the attitude."""
    if not x.begun:
        x.begun, x.attitude = True, measured
        return
    residual = rotation_vector(conjugate(x.attitude) * measured)
    x.attitude = turned(x.attitude, p.attitude_gain * residual)
    x.bias = x.bias - p.bias_gain * residual


@kernel
def accelerate(p, x, rate, joint_rates):
    """Accelerations by the difference of the rates from the sample before, as they are or low-passed."""
    share = 1.0 if p.accelerations == DIFFERENCED else 1.0 - exp(-p.bandwidth * p.period)
    if x.samples > 0.0:
        x.acceleration = x.acceleration + share * ((rate - x.rate_before) / p.period - x.acceleration)
        x.joint_acceleration = x.joint_acceleration + share * (
            (joint_rates - x.joint_rate_before) / p.period - x.joint_acceleration)
    x.rate_before, x.joint_rate_before = rate, joint_rates


@kernel
def estimate(t_ns, p, x, inputs, outputs):
    """One sample. The attitude is published as identity until a star tracker measurement is there."""
    imu, star_tracker, joint_states, odometry = inputs.imu, inputs.star_tracker, inputs.joint_states, outputs.odometry
    rate = imu.angular_velocity - x.bias
    if x.begun:
        x.attitude = turned(x.attitude, 0.5 * p.period * (rate + x.rate_before))
    if star_tracker.header.stamp.sec != 0 and same_stamp(star_tracker.header.stamp, odometry.header.stamp):
        correct(p, x, star_tracker.quaternion)
    outputs.accelerations.known = 1.0 if x.samples > 0.0 else 0.0
    accelerate(p, x, rate, joint_states.velocity)
    x.samples += 1.0
    odometry.pose.pose.orientation = x.attitude if x.begun else Quaternion(0.0, 0.0, 0.0, 1.0)
    odometry.twist.twist.angular = rate
    outputs.accelerations.angular, outputs.accelerations.joints = x.acceleration, x.joint_acceleration
    outputs.accelerations.translation = imu.linear_acceleration
    outputs.torque.wrench.torque = inputs.base_torque.wrench.torque
    joints = outputs.joints
    joints.position, joints.velocity, joints.effort = joint_states.position, joint_states.velocity, joint_states.effort


def estimator(topics: spacerobot.Topics) -> type[Component]:
    """The state estimator of a robot with these topics."""

    class StateEstimator(Component):
        """Attitude, rates, joints and accelerations of the space robot from gyro, star tracker and joint sensors.

        Promises: attitude (x, y, z, w, base to inertial), rates [rad/s] in base axes, joint angles [rad] and rates, and
        accelerations, differenced or low-passed, at every firing.

        Bad input: the attitude is the identity until a first star tracker measurement. Readings are not tested: see
        robust_state_estimator. Accelerations of the first sample are marked as unknown.
        """

        parameters, state = StateEstimatorParameters, estimator_state(topics.joints)
        inputs = {"imu": topics.imu, "star_tracker": topics.star_tracker, "joint_states": topics.joint_state,
                  "base_torque": topics.base_torque}
        outputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                   "torque": topics.torque_estimate}
        rate_hz = 50.0
        kernel = estimate

    return StateEstimator


StateEstimator = estimator(spacerobot.MINI)
