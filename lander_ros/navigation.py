"""Navigation of the landing as a component: inertial unit, star tracker, altimeter, camera in; pose and motor out.

The filter is `lander_ros.navigation_filter`. It starts with the first sample in which star tracker, altimeter and
camera all have something to say, at an unknown velocity.
"""

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from flight_graph.timebase import SECOND
from lander_ros import navigation_filter
from lander_ros.rotation import to_body, to_site
from msg_schemas import lander


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
    begun: bool
    position: Vec3
    velocity: Vec3
    orientation: Array(4)
    gyro_bias: Vec3
    accelerometer_bias: Vec3
    covariance: Array(15, 15)
    transition: Array(15, 15)
    product: Array(15, 15)
    rate_before: Vec3
    correction: Array(15)
    row: Array(15)
    gain: Array(15)
    direction: Vec3
    seen: Vec3
    quaternions: Array(2, 4)
    site: Array(4)
    inertial: Array(4)
    measured: Array(4)
    force: Vec3
    gyro: Vec3
    gravity: Vec3
    turned: Array(3, 3)
    range_squared: float
    los_squared: float
    star_squared: float
    accepted: float
    rejected: float


@kernel
def navigate(t_ns, p, x, imu, star_tracker, altimeter, camera, gravity, odometry, telemetry):
    now = odometry.header.stamp
    star = same_stamp(star_tracker.header.stamp, now)
    ranged = same_stamp(altimeter.header.stamp, now) and altimeter.range > 0.0
    seen = same_stamp(camera.header.stamp, now) and (
        camera.vector[0] != 0.0 or camera.vector[1] != 0.0 or camera.vector[2] != 0.0)
    for i in range(3):
        x.force[i] = imu.linear_acceleration[i]
        x.gyro[i] = imu.angular_velocity[i]
        x.gravity[i] = gravity.accel.linear[i]
    if star:
        navigation_filter.spin_quaternion(p.site_spin, t_ns / SECOND, x.site)
        for i in range(4):
            x.inertial[i] = star_tracker.quaternion[i]
        navigation_filter.relative_attitude(x.site, x.inertial, x.measured)
    if not x.begun:
        if star and ranged and seen:
            begin(p, x, altimeter, camera)
    else:
        navigation_filter.predict(p, x, x.force, x.gyro, x.gravity, p.period)
        if star:
            x.star_squared = navigation_filter.take_attitude(p, x, x.measured)
        if ranged:
            x.range_squared = navigation_filter.take_range(p, x, float(altimeter.range))
        if seen:
            for i in range(3):
                x.turned[0, i] = camera.vector[i]
            x.los_squared = navigation_filter.take_direction(p, x, x.turned[0])
        if star or ranged or seen:
            navigation_filter.inject(x)
    publish(p, x, odometry, telemetry)


@kernel
def begin(p, x, altimeter, camera):
    """Estimate and covariance from one attitude, one distance and one direction; the velocity is unknown."""
    distance = float(altimeter.range)
    for i in range(4):
        x.orientation[i] = x.measured[i]
    mx, my, mz = to_site(x.orientation, camera.vector[0], camera.vector[1], camera.vector[2])
    x.position[0] = -distance * mx
    x.position[1] = -distance * my
    x.position[2] = -distance * mz - p.mark_depth
    sigma = p.altimeter_sigma + p.altimeter_relative_sigma * distance
    across = distance * (p.camera_sigma + p.star_tracker_sigma)
    for i in range(3):
        x.rate_before[i] = x.gyro[i]
        x.covariance[i, i] = sigma * sigma + across * across
        x.covariance[3 + i, 3 + i] = p.initial_velocity_sigma * p.initial_velocity_sigma
        x.covariance[6 + i, 6 + i] = p.star_tracker_sigma * p.star_tracker_sigma
        x.covariance[9 + i, 9 + i] = p.initial_gyro_bias_sigma * p.initial_gyro_bias_sigma
        x.covariance[12 + i, 12 + i] = p.initial_accelerometer_bias_sigma * p.initial_accelerometer_bias_sigma
    x.begun = True


