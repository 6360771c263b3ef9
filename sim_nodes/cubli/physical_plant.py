"""The Cubli rover as a rigid body with wheels on real ground: it stands on a corner, slides, flies, lands or falls.

Beyond the paper's model (Aerospace 2022, 9(11), 728): inertia about the corner, gyroscopic torque, wheel momentum,
tilted ground, the force that holds the corner, and what follows when the ground cannot give it. Equations:
`sim_nodes.cubli.dynamics` (standing) and `sim_nodes.cubli.contact` (sliding, flying).

Events, looked for at every Runge-Kutta step:

* The force on the standing corner leaves the friction cone. It is flagged (`slipping`, `slip_time`). With on_slip:
  hold the corner stays where it is all the same; with on_slip: slide it slides with the friction coefficient, until it
  stops.
* The ground would have to pull. With on_lift_off: fly the corner is let go: a free rigid body flies, in the site's
  gravity with its gradient and Coriolis acceleration. (Where the corner, let go, would move into the ground, it
  slides: a force without pressure has no friction.) With on_lift_off: hold the corner is held as if glued, as in the
  paper's model.
* A corner touches the ground: the corner it took off from or another one after a flight (landed), another corner
  without a flight (fell). That decides the run: the state stays as it was at the touch, and the outcome stands in
  `cubli/truth/contact`. Impacts are not modelled.
"""

import math

import numpy as np

from cubli_ros.attitude import cardan_from_quaternion, quaternion_from_cardan
from flight_graph.components.component import Component
from flight_graph.components.placement import TrueMotion
from flight_graph.components.records import Choice, Mat3, field
from flight_graph.errors import FlightError
from flight_graph.timebase import SECOND
from flight_math import Quaternion, Vec3, kernel, plain, rotate, rotate_back, same, sincos
from msg_schemas import cubli
from sim_nodes.cubli import contact, dynamics
from sim_nodes.cubli.contact_events import (
    ENDED,
    FLYING,
    LOST,
    SLIDING,
    STANDING,
    advance,
    events,
    motion_of,
    standing_force,
    touch,
)
from sim_nodes.cubli.plant import (
    FRAMES,
    SITE_FROM_BALANCE,
    RoverParameters,
    WheelDrive,
    balance_attitude,
    body_rates,
    require_inertia,
    write_frames,
)
from sim_nodes.cubli.reaction_wheels import wheel_torque
from sim_nodes.cubli.scene import scene
from sim_nodes.gravity.parameters import SiteParameters, resolve_site
from sim_nodes.sensors.inertial import UNKNOWN

DECIDED, IN_GROUND = 1, 2


class PhysicalPlantParameters(RoverParameters, SiteParameters):
    mass: float = field(2.0, unit="kg", gt=0, source="section 5", doc="mass, wheels included")
    length: float = field(0.2, unit="m", gt=0, source="section 5", doc="edge of the cube")
    body_inertia: Mat3 = field(0.0, unit="kg m^2", doc=(
        "about the centre, wheels included, as a full matrix; 0: that of a solid cube, m l^2 / 6"))
    friction: float = field(0.6, unit="1", gt=0, doc="friction coefficient of the ground")
    on_lift_off: Choice("fly", "hold") = field(
        "fly", doc="where the ground would have to pull: fly, or stay as if glued")
    on_slip: Choice("hold", "slide") = field("hold", doc="when friction does not suffice: stay all the same, or slide")
    initial_wheel_speed: Vec3 = field(0.0, unit="rad/s", doc="wheel speeds at the start")
    disturbance_amplitude: Vec3 = field(0.02, unit="rad/s^2", ge=0, source="eq. (42)",
                                        doc="of each axis; acts as a torque of the inertia about the centre times this")


class PhysicalPlantState(WheelDrive):
    """Motion as in `sim_nodes.cubli.contact`; slide, anchor, force: site frame; extremes and events for the messages."""

    attitude: Quaternion
    rates: Vec3
    wheel_speed: Vec3
    centre: Vec3
    centre_velocity: Vec3
    mode: int
    flown: bool
    slide: Vec3
    anchor: Vec3
    torque: Vec3
    disturbance: Vec3
    accelerations: Vec3
    force: Vec3
    normal_force: float
    friction_ratio: float
    slipping: bool
    slip_time: float = -1.0
    lift_off_time: float = -1.0
    end_time: float = -1.0
    outcome: int
    touching_corner: int = -1
    touching_speed: float


