"""State of the space robot from sensors that fail: attitude, rates, joints, accelerations, and what is to be trusted.

The drop-in for `state_estimator`, with the same outputs and one more, `status`. Star tracker and gyro, and encoder and rate
sensor of each joint, watch each other (`spacerobot_ros.sensor_pairs`). Torques and the accelerometer have no second sensor:
they are passed on. The estimate is valid while the attitude's and the joints' standard deviations are below their limits
and no rate is older than `rate_hold`.
"""

import math

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Array, Choice, Parameters, field
from flight_graph.timebase import SECOND
from flight_math import Quaternion, Vec, Vec3, conjugate, kernel, rotation_vector, stack_array, vec3
from msg_schemas import spacerobot
from spacerobot_ros.angle_sensors import take_angle
from spacerobot_ros.rate_sensors import take_rate
from spacerobot_ros.sensor_pairs import Sample, pair_state, start_pairs
from spacerobot_ros.state_estimator import accelerate, turned


class RobustEstimatorParameters(Parameters):
    gyro_sigma: float = field(5e-5, unit="rad/s", gt=0, doc="noise of a gyro sample about an axis")
    star_tracker_sigma: float = field(2e-5, unit="rad", gt=0, doc="noise of a star tracker measurement about an axis")
    encoder_sigma: float = field(1e-5, unit="rad", gt=0, doc="noise of a joint angle")
    joint_rate_sigma: float = field(2e-4, unit="rad/s", gt=0, doc="noise of a joint rate")
    bias_sigma: float = field(1e-3, unit="rad/s", ge=0, doc="standard deviation of a rate sensor's bias at the start")
    bias_walk: float = field(1e-6, unit="rad/s^1.5", ge=0, doc="by which a bias wanders")
    attitude_gate: float = field(30.7, unit="1", gt=0, doc="chi-square of three axes: passed with probability 1 - 1e-6")
    joint_gate: float = field(23.9, unit="1", gt=0, doc="chi-square of one joint: likewise")
    isolate_after: int = field(5, ge=2, doc="refusals in a row until a sensor is out")
    readmit_after: int = field(10, ge=1, doc="readings in a row that agree until it is back")
    repeats: int = field(5, ge=0, doc="equal readings in a row that are a stuck sensor; 0: never (sensors without noise)")
    base_acceleration: float = field(0.3, unit="rad/s^2", gt=0, doc="largest that is no jump of the gyro")
    joint_acceleration: float = field(3.0, unit="rad/s^2", gt=0, doc="largest that is no jump of a joint's rate")
    doubt_limit: float = field(0.3, unit="s", gt=0, doc="a doubted rate is believed when no angle decides by then")
    silent_after: float = field(0.1, unit="s", gt=0, doc="a rate sensor that says nothing for so long is out")
    coast_sigma: float = field(0.02, unit="rad/s", gt=0, doc="how well a rate is known that is held or derived")
    bias_limit: float = field(0.05, unit="rad/s", gt=0, doc="largest bias with which a rate sensor comes back")
    rate_hold: float = field(0.3, unit="s", gt=0, doc="age at which a rate is no longer valid")
    fresh: float = field(0.35, unit="s", gt=0, doc="age at which a sensor is no longer healthy")
    attitude_limit: float = field(0.02, unit="rad", gt=0, doc="largest standard deviation of a valid attitude")
    joint_limit: float = field(0.02, unit="rad", gt=0, doc="largest standard deviation of a valid joint angle")
    accelerations: Choice("differenced", "filtered") = field("differenced", doc="differences of rates, or low-passed")
    bandwidth: float = field(5.0, unit="rad/s", gt=0, doc="of the low-pass on accelerations")


def robust_state(joints):
    """State of the estimator: the pairs, what was read last, and what `state_estimator` keeps for its accelerations."""
    class RobustState(pair_state(joints)):
        samples: float
        refused: float
        attitude: Quaternion
        angles: Array(joints)
        tracker_before: Quaternion
        encoder_before: Array(joints)
        rate_before: Vec3
        joint_rate_before: Vec(joints)
        acceleration: Vec3
        joint_acceleration: Vec(joints)

    return RobustState


