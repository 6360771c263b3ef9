"""The Cubli rover as a rigid body with wheels on real ground: it stands on a corner, slides, flies, lands or falls.

Beyond the paper's model (Aerospace 2022, 9(11), 728): inertia about the corner, gyroscopic torque, wheel momentum,
tilted ground, the force that holds the corner, and what follows when the ground cannot give it. Equations:
`sim_nodes.cubli_dynamics` (standing) and `sim_nodes.cubli_contact` (sliding, flying).

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

from cubli_ros.attitude import (
    cardan_from_quaternion,
    invert_3x3,
    quaternion_from_cardan,
    quaternion_multiply,
    quaternion_to_balance,
    quaternion_to_body,
    rotation_matrix,
)
from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, Choice, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.kernel import kernel, plain
from flight_graph.timebase import SECOND
from msg_schemas import cubli
from sim_nodes import cubli_contact, cubli_dynamics
from sim_nodes.cubli_contact_events import (
    ENDED,
    FLYING,
    LOST,
    SLIDING,
    STANDING,
    advance,
    events,
    standing_force,
    touch,
)
from sim_nodes.cubli_plant import SITE_FROM_BALANCE, RoverParameters, transform
from sim_nodes.gravity.parameters import SiteParameters, resolve_site
from sim_nodes.reaction_wheels import deliverable_torque


class PhysicalPlantParameters(RoverParameters, SiteParameters):
    mass: float = field(2.0, unit="kg", gt=0, source="section 5", doc="mass, wheels included")
    length: float = field(0.2, unit="m", gt=0, source="section 5", doc="edge of the cube")
    friction: float = field(0.6, unit="1", gt=0, doc="friction coefficient of the ground")
    on_lift_off: Choice("fly", "hold") = field(
        "fly", doc="where the ground would have to pull: fly, or stay as if glued")
    on_slip: Choice("hold", "slide") = field("hold", doc="when friction does not suffice: stay all the same, or slide")
    initial_wheel_speed: Vec3 = field(0.0, unit="rad/s", doc="wheel speeds at the start")
    disturbance_amplitude: Vec3 = field(0.02, unit="rad/s^2", ge=0, source="eq. (42)",
                                        doc="of each axis; acts as a torque of m l^2 / 6 times this")


class PhysicalPlantState(State):
    """motion: see `sim_nodes.cubli_contact`; normal, slide, anchor, force: site frame; the rest: scratch, telemetry."""

    motion: Array(16)
    mode: int
    flown: bool
    theta: Array(3, 3)
    inverse: Array(3, 3)
    push_amplitude: Vec3
    push: Vec3
    gravity: Vec3
    normal: Vec3
    slide: Vec3
    anchor: Vec3
    force: Vec3
    torque: Vec3
    accelerations: Vec3
    angles: Vec3
    quaternion: Array(4)
    position: Vec3
    velocity: Vec3
    rates: Array(16)
    work: Array(4, 16)
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
def start(p, x):
    for i in range(3):
        x.motion[4 + i] = p.initial_rates[i]
        x.motion[7 + i] = p.initial_wheel_speed[i]
        x.push_amplitude[i] = p.disturbance_amplitude[i] * p.mass * p.length * p.length / 6.0
        x.gravity[i] = -p.gravity / math.sqrt(3.0)
        for j in range(3):
            x.theta[i, j] = -0.25 * p.mass * p.length * p.length
        x.theta[i, i] += 11.0 / 12.0 * p.mass * p.length * p.length
    for i in range(3):
        x.theta[i, i] -= p.wheel_inertia
    invert_3x3(x.theta, x.inverse)
    for i in range(3):
        x.theta[i, i] += p.wheel_inertia
    quaternion_from_cardan(p.initial_angles, x.motion)
    x.normal[0] = math.sin(p.tilt) * math.cos(p.azimuth)
    x.normal[1] = math.sin(p.tilt) * math.sin(p.azimuth)
    x.normal[2] = math.cos(p.tilt)
    cubli_contact.stand_at(x.motion, p.length, x.anchor, x.quaternion)
    x.normal_force = math.cos(p.tilt)
    x.friction_ratio = math.tan(p.tilt)
    x.force[2] = p.mass * p.gravity
    cubli_dynamics.disturbance(0.0, x.push_amplitude, p.disturbance_frequency, p.disturbance_phase, x.push)
    standing_force(p, x)


@kernel
def update(t_ns, p, x, command):
    """One period under the wheels' torque: clipped to what they can deliver, held."""
    if x.mode == ENDED:
        return
    x.normal_force = LOST
    x.friction_ratio = 0.0
    deliverable_torque(command.effort, x.motion[7:10], p.torque_limit, p.speed_limit, p.wheel_inertia, p.period,
                       x.torque)
    substeps = int(math.ceil(p.period / p.largest_step - 1e-9))
    h = p.period / substeps
    t = t_ns / SECOND
    for step in range(substeps + 1):
        if x.mode != ENDED:
            events(t + step * h, p, x)
        if x.mode != ENDED and step < substeps:
            advance(t + step * h, h, p, x)
            touch(t + (step + 1) * h, p, x)