@kernel
def ground_normal(p):
    """Unit normal of the ground, site frame."""
    sin_tilt, cos_tilt = sincos(p.tilt)
    sin_azimuth, cos_azimuth = sincos(p.azimuth)
    return Vec3(sin_tilt * cos_azimuth, sin_tilt * sin_azimuth, cos_tilt)


@kernel
def start(p, x):
    x.attitude, x.rates = quaternion_from_cardan(p.initial_angles), p.initial_rates
    x.wheel_speed = p.initial_wheel_speed
    x.centre, x.centre_velocity = contact.standing_at(p, x.attitude, x.rates, x.anchor)
    x.disturbance = dynamics.disturbance(p, 0.0)
    sin_tilt, cos_tilt = sincos(p.tilt)
    x.normal_force, x.friction_ratio = cos_tilt, sin_tilt / cos_tilt
    x.force = standing_force(p, x)


@kernel
def place(p, x, placement):
    """Attitude and rates, the wheels' speeds as they are. On the ground the corner stands where it is, in flight the centre
    is put too.
    """
    if x.mode == ENDED:
        x.fault = DECIDED
        return
    if x.mode == SLIDING:
        x.anchor, _ = contact.corner_motion(p, 0, motion_of(x))
        x.mode = STANDING
    if placement.sets_orientation:
        x.attitude = balance_attitude(placement.orientation)
    if placement.sets_angular_velocity:
        x.rates = body_rates(x.attitude, placement.angular_velocity)
    if x.mode == STANDING:
        x.centre, x.centre_velocity = contact.standing_at(p, x.attitude, x.rates, x.anchor)
        x.force = standing_force(p, x)
    else:
        if placement.sets_position:
            x.centre = placement.position
        if placement.sets_velocity:
            x.centre_velocity = placement.velocity
    normal = ground_normal(p)
    for corner in range(1 if x.mode == STANDING else 0, 8):
        position, _ = contact.corner_motion(p, corner, motion_of(x))
        if normal @ position < 0.0:
            x.fault = IN_GROUND


def motion(outputs) -> TrueMotion:
    """The motion of the centre in the site; accelerations: under what acted over the last interval, gravity's gradient and
    the turning of the site left out.
    """
    pose, truth, contact_now = outputs["pose"].pose, outputs["truth"], outputs["contact"]
    turn = Quaternion(*pose.orientation.tolist())
    rates, accelerations, gravity, force = (rotate(turn, Vec3(*numbers.tolist())) for numbers in (
        truth.rates, truth.accelerations, truth.gravity, contact_now.specific_force))
    return TrueMotion(pose.position.tolist(), pose.orientation.tolist(), contact_now.centre_velocity.tolist(),
                  *(list(one.parts()) for one in (rates, force + gravity, accelerations)))


@kernel
def update(t_ns, p, x, command, power):
    """One period under the wheels' torque: clipped to what they can deliver, held."""
    if x.mode == ENDED:
        return
    normal, t, speed = ground_normal(p), t_ns / SECOND, x.wheel_speed
    x.normal_force, x.friction_ratio = LOST, 0.0
    x.torque = wheel_torque(p, x, command, power.on if power.header.stamp.sec != 0 else same(1.0))
    substeps = math.ceil(p.period / p.largest_step - 1e-9)
    h = p.period / substeps
    for step in range(substeps + 1):
        if x.mode != ENDED:
            events(t + step * h, p, x, normal)
        if x.mode != ENDED and step < substeps:
            advance(t + step * h, h, p, x, normal)
            touch(t + (step + 1) * h, p, x, normal)
    x.wheel_angle = x.wheel_angle + 0.5 * p.period * (speed + x.wheel_speed)


@kernel
def output(t_ns, p, x, outputs):
    truth, attitude, wheels, pose = outputs.truth, outputs.attitude, outputs.wheels, outputs.pose.pose
    turned = SITE_FROM_BALANCE * x.attitude
    truth.angles, truth.rates, truth.accelerations = cardan_from_quaternion(x.attitude), x.rates, x.accelerations
    truth.wheel_speed, truth.torque, truth.disturbance = x.wheel_speed, x.torque, x.disturbance
    truth.gravity = rotate_back(turned, Vec3(0.0, 0.0, -p.gravity))
    attitude.orientation, attitude.angular_velocity = x.attitude, x.rates
    attitude.linear_acceleration_covariance = UNKNOWN
    wheels.velocity, wheels.effort = x.wheel_speed, x.torque
    pose.orientation, pose.position = turned, x.centre
    write_frames(x, x.centre, turned, outputs.frames)
    report(p, x, turned, outputs.contact)


