"""Sensors of the lander as components, and a stand-in for navigation: the true state with white noise.

Camera and altimeter look at a mark on the ground, ``mark_depth`` below the goal on the site's normal. The altimeter
measures the distance to the mark along the camera's line of sight, not the height over the terrain. Noise is white, its
standard deviations are per sample and axis; 0 switches a source off.
"""

import math

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from flight_graph.noise import gaussian
from flight_graph.timebase import SECOND
from lander_ros.landing_controller import take_odometry
from lander_ros.navigation_filter import spin_quaternion
from lander_ros.rotation import multiply, to_body
from msg_schemas import lander
from sim_nodes.sensors import (
    ACCELEROMETER_DRAW,
    ImuState,
    gyro_sample,
    noise_vector,
    star_tracker_sample,
    start_imu,
)

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
    for i in range(3):
        imu.linear_acceleration[i] = truth.specific_force[i] + p.accelerometer_bias[i]
        imu.angular_velocity_covariance[4 * i] = p.gyro_sigma * p.gyro_sigma
        imu.linear_acceleration_covariance[4 * i] = p.accelerometer_sigma * p.accelerometer_sigma
    noise_vector(p.seed, t_ns, ACCELEROMETER_DRAW, p.accelerometer_sigma, imu.linear_acceleration)
    gyro_sample(p.seed, t_ns, truth.inertial_rates, p.gyro_sigma, p.gyro_walk_sigma, x.bias, imu.angular_velocity)
    imu.orientation[3] = 1.0
    imu.orientation_covariance[0] = -1.0  # [-] sensor_msgs/Imu: no orientation is measured


class Imu(Component):
    """Inertial measurement unit of the lander: inertial rate, specific force of the last interval."""

    parameters, state = ImuParameters, ImuState
    inputs, outputs = {"truth": lander.TRUTH}, {"imu": lander.IMU}
    rate_hz = 50.0
    start, kernel = start_imu, sample_imu


class StarTrackerParameters(Parameters):
    site_spin: Vec3 = field(SPIN, unit="rad/s", doc="w_D of the body, in D")
    sigma: float = field(2e-4, unit="rad", ge=0, doc="noise of a measurement about each body axis")
    seed: int = field(0, ge=0, doc="noise stream")


class StarTrackerState(State):
    attitude: Array(4)
    site: Array(4)
    inertial: Array(4)
    work: Array(2, 4)


@kernel
def sample_star_tracker(t_ns, p, x, truth, measured):
    spin_quaternion(p.site_spin, t_ns / SECOND, x.site)
    for i in range(4):
        x.attitude[i] = truth.attitude[i]
    multiply(x.site, x.attitude, x.inertial)
    star_tracker_sample(p.seed, t_ns, x.inertial, p.sigma, measured.quaternion, x.work)


class StarTracker(Component):
    """Star tracker of the lander: attitude to the inertial frame that equals the site's at the epoch."""

    parameters, state = StarTrackerParameters, StarTrackerState
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


class SiteCameraParameters(SiteSensorParameters):
    sigma: float = field(1e-3, unit="rad", ge=0, doc="noise of the direction about each axis across it")


class SiteSensorState(State):
    mark: Vec3
    attitude: Array(4)
    first: Vec3
    second: Vec3


@kernel
def find_mark(depth, x, truth):
    """Vector from B to the mark, in B, to ``x.mark`` [m]; returns its length and the angle from -z_B."""
    for i in range(4):
        x.attitude[i] = truth.attitude[i]
    position = truth.site_position
    x.mark[0], x.mark[1], x.mark[2] = to_body(x.attitude, -position[0], -position[1], -position[2] - depth)
    distance = math.sqrt(x.mark[0] * x.mark[0] + x.mark[1] * x.mark[1] + x.mark[2] * x.mark[2])
    return distance, math.acos(min(max(-x.mark[2] / distance, -1.0), 1.0))