@kernel
def output(t_ns, p, x, truth, contact, attitude, wheels, pose):
    cardan_from_quaternion(x.motion, x.angles)
    quaternion_multiply(SITE_FROM_BALANCE, x.motion, pose.pose.orientation)
    g_x, g_y, g_z = quaternion_to_body(pose.pose.orientation, 0.0, 0.0, -p.gravity)
    truth.gravity[0] = g_x
    truth.gravity[1] = g_y
    truth.gravity[2] = g_z
    inertia = p.mass * p.length * p.length / 6.0
    for i in range(3):
        truth.angles[i] = x.angles[i]
        truth.rates[i] = x.motion[4 + i]
        truth.accelerations[i] = x.accelerations[i]
        truth.wheel_speed[i] = x.motion[7 + i]
        truth.torque[i] = x.torque[i]
        truth.disturbance[i] = x.push[i] / inertia
        attitude.angular_velocity[i] = x.motion[4 + i]
        wheels.velocity[i] = x.motion[7 + i]
        wheels.effort[i] = x.torque[i]
        pose.pose.position[i] = x.motion[10 + i]
    for i in range(4):
        attitude.orientation[i] = x.motion[i]
    report(p, x, contact)


@kernel
def report(p, x, contact):
    contact.phase = 0.0
    if x.mode == FLYING:
        contact.phase = 1.0
    elif x.mode == ENDED:
        contact.phase = 2.0
    contact.sliding = 1.0 if x.mode == SLIDING else 0.0
    contact.slipping = 1.0 if x.slipping and x.mode == STANDING else 0.0
    contact.normal_force = x.normal_force
    contact.friction_ratio = x.friction_ratio
    contact.slip_time = x.slip_time
    contact.lift_off_time = x.lift_off_time
    contact.end_time = x.end_time
    contact.outcome = float(x.outcome)
    contact.touching_corner = float(x.touching_corner)
    contact.touching_speed = x.touching_speed
    cubli_contact.corner_motion(x.motion, p.length, 0, x.quaternion, x.position, x.velocity)
    quaternion_multiply(SITE_FROM_BALANCE, x.motion, x.quaternion)
    f_x, f_y, f_z = quaternion_to_body(x.quaternion, x.force[0], x.force[1], x.force[2])
    contact.specific_force[0] = f_x / p.mass
    contact.specific_force[1] = f_y / p.mass
    contact.specific_force[2] = f_z / p.mass
    for i in range(3):
        contact.force[i] = x.force[i]
        contact.corner[i] = x.position[i]
        contact.corner_velocity[i] = x.velocity[i]
        contact.centre[i] = x.motion[10 + i]
        contact.centre_velocity[i] = x.motion[13 + i]


class CubliPhysicalPlant(Component):
    """The Cubli rover with wheels and full inertia on tilted ground: contact, slip, lift-off and flight."""

    parameters, state = PhysicalPlantParameters, PhysicalPlantState
    inputs = {"command": cubli.COMMAND}
    outputs = {"truth": cubli.TRUTH, "contact": cubli.TRUTH_CONTACT, "attitude": cubli.TRUTH_ATTITUDE,
               "wheels": cubli.WHEEL_STATE, "pose": cubli.TRUTH_POSE}
    output_rate_hz = {"pose": 10.0}
    rate_hz = 100.0
    start, output, update = start, output, update
    formatted = (Formatted("tf", "tf2_msgs/msg/TFMessage", "pose", transform),)
    resolve = staticmethod(resolve_site)

    @classmethod
    def check(cls, values, where):
        """The wheels must turn more easily than the whole, and only the corner may touch the ground at the start."""
        largest = values["mass"] * values["length"] ** 2 / 6.0
        if values["wheel_inertia"] >= largest:
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
    turn = np.zeros((3, 3))
    plain(rotation_matrix)(values["initial_angles"], turn)
    tilt, azimuth = values["tilt"], values["azimuth"]
    normal = np.array([math.sin(tilt) * math.cos(azimuth), math.sin(tilt) * math.sin(azimuth), math.cos(tilt)])
    corners = [values["length"] * np.array([corner & 1, corner >> 1 & 1, corner >> 2 & 1]) for corner in range(8)]
    return [float(normal @ plain(quaternion_to_balance)(SITE_FROM_BALANCE, *(turn.T @ arm))) for arm in corners]
