"""The Cubli rover on its corner, by the paper's model: cube, gravity, disturbance, three reaction wheels.

Source: Aerospace 2022, 9(11), 728, equations (1)-(5), (42). The equations are in `sim_nodes.cubli.dynamics`.
"""

import math

import numpy as np

from cubli_ros.attitude import cardan_from_quaternion, level_gravity, quaternion_from_cardan
from flight_graph.components.component import Component, Formatted
from flight_graph.components.placement import TrueMotion
from flight_graph.components.records import Mat3, Parameters, State, field
from flight_graph.errors import FlightError
from flight_graph.scenes.messages import joint_states, latched, moving, turned_joint
from flight_graph.scenes.scene import Pose
from flight_graph.timebase import SECOND
from flight_math import Quaternion, Vec3, conjugate, cross, kernel, rotate, rotate_back, same
from msg_schemas import cubli
from msg_schemas.qos import Role
from sim_nodes.cubli import dynamics
from sim_nodes.cubli.reaction_wheels import spun, wheel_torque
from sim_nodes.cubli.scene import scene
from sim_nodes.sensors.inertial import UNKNOWN

# Quaternion x, y, z, w that turns balance-frame coordinates into the site frame: [1, 1, 1] / sqrt(3) goes up.
_HALF = 0.5 * math.acos(1.0 / math.sqrt(3.0))  # [rad]
SITE_FROM_BALANCE = Quaternion(math.sin(_HALF) / math.sqrt(2.0), -math.sin(_HALF) / math.sqrt(2.0), 0.0, math.cos(_HALF))


class RoverParameters(Parameters):
    """Start, disturbance and wheels: what every plant of the rover has."""

    initial_angles: Vec3 = field((-0.3, 0.3, 0.3), unit="rad", source="section 5", doc="Cardan angles at the start")
    initial_rates: Vec3 = field(0.0, unit="rad/s", doc="body rates at the start")
    disturbance_amplitude: Vec3 = field(0.02, unit="rad/s^2", ge=0, source="eq. (42)", doc="of each axis")
    disturbance_frequency: float = field(1.0, unit="rad/s", ge=0, source="eq. (42); not given there", doc="of all axes")
    disturbance_phase: Vec3 = field(0.0, unit="rad", doc="of each axis")
    torque_limit: float = field(0.02, unit="N m", gt=0, doc="each wheel's largest torque")
    speed_limit: float = field(628.0, unit="rad/s", gt=0, doc="each wheel's largest speed")
    wheel_inertia: float = field(1.0e-3, unit="kg m^2", gt=0, doc="of each wheel about its axis")
    wheel_effectiveness: Vec3 = field(1.0, unit="1", ge=0, le=2, doc="torque of each motor over what it is told")
    wheel_runaway: Vec3 = field(0.0, unit="N m", doc="torque that each drive gives whatever it is told; 0: none, it obeys")
    wheel_viscous: Vec3 = field(0.0, unit="N m s/rad", ge=0, doc="friction of each bearing over its speed")
    wheel_coulomb: Vec3 = field(0.0, unit="N m", ge=0, doc="dry friction of each bearing; it holds a wheel that stands")
    command_timeout: float = field(0.0, unit="s", ge=0, doc="without a new command for longer, no torque; 0: never")
    largest_step: float = field(1.0e-3, unit="s", gt=0, doc="Runge-Kutta steps are no longer than this")


class CubliPlantParameters(RoverParameters):
    mass: float = field(2.0, unit="kg", gt=0, source="section 5", doc="mass")
    length: float = field(0.2, unit="m", gt=0, source="section 5", doc="edge of the cube")
    gravity: float = field(0.002, unit="m/s^2", ge=0, source="section 5.2", doc="surface gravity, level ground")
    body_inertia: Mat3 = field(0.0, unit="kg m^2", doc="that moments turn, as a full matrix; 0: m l^2 / 6, as in the paper")
    gravity_sign: int = field(1, ge=-1, le=1, source="eq. (4)", doc="+1: inverted pendulum; -1: as printed (hanging)")


class WheelDrive(State):
    """Stamp of the last command that a drive heard, and for how long [s] it has not heard another; angles of the wheels
    since the start."""

    wheel_angle: Vec3
    command_sec: int
    command_nanosec: int
    command_silence: float


class CubliPlantState(WheelDrive):
    angles: Vec3
    rates: Vec3
    wheel_speed: Vec3
    torque: Vec3
    disturbance: Vec3


@kernel
def start(p, x):
    x.angles, x.rates = p.initial_angles, p.initial_rates
    x.disturbance = dynamics.disturbance(p, 0.0)


@kernel
def write_frames(x, position, orientation, frames):
    """Where the cube is, and how far its wheels have turned."""
    frames.position, frames.attitude = position, orientation
    frames.wheel_angle, frames.wheel_speed = x.wheel_angle, x.wheel_speed


@kernel
def output(t_ns, p, x, outputs):
    truth, attitude, wheels, pose = outputs.truth, outputs.attitude, outputs.wheels, outputs.pose
    orientation = quaternion_from_cardan(x.angles)
    gravity = rotate_back(orientation, level_gravity(p))
    truth.angles, truth.rates, truth.gravity = x.angles, x.rates, gravity
    truth.accelerations = dynamics.body_acceleration(p, gravity, x.rates, x.torque, x.disturbance)
    truth.wheel_speed, truth.torque, truth.disturbance = x.wheel_speed, x.torque, x.disturbance
    attitude.orientation, attitude.angular_velocity = orientation, x.rates
    attitude.linear_acceleration_covariance = UNKNOWN
    wheels.velocity, wheels.effort = x.wheel_speed, x.torque
    pose.pose.orientation = SITE_FROM_BALANCE * orientation
    pose.pose.position = rotate(pose.pose.orientation, same(0.5 * p.length))  # the centre
    write_frames(x, pose.pose.position, pose.pose.orientation, outputs.frames)