@kernel
def publish(p, x, odometry, telemetry):
    """Pose and motor with covariances: position and orientation in D, twist in B."""
    q, spin = x.orientation, p.site_spin
    if not x.begun:
        odometry.pose.pose.orientation[3] = 1.0
        odometry.pose.covariance[0] = -1.0
        return
    zx, zy, zz = to_body(q, spin[0], spin[1], spin[2])
    odometry.twist.twist.angular[0] = x.gyro[0] - x.gyro_bias[0] - zx
    odometry.twist.twist.angular[1] = x.gyro[1] - x.gyro_bias[1] - zy
    odometry.twist.twist.angular[2] = x.gyro[2] - x.gyro_bias[2] - zz
    ax, ay, az = to_body(q, x.velocity[0], x.velocity[1], x.velocity[2])
    odometry.twist.twist.linear[0] = ax
    odometry.twist.twist.linear[1] = ay
    odometry.twist.twist.linear[2] = az
    for i in range(3):
        odometry.pose.pose.position[i] = x.position[i]
        telemetry.gyro_bias[i] = x.gyro_bias[i]
        telemetry.accelerometer_bias[i] = x.accelerometer_bias[i]
    for i in range(4):
        odometry.pose.pose.orientation[i] = q[i]
    for i in range(3):
        for j in range(3):
            odometry.pose.covariance[6 * i + j] = x.covariance[i, j]
            odometry.twist.covariance[6 * (3 + i) + 3 + j] = x.covariance[9 + i, 9 + j]
        odometry.twist.covariance[7 * (3 + i)] += p.gyro_sigma * p.gyro_sigma
    rotate_block(q, x, 6, True)
    for i in range(3):
        for j in range(3):
            odometry.pose.covariance[6 * (3 + i) + 3 + j] = x.turned[i, j]
    rotate_block(q, x, 3, False)
    for i in range(3):
        for j in range(3):
            odometry.twist.covariance[6 * i + j] = x.turned[i, j]
    for i in range(15):
        telemetry.variances[i] = x.covariance[i, i]
    telemetry.range_innovation_squared = x.range_squared
    telemetry.los_innovation_squared = x.los_squared
    telemetry.star_innovation_squared = x.star_squared
    telemetry.accepted = x.accepted
    telemetry.rejected = x.rejected


@kernel
def rotate_block(q, x, first, out_of_body):
    """The 3 x 3 block of the covariance at ``first``, rotated from B to D or from D to B, to ``x.turned``."""
    for j in range(3):
        for i in range(3):
            x.seen[i] = x.covariance[first + i, first + j]
        if out_of_body:
            x.turned[0, j], x.turned[1, j], x.turned[2, j] = to_site(q, x.seen[0], x.seen[1], x.seen[2])
        else:
            x.turned[0, j], x.turned[1, j], x.turned[2, j] = to_body(q, x.seen[0], x.seen[1], x.seen[2])
    for i in range(3):
        a, b, c = x.turned[i, 0], x.turned[i, 1], x.turned[i, 2]
        if out_of_body:
            x.turned[i, 0], x.turned[i, 1], x.turned[i, 2] = to_site(q, a, b, c)
        else:
            x.turned[i, 0], x.turned[i, 1], x.turned[i, 2] = to_body(q, a, b, c)


class Navigation(Component):
    """Error-state Kalman filter of the lander: pose and motor relative to the landing site."""

    parameters, state = NavigationParameters, NavigationState
    inputs = {"imu": lander.IMU, "star_tracker": lander.STAR_TRACKER, "altimeter": lander.ALTIMETER,
              "camera": lander.SITE_LOS, "gravity": lander.GRAVITY}
    outputs = {"odometry": lander.ODOMETRY, "filter": lander.NAVIGATION}
    rate_hz = 50.0
    kernel = navigate
