"""A rigid spacecraft that points, in the blocks of Basilisk's attitude feedback examples; for beside_basilisk.py.

plant -> navigation -> tracking <- reference;  tracking -> feedback -> (wheels: allocation) -> plant

Attitudes are modified Rodrigues parameters (MRP) sigma of the body B to the inertial frame N. Equations: Schaub and
Junkins, Analytical Mechanics of Space Systems (MRP kinematics, subtraction, shadow set; balanced reaction wheels; MRP
feedback), the same that the documentation of Basilisk's modules cites.
"""

from typing import NamedTuple

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, field
from flight_math import Mat3, Vec3, cross, diagonal, dot, inverse, kernel, rk4, same, transpose
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector

BODY = "pointing_body"
TRUTH = named_vector("pointing/truth", BODY, {
    "position": Quantity(3, "m", "in N"), "velocity": Quantity(3, "m/s", "in N"), "sigma": Quantity(3, "1", "MRP"),
    "omega": Quantity(3, "rad/s", "in B")}, Role.TRUTH)
WHEEL_SPEEDS = named_vector("pointing/wheel_speeds", BODY, {"speeds": Quantity(3, "rad/s")}, Role.SENSOR)
ATTITUDE = named_vector("pointing/attitude", BODY, {
    "sigma": Quantity(3, "1", "MRP"), "omega": Quantity(3, "rad/s", "in B")}, Role.ESTIMATE)
REFERENCE = named_vector("pointing/reference", BODY, {
    "sigma": Quantity(3, "1", "MRP"), "omega": Quantity(3, "rad/s", "in N"),
    "omega_dot": Quantity(3, "rad/s^2", "in N")}, Role.TELEMETRY)
ERROR = named_vector("pointing/error", BODY, {
    "sigma": Quantity(3, "1", "of B to R"), "omega": Quantity(3, "rad/s", "of B to R, in B"),
    "reference_omega": Quantity(3, "rad/s", "of R to N, in B"),
    "reference_omega_dot": Quantity(3, "rad/s^2", "of R to N, in B")}, Role.TELEMETRY)
TORQUE = named_vector("pointing/torque", BODY, {"torque": Quantity(3, "N m", "on the body")}, Role.COMMAND)
MOTOR_TORQUE = named_vector("pointing/motor_torque", BODY, {"torque": Quantity(3, "N m", "on the wheels")}, Role.COMMAND)


# -- attitude ----------------------------------------------------------------------------------------------------------
@kernel
def mrp_rates(sigma, omega):
    """sigma' for body rates omega [rad/s]."""
    return 0.25 * ((1.0 - dot(sigma, sigma)) * omega + 2.0 * cross(sigma, omega) + 2.0 * dot(sigma, omega) * sigma)


@kernel
def mrp_difference(sigma, other):
    """MRP of the rotation other -> sigma."""
    square, other_square = dot(sigma, sigma), dot(other, other)
    above = (1.0 - other_square) * sigma - (1.0 - square) * other + 2.0 * cross(sigma, other)
    return short_way(above / (1.0 + square * other_square + 2.0 * dot(sigma, other)))


@kernel
def short_way(sigma):
    """The shadow set where it is the shorter way."""
    square = dot(sigma, sigma)
    return -sigma / square if square > 1.0 else sigma


@kernel
def turned(sigma, vector, sense):
    """A vector of B in N (sense 1), of N in B (sense -1)."""
    square, once = dot(sigma, sigma), cross(sigma, vector)
    return vector + (8.0 * cross(sigma, once) + sense * 4.0 * (1.0 - square) * once) / ((1.0 + square) * (1.0 + square))


# -- plant -------------------------------------------------------------------------------------------------------------
class BodyParameters(Parameters):
    mass: float = field(750.0, unit="kg", gt=0)
    inertia: Mat3 = field((900, 0, 0, 0, 800, 0, 0, 0, 600), unit="kg m^2", doc="with the wheels")
    force: Vec3 = field(0.0, unit="N", doc="on the body, in B, constant")
    disturbance: Vec3 = field(0.0, unit="N m", doc="on the body, in B, constant")
    position: Vec3 = field(0.0, unit="m", doc="at the start, in N")
    velocity: Vec3 = field(0.0, unit="m/s", doc="at the start, in N")
    sigma: Vec3 = field(0.0, unit="1", doc="MRP at the start")
    omega: Vec3 = field(0.0, unit="rad/s", doc="body rates at the start")