@kernel
def sample_altimeter(t_ns, p, x, truth, measured):
    distance, angle = find_mark(p.mark_depth, x, truth)
    measured.radiation_type = 1
    measured.field_of_view = 2.0 * p.field_of_view
    measured.max_range = p.reach
    sigma = p.sigma + p.relative_sigma * distance
    measured.variance = sigma * sigma
    measured.range = distance
    if sigma > 0.0:
        measured.range = distance + sigma * gaussian(p.seed, t_ns, 0)
    if angle > p.field_of_view or distance > p.reach:
        measured.range = -math.inf  # sensor_msgs/Range: no detection within reach is +-inf (REP 117)


class Altimeter(Component):
    """Ranging altimeter of the lander, steered to the mark by the site camera."""

    parameters, state = AltimeterParameters, SiteSensorState
    inputs, outputs = {"truth": lander.TRUTH}, {"measured": lander.ALTIMETER}
    rate_hz = 5.0
    kernel = sample_altimeter


@kernel
def sample_camera(t_ns, p, x, truth, measured):
    distance, angle = find_mark(p.mark_depth, x, truth)
    for i in range(3):
        x.first[i] = x.mark[i] / distance
    if p.sigma > 0.0:
        # noise across the direction: n - u (u . n)
        for i in range(3):
            x.second[i] = p.sigma * gaussian(p.seed, t_ns, i)
        along = x.first[0] * x.second[0] + x.first[1] * x.second[1] + x.first[2] * x.second[2]
        for i in range(3):
            x.first[i] += x.second[i] - along * x.first[i]
        norm = math.sqrt(x.first[0] * x.first[0] + x.first[1] * x.first[1] + x.first[2] * x.first[2])
        for i in range(3):
            x.first[i] /= norm
    for i in range(3):
        measured.vector[i] = x.first[i] if angle <= p.field_of_view else 0.0


class SiteCamera(Component):
    """Site camera of the lander, after image processing: the direction of the mark, in B."""

    parameters, state = SiteCameraParameters, SiteSensorState
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


class NoisyNavigationState(State):
    position: Vec3
    orientation: Array(4)
    alpha: Vec3
    rate: Vec3
    turned: Array(4)
    turn: Array(4)


@kernel
def add_noise(t_ns, p, x, truth, odometry):
    """True odometry plus white noise; the two parts of the position's noise are of one draw."""
    take_odometry(x, truth)
    distance = math.sqrt(x.position[0] * x.position[0] + x.position[1] * x.position[1]
                         + x.position[2] * x.position[2])
    sigma = p.position_sigma + p.position_relative_sigma * distance
    noise_vector(p.seed, t_ns, 0, sigma, x.position)
    noise_vector(p.seed, t_ns, 3, p.velocity_sigma, x.alpha)
    noise_vector(p.seed, t_ns, 6, p.rate_sigma, x.rate)
    for i in range(4):
        x.turned[i] = x.orientation[i]
    if p.attitude_sigma > 0.0:
        for i in range(3):
            x.turn[i] = 0.5 * p.attitude_sigma * gaussian(p.seed, t_ns, 9 + i)
        x.turn[3] = 1.0
        multiply(x.orientation, x.turn, x.turned)
        norm = math.sqrt(x.turned[0] * x.turned[0] + x.turned[1] * x.turned[1] + x.turned[2] * x.turned[2]
                         + x.turned[3] * x.turned[3])
        for i in range(4):
            x.turned[i] /= norm
    for i in range(3):
        odometry.pose.pose.position[i] = x.position[i]
        odometry.twist.twist.linear[i] = x.alpha[i]
        odometry.twist.twist.angular[i] = x.rate[i]
        odometry.pose.covariance[7 * i] = sigma * sigma
        odometry.pose.covariance[21 + 7 * i] = p.attitude_sigma * p.attitude_sigma
        odometry.twist.covariance[7 * i] = p.velocity_sigma * p.velocity_sigma
        odometry.twist.covariance[21 + 7 * i] = p.rate_sigma * p.rate_sigma
    for i in range(4):
        odometry.pose.pose.orientation[i] = x.turned[i]


class NoisyNavigation(Component):
    """Stand-in for navigation: the true pose and motor with white noise in every sample."""

    parameters, state = NoisyNavigationParameters, NoisyNavigationState
    inputs, outputs = {"truth": lander.TRUTH_ODOMETRY}, {"odometry": lander.ODOMETRY}
    rate_hz = 10.0
    kernel = add_noise
