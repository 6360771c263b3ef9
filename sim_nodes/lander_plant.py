"""The lander near a rotating small body as a component: truth, contact trigger, and the tally of the landing.

Equations of motion: `sim_nodes.lander_dynamics`. At the contact trigger (z_D <= contact_height within contact_radius)
the state is held to the end of the run, and the truth says so.
"""

import math
from types import SimpleNamespace

import numpy as np

from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.kernel import kernel, plain
from flight_graph.timebase import SECOND
from lander_ros.feed_forward import site_in_landing_frame
from lander_ros.landing_checks import require_vehicle
from lander_ros.twistor import unit_quaternion
from msg_schemas import lander
from msg_schemas.definitions import TYPESTORE
from sim_nodes import lander_start
from sim_nodes.ellipsoid_gravity import EROS_LIKE_SPIN, Ellipsoid, ellipsoid_gravity, ellipsoid_site
from sim_nodes.lander_descent import watched
from sim_nodes.lander_dynamics import ELLIPSOID, body_velocity, touched_down
from sim_nodes.lander_site import prepare_site
from sim_nodes.lander_thrusters import apply_thrusters

REFERENCE = "reference scenario (ours)"


class LanderPlantParameters(lander_start.LanderStart):
    mass: float = field(500.0, unit="kg", gt=0, source=REFERENCE, doc="mass at the start")
    inertia: Array(3, 3) = field([[120.0, 2.0, -3.0], [2.0, 100.0, 1.5], [-3.0, 1.5, 140.0]], unit="kg m^2",
                                 source=REFERENCE, doc="J in B, constant")
    semi_axes: Vec3 = field((17740.0, 6470.0, 5300.0), unit="m", gt=0, source=REFERENCE, doc="of the ellipsoid")
    mu: float = field(446300.0, unit="m^3/s^2", gt=0, source=REFERENCE, doc="gravitational parameter of the body")
    body_spin: float = field(EROS_LIKE_SPIN, unit="rad/s", source=REFERENCE, doc="about z_A")
    site_latitude: float = field(math.radians(25.0), unit="rad", gt=-0.5 * math.pi, lt=0.5 * math.pi,
                                 source=REFERENCE, doc="parametric latitude of the mark on the ellipsoid")
    site_longitude: float = field(math.radians(40.0), unit="rad", source=REFERENCE, doc="parametric longitude")
    site_height: float = field(1.5, unit="m", source=REFERENCE, doc="of the goal above the ground, along its normal")
    goal_position: Vec3 = field(0.0, unit="m", doc="rho_D in D; worked out from the site: a law may refer to it")
    goal_spin: Vec3 = field(0.0, unit="rad/s", doc="w_D, the body's spin in D; worked out from the site")
    goal_gravity: float = field(0.0, unit="m/s^2", doc="|g| at the goal; worked out from the site")
    gravity_gradient: bool = field(False, doc="torque of the central field's gradient")
    force_limit: float = field(40.0, unit="N", gt=0, source=REFERENCE, doc="of the thrusters, per body axis")
    torque_limit: float = field(10.0, unit="N m", gt=0, source=REFERENCE, doc="of the thrusters, per body axis")
    force_impulse_bit: float = field(0.0, unit="N s", ge=0, doc="smallest impulse of a step, per axis; 0: ideal")
    torque_impulse_bit: float = field(0.0, unit="N m s", ge=0, doc="smallest angular impulse of a step, per axis")
    specific_impulse: float = field(0.0, unit="s", ge=0, doc="0: the mass is constant")
    torque_arm: float = field(0.0, unit="m", ge=0, doc="lever of the torque thrusters; 0: torque costs no propellant")
    contact_height: float = field(0.1, unit="m", source=REFERENCE, doc="z_td: contact where z_D is not above it")
    contact_radius: float = field(20.0, unit="m", gt=0, source=REFERENCE, doc="and |r| is below this")
    view_half_angle: float = field(math.radians(30.0), unit="rad", gt=0, lt=math.pi, source=REFERENCE,
                                   doc="of the view cone, for the tally")
    clearance_range: float = field(20.0, unit="m", ge=0, source=REFERENCE, doc="clearance_min is taken beyond")
    view_range: float = field(5.0, unit="m", ge=0, source=REFERENCE, doc="view_max is taken beyond")
    largest_step: float = field(0.2, unit="s", gt=0, doc="Runge-Kutta steps are no longer than this")


