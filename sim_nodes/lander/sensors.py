"""Sensors of the lander as components, and a stand-in for navigation: the true state with white noise.

Camera and altimeter look at a mark on the ground, ``mark_depth`` below the goal on the site's normal. The altimeter
measures the distance to the mark along the camera's line of sight, not the height over the terrain. Noise is white, its
standard deviations are per sample and axis; 0 switches a source off.
"""

import math

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, field
from flight_graph.timebase import SECOND
from flight_math import Vec3, acos, clip, dot, gaussian, kernel, norm, normalised, quaternion, rotate_back, uniform, where
from lander_ros.landing_controller import pose_and_motor
from lander_ros.navigation_filter import spin_quaternion
from msg_schemas import lander
from sim_nodes.sensors.inertial import ImuState, accelerometer, gyro, start_imu, write_imu
from sim_nodes.sensors.star_tracker import measured_attitude
from sim_nodes.sensors.white_noise import white_noise

MULTIPATH_DRAW = 2  # [-] index of the altimeter's draw; its noise takes those before
SPIN = (0.0, 0.0002570616125008937, 0.00020878277451562036)  # [rad/s] w_D of the reference site


class ImuParameters(Parameters):
    gyro_sigma: float = field(2e-5, unit="rad/s", ge=0, doc="white noise of a sample")
    gyro_bias: Vec3 = field((3e-5, -2e-5, 1e-5), unit="rad/s", doc="bias at the start")
    gyro_walk_sigma: float = field(1e-8, unit="rad/s", ge=0, doc="random walk of the bias in a sample")
    accelerometer_sigma: float = field(2e-4, unit="m/s^2", ge=0, doc="white noise of a sample")
    accelerometer_bias: Vec3 = field((5e-5, -8e-5, 3e-5), unit="m/s^2", doc="constant bias")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_imu(t_ns, p, x, truth, imu):
    force = accelerometer(t_ns, p, truth.specific_force + p.accelerometer_bias)
    write_imu(p, gyro(t_ns, p, x, truth.inertial_rates), force, imu)


class Imu(Component):
    """Inertial measurement unit of the lander: inertial rate, specific force of the last interval.

    Promises: angular velocity to the inertial frame [rad/s] and specific force of the last interval [m/s^2], body frame
    B, with biases and white noise that are functions of seed and time alone.

    Bad input: truth that has not come reads as zero. It tests nothing: faults are put on its output.
    """

    parameters, state = ImuParameters, ImuState
    inputs, outputs = {"truth": lander.TRUTH}, {"imu": lander.IMU}
    rate_hz = 50.0
    start, kernel = start_imu, sample_imu


class StarTrackerParameters(Parameters):
    site_spin: Vec3 = field(SPIN, unit="rad/s", doc="w_D of the body, in D")
    sigma: float = field(2e-4, unit="rad", ge=0, doc="noise of a measurement about each body axis")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_star_tracker(t_ns, p, x, truth, measured):
    site = spin_quaternion(p.site_spin, t_ns / SECOND)
    measured.quaternion = measured_attitude(t_ns, p, site * truth.attitude)


class StarTracker(Component):
    """Star tracker of the lander: attitude to the inertial frame that equals the site's at the epoch.

    Promises: the attitude (x, y, z, w) from B to the inertial frame that equals the site's at the epoch, turned by a
    small random angle.

    Bad input: it tests nothing: faults are put on its output.
    """

    parameters = StarTrackerParameters
    inputs, outputs = {"truth": lander.TRUTH}, {"measured": lander.STAR_TRACKER}
    rate_hz = 5.0
    kernel = sample_star_tracker


class SiteSensorParameters(Parameters):
    mark_depth: float = field(1.5, unit="m", gt=0, doc="of the mark below the goal, on the site's normal")
    field_of_view: float = field(math.radians(45.0), unit="rad", gt=0, lt=1.5, doc="half angle about -z_B")
    seed: int = field(0, ge=0, doc="noise stream")


class AltimeterParameters(SiteSensorParameters):
    sigma: float = field(0.02, unit="m", ge=0, doc="noise of a measurement")
    relative_sigma: float = field(0.001, unit="1", ge=0, doc="further noise, relative to the distance")
    reach: float = field(5000.0, unit="m", gt=0, doc="largest distance")
    multipath_probability: float = field(0.0, unit="1", ge=0, le=1, doc="of a measurement of the second echo; 0: never")
    multipath_excess: float = field(10.0, unit="m", ge=0, doc="by which the path of the second echo is longer")


class SiteCameraParameters(SiteSensorParameters):
    sigma: float = field(1e-3, unit="rad", ge=0, doc="noise of the direction about each axis across it")


