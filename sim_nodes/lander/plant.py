"""The lander near a rotating small body as a component: truth, contact trigger, and the tally of the landing.

Equations of motion: `sim_nodes.lander.dynamics`. At the contact trigger (z_D <= contact_height within contact_radius)
the state is held to the end of the run, and the truth says so.
"""

import math
from types import SimpleNamespace

from flight_graph.components.component import Component
from flight_graph.components.placement import TrueMotion
from flight_graph.components.records import field
from flight_graph.errors import FlightError
from flight_graph.scenes.messages import latched, moving
from flight_graph.scenes.scene import Pose, Sphere
from flight_graph.timebase import SECOND
from flight_math import Mat3, Quaternion, Vec3, kernel, norm, rotate, transpose, uncompiled
from lander_ros.feed_forward import site_in_landing_frame
from lander_ros.landing_checks import require_vehicle
from lander_ros.navigation_filter import spin_quaternion
from lander_ros.twistor import unit_quaternion
from msg_schemas import lander
from sim_nodes.gravity.ellipsoid import EROS_LIKE_SPIN, checked_ellipsoid_site, ellipsoid_gravity
from sim_nodes.lander import start as starts
from sim_nodes.lander.dynamics import ELLIPSOID, Motion, attitude_matrix, motor, site_spin, touched_down
from sim_nodes.lander.scene import scene
from sim_nodes.lander.site import SiteState, prepare_site, site_orientation
from sim_nodes.lander.tally import summarise, tally_place, tally_step
from sim_nodes.lander.thruster_failures import ThrusterFailures, Watchdog, watched_command
from sim_nodes.lander.thrusters import apply_thrusters

HELD, TOUCHES = 1, 2
REFERENCE = "reference scenario (ours)"


