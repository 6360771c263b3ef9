"""State of the space robot from its sensors: attitude, rates, joints, and accelerations two ways.

Attitude: the gyro turns the quaternion (mean rate of the interval, exact for a constant one); a star tracker
measurement corrects attitude and gyro bias by fixed gains. Angular and joint accelerations are differences of the
measured rates over the sample, as they are or through a first-order low-pass; the base's acceleration is the
accelerometer's.
"""

import math

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Array, Choice, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from msg_schemas import spacerobot
from spacerobot_ros.kinematics import attitude_difference, rotation_vector

DIFFERENCED, FILTERED = 0, 1


class StateEstimatorParameters(Parameters):
    attitude_gain: float = field(0.3, unit="1", ge=0, le=1, doc="part of a star tracker's residual that is taken")
    bias_gain: float = field(0.02, unit="1/s", ge=0, doc="part of it that goes to the gyro bias")
    accelerations: Choice("differenced", "filtered") = field("differenced", doc="differences of rates, or low-passed")
    bandwidth: float = field(5.0, unit="rad/s", gt=0, doc="of the low-pass on accelerations")


def estimator_state(joints):
    """State of the estimator."""

    class StateEstimatorState(State):
        begun: bool
        samples: float
        q: Array(4)
        measured: Array(4)
        difference: Array(4)
        bias: Vec3
        rate: Vec3
        rate_before: Vec3
        residual: Vec3
        joint_rate_before: Array(joints)
        angular: Vec3
        joint_acceleration: Array(joints)

    return StateEstimatorState


@kernel
def turn(q, x, y, z):
    """q <- q * exp((x, y, z) / 2), scalar first, normalised."""
    angle = math.sqrt(x * x + y * y + z * z)
    factor = 0.5 if angle < 1e-9 else math.sin(0.5 * angle) / angle
    c, x, y, z = math.cos(0.5 * angle), factor * x, factor * y, factor * z
    a, b, d, e = q[0], q[1], q[2], q[3]
    q[0] = a * c - b * x - d * y - e * z
    q[1] = a * x + b * c + d * z - e * y
    q[2] = a * y - b * z + d * c + e * x
    q[3] = a * z + b * y - d * x + e * c
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for k in range(4):
        q[k] /= norm


@kernel
def correct(p, x, star_tracker):
    """Take a star tracker measurement; the first one is the attitude."""
    x.measured[0] = star_tracker.quaternion[3]
    for k in range(3):
        x.measured[1 + k] = star_tracker.quaternion[k]
    if not x.begun:
        x.begun = True
        for k in range(4):
            x.q[k] = x.measured[k]
        return
    attitude_difference(x.q[:], x.measured[:], x.difference[:])
    rotation_vector(x.difference[:], x.residual[:])
    turn(x.q[:], p.attitude_gain * x.residual[0], p.attitude_gain * x.residual[1], p.attitude_gain * x.residual[2])
    for k in range(3):
        x.bias[k] -= p.bias_gain * x.residual[k]


@kernel
def estimate(t_ns, p, x, imu, star_tracker, joint_states, base_torque, odometry, joints, accelerations, torque):
    """One sample. The attitude is published as identity until a star tracker measurement is there."""
    n = joint_states.position.shape[0]
    for k in range(3):
        x.rate[k] = imu.angular_velocity[k] - x.bias[k]
    if x.begun:
        half = 0.5 * p.period
        turn(x.q[:], half * (x.rate[0] + x.rate_before[0]), half * (x.rate[1] + x.rate_before[1]),
             half * (x.rate[2] + x.rate_before[2]))
    if star_tracker.header.stamp.sec != 0 and same_stamp(star_tracker.header.stamp, odometry.header.stamp):
        correct(p, x, star_tracker)
    share = 1.0 if p.accelerations == DIFFERENCED else 1.0 - math.exp(-p.bandwidth * p.period)
    known = x.samples > 0.0
    for k in range(3):
        if known:
            x.angular[k] += share * ((x.rate[k] - x.rate_before[k]) / p.period - x.angular[k])
        x.rate_before[k] = x.rate[k]
        odometry.twist.twist.angular[k] = x.rate[k]
        odometry.pose.pose.orientation[k] = x.q[1 + k]
        accelerations.angular[k] = x.angular[k]
        accelerations.translation[k] = imu.linear_acceleration[k]
        torque.wrench.torque[k] = base_torque.wrench.torque[k]
    odometry.pose.pose.orientation[3] = x.q[0] if x.begun else 1.0
    for i in range(n):
        if known:
            slope = (joint_states.velocity[i] - x.joint_rate_before[i]) / p.period
            x.joint_acceleration[i] += share * (slope - x.joint_acceleration[i])
        x.joint_rate_before[i] = joint_states.velocity[i]
        joints.position[i] = joint_states.position[i]
        joints.velocity[i] = joint_states.velocity[i]
        joints.effort[i] = joint_states.effort[i]
        accelerations.joints[i] = x.joint_acceleration[i]
    accelerations.known = 1.0 if known else 0.0
    x.samples += 1.0


def estimator(topics: spacerobot.Topics) -> type[Component]:
    """The state estimator of a robot with these topics."""

    class StateEstimator(Component):
        """Attitude, rates, joints and accelerations of the space robot from gyro, star tracker and joint sensors."""

        parameters, state = StateEstimatorParameters, estimator_state(topics.joints)
        inputs = {"imu": topics.imu, "star_tracker": topics.star_tracker, "joint_states": topics.joint_state,
                  "base_torque": topics.base_torque}
        tolerates_nonfinite = ("joint_states",)
        outputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                   "torque": topics.torque_estimate}
        rate_hz = 50.0
        kernel = estimate

    return StateEstimator


StateEstimator = estimator(spacerobot.MINI)
