"""The attitude filter that finds out which sensors to trust; attitude, covariance and status out.

The filter is `cubli_ros.attitude_filter`; tests, isolation, re-admission and the referee are in
`cubli_ros.sensor_admission`.

Dead reckoning. Without a star tracker (silent, blinded, isolated) the gyro alone carries the attitude, and the
covariance grows as the filter says: to second order P_a(t) = P_a + 2 t P_c' + t^2 P_b + (gyro_sigma^2 h) t. Without
both, or once the attitude is less sure than `valid_sigma`, the estimate goes on but is not valid. `status.valid` is
the flag to obey.
"""

import math

from cubli_ros import attitude_filter
from cubli_ros.attitude import is_fix
from cubli_ros.attitude_estimator import (
    UNKNOWN,
    AttitudeEstimatorParameters,
    AttitudeEstimatorState,
    write_covariances,
)
from cubli_ros.sensor_admission import admit_gyro, admit_tracker, average_vertical, tilt_residual
from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import field
from flight_math import Quaternion, Vec3, diagonal, diagonal_of, kernel, largest, same, smallest, total, transpose
from msg_schemas import cubli

NEVER = -1.0  # [s] age of what has not come yet
LARGEST_VARIANCE = 100.0  # [rad^2] of an attitude
MARGIN = 1.01  # [-] of rounding in |P_c|^2 <= tr(P_a) tr(P_b), which every covariance keeps


class RobustEstimatorParameters(AttitudeEstimatorParameters):
    rate_limit: float = field(2.0, unit="rad/s", gt=0, doc="a gyro axis beyond it is refused")
    acceleration_limit: float = field(2.0, unit="rad/s^2", gt=0, doc="a gyro axis that changes faster is refused")
    frozen_limit: int = field(5, ge=0, doc="a gyro axis that repeats itself so often is refused; 0: one without noise")
    gyro_limit: int = field(5, ge=1, doc="refused gyro samples in a row that isolate it")
    gyro_readmit: int = field(100, ge=1, doc="sound gyro samples in a row that bring it back")
    bias_limit: float = field(5e-3, unit="rad/s", gt=0, doc="an isolated gyro is sound within this of the tracker's rate")
    largest_bias: float = field(0.02, unit="rad/s", gt=0, doc="a larger bias is an upset of the filter's memory")
    coasting_walk: float = field(2e-4, unit="rad/s", gt=0, doc="without gyro: random walk of the rate in a sample")
    tracker_limit: int = field(3, ge=1, doc="refused star tracker measurements in a row that isolate it")
    tracker_readmit: int = field(8, ge=1, doc="consistent measurements in a row that bring it back")
    gravity: float = field(0.002, unit="m/s^2", ge=0, doc="surface gravity: of the accelerometer's vertical")
    vertical_time: float = field(5.0, unit="s", gt=0, doc="time constant of the accelerometer's vertical")
    referee_angle: float = field(0.03, unit="rad", gt=0, doc="from which the accelerometer tells two attitudes apart")
    votes: int = field(4, ge=1, doc="votes for an isolated tracker, in a row, that reopen the estimate")
    reopened_bias_sigma: float = field(0.02, unit="rad/s", gt=0, doc="expected size of the bias error then")
    reopen_again: float = field(20.0, unit="s", ge=0, doc="a second time within this isolates the gyro")
    coast_time: float = field(3.0, unit="s", gt=0, doc="without gyro and star tracker for longer: not valid")
    valid_sigma: float = field(0.02, unit="rad", gt=0, doc="an attitude less sure than this is not valid")


class RobustEstimatorState(AttitudeEstimatorState):
    """The filter's, and what is known of each sensor; streaks count what would change its state."""

    gyro_raw: Vec3
    gyro_repeats: Vec3
    gyro_lost: bool
    gyro_streak: int
    gyro_rejected: int
    gyro_isolations: int
    gyro_age: float = NEVER
    gyro_refused_for: float = 1e9
    known_bias: Vec3
    measured_before: Quaternion
    measured_for: float
    tracker_fix: bool
    tracker_lost: bool
    tracker_streak: int
    tracker_rejected: int
    tracker_isolations: int
    tracker_age: float = NEVER
    first_innovation: Vec3
    innovation_before: Vec3
    growth_before: Vec3
    votes: int
    steady: int
    reopened: int
    restarts: int
    reopened_for: float
    vertical: Vec3
    vertical_age: float


