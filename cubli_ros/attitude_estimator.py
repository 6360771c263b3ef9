"""The attitude filter as a component: gyro and star tracker in, attitude, rates and covariance out."""

from cubli_ros import attitude_filter
from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from msg_schemas import cubli


class AttitudeEstimatorParameters(Parameters):
    gyro_sigma: float = field(1e-4, unit="rad/s", gt=0, doc="white noise of a gyro sample")
    gyro_walk_sigma: float = field(1e-7, unit="rad/s", gt=0, doc="random walk of the gyro bias in a sample")
    star_tracker_sigma: float = field(5e-5, unit="rad", gt=0, doc="noise of a star tracker measurement, per axis")
    initial_bias_sigma: float = field(1e-3, unit="rad/s", gt=0, doc="expected size of the gyro bias")
    gate: float = field(16.27, unit="1", gt=0, doc="largest accepted squared innovation (chi-square, 3 degrees, 99.9 %)")


class AttitudeEstimatorState(State):
    begun: bool
    quaternion: Array(4)
    bias: Vec3
    covariance: Array(6, 6)
    gyro_before: Vec3
    innovation: Vec3
    innovation_squared: float
    accepted: float
    rejected: float
    work: Array(3, 6, 6)


@kernel
def estimate(t_ns, p, x, imu, star_tracker, attitude, telemetry):
    fresh = same_stamp(star_tracker.header.stamp, attitude.header.stamp)
    if not x.begun:
        if fresh:
            attitude_filter.start(star_tracker.quaternion, p.star_tracker_sigma, p.initial_bias_sigma, x.quaternion,
                                  x.bias, x.covariance)
            x.begun = True
            x.accepted = 1.0
    else:
        attitude_filter.predict(x.quaternion, x.bias, x.covariance, x.gyro_before, imu.angular_velocity, p.period,
                                p.gyro_sigma, p.gyro_walk_sigma, x.work)
        if fresh:
            x.innovation_squared, accepted = attitude_filter.update(
                x.quaternion, x.bias, x.covariance, star_tracker.quaternion, p.star_tracker_sigma, p.gate, x.innovation,
                x.work)
            if accepted:
                x.accepted += 1.0
            else:
                x.rejected += 1.0
    publish(p, x, imu, attitude, telemetry)


@kernel
def publish(p, x, imu, attitude, telemetry):
    for i in range(3):
        x.gyro_before[i] = imu.angular_velocity[i]
        attitude.angular_velocity[i] = imu.angular_velocity[i] - x.bias[i]
        attitude.linear_acceleration[i] = imu.linear_acceleration[i]
        telemetry.bias[i] = x.bias[i]
        telemetry.innovation[i] = x.innovation[i]
        for j in range(3):
            attitude.orientation_covariance[3 * i + j] = x.covariance[i, j]
            attitude.angular_velocity_covariance[3 * i + j] = x.covariance[3 + i, 3 + j]
        attitude.angular_velocity_covariance[4 * i] += p.gyro_sigma * p.gyro_sigma
    for i in range(4):
        attitude.orientation[i] = x.quaternion[i]
    for i in range(6):
        for j in range(6):
            telemetry.covariance[6 * i + j] = x.covariance[i, j]
    telemetry.innovation_squared = x.innovation_squared
    telemetry.accepted = x.accepted
    telemetry.rejected = x.rejected
    if not x.begun:
        attitude.orientation[3] = 1.0
        attitude.orientation_covariance[0] = -1.0  # [-] sensor_msgs/Imu: no orientation yet


class AttitudeEstimator(Component):
    """Multiplicative extended Kalman filter of the Cubli rover's attitude and gyro bias."""

    parameters, state = AttitudeEstimatorParameters, AttitudeEstimatorState
    inputs = {"imu": cubli.IMU, "star_tracker": cubli.STAR_TRACKER}
    outputs = {"attitude": cubli.ATTITUDE, "filter": cubli.FILTER}
    rate_hz = 100.0
    kernel = estimate