@kernel
def find_mark(p, truth):
    """Distance [m] and direction of the mark, in B, and whether it is in the field of view."""
    below = Vec3(0.0, 0.0, p.mark_depth)
    to_mark = rotate_back(truth.attitude, -truth.site_position - below)
    distance = norm(to_mark)
    angle = acos(clip(-to_mark.z / distance, -1.0, 1.0))
    return distance, to_mark / distance, angle <= p.field_of_view


@kernel
def sample_altimeter(t_ns, p, x, truth, measured):
    distance, _, in_view = find_mark(p, truth)
    sigma = p.sigma + p.relative_sigma * distance
    measured.radiation_type = 1
    measured.field_of_view = 2.0 * p.field_of_view
    measured.max_range = p.reach
    measured.variance = sigma * sigma
    if p.multipath_probability > 0.0 and uniform(p.seed, t_ns, MULTIPATH_DRAW) < p.multipath_probability:
        distance += p.multipath_excess
    noise = sigma * gaussian(p.seed, t_ns, 0) if sigma > 0.0 else 0.0
    measured.range = distance + noise if in_view and distance <= p.reach else math.inf  # REP 117


class Altimeter(Component):
    """Ranging altimeter of the lander, steered to the mark by the site camera.

    Promises: the distance [m] to the mark along the camera's line of sight, not the height over the terrain, with its
    variance.

    Bad input: infinity (REP 117) where the mark is out of the field of view or beyond `reach`. With
    `multipath_probability` it reads a second echo now and then.
    """

    parameters = AltimeterParameters
    inputs, outputs = {"truth": lander.TRUTH}, {"measured": lander.ALTIMETER}
    rate_hz = 5.0
    kernel = sample_altimeter


@kernel
def sample_camera(t_ns, p, x, truth, measured):
    _, direction, in_view = find_mark(p, truth)
    if p.sigma > 0.0:
        noise = white_noise(p.seed, t_ns, 0, p.sigma)
        direction = normalised(direction + noise - dot(direction, noise) * direction)  # noise across the direction
    measured.vector = where(in_view, direction, Vec3(0.0, 0.0, 0.0))


class SiteCamera(Component):
    """Site camera of the lander, after image processing: the direction of the mark, in B.

    Promises: the direction of the mark as a unit vector in B, with noise across it.

    Bad input: zeros where the mark is out of the field of view.
    """

    parameters = SiteCameraParameters
    inputs, outputs = {"truth": lander.TRUTH}, {"measured": lander.SITE_LOS}
    rate_hz = 5.0
    kernel = sample_camera


class NoisyNavigationParameters(Parameters):
    position_sigma: float = field(0.02, unit="m", ge=0, doc="of the position, per axis")
    position_relative_sigma: float = field(0.002, unit="1", ge=0, doc="further, relative to |r|")
    velocity_sigma: float = field(0.01, unit="m/s", ge=0, doc="of the velocity, per axis")
    attitude_sigma: float = field(math.radians(0.1), unit="rad", ge=0, doc="about each body axis")
    rate_sigma: float = field(math.radians(0.005), unit="rad/s", ge=0, doc="of the rate, per axis")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def add_noise(t_ns, p, x, truth, odometry):
    """True odometry plus white noise; the two parts of the position's noise are of one draw."""
    r, q, motor = pose_and_motor(truth)
    sigma = p.position_sigma + p.position_relative_sigma * norm(r)
    turn = white_noise(p.seed, t_ns, 9, p.attitude_sigma)
    pose, twist = odometry.pose, odometry.twist
    pose.pose.position = r + white_noise(p.seed, t_ns, 0, sigma)
    pose.pose.orientation = normalised(q * quaternion(0.5 * turn, 1.0)) if p.attitude_sigma > 0.0 else q
    twist.twist.linear = motor.dual + white_noise(p.seed, t_ns, 3, p.velocity_sigma)
    twist.twist.angular = motor.real + white_noise(p.seed, t_ns, 6, p.rate_sigma)
    for i in range(3):
        pose.covariance[7 * i] = sigma * sigma
        pose.covariance[21 + 7 * i] = p.attitude_sigma * p.attitude_sigma
        twist.covariance[7 * i] = p.velocity_sigma * p.velocity_sigma
        twist.covariance[21 + 7 * i] = p.rate_sigma * p.rate_sigma


class NoisyNavigation(Component):
    """Stand-in for navigation: the true pose and motor with white noise in every sample.

    Promises: the true pose and velocities with white noise in every sample, and the covariances that belong to it.

    Bad input: truth that has not come reads as the zero pose. It tests nothing.
    """

    parameters = NoisyNavigationParameters
    inputs, outputs = {"truth": lander.TRUTH_ODOMETRY}, {"odometry": lander.ODOMETRY}
    rate_hz = 10.0
    kernel = add_noise