@kernel
def estimate(t_ns, p, x, inputs, outputs):
    imu, attitude = inputs.imu, outputs.attitude
    now, measured = attitude.header.stamp, inputs.star_tracker.quaternion
    imu_fresh, looked = same_stamp(imu.header.stamp, now), same_stamp(inputs.star_tracker.header.stamp, now)
    if x.begun and not is_possible(p, x):
        restart(x)
    gyro = admit_gyro(p, x, imu.angular_velocity, imu_fresh)
    if looked:
        x.tracker_fix = is_fix(measured)
    if x.begun:
        x.tracker_age += p.period
        x.reopened_for += p.period
        x.measured_for += p.period
        if x.gyro_lost:
            attitude_filter.carry(x, x.gyro_before - x.bias, p.period, p.gyro_sigma * p.period, p.coasting_walk)
        else:
            attitude_filter.predict(p, x, gyro)
        if imu_fresh:
            average_vertical(p, x, imu.linear_acceleration)
        if looked and x.tracker_fix and admit_tracker(p, x, measured):
            x.accepted += 1
            x.tracker_age = 0.0
        if looked and x.tracker_fix:
            x.measured_for = 0.0
    elif looked and x.tracker_fix:
        attitude_filter.start(p, x, measured)
        x.begun, x.accepted, x.tracker_age, x.measured_before = True, 1, 0.0, measured
    x.gyro_before = gyro
    attitude.angular_velocity = gyro - x.bias
    attitude.linear_acceleration = imu.linear_acceleration
    if x.begun:
        attitude.orientation = x.quaternion
        write_covariances(p, x, attitude, outputs.filter)
    else:
        attitude.orientation = Quaternion(0.0, 0.0, 0.0, 1.0)
        attitude.orientation_covariance = UNKNOWN
    tell(p, x, outputs.filter, outputs.status)


@kernel
def is_possible(p, x):
    """Whether the filter's memory can be one: an upset memory cell makes a quaternion or a covariance that is none."""
    attitude, bias = diagonal_of(x.attitude_covariance), diagonal_of(x.bias_covariance)
    largest_product = MARGIN * total(attitude) * total(bias)
    crossed = total(diagonal_of(x.cross_covariance @ transpose(x.cross_covariance)))
    largest_bias = p.rate_limit if x.gyro_lost else p.largest_bias
    return (is_fix(x.quaternion) and largest(abs(x.bias)) <= largest_bias and largest(abs(x.gyro_before)) <= p.rate_limit
            and smallest(attitude) >= 0.0 and largest(attitude) <= LARGEST_VARIANCE and smallest(bias) >= 0.0
            and largest(bias) <= p.rate_limit * p.rate_limit and crossed <= largest_product)


@kernel
def restart(x):
    """Forget the estimate; it begins again with the next measurement. What is known of the sensors stays."""
    x.begun, x.tracker_lost, x.tracker_streak = False, False, 0
    x.bias, x.gyro_before, x.vertical, x.vertical_age = same(0.0), x.gyro_raw, same(0.0), 0.0
    x.attitude_covariance = x.cross_covariance = x.bias_covariance = diagonal(same(0.0))
    x.innovation, x.innovation_squared = same(0.0), 0.0
    x.restarts += 1


@kernel
def tell(p, x, telemetry, status):
    """What the filter holds, and what it trusts."""
    x.rejected = x.tracker_rejected
    telemetry.bias, telemetry.innovation, telemetry.innovation_squared = x.bias, x.innovation, x.innovation_squared
    telemetry.accepted, telemetry.rejected = x.accepted, x.rejected
    status.sigma = math.sqrt(total(diagonal_of(x.attitude_covariance)))
    status.rate_sigma = math.sqrt(total(diagonal_of(x.bias_covariance)) + 3.0 * p.gyro_sigma * p.gyro_sigma)
    blind = x.gyro_age > p.coast_time and x.tracker_age > p.coast_time
    status.valid = x.begun and x.gyro_age >= 0.0 and not blind and status.sigma <= p.valid_sigma
    status.tracker_age, status.gyro_age = x.tracker_age, x.gyro_age
    status.tracker_admitted, status.gyro_admitted = x.begun and not x.tracker_lost, not x.gyro_lost
    status.tracker_fix = x.tracker_fix
    status.tracker_rejected, status.gyro_rejected = x.tracker_rejected, x.gyro_rejected
    status.tracker_isolations, status.gyro_isolations = x.tracker_isolations, x.gyro_isolations
    status.reopened, status.restarts = x.reopened, x.restarts
    status.tilt_residual = tilt_residual(p, x)


class RobustAttitudeEstimator(Component):
    """Attitude filter of the Cubli rover that tests, isolates and re-admits its sensors, and says whether it is valid.

    Promises: attitude, rates and covariances as attitude_estimator has them, and `status.valid`, the flag to obey:
    while it is 1 the filter's own standard deviation of the attitude is at most `valid_sigma` [rad], and one of gyro
    and tracker was heard within `coast_time` [s].

    Bad input: a gyro sample that is too fast, changes faster than torques allow, or repeats itself is refused, and the
    last good one is used; `gyro_limit` of them in a row isolate the gyro, and the tracker alone carries the rate. A
    tracker measurement that repeats bit for bit or lies beyond the gate is refused; `tracker_limit` in a row isolate
    the tracker. Both come back when they agree again. A memory that no filter can have (an upset) restarts the
    estimate. A tracker that drifts slowly passes for a biased gyro.
    """

    parameters, state = RobustEstimatorParameters, RobustEstimatorState
    inputs = {"imu": cubli.IMU, "star_tracker": cubli.STAR_TRACKER}
    outputs = {"attitude": cubli.ATTITUDE, "filter": cubli.FILTER, "status": cubli.ESTIMATOR_STATUS}
    rate_hz = 100.0
    kernel = estimate
