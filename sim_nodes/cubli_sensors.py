"""Sensors of the Cubli rover as components: inertial measurement unit and star tracker. Sampling: `sim_nodes.sensors`."""

from cubli_ros.attitude import quaternion_from_cardan
from flight_graph.components.component import Component
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from msg_schemas import cubli
from sim_nodes import sensors


class ImuParameters(Parameters):
    length: float = field(0.2, unit="m", gt=0, doc="edge of the cube; the unit sits at its centre")
    gyro_sigma: float = field(1e-4, unit="rad/s", ge=0, doc="white noise of a sample")
    gyro_bias: Vec3 = field(2e-4, unit="rad/s", doc="bias at the start")
    gyro_walk_sigma: float = field(1e-7, unit="rad/s", ge=0, doc="random walk of the bias in a sample")
    accelerometer_sigma: float = field(1e-6, unit="m/s^2", ge=0, doc="white noise of a sample")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_imu(t_ns, p, x, truth, contact, imu):
    if contact.header.stamp.sec != 0:
        for i in range(3):
            imu.linear_acceleration[i] = contact.specific_force[i]
        sensors.noise_vector(p.seed, t_ns, sensors.ACCELEROMETER_DRAW, p.accelerometer_sigma, imu.linear_acceleration)
    else:
        sensors.accelerometer_sample(p.seed, t_ns, truth.rates, truth.accelerations, truth.gravity, p.length,
                                     p.accelerometer_sigma, imu.linear_acceleration)
    sensors.gyro_sample(p.seed, t_ns, truth.rates, p.gyro_sigma, p.gyro_walk_sigma, x.bias, imu.angular_velocity)
    imu.orientation[3] = 1.0
    imu.orientation_covariance[0] = -1.0  # [-] sensor_msgs/Imu: no orientation is measured
    for i in range(3):
        imu.angular_velocity_covariance[4 * i] = p.gyro_sigma * p.gyro_sigma
        imu.linear_acceleration_covariance[4 * i] = p.accelerometer_sigma * p.accelerometer_sigma


class Imu(Component):
    """Gyro and accelerometer of the Cubli rover, with white noise and a wandering gyro bias.

    A plant that simulates its contact gives the specific force; otherwise it follows from a corner at rest.
    """

    parameters, state = ImuParameters, sensors.ImuState
    inputs, outputs = {"truth": cubli.TRUTH, "contact": cubli.TRUTH_CONTACT}, {"imu": cubli.IMU}
    optional_inputs = ("contact",)
    rate_hz = 100.0
    start, kernel = sensors.start_imu, sample_imu


class StarTrackerParameters(Parameters):
    sigma: float = field(5e-5, unit="rad", ge=0, doc="noise of a measurement about each body axis")
    seed: int = field(0, ge=0, doc="noise stream")


class StarTrackerState(State):
    quaternion: Array(4)
    work: Array(2, 4)


@kernel
def sample_star_tracker(t_ns, p, x, truth, measured):
    quaternion_from_cardan(truth.angles, x.quaternion)
    sensors.star_tracker_sample(p.seed, t_ns, x.quaternion, p.sigma, measured.quaternion, x.work)


class StarTracker(Component):
    """Star tracker of the Cubli rover."""

    parameters, state = StarTrackerParameters, StarTrackerState
    inputs, outputs = {"truth": cubli.TRUTH}, {"measured": cubli.STAR_TRACKER}
    rate_hz = 4.0
    kernel = sample_star_tracker