@kernel
def report(p, x, turned, message):
    """State of the contact, its extremes since the last message, and what happened."""
    message.phase = 1.0 if x.mode == FLYING else 2.0 if x.mode == ENDED else 0.0
    message.sliding = x.mode == SLIDING
    message.slipping = x.slipping and x.mode == STANDING
    message.normal_force, message.friction_ratio = x.normal_force, x.friction_ratio
    message.slip_time, message.lift_off_time, message.end_time = x.slip_time, x.lift_off_time, x.end_time
    message.outcome, message.touching_corner, message.touching_speed = x.outcome, x.touching_corner, x.touching_speed
    message.corner, message.corner_velocity = contact.corner_motion(p, 0, motion_of(x))
    message.force, message.specific_force = x.force, rotate_back(turned, x.force) / p.mass
    message.centre, message.centre_velocity = x.centre, x.centre_velocity


class CubliPhysicalPlant(Component):
    """The Cubli rover with wheels and full inertia on tilted ground: contact, slip, lift-off and flight.

    Promises: what cubli_plant gives, with the force of the ground [N], slip, lift-off, flight and how it ended. Every
    event is looked for in each step of Runge-Kutta. A corner that touches the ground after a flight, or another corner,
    decides the run: the state stays.

    Bad input: a torque beyond the wheels' limits is clipped, a drive without power gives none, and with
    `command_timeout` one that hears nothing new gives none. A start with a corner in the ground, or an inertia that no
    body has, is refused before anything runs.
    """

    parameters, state = PhysicalPlantParameters, PhysicalPlantState
    inputs = {"command": cubli.COMMAND, "power": cubli.WHEEL_POWER}
    optional_inputs = ("power",)
    outputs = {"truth": cubli.TRUTH, "contact": cubli.TRUTH_CONTACT, "attitude": cubli.TRUTH_ATTITUDE,
               "wheels": cubli.WHEEL_STATE, "pose": cubli.TRUTH_POSE, "frames": cubli.TRUTH_FRAMES}
    output_rate_hz = {"pose": 10.0, "frames": 10.0}
    rate_hz = 100.0
    start, output, update, place = start, output, update, place
    formatted = FRAMES
    faults = {DECIDED: "it cannot be put elsewhere: its run is decided, and it stays as it touched the ground",
              IN_GROUND: "it was put with a corner in the ground"}
    resolve = staticmethod(resolve_site)

    @classmethod
    def motion(cls, outputs):
        return motion(outputs)

    @classmethod
    def scene(cls, values):
        return scene(values, SITE_FROM_BALANCE)

    @classmethod
    def check(cls, values, where):
        """The wheels must turn more easily than the whole, and only the corner may touch the ground at the start."""
        require_inertia(values["body_inertia"], f"{where}.body_inertia", values["wheel_inertia"])
        largest = values["mass"] * values["length"] ** 2 / 6.0
        if values["wheel_inertia"] >= largest and not np.any(values["body_inertia"]):
            raise FlightError(f"{where}.wheel_inertia: {values['wheel_inertia']} kg m^2 is not allowed; allowed: less "
                              f"than the cube's own m l^2 / 6 = {largest:.4g} kg m^2")
        heights = corner_heights(values)
        lowest = min(range(1, 8), key=lambda corner: heights[corner])
        if heights[lowest] < 0.0:
            raise FlightError(f"{where}.initial_angles: {values['initial_angles']} rad puts corner {lowest} of the "
                              f"cube {-heights[lowest]:.3g} m into the ground (tilt {values['tilt']:.3g} rad, azimuth "
                              f"{values['azimuth']:.3g} rad); lean the cube less")


def corner_heights(values) -> list[float]:
    """Heights [m] of the eight corners above the ground at the start, of parameters in plain form."""
    turn = SITE_FROM_BALANCE * plain(quaternion_from_cardan)(Vec3(*values["initial_angles"]))
    tilt, azimuth = values["tilt"], values["azimuth"]
    normal = Vec3(math.sin(tilt) * math.cos(azimuth), math.sin(tilt) * math.sin(azimuth), math.cos(tilt))
    corners = [values["length"] * Vec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1) for corner in range(8)]
    return [float(normal @ rotate(turn, arm)) for arm in corners]