@kernel
def start(p, x):
    x.attitude = Quaternion(0.0, 0.0, 0.0, 1.0)
    start_pairs(p, x)


@kernel
def read_rates(inputs, stamp, sample):
    """What is new of gyro and joint rates."""
    sample.has_rates[0] = 1.0 if same_stamp(inputs.imu.header.stamp, stamp) else 0.0
    sample.rates[0:3] = inputs.imu.angular_velocity
    new = 1.0 if same_stamp(inputs.joint_states.header.stamp, stamp) else 0.0
    for i in range(len(sample.rates) - 3):
        sample.has_rates[1 + i] = new
        sample.rates[3 + i] = inputs.joint_states.velocity[i]


@kernel
def propagate(p, x):
    """Angles one period on, by the mean rate of the interval."""
    half = 0.5 * p.period
    x.attitude = turned(x.attitude, half * (vec3(x.rate[0:3]) + vec3(x.used_rate[0:3])))
    for i in range(len(x.angles)):
        x.angles[i] += half * (x.rate[3 + i] + x.used_rate[3 + i])


@kernel
def read_angles(x, inputs, stamp, sample):
    """What is new of star tracker and encoders, against the readings before and against the estimate."""
    measured = inputs.star_tracker.quaternion
    if same_stamp(inputs.star_tracker.header.stamp, stamp):
        sample.has_angles[0] = 1.0
        before = x.tracker_before
        if not (measured.x == before.x and measured.y == before.y and measured.z == before.z and measured.w == before.w):
            sample.increment[0:3] = rotation_vector(conjugate(before) * measured)
        x.tracker_before = measured
        if x.angle_seen[0] < 0.0:
            x.attitude = measured
        sample.residual[0:3] = rotation_vector(conjugate(x.attitude) * measured)
    if same_stamp(inputs.joint_states.header.stamp, stamp):
        for i in range(len(x.angles)):
            angle = inputs.joint_states.position[i]
            sample.has_angles[1 + i] = 1.0
            sample.increment[3 + i] = angle - x.encoder_before[i]
            sample.residual[3 + i] = angle - x.angles[i]
            x.encoder_before[i] = angle


@kernel
def number(truth):
    """1 or 0."""
    return 1.0 if truth else 0.0


@kernel
def since(t, time):
    """Age of a reading [s]; that of the run when there is none."""
    return t - max(time, 0.0)


@kernel
def units_valid(p, x, t, u, limit):
    """Whether the angle and the rate of a unit may be used."""
    return x.angle_known[u] > 0.0 and math.sqrt(x.p_aa[u]) < limit, x.rate_known[u] > 0.0 and (
        since(t, x.rate_time[u]) <= p.rate_hold)


@kernel
def report(p, x, t, status):
    """The status of every sensor, and whether the estimate may be used."""
    attitude, rates = units_valid(p, x, t, 0, p.attitude_limit)
    status.attitude_valid, status.rates_valid, joints, healthy = number(attitude), number(rates), True, True
    n = len(x.angles)
    encoder, joint_rate, sigma = stack_array(3, n), stack_array(3, n), stack_array(n)
    refused = doubted = 0.0
    for u in range(1 + n):
        refused += x.angle_rejected[u] + x.rate_rejected[u]
        doubted += number(x.doubt_time[u] > 0.0)
        trusted = x.angle_admitted[u] * x.rate_admitted[u] > 0.0 and x.doubt_time[u] == 0.0
        healthy = healthy and trusted and since(t, x.angle_time[u]) < p.fresh and since(t, x.rate_accepted[u]) < p.fresh
        if u > 0:
            angle, rate = units_valid(p, x, t, u, p.joint_limit)
            joints = joints and angle and rate
            i, sigma[u - 1] = u - 1, math.sqrt(x.p_aa[u])
            encoder[0, i], encoder[1, i], encoder[2, i] = (
                x.angle_admitted[u], since(t, x.angle_time[u]), x.angle_rejected[u])
            joint_rate[0, i], joint_rate[1, i], joint_rate[2, i] = (
                x.rate_admitted[u], since(t, x.rate_accepted[u]), x.rate_rejected[u])
    status.doubted = doubted
    status.refused, x.refused = refused - x.refused, refused
    status.joints_valid, status.valid = number(joints), number(attitude and rates and joints)
    status.healthy = number(healthy and attitude and rates and joints)
    status.attitude_sigma, status.joint_sigma, status.innovation = math.sqrt(x.p_aa[0]), sigma, x.innovation
    status.gyro_admitted, status.gyro_age = x.rate_admitted[0], since(t, x.rate_accepted[0])
    status.star_tracker_admitted, status.star_tracker_age = x.angle_admitted[0], since(t, x.angle_time[0])
    status.gyro_rejected, status.star_tracker_rejected = x.rate_rejected[0], x.angle_rejected[0]
    status.encoder_admitted, status.encoder_age, status.encoder_rejected = encoder[0], encoder[1], encoder[2]
    status.joint_rate_admitted, status.joint_rate_age, status.joint_rate_rejected = (
        joint_rate[0], joint_rate[1], joint_rate[2])


