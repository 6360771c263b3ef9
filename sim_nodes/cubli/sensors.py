"""Sensors of the Cubli rover as components: inertial measurement unit and star tracker. Sampling: `sim_nodes.sensors`."""

from cubli_ros.attitude import quaternion_from_cardan
from cubli_ros.jump_condition import centre_acceleration
from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, field
from flight_math import Vec3, kernel
from msg_schemas import cubli
from sim_nodes.sensors.inertial import ImuState, accelerometer, gyro, start_imu, write_imu
from sim_nodes.sensors.star_tracker import NO_FIX, is_blinded, measured_attitude


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
        specific_force = contact.specific_force
    else:  # the corner rests
        specific_force = centre_acceleration(truth.rates, truth.accelerations, p.length) - truth.gravity
    write_imu(p, gyro(t_ns, p, x, truth.rates), accelerometer(t_ns, p, specific_force), imu)


class Imu(Component):
    """Gyro and accelerometer of the Cubli rover, with white noise and a wandering gyro bias.

    Promises: angular velocity [rad/s] and specific force [m/s^2] at the cube's centre, body axes, with white noise and
    a wandering gyro bias that are functions of seed and time alone. A plant that simulates its contact gives the
    specific force; otherwise it follows from a corner at rest.

    Bad input: truth that has not come reads as zero. It tests nothing: faults are put on its output.
    """

    parameters, state = ImuParameters, ImuState
    inputs, outputs = {"truth": cubli.TRUTH, "contact": cubli.TRUTH_CONTACT}, {"imu": cubli.IMU}
    optional_inputs = ("contact",)
    rate_hz = 100.0
    start, kernel = start_imu, sample_imu


class StarTrackerParameters(Parameters):
    sigma: float = field(5e-5, unit="rad", ge=0, doc="noise of a measurement about each body axis")
    boresight: Vec3 = field((1.0, 0.0, 0.0), unit="1", doc="where it looks, body frame; any length")
    blinding_direction: Vec3 = field((1.0, 1.0, 1.0), unit="1", doc="where the Sun or a limb is, balance frame; any length")
    blinding_angle: float = field(0.0, unit="rad", ge=0, le=3.2,
                                  doc="blind while the boresight is nearer to that direction; 0: never")
    seed: int = field(0, ge=0, doc="noise stream")


@kernel
def sample_star_tracker(t_ns, p, x, truth, measured):
    attitude = quaternion_from_cardan(truth.angles)
    measured.quaternion = NO_FIX if is_blinded(p, attitude) else measured_attitude(t_ns, p, attitude)


class StarTracker(Component):
    """Star tracker of the Cubli rover.

    Promises: the true attitude (x, y, z, w, body to balance frame), turned by a small random angle about body axes.

    Bad input: a quaternion of zeros while it is blinded: its boresight is nearer than `blinding_angle` to
    `blinding_direction`.
    """

    parameters = StarTrackerParameters
    inputs, outputs = {"truth": cubli.TRUTH}, {"measured": cubli.STAR_TRACKER}
    rate_hz = 4.0
    kernel = sample_star_tracker