class WheelParameters(BodyParameters):
    axes: Mat3 = field((1, 0, 0, 0, 1, 0, 0, 0, 1), unit="1", doc="spin axes of the wheels, one a row")
    wheel_inertia: float = field(0.16, unit="kg m^2", gt=0, doc="of each wheel about its axis")
    wheel_speeds: Vec3 = field(0.0, unit="rad/s", doc="at the start")


class BodyState(State):
    position: Vec3
    velocity: Vec3
    sigma: Vec3
    omega: Vec3


class WheelState(BodyState):
    wheel_speeds: Vec3


class Motion(NamedTuple):
    position: Vec3
    velocity: Vec3
    sigma: Vec3
    omega: Vec3


class WheelMotion(NamedTuple):
    position: Vec3
    velocity: Vec3
    sigma: Vec3
    omega: Vec3
    wheel_speeds: Vec3


@kernel
def body_start(p, x):
    x.position, x.velocity, x.sigma, x.omega = p.position, p.velocity, p.sigma, p.omega


@kernel
def wheel_start(p, x):
    body_start(p, x)
    x.wheel_speeds = p.wheel_speeds


@kernel
def body_output(t_ns, p, x, truth):
    truth.position, truth.velocity, truth.sigma, truth.omega = x.position, x.velocity, x.sigma, x.omega


@kernel
def wheel_output(t_ns, p, x, truth, wheels):
    body_output(t_ns, p, x, truth)
    wheels.speeds = x.wheel_speeds


@kernel
def body_rates(held, t, motion):
    """held: parameters, torque on the body [N m]."""
    p, torque = held
    moment = p.disturbance + torque - cross(motion.omega, p.inertia @ motion.omega)
    return Motion(motion.velocity, turned(motion.sigma, p.force, 1.0) / p.mass, mrp_rates(motion.sigma, motion.omega),
                  inverse(p.inertia) @ moment)


@kernel
def wheel_rates(held, t, motion):
    """held: parameters, torque of the motors on the wheels [N m]."""
    p, torque = held
    outward = transpose(p.axes)
    momentum = p.inertia @ motion.omega + outward @ (p.wheel_inertia * motion.wheel_speeds)
    moment = p.disturbance - outward @ torque - cross(motion.omega, momentum)
    locked_out = p.inertia - (outward @ diagonal(same(p.wheel_inertia))) @ p.axes
    omega_dot = inverse(locked_out) @ moment
    return WheelMotion(motion.velocity, turned(motion.sigma, p.force, 1.0) / p.mass,
                       mrp_rates(motion.sigma, motion.omega), omega_dot, torque / p.wheel_inertia - p.axes @ omega_dot)


@kernel
def body_update(t_ns, p, x, command):
    motion = rk4(body_rates, (p, command.torque), 0.0, Motion(x.position, x.velocity, x.sigma, x.omega), p.period)
    x.position, x.velocity, x.sigma, x.omega = motion.position, motion.velocity, short_way(motion.sigma), motion.omega


@kernel
def wheel_update(t_ns, p, x, command):
    motion = rk4(wheel_rates, (p, command.torque), 0.0,
                 WheelMotion(x.position, x.velocity, x.sigma, x.omega, x.wheel_speeds), p.period)
    x.position, x.velocity, x.sigma, x.omega = motion.position, motion.velocity, short_way(motion.sigma), motion.omega
    x.wheel_speeds = motion.wheel_speeds


class Body(Component):
    """A rigid body under torques."""

    parameters, state = BodyParameters, BodyState
    inputs, outputs = {"command": TORQUE}, {"truth": TRUTH}
    rate_hz = 100.0
    start, output, update = body_start, body_output, body_update


class BodyWithWheels(Component):
    """A rigid body with three balanced reaction wheels."""

    parameters, state = WheelParameters, WheelState
    inputs, outputs = {"command": MOTOR_TORQUE}, {"truth": TRUTH, "wheels": WHEEL_SPEEDS}
    rate_hz = 100.0
    start, output, update = wheel_start, wheel_output, wheel_update