@kernel
def update(t_ns, p, x, command):
    """One period under the wheels' torque: clipped to what they can deliver, held."""
    x.torque = wheel_torque(p, x, command, same(1.0))
    t, substeps = t_ns / SECOND, math.ceil(p.period / p.largest_step - 1e-9)
    held, motion, h, before = (p, level_gravity(p), x.torque), (x.angles, x.rates), p.period / substeps, x.rates
    for step in range(substeps):
        motion, x.disturbance = dynamics.paper_step(held, x.disturbance, t + step * h, h, motion)
    x.angles, x.rates = motion
    speed = x.wheel_speed
    x.wheel_speed = spun(p, speed, x.torque, x.rates - before)
    x.wheel_angle = x.wheel_angle + 0.5 * p.period * (speed + x.wheel_speed)


@kernel
def place(p, x, placement):
    """Attitude and rates, the wheels' speeds as they are; the corner stands where it stands."""
    if placement.sets_orientation:
        x.angles = cardan_from_quaternion(balance_attitude(placement.orientation))
    if placement.sets_angular_velocity:
        x.rates = body_rates(quaternion_from_cardan(x.angles), placement.angular_velocity)


@kernel
def balance_attitude(orientation):
    """Attitude, body to balance frame, of the orientation body to site."""
    return conjugate(SITE_FROM_BALANCE) * orientation


@kernel
def body_rates(attitude, angular_velocity):
    """Rates [rad/s] in the body's axes of those in the site's; attitude: body to balance frame."""
    return rotate_back(SITE_FROM_BALANCE * attitude, angular_velocity)


def motion(outputs) -> TrueMotion:
    """The motion of the centre in the site; accelerations: under what acted over the last interval."""
    pose, truth = outputs["pose"].pose, outputs["truth"]
    turn, arm = Quaternion(*pose.orientation.tolist()), Vec3(*pose.position.tolist())
    rates, accelerations = (rotate(turn, Vec3(*numbers.tolist())) for numbers in (truth.rates, truth.accelerations))
    velocity = cross(rates, arm)
    found = velocity, rates, cross(accelerations, arm) + cross(rates, velocity), accelerations
    return TrueMotion(pose.position.tolist(), pose.orientation.tolist(), *(list(one.parts()) for one in found))


def poses(record, scene):
    """Where the cube is, and its wheels."""
    yield cubli.BASE, Pose(tuple(record.position), tuple(record.attitude))
    for name, angle in zip(cubli.WHEEL_LINKS, record.wheel_angle):
        yield name, turned_joint(scene.tree[name], angle)


def wheel_joints(record):
    """The wheels' angles and speeds."""
    return joint_states(record, cubli.WHEELS, record.wheel_angle, record.wheel_speed)


FRAMES = (*moving("frames", poses), *latched("frames"),
          Formatted("joint_states", "sensor_msgs/msg/JointState", "frames", wheel_joints, Role.TELEMETRY))


class CubliPlant(Component):
    """The Cubli rover by the paper's model, with reaction wheels that have limits.

    Promises: angles [rad], rates [rad/s], accelerations and torques of the cube on its resting corner by eq. (1)-(5)
    and (42), integrated by Runge-Kutta in steps of `largest_step` at most; its pose in the site frame and the wheels'
    speeds. The corner cannot leave the ground here: see cubli_physical_plant.

    Bad input: a torque beyond the wheels' limits of torque and speed is clipped. With `command_timeout` a drive that
    hears nothing new gives no torque; without it the last command holds. An inertia that no body has is refused before
    anything runs.
    """

    parameters, state = CubliPlantParameters, CubliPlantState
    inputs = {"command": cubli.COMMAND}
    outputs = {"truth": cubli.TRUTH, "attitude": cubli.TRUTH_ATTITUDE, "wheels": cubli.WHEEL_STATE,
               "pose": cubli.TRUTH_POSE, "frames": cubli.TRUTH_FRAMES}
    output_rate_hz = {"pose": 10.0, "frames": 10.0}
    rate_hz = 100.0
    start, output, update, place = start, output, update, place
    formatted = FRAMES

    @classmethod
    def motion(cls, outputs):
        return motion(outputs)

    @classmethod
    def scene(cls, values):
        return scene(values, SITE_FROM_BALANCE)

    @classmethod
    def check(cls, values, where):
        if values["gravity_sign"] == 0:
            raise FlightError(f"{where}.gravity_sign: 0 is not allowed; allowed: 1 or -1")
        require_inertia(values["body_inertia"], f"{where}.body_inertia")


def require_inertia(given: list, where: str, wheels: float = 0.0) -> None:
    """Refuse an inertia (3, 3) [kg m^2] that no body has, or of which nothing is left without its wheels.

    All zero: none is given. Raises FlightError.
    """
    inertia = np.array(given, float)
    if not inertia.any():
        return
    if not np.allclose(inertia, inertia.T, rtol=1e-9, atol=0.0):
        raise FlightError(f"{where}: {inertia.tolist()} is not symmetric")
    principal = np.linalg.eigvalsh(inertia)
    moments = ", ".join(f"{one:.4g}" for one in principal)
    if not principal[0] > wheels:
        least = f"the {wheels:g} kg m^2 of a wheel" if wheels else "0"
        raise FlightError(f"{where}: its principal moments are {moments} kg m^2; allowed: greater than {least}")
    if principal[2] > (principal[0] + principal[1]) * (1.0 + 1e-9):
        raise FlightError(f"{where}: no body has the principal moments {moments} kg m^2: the largest is at most the sum of "
                          "the two others")
