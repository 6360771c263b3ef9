"""Navigation of the landing as a component: inertial unit, star tracker, altimeter, camera in; pose and motor out.

The filter is `lander_ros.navigation_filter`. It starts with the first sample in which star tracker, altimeter and
camera all have something to say, at an unknown velocity.
"""

import math

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Array, Parameters, State, field
from flight_graph.timebase import SECOND
from flight_math import (
    Quaternion,
    Vec,
    Vec3,
    conjugate,
    diagonal_of,
    identity3,
    kernel,
    mat3,
    rotate,
    rotate_back,
    rotation_matrix,
    stack_array,
    transpose,
)
from lander_ros import navigation_filter
from lander_ros.navigation_filter import ACCELEROMETER, ATTITUDE, GYRO, PARTS, POSITION, VELOCITY
from msg_schemas import lander

Vec15 = Vec(15)


class NavigationParameters(Parameters):
    site_position: Vec3 = field((-9793.067387644818, -3535.8859359770563, 7907.859038812286), unit="m",
                                doc="rho_D, from the body's centre to the goal, in D")
    site_spin: Vec3 = field((0.0, 0.0002570616125008937, 0.00020878277451562036), unit="rad/s", doc="w_D, in D")
    mark_depth: float = field(1.5, unit="m", gt=0, doc="of the mark below the goal, on the site's normal")
    gyro_sigma: float = field(2e-5, unit="rad/s", gt=0, doc="white noise of a gyro sample")
    gyro_walk_sigma: float = field(2e-8, unit="rad/s", gt=0, doc="random walk of the gyro bias in a sample")
    accelerometer_sigma: float = field(2e-4, unit="m/s^2", gt=0, doc="white noise of an accelerometer sample")
    accelerometer_walk_sigma: float = field(5e-8, unit="m/s^2", gt=0, doc="random walk of its bias in a sample")
    star_tracker_sigma: float = field(2e-4, unit="rad", gt=0, doc="noise of a measurement, per axis")
    altimeter_sigma: float = field(0.02, unit="m", gt=0, doc="noise of a measurement")
    altimeter_relative_sigma: float = field(0.001, unit="1", ge=0, doc="further noise, relative to the distance")
    camera_sigma: float = field(1e-3, unit="rad", gt=0, doc="noise of a direction, per axis across it")
    initial_velocity_sigma: float = field(0.5, unit="m/s", gt=0, doc="expected speed at the start, per axis")
    initial_gyro_bias_sigma: float = field(5e-5, unit="rad/s", gt=0, doc="expected size of the gyro bias")
    initial_accelerometer_bias_sigma: float = field(1e-4, unit="m/s^2", gt=0, doc="expected size of its bias")
    gate: float = field(25.0, unit="1", gt=0, doc="largest accepted squared innovation of one scalar")


class NavigationState(State):
    """The estimate, its covariance in blocks of 3x3, the gyro's last sample, and what became of the measurements."""

    begun: bool
    position: Vec3
    velocity: Vec3
    orientation: Quaternion
    gyro_bias: Vec3
    accelerometer_bias: Vec3
    covariance: Array(PARTS, PARTS, 3, 3)
    rate_before: Vec3
    range_squared: float
    los_squared: float
    star_squared: float
    accepted: float
    rejected: float


@kernel
def navigate(t_ns, p, x, inputs, outputs):
    """One sample of the inertial unit, and what other sensors have new, into the estimate."""
    now = outputs.odometry.header.stamp
    star = same_stamp(inputs.star_tracker.header.stamp, now)
    ranged = same_stamp(inputs.altimeter.header.stamp, now) and 0.0 < inputs.altimeter.range < math.inf
    seen = same_stamp(inputs.camera.header.stamp, now) and any(inputs.camera.vector != 0.0)
    distance, direction = float(inputs.altimeter.range), inputs.camera.vector
    gyro = inputs.imu.angular_velocity
    if x.begun:
        navigation_filter.predict(p, x, inputs.imu.linear_acceleration, gyro, inputs.gravity.accel.linear)
        correction = stack_array(PARTS, 3)
        if star:
            x.star_squared = navigation_filter.take_attitude(p, x, correction, attitude(p, t_ns, inputs.star_tracker))
        if ranged:
            x.range_squared = navigation_filter.take_range(p, x, correction, distance)
        if seen:
            x.los_squared = navigation_filter.take_direction(p, x, correction, direction)
        if star or ranged or seen:
            navigation_filter.inject(x, correction)
    elif star and ranged and seen:
        x.orientation, x.rate_before = attitude(p, t_ns, inputs.star_tracker), gyro
        begin(p, x, distance, direction)
    publish(p, x, gyro, outputs.odometry, outputs.filter)


