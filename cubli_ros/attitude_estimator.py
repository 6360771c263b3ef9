"""The attitude filter as a component: gyro and star tracker in, attitude, rates and covariance out."""

from cubli_ros import attitude_filter
from cubli_ros.attitude import is_fix
from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Parameters, State, field
from flight_math import Mat3, Quaternion, Vec, Vec3, diagonal, kernel, row_by_row, same
from msg_schemas import cubli

UNKNOWN = Vec(9)(-1.0, *[0.0] * 8)  # [-] a covariance of sensor_msgs/Imu: what it belongs to is not known


class AttitudeEstimatorParameters(Parameters):
    gyro_sigma: float = field(1e-4, unit="rad/s", gt=0, doc="white noise of a gyro sample")
    gyro_walk_sigma: float = field(1e-7, unit="rad/s", gt=0, doc="random walk of the gyro bias in a sample")
    star_tracker_sigma: float = field(5e-5, unit="rad", gt=0, doc="noise of a star tracker measurement, per axis")
    initial_bias_sigma: float = field(1e-3, unit="rad/s", gt=0, doc="expected size of the gyro bias")
    gate: float = field(16.27, unit="1", gt=0, doc="largest accepted squared innovation (chi-square, 3 degrees, 99.9 %)")


class AttitudeEstimatorState(State):
    """Reference attitude and bias, the blocks of the error's covariance, the last gyro sample and measurement."""

    begun: bool
    quaternion: Quaternion
    bias: Vec3
    attitude_covariance: Mat3
    cross_covariance: Mat3
    bias_covariance: Mat3
    gyro_before: Vec3
    innovation: Vec3
    innovation_squared: float
    accepted: int
    rejected: int


@kernel
def estimate(t_ns, p, x, imu, star_tracker, attitude, telemetry):
    fresh = same_stamp(star_tracker.header.stamp, attitude.header.stamp) and is_fix(star_tracker.quaternion)
    if not x.begun:
        if fresh:
            attitude_filter.start(p, x, star_tracker.quaternion)
            x.begun = True
            x.accepted = 1
    else:
        attitude_filter.predict(p, x, imu.angular_velocity)
        if fresh:
            if attitude_filter.update(p, x, star_tracker.quaternion):
                x.accepted += 1
            else:
                x.rejected += 1
    x.gyro_before = imu.angular_velocity
    attitude.angular_velocity = imu.angular_velocity - x.bias
    attitude.linear_acceleration = imu.linear_acceleration
    if x.begun:
        attitude.orientation = x.quaternion
        write_covariances(p, x, attitude, telemetry)
    else:
        attitude.orientation = Quaternion(0.0, 0.0, 0.0, 1.0)
        attitude.orientation_covariance = UNKNOWN
    telemetry.bias, telemetry.innovation = x.bias, x.innovation
    telemetry.innovation_squared = x.innovation_squared
    telemetry.accepted, telemetry.rejected = x.accepted, x.rejected


@kernel
def write_covariances(p, x, attitude, telemetry):
    """Covariances of attitude and rate into the estimate; the whole of the error's, row by row, into the telemetry."""
    attitude.orientation_covariance = row_by_row(x.attitude_covariance)
    attitude.angular_velocity_covariance = row_by_row(
        x.bias_covariance + diagonal(same(p.gyro_sigma * p.gyro_sigma)))
    for i in range(3):
        for j in range(3):
            telemetry.covariance[6 * i + j] = x.attitude_covariance[i, j]
            telemetry.covariance[6 * i + j + 3] = x.cross_covariance[i, j]
            telemetry.covariance[6 * i + j + 18] = x.cross_covariance[j, i]
            telemetry.covariance[6 * i + j + 21] = x.bias_covariance[i, j]


class AttitudeEstimator(Component):
    """Multiplicative extended Kalman filter of the Cubli rover's attitude and gyro bias.

    Promises: attitude (x, y, z, w, body to balance frame), body rates without the gyro's bias [rad/s], and covariances
    [rad^2, rad^2/s^2] at every firing. Where the noise is as declared they are consistent: the normalised error squared
    has the chi-square distribution of six degrees of freedom.

    Bad input: the orientation is unknown (covariance -1) until a first star tracker measurement. A quaternion that is
    not of length one (a blinded tracker sends zeros) is left out; one beyond the gate is refused and counted. Without
    the tracker the gyro carries the attitude, and the covariance grows. Gyro samples are not tested, and a silent
    gyro's last rate is used on: see robust_attitude_estimator.
    """

    parameters, state = AttitudeEstimatorParameters, AttitudeEstimatorState
    inputs = {"imu": cubli.IMU, "star_tracker": cubli.STAR_TRACKER}
    outputs = {"attitude": cubli.ATTITUDE, "filter": cubli.FILTER}
    rate_hz = 100.0
    kernel = estimate