class LanderPlantState(State):
    motion: Array(14)
    inertia: Array(3, 3)
    site_rotation: Array(3, 3)
    site_position: Vec3
    spin: float
    gravity_gradient_mu: float
    site_orientation: Array(4)
    force: Vec3
    torque: Vec3
    gravity: Vec3
    specific_force: Vec3
    matrix: Array(3, 3)
    work: Array(3, 14)
    quaternions: Array(4, 4)
    velocity: Vec3
    landed: bool
    flown: float
    clearance: float
    view_angle: float
    clearance_min: float = 1e9
    clearance_min_time: float
    clearance_min_all: float = 1e9
    view_max: float
    clearance_violation: float
    view_violation: float
    delta_v: float
    torque_impulse: float
    force_peak: float
    torque_peak: float
    speed_max: float
    saturated: float


@kernel
def length(vector):
    """|vector| of three components."""
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@kernel
def tally(p, x, dt):
    """What a step of dt [s] from the state costs, under the delivered wrench."""
    if x.clearance < 0.0:
        x.clearance_violation += dt
    if x.view_angle > p.view_half_angle and length(x.motion) > p.view_range:
        x.view_violation += dt
    x.delta_v += dt / x.motion[13] * length(x.force)
    x.torque_impulse += dt * length(x.torque)
    limited = False
    for i in range(3):
        x.force_peak = max(x.force_peak, abs(x.force[i]))
        x.torque_peak = max(x.torque_peak, abs(x.torque[i]))
        limited = limited or abs(x.force[i]) >= p.force_limit or abs(x.torque[i]) >= p.torque_limit
    if limited:
        x.saturated += dt


def moving(prepare, dynamics):
    """The kernels `start` and `update` of a plant: ``prepare(p, x)`` places the site, `Dynamics` move the state."""
    site_gravity, hold_step = dynamics.site_gravity, dynamics.hold_step

    @kernel
    def look(p, x):
        """Gravity, clearance and view angle of the state, and their extremes."""
        site_gravity(p, x, x.motion, x.gravity)
        x.clearance, x.view_angle = watched(p, x.motion, x.matrix)
        distance = length(x.motion)
        if distance > p.clearance_range and x.clearance < x.clearance_min:
            x.clearance_min = x.clearance
            x.clearance_min_time = x.flown
        x.clearance_min_all = min(x.clearance_min_all, x.clearance)
        if distance > p.view_range:
            x.view_max = max(x.view_max, x.view_angle)
        x.speed_max = max(x.speed_max, length(x.motion[3:6]))

    @kernel
    def start(p, x):
        prepare(p, x)
        for i in range(3):
            for j in range(3):
                x.inertia[i, j] = p.inertia[i, j]
        x.gravity_gradient_mu = p.mu if p.gravity_gradient else 0.0
        lander_start.place(p, x.motion, x.quaternions)
        x.motion[13] = p.mass
        look(p, x)

    @kernel
    def update(t_ns, p, x, command):
        """One period under the wrench that the thrusters make of the command, held."""
        if x.landed:
            return
        flow = apply_thrusters(p, command.wrench.force, command.wrench.torque, p.period, x.force, x.torque)
        substeps = int(math.ceil(p.period / p.largest_step - 1e-9))
        dt = p.period / substeps
        for step in range(substeps):
            tally(p, x, dt)
            hold_step(p, x, x.motion, x.force, x.torque, flow, dt, x.matrix, x.work)
            x.flown = (t_ns + (step + 1) * (p.period * SECOND) / substeps) / SECOND
            look(p, x)
            if touched_down(x.motion, p.contact_height, p.contact_radius):
                x.landed = True
                break
        for i in range(3):
            x.specific_force[i] = x.force[i] / x.motion[13]

    return start, update


@kernel
def output(t_ns, p, x, truth, odometry, summary, pose, goal):
    body_velocity(x.motion, x.matrix, x.velocity)
    matrix = x.matrix
    spin_x = x.spin * x.site_rotation[2, 0]
    spin_y = x.spin * x.site_rotation[2, 1]
    spin_z = x.spin * x.site_rotation[2, 2]
    for i in range(3):
        truth.site_position[i] = x.motion[i]
        truth.site_velocity[i] = x.motion[3 + i]
        truth.rates[i] = x.motion[10 + i]
        truth.inertial_rates[i] = x.motion[10 + i] + (
            matrix[0, i] * spin_x + matrix[1, i] * spin_y + matrix[2, i] * spin_z)
        truth.specific_force[i] = x.specific_force[i]
        truth.gravity[i] = x.gravity[i]
        truth.force[i] = x.force[i]
        truth.torque[i] = x.torque[i]
        odometry.pose.pose.position[i] = x.motion[i]
        odometry.twist.twist.linear[i] = x.velocity[i]
        odometry.twist.twist.angular[i] = x.motion[10 + i]
        pose.pose.position[i] = x.motion[i]
        goal.pose.position[i] = x.site_position[i]
    for i in range(4):
        truth.attitude[i] = x.motion[6 + i]
        odometry.pose.pose.orientation[i] = x.motion[6 + i]
        pose.pose.orientation[i] = x.motion[6 + i]
        goal.pose.orientation[i] = x.site_orientation[i]
    truth.mass = x.motion[13]
    truth.clearance = x.clearance
    truth.view_angle = x.view_angle
    truth.landed = 1.0 if x.landed else 0.0
    summarise(p, x, summary)