@kernel
def attitude(p, t_ns, star_tracker):
    """q, B to D, of a measured attitude in the inertial frame that D has turned in since the epoch."""
    return conjugate(navigation_filter.spin_quaternion(p.site_spin, t_ns / SECOND)) * star_tracker.quaternion


@kernel
def begin(p, x, distance, direction):
    """Estimate and covariance from attitude, distance [m] and direction in B; the velocity is unknown."""
    x.begun = True
    place_at(p, x, distance, direction)
    navigation_filter.add_variance(x.covariance, ATTITUDE, p.star_tracker_sigma)
    navigation_filter.add_variance(x.covariance, GYRO, p.initial_gyro_bias_sigma)
    navigation_filter.add_variance(x.covariance, ACCELEROMETER, p.initial_accelerometer_bias_sigma)


@kernel
def place_at(p, x, distance, direction):
    """Position and its covariance from attitude, distance [m] and direction in B; an unknown velocity."""
    x.position = -distance * rotate(x.orientation, direction) - Vec3(0.0, 0.0, p.mark_depth)
    along = navigation_filter.range_sigma(p, distance)
    across = distance * (p.camera_sigma + p.star_tracker_sigma)
    x.covariance[POSITION, POSITION] = (along * along + across * across) * identity3()
    navigation_filter.add_variance(x.covariance, VELOCITY, p.initial_velocity_sigma)


@kernel
def publish(p, x, gyro, odometry, telemetry):
    """Pose and motor with covariances: position and orientation in D, twist in B."""
    pose, twist = odometry.pose, odometry.twist
    if not x.begun:
        pose.pose.orientation = Quaternion(0.0, 0.0, 0.0, 1.0)
        pose.covariance[0] = -1.0
        return
    q = x.orientation
    pose.pose.position, pose.pose.orientation = x.position, q
    twist.twist.linear = rotate_back(q, x.velocity)
    twist.twist.angular = gyro - x.gyro_bias - rotate_back(q, p.site_spin)
    r = rotation_matrix(q)
    put_block(pose.covariance, 0, mat3(x.covariance[POSITION, POSITION]))
    put_block(pose.covariance, 3, r @ mat3(x.covariance[ATTITUDE, ATTITUDE]) @ transpose(r))
    put_block(twist.covariance, 0, transpose(r) @ mat3(x.covariance[VELOCITY, VELOCITY]) @ r)
    put_block(twist.covariance, 3, mat3(x.covariance[GYRO, GYRO]) + p.gyro_sigma * p.gyro_sigma * identity3())
    telemetry.gyro_bias, telemetry.accelerometer_bias = x.gyro_bias, x.accelerometer_bias
    telemetry.variances = variances(x.covariance)
    telemetry.range_innovation_squared = x.range_squared
    telemetry.los_innovation_squared = x.los_squared
    telemetry.star_innovation_squared = x.star_squared
    telemetry.accepted, telemetry.rejected = x.accepted, x.rejected


@kernel
def put_block(covariance, first, block):
    """Store a 3x3 block on the diagonal of a message's covariance (36,), a matrix of 6 x 6 row by row."""
    for i in range(3):
        for j in range(3):
            covariance[6 * (first + i) + first + j] = block[i, j]


@kernel
def variances(covariance):
    """The diagonal of the covariance."""
    found = stack_array(3 * PARTS)
    for i in range(PARTS):
        found[3 * i:3 * i + 3] = diagonal_of(mat3(covariance[i, i]))
    return Vec15(found)


class Navigation(Component):
    """Error-state Kalman filter of the lander: pose and motor relative to the landing site.

    Promises: position [m] and orientation (B to D) in the landing frame D, velocity [m/s] and rate [rad/s] in B, with
    covariances, at every firing, and the biases of the inertial unit. Where the noise is as declared they are
    consistent with the truth.

    Bad input: no estimate (covariance -1) before the first sample in which star tracker, altimeter and camera all have
    something to say. An altimeter out of reach (infinite) and a camera without the mark (zeros) are left out; an
    innovation beyond the gate is refused and counted. A silent inertial unit's last sample is used on, and no sample of
    it is tested: see robust_navigation.
    """

    parameters, state = NavigationParameters, NavigationState
    inputs = {"imu": lander.IMU, "star_tracker": lander.STAR_TRACKER, "altimeter": lander.ALTIMETER,
              "camera": lander.SITE_LOS, "gravity": lander.GRAVITY}
    outputs = {"odometry": lander.ODOMETRY, "filter": lander.NAVIGATION}
    rate_hz = 50.0
    kernel = navigate