# -- flight software ---------------------------------------------------------------------------------------------------
@kernel
def navigate(t_ns, p, x, truth, attitude):
    attitude.sigma, attitude.omega = truth.sigma, truth.omega


class Navigation(Component):
    """The true attitude as the estimated one."""

    inputs, outputs = {"truth": TRUTH}, {"attitude": ATTITUDE}
    rate_hz = 100.0
    kernel = navigate


class ReferenceParameters(Parameters):
    sigma: Vec3 = field(0.0, unit="1", doc="MRP to point at")


@kernel
def refer(t_ns, p, x, reference):
    reference.sigma, reference.omega, reference.omega_dot = p.sigma, same(0.0), same(0.0)


class Reference(Component):
    """An inertially fixed attitude."""

    parameters, outputs = ReferenceParameters, {"reference": REFERENCE}
    rate_hz = 100.0
    kernel = refer


@kernel
def track(t_ns, p, x, attitude, reference, error):
    error.sigma = mrp_difference(attitude.sigma, reference.sigma)
    error.reference_omega = turned(attitude.sigma, reference.omega, -1.0)
    error.reference_omega_dot = turned(attitude.sigma, reference.omega_dot, -1.0)
    error.omega = attitude.omega - error.reference_omega


class Tracking(Component):
    """The error of the attitude."""

    inputs, outputs = {"attitude": ATTITUDE, "reference": REFERENCE}, {"error": ERROR}
    rate_hz = 100.0
    kernel = track


class FeedbackParameters(Parameters):
    k: float = field(3.5, unit="N m", gt=0, doc="gain on the MRP error")
    p: float = field(30.0, unit="N m s", gt=0, doc="gain on the rate error")
    inertia: Mat3 = field((900, 0, 0, 0, 800, 0, 0, 0, 600), unit="kg m^2")
    disturbance: Vec3 = field(0.0, unit="N m", doc="known torque on the body")


class WheelFeedbackParameters(FeedbackParameters):
    axes: Mat3 = field((1, 0, 0, 0, 1, 0, 0, 0, 1), unit="1", doc="spin axes of the wheels, one a row")
    wheel_inertia: float = field(0.16, unit="kg m^2", gt=0, doc="of each wheel about its axis")


@kernel
def demanded(p, error, momentum):
    """Torque on the body [N m]; momentum: of body and wheels [N m s]."""
    rates = error.reference_omega
    wanted = cross(error.omega + rates, rates) - error.reference_omega_dot
    return -(p.k * error.sigma + p.p * error.omega - cross(rates, momentum) + p.inertia @ wanted + p.disturbance)


@kernel
def feed_back(t_ns, p, x, error, command):
    command.torque = demanded(p, error, p.inertia @ (error.omega + error.reference_omega))


@kernel
def feed_back_with_wheels(t_ns, p, x, error, wheels, command):
    omega = error.omega + error.reference_omega
    spin = p.wheel_inertia * (p.axes @ omega + wheels.speeds)
    command.torque = demanded(p, error, p.inertia @ omega + transpose(p.axes) @ spin)


class Feedback(Component):
    """MRP feedback."""

    parameters = FeedbackParameters
    inputs, outputs = {"error": ERROR}, {"command": TORQUE}
    rate_hz = 100.0
    kernel = feed_back


class FeedbackWithWheels(Component):
    """MRP feedback that knows the wheels' momentum."""

    parameters = WheelFeedbackParameters
    inputs, outputs = {"error": ERROR, "wheels": WHEEL_SPEEDS}, {"command": TORQUE}
    rate_hz = 100.0
    kernel = feed_back_with_wheels


class AllocationParameters(Parameters):
    axes: Mat3 = field((1, 0, 0, 0, 1, 0, 0, 0, 1), unit="1", doc="spin axes of the wheels, one a row")


@kernel
def allocate(t_ns, p, x, torque, motors):
    motors.torque = p.axes @ (inverse(transpose(p.axes) @ p.axes) @ (-torque.torque))


class Allocation(Component):
    """The wheels' torques of least norm."""

    parameters = AllocationParameters
    inputs, outputs = {"torque": TORQUE}, {"motors": MOTOR_TORQUE}
    rate_hz = 100.0
    kernel = allocate