@kernel
def summarise(p, x, summary):
    summary.landed = 1.0 if x.landed else 0.0
    summary.time = x.flown
    summary.lateral = math.sqrt(x.motion[0] * x.motion[0] + x.motion[1] * x.motion[1])
    summary.speed = length(x.motion[3:6])
    turn = length(x.motion[6:9])
    summary.attitude_error = 2.0 * math.atan2(turn, abs(x.motion[9]))
    summary.rate = length(x.motion[10:13])
    summary.clearance_min = x.clearance_min
    summary.clearance_min_time = x.clearance_min_time
    summary.clearance_min_all = x.clearance_min_all
    summary.view_max = x.view_max
    summary.clearance_violation = x.clearance_violation
    summary.view_violation = x.view_violation
    summary.delta_v = x.delta_v
    summary.torque_impulse = x.torque_impulse
    summary.force_peak = x.force_peak
    summary.torque_peak = x.torque_peak
    summary.speed_max = x.speed_max
    summary.saturated = x.saturated
    summary.propellant = p.mass - x.motion[13]


def transform(record, parent, child):
    """A stamped pose as a TFMessage parent -> child."""
    types = TYPESTORE.types
    time = types["builtin_interfaces/msg/Time"](int(record.header.stamp.sec), int(record.header.stamp.nanosec))
    pose = record.pose
    return types["tf2_msgs/msg/TFMessage"]([types["geometry_msgs/msg/TransformStamped"](
        types["std_msgs/msg/Header"](time, parent), child, types["geometry_msgs/msg/Transform"](
            types["geometry_msgs/msg/Vector3"](*map(float, pose.position)),
            types["geometry_msgs/msg/Quaternion"](*map(float, pose.orientation))))])


def craft_transform(record):
    """landing_site -> base_link."""
    return transform(record, lander.SITE, lander.BASE)


def site_transform(record):
    """asteroid -> landing_site."""
    return transform(record, lander.ASTEROID, lander.SITE)


class LanderPlant(Component):
    """The lander near a rotating ellipsoid: rigid body, thruster limits, contact trigger."""

    parameters, state = LanderPlantParameters, LanderPlantState
    inputs = {"command": lander.COMMAND}
    outputs = {"truth": lander.TRUTH, "odometry": lander.TRUTH_ODOMETRY, "summary": lander.SUMMARY,
               "pose": lander.TRUTH_POSE, "goal": lander.GOAL}
    output_rate_hz = {"summary": 1.0, "pose": 10.0, "goal": 1.0}
    rate_hz = 10.0
    start, update = moving(prepare_site, ELLIPSOID)
    output = output
    formatted = (Formatted("tf", "tf2_msgs/msg/TFMessage", "pose", craft_transform),
                 Formatted("tf", "tf2_msgs/msg/TFMessage", "goal", site_transform))

    @classmethod
    def resolve(cls, values, where, folder=None):
        """A random start replaces the start_ values; the goal_ values follow from body and site."""
        if values["draw_seed"] >= 0:
            values = {**values, **lander_start.drawn(values["draw_seed"])}
        position, rotation, gravity = cls.site(values, where)
        goal, spin = site_in_landing_frame(rotation, position, values["body_spin"])
        return {**values, "goal_position": goal.tolist(), "goal_spin": [float(part) for part in spin],
                "goal_gravity": math.sqrt(sum(part * part for part in gravity))}

    @classmethod
    def site(cls, values, where):
        """rho (3,) [m] in A, R_AD (3, 3) and g^A (3) [m/s^2] of the goal."""
        try:
            position, rotation = ellipsoid_site(
                values["semi_axes"], values["site_latitude"], values["site_longitude"], values["site_height"])
        except FlightError as error:
            raise FlightError(f"{where}.site_height: {error}") from None
        body = Ellipsoid(values["mu"], np.array(values["semi_axes"]))
        return position, rotation, plain(ellipsoid_gravity)(body, *map(float, position))

    @classmethod
    def check(cls, values, where):
        p = SimpleNamespace(**values)
        require_vehicle(p, where)
        try:
            unit_quaternion(values["start_orientation"])
        except FlightError as error:
            raise FlightError(f"{where}.start_orientation: {error}") from None
        if p.start_at == "position" and not np.any(values["start_position"]):
            raise FlightError(f"{where}.start_position: the goal itself is no start")