@kernel
def estimate(t_ns, p, x, inputs, outputs):
    """One sample. The attitude is published as identity until a star tracker measurement is there."""
    n, t, stamp = len(x.angles), t_ns / SECOND, outputs.odometry.header.stamp
    sample = Sample(t, stack_array(3 + n), stack_array(1 + n), stack_array(3 + n), stack_array(3 + n),
                    stack_array(1 + n), stack_array(3 + n))
    read_rates(inputs, stamp, sample)
    for u in range(1 + n):
        take_rate(p, x, u, sample)
    propagate(p, x)
    read_angles(x, inputs, stamp, sample)
    for u in range(1 + n):
        take_angle(p, x, u, sample)
    x.attitude = turned(x.attitude, vec3(sample.correction[0:3]))
    for i in range(n):
        x.angles[i] += sample.correction[3 + i]
    for c in range(3 + n):
        x.used_rate[c] = x.rate[c]
    publish(p, x, inputs, outputs)
    report(p, x, t, outputs.status)


@kernel
def publish(p, x, inputs, outputs):
    """The estimate, and the sensors without a second one as they are."""
    odometry, joints = outputs.odometry, outputs.joints
    outputs.accelerations.known = 1.0 if x.samples > 0.0 else 0.0
    joints.position, joints.velocity, joints.effort = x.angles, x.rate[3:], inputs.joint_states.effort
    accelerate(p, x, vec3(x.rate[0:3]), joints.velocity)
    x.samples += 1.0
    odometry.pose.pose.orientation, odometry.twist.twist.angular = x.attitude, vec3(x.rate[0:3])
    outputs.accelerations.angular, outputs.accelerations.joints = x.acceleration, x.joint_acceleration
    outputs.accelerations.translation = inputs.imu.linear_acceleration
    outputs.torque.wrench.torque = inputs.base_torque.wrench.torque


def estimator(topics: spacerobot.Topics) -> type[Component]:
    """The estimator of a robot with these topics."""

    class RobustStateEstimator(Component):
        """Attitude, rates and joints of the space robot from sensors that watch each other, with a status.

        Promises: what state_estimator gives, and a status: whether attitude, rates and joints may be used (`valid`,
        `rates_valid`), from standard deviations and ages, and which sensor is out.

        Bad input: star tracker and gyro, encoder and rate sensor of each joint watch each other: a stuck, noisy,
        jumping or biased one is out, and comes back when it agrees again. With a rate sensor out, rates are differences
        of angles. Torques and the accelerometer have no second sensor and are passed on.
        """

        parameters, state = RobustEstimatorParameters, robust_state(topics.joints)
        inputs = {"imu": topics.imu, "star_tracker": topics.star_tracker, "joint_states": topics.joint_state,
                  "base_torque": topics.base_torque}
        outputs = {"odometry": topics.odometry, "joints": topics.joint_estimate, "accelerations": topics.accelerations,
                   "torque": topics.torque_estimate, "status": topics.state_status}
        rate_hz = 50.0
        start, kernel = start, estimate

    return RobustStateEstimator


RobustStateEstimator = estimator(spacerobot.MINI)