class LanderPlantParameters(starts.LanderStart, ThrusterFailures):
    mass: float = field(500.0, unit="kg", gt=0, source=REFERENCE, doc="mass at the start")
    inertia: Mat3 = field([[120.0, 2.0, -3.0], [2.0, 100.0, 1.5], [-3.0, 1.5, 140.0]], unit="kg m^2",
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


class LanderPlantState(SiteState, Watchdog):
    """Motion of the lander and the site it lands on; the wrench delivered over the last interval; gravity g^D at the
    position; the tally of the landing so far."""

    site_orientation: Quaternion
    position: Vec3
    velocity: Vec3
    attitude: Quaternion
    rates: Vec3
    mass: float
    force: Vec3
    torque: Vec3
    gravity: Vec3
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
def motion_of(x):
    """The motion in the state."""
    return Motion(x.position, x.velocity, x.attitude, x.rates, x.mass)


@kernel
def move_to(x, motion):
    """Put a motion into the state."""
    x.position, x.velocity, x.attitude = motion.position, motion.velocity, motion.attitude
    x.rates, x.mass = motion.rates, motion.mass


def motion_kernels(prepare, dynamics):
    """The kernels `start`, `update`, `place` of a plant: ``prepare(p, x)`` places the site, `Dynamics` move the state."""
    site_gravity, hold_step = dynamics.site_gravity, dynamics.hold_step

    @kernel
    def begin(p, x):
        prepare(p, x)
        x.site_orientation = site_orientation(x.site_rotation)
        move_to(x, starts.motion_at_start(p))
        x.gravity = site_gravity(p, x, x.position)
        tally_place(p, x)

    @kernel
    def update(t_ns, p, x, command):
        """One period under the wrench that the thrusters make of the command, held."""
        if x.landed:
            return
        wrench, flow = apply_thrusters(p, watched_command(p, x, command))
        x.force, x.torque = wrench.real, wrench.dual
        substeps = int(math.ceil(p.period / p.largest_step - 1e-9))
        dt = p.period / substeps
        for step in range(substeps):
            tally_step(p, x, dt)
            move_to(x, hold_step(p, x, motion_of(x), x.gravity, wrench, flow, dt))
            x.gravity = site_gravity(p, x, x.position)
            x.flown = (t_ns + (step + 1) * (p.period * SECOND) / substeps) / SECOND
            tally_place(p, x)
            if touched_down(p, x.position):
                x.landed = True
                break

    @kernel
    def place(p, x, placement):
        """Pose and twist relative to the site; the mass and the tally so far stay."""
        if x.landed:
            x.fault = HELD
            return
        if placement.sets_position:
            x.position = placement.position
        if placement.sets_velocity:
            x.velocity = placement.velocity
        if placement.sets_orientation:
            x.attitude = placement.orientation
        if placement.sets_angular_velocity:
            x.rates = transpose(attitude_matrix(x.attitude)) @ placement.angular_velocity
        if touched_down(p, x.position):
            x.fault = TOUCHES
            return
        x.gravity = site_gravity(p, x, x.position)
        tally_place(p, x)

    return begin, update, place


def motion(outputs) -> TrueMotion:
    """The motion of the centre of mass in the frame of the site, which turns with the body."""
    truth = outputs["truth"]
    rates = rotate(Quaternion(*truth.attitude.tolist()), Vec3(*truth.rates.tolist()))
    return TrueMotion(truth.site_position.tolist(), truth.attitude.tolist(), truth.site_velocity.tolist(),
                      list(rates.parts()))


@kernel
def output(t_ns, p, x, outputs):
    """Truth, the true odometry, the tally, and the poses of craft and goal."""
    truth, odometry = outputs.truth, outputs.odometry
    velocity = motor(motion_of(x))
    truth.site_position, truth.site_velocity, truth.attitude = x.position, x.velocity, x.attitude
    truth.rates = x.rates
    truth.inertial_rates = x.rates + transpose(attitude_matrix(x.attitude)) @ site_spin(p, x)
    truth.specific_force = x.force / x.mass
    truth.gravity, truth.force, truth.torque, truth.mass = x.gravity, x.force, x.torque, x.mass
    truth.clearance, truth.view_angle = x.clearance, x.view_angle
    truth.landed = 1.0 if x.landed else 0.0
    odometry.pose.pose.position, odometry.pose.pose.orientation = x.position, x.attitude
    odometry.twist.twist.linear, odometry.twist.twist.angular = velocity.dual, velocity.real
    outputs.pose.pose.position, outputs.pose.pose.orientation = x.position, x.attitude
    outputs.frames.position, outputs.frames.attitude = x.position, x.attitude
    outputs.frames.inertial = spin_quaternion(-p.goal_spin, t_ns / SECOND)
    outputs.goal.pose.position, outputs.goal.pose.orientation = x.site_position, x.site_orientation
    summarise(p, x, outputs.summary)


def poses(record, scene):
    """Where the craft is, and the inertial axes with their origin at the goal."""
    yield lander.BASE, Pose(tuple(record.position), tuple(record.attitude))
    yield lander.INERTIAL, Pose(orientation=tuple(record.inertial))


class LanderPlant(Component):
    """The lander near a rotating ellipsoid: rigid body, thruster limits, contact trigger.

    Promises: position [m] and velocity relative to the site in D, attitude, rates, gravity, delivered force and torque,
    the tally of the landing (clearance, view, velocity change), integrated by Runge-Kutta in steps of `largest_step` at
    most. At the contact trigger the state is held to the end of the run, and the truth says so.

    Bad input: forces and torques beyond the thrusters' limits are clipped, those below an impulse bit fall away. With
    `command_timeout` a command that is old counts as zero; without it the last one holds. A start at the goal itself,
    or with a quaternion that is none, is refused before anything runs.
    """

    parameters, state = LanderPlantParameters, LanderPlantState
    inputs = {"command": lander.COMMAND}
    outputs = {"truth": lander.TRUTH, "odometry": lander.TRUTH_ODOMETRY, "summary": lander.SUMMARY,
               "pose": lander.TRUTH_POSE, "goal": lander.GOAL, "frames": lander.TRUTH_FRAMES}
    output_rate_hz = {"summary": 1.0, "pose": 10.0, "goal": 1.0, "frames": 10.0}
    rate_hz = 10.0
    start, update, place = motion_kernels(prepare_site, ELLIPSOID)
    output = output
    faults = {HELD: "it cannot be put elsewhere: it has landed, and stays as it is",
              TOUCHES: "it was put where its contact trigger fires: not above contact_height, within contact_radius"}
    formatted = (*moving("frames", poses), *latched("frames"))

    @classmethod
    def resolve(cls, values, where, folder=None):
        """A random start replaces the start_ values; the goal_ values follow from body and site."""
        if values["draw_seed"] >= 0:
            values = {**values, **starts.drawn(values["draw_seed"])}
        position, rotation, gravity = cls.site(values, where)
        goal, spin = site_in_landing_frame(rotation, position, values["body_spin"])
        return {**values, "goal_position": list(goal.parts()), "goal_spin": list(spin.parts()),
                "goal_gravity": float(norm(gravity))}

    @classmethod
    def motion(cls, outputs):
        return motion(outputs)

    @classmethod
    def site(cls, values, where):
        """rho [m] in A, R_AD and g^A [m/s^2] of the goal."""
        p = SimpleNamespace(**{**values, "semi_axes": Vec3(*values["semi_axes"])})
        try:
            position, rotation = checked_ellipsoid_site(p)
        except FlightError as error:
            raise FlightError(f"{where}.site_height: {error}") from None
        return position, rotation, uncompiled(ellipsoid_gravity)(p, position)

    @classmethod
    def surface(cls, values):
        """The body as it looks, and the function that gives the distance [m] of its surface along a unit vector (3,)."""
        a, b, c = values["semi_axes"]

        def radius(d):
            x, y, z = d[0] / a, d[1] / b, d[2] / c
            return 1.0 / math.sqrt(x * x + y * y + z * z)
        return Sphere((a, b, c)), radius

    @classmethod
    def scene(cls, values):
        place, rotation, _ = cls.site(values, "scene")
        return scene(values, place, rotation, *cls.surface(values))

    @classmethod
    def check(cls, values, where):
        p = SimpleNamespace(**values)
        require_vehicle(p, where)
        try:
            unit_quaternion(values["start_orientation"])
        except FlightError as error:
            raise FlightError(f"{where}.start_orientation: {error}") from None
        if p.start_at == "position" and not any(p.start_position):
            raise FlightError(f"{where}.start_position: the goal itself is no start")
        if p.start_at == "position" and p.start_facing == "view":
            try:
                starts.require_approach(p.start_position)
            except FlightError as error:
                raise FlightError(f"{where}.start_position: {error}") from None
