"""The truth of the space robot as a component: free-floating base, arm, wheels, drives, stops, and a payload to take.

Source: Aerospace 2023, 10(8), 679, equations (5), (7), (21)-(28); the dynamics are in `sim_nodes.spacerobot.dynamics`,
the actuators in `sim_nodes.spacerobot.actuators`.

What fails by parameters, all off by default: joints with friction, seized joints, backlash (`joint_hardware`), wheels with
drag, commands that count as zero when they are too old. Brakes are told by an input of their own.

The payload becomes part of the last body at ``payload_time`` with velocities that match (the grasp gives no jolt): from
then on its momentum is the robot's. Parameters about the body's origin add up, so a payload is ten more numbers.
"""

import math

from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, Choice, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.scenes.messages import latched
from flight_graph.scenes.transforms import TYPE
from flight_graph.timebase import SECOND
from flight_math import (
    dot,
    identity3,
    kernel,
    outer,
    rotate,
    rotate_back,
    stack_array,
)
from flight_math.dense import copy
from msg_schemas import spacerobot
from msg_schemas.qos import Role
from sim_nodes.spacerobot.actuators import IDEAL, WHEELS, limit_torque, wheels_step
from sim_nodes.spacerobot.dynamics import (
    ZERO,
    RobotState,
    momentum_and_energy,
    robot_state,
    state_size,
    step,
    write_state,
)
from sim_nodes.spacerobot.joint_hardware import friction_capacity, pass_on, rubbing_step
from sim_nodes.spacerobot.scene import moving_frames, scene, true_joints
from sim_nodes.spacerobot.truth import motion, write_frames, write_truth
from spacerobot_ros.ages import Stamp, age
from spacerobot_ros.dynamics import Inertia, add_inertia, body_inertia, composite_parameters
from spacerobot_ros.kinematics import posed
from spacerobot_ros.robot_parameters import NO_LIMIT, resolve_robot, robot_parameters
from spacerobot_ros.trajectory import euler_quaternion

DIVERGED = 1
BOUND = 1e4  # [rad/s] rates beyond it: the loop has diverged


def plant_parameters(joints):
    """Parameters of the plant of a robot with this many joints."""

    class SpaceRobotPlantParameters(robot_parameters(joints)):
        pi: Array(10 * (joints + 1)) = field(0.0, unit="SI", doc="true inertial parameters before a payload is taken")
        lower: Array(joints) = field(-NO_LIMIT, unit="rad", doc="lower stops")
        upper: Array(joints) = field(NO_LIMIT, unit="rad", doc="upper stops")
        initial_attitude: Vec3 = field(0.0, unit="rad", doc="roll, pitch, yaw (Euler ZYX)")
        initial_rates: Vec3 = field(0.0, unit="rad/s", doc="body rates")
        initial_joints: Array(joints) = field(0.0, unit="rad", doc="joint angles")
        initial_joint_rates: Array(joints) = field(0.0, unit="rad/s", doc="joint rates")
        base_actuator: Choice("ideal", "wheels") = field("ideal", doc="what puts torque on the base")
        base_torque_limit: Vec3 = field(NO_LIMIT, unit="N m", gt=0, doc="of the ideal actuator")
        joint_torque_limit: Array(joints) = field(NO_LIMIT, unit="N m", gt=0, doc="of the joint drives")
        wheel_torque_limit: float = field(0.05, unit="N m", gt=0, doc="of each wheel, along a base axis")
        wheel_momentum_limit: float = field(0.5, unit="N m s", gt=0, doc="6000 rpm at 8e-4 kg m^2")
        wheel_lag: float = field(0.02, unit="s", ge=0, doc="time constant of the torque")
        wheel_friction: float = field(5e-4, unit="N m", ge=0, doc="Coulomb friction of a wheel")
        wheel_quantum: float = field(1e-3, unit="N m", ge=0, doc="step of the torque command; 0: none")
        wheel_drag: Vec3 = field(0.0, unit="N m", ge=0, doc="more Coulomb friction of each wheel: a bearing that fails")
        wheel_viscous: Vec3 = field(0.0, unit="1/s", ge=0, doc="viscous friction of each wheel, torque over momentum")
        joint_friction: Array(joints) = field(0.0, unit="N m", ge=0, doc="Coulomb friction of each joint")
        joint_viscous: Array(joints) = field(0.0, unit="N m s/rad", ge=0, doc="viscous friction of each joint")
        joint_seized: Array(joints) = field(0.0, unit="N m", ge=0, doc="torque that a seized joint takes before it moves")
        brake_torque: Array(joints) = field(10.0, unit="N m", ge=0, doc="that an engaged brake takes before it slips")
        backlash: Array(joints) = field(0.0, unit="rad", ge=0, doc="play between drive and joint")
        drive_rate: float = field(0.5, unit="rad/s", gt=0, doc="no-load rate at which a drive crosses the play")
        command_timeout: float = field(0.0, unit="s", ge=0, doc="an older command counts as zero; 0: never")
        stop_stiffness: float = field(200.0, unit="N m/rad", ge=0, doc="of the joints' mechanical stops")
        stop_damping: float = field(2.0, unit="s/rad", ge=0, doc="of the stops, Hunt and Crossley")
        payload_time: float = field(-1.0, unit="s", doc="when the payload is taken; negative: never")
        payload_scale: float = field(1.0, unit="1", gt=0, doc="factor on the last body's parameters")
        payload_mass: float = field(0.0, unit="kg", ge=0, doc="of a point payload")
        payload_position: Vec3 = field(0.0, unit="m", doc="of the point payload in the last body's frame")
        largest_step: float = field(0.01, unit="s", gt=0, doc="of the integration (Runge-Kutta, order four)")

    return SpaceRobotPlantParameters


def plant_state(joints):
    """State of the plant. motion: the state vector of `sim_nodes.spacerobot.dynamics`; pi: inertial parameters now;
    drive: motor torques of the wheels; torque, friction (of the joints) and wheel_rate: what acted over the last interval;
    play: where the drives are in their backlash [rad]; now: seconds and nanoseconds of the last output's stamp; counters of
    limits."""
    n = joints

    class SpaceRobotPlantState(State):
        pi: Array(10 * (n + 1))
        placed: bool
        taken: bool
        motion: Array(state_size(n))
        drive: Vec3
        torque: Array(3 + n)
        friction: Array(n)
        play: Array(n)
        now: Array(2)
        wheel_rate: Vec3
        limited: float
        wheels_limited: float

    return SpaceRobotPlantState


@kernel
def start(p, x):
    x.pi = p.pi
    write_state(x.motion, RobotState(ZERO, ZERO, euler_quaternion(p.initial_attitude), p.initial_rates, p.initial_joints,
                                     p.initial_joint_rates, 0.0, ZERO, ZERO))


@kernel
def put_at_rest(p, x):
    """Put the system's centre of mass at the inertial origin, at rest."""
    s = robot_state(x.motion)
    composite = stack_array(len(x.pi))
    composite_parameters(posed(p, s.joints, stack_array(len(s.joints), 3, 3)), x.pi, composite)
    whole = body_inertia(composite, 0)
    momentum, _, _ = momentum_and_energy(p, x.pi, x.motion)
    x.motion[0:3] = -rotate(s.attitude, whole.moment) / whole.mass
    x.motion[3:6] = -momentum / whole.mass


@kernel
def place(p, x, placement):
    """Pose and twist of the base; joints, their rates and the wheels' momentum stay."""
    if not x.placed:
        x.placed = True
        put_at_rest(p, x)
    if placement.sets_position:
        x.motion[0:3] = placement.position
    if placement.sets_velocity:
        x.motion[3:6] = placement.velocity
    if placement.sets_orientation:
        x.motion[6:10] = placement.orientation
    if placement.sets_angular_velocity:
        x.motion[10:13] = rotate_back(robot_state(x.motion).attitude, placement.angular_velocity)


@kernel
def take_payload(t, p, x):
    """At payload_time the last body's parameters change; velocities do not."""
    if x.taken or p.payload_time < 0.0 or t < p.payload_time:
        return
    x.taken = True
    m, c, last = p.payload_mass, p.payload_position, len(p.parent)
    for k in range(10 * last, 10 * last + 10):
        x.pi[k] = p.payload_scale * p.pi[k]
    add_inertia(x.pi, last, Inertia(m * (dot(c, c) * identity3() - outer(c, c)), m * c, m))


@kernel
def output(t_ns, p, x, outputs):
    if not x.placed:
        x.placed = True
        put_at_rest(p, x)
    take_payload(t_ns / SECOND, p, x)
    truth = outputs.truth
    x.now[0], x.now[1] = truth.header.stamp.sec, truth.header.stamp.nanosec
    s = robot_state(x.motion)
    write_truth(p, x, s, truth)
    outputs.parameters.pi = x.pi
    outputs.wheels.momentum, outputs.wheels.limited = s.wheels, x.wheels_limited
    outputs.pose.pose.position, outputs.pose.pose.orientation = s.position, s.attitude
    write_frames(p, s, outputs.frames)


@kernel
def drive_torques(p, base_demand, joint_demand, torque):
    """Fill ``torque`` (3+n,) [N m] with what the drives and an ideal base actuator give; returns how many are limited."""
    limited = 0
    for k in range(3):
        torque[k] = 0.0
        if p.base_actuator == IDEAL:
            torque[k], clipped = limit_torque(base_demand[k], p.base_torque_limit[k])
            limited += clipped
    for i in range(len(p.parent)):
        torque[3 + i], clipped = limit_torque(joint_demand[i], p.joint_torque_limit[i])
        limited += clipped
    return limited


@kernel
def in_time(p, x, command):
    """Whether a command is new enough to be followed."""
    return p.command_timeout <= 0.0 or age(Stamp(x.now[0], x.now[1]), command.header.stamp) <= p.command_timeout


@kernel
def update(t_ns, p, x, base_command, joint_command, brakes):
    """One period under the commanded torques, as far as the actuators can give them."""
    n = len(p.parent)
    base_demand, joint_demand, demand = base_command.wrench.torque, stack_array(n), stack_array(3 + n)
    if not in_time(p, x, base_command):
        base_demand = ZERO
    if in_time(p, x, joint_command):
        joint_demand[:] = joint_command.effort
    limited = drive_torques(p, base_demand, joint_demand, x.torque)
    wrench, capacity = stack_array(6 + n), stack_array(n)
    copy(x.torque, wrench[3:])
    copy(x.torque, demand)
    rubs = friction_capacity(p, brakes.engaged, capacity)
    substeps = math.ceil(p.period / p.largest_step - 1e-9)
    h = p.period / substeps
    x.wheels_limited, x.wheel_rate, rate = 0.0, ZERO, ZERO
    for i in range(n):
        x.friction[i] = 0.0
    for _ in range(substeps):
        if p.base_actuator == WHEELS:
            momentum = robot_state(x.motion).wheels
            x.drive, rate, at_limit = wheels_step(p, base_demand, x.drive, momentum, h)
            x.wheels_limited = max(x.wheels_limited, float(at_limit))
        x.wheel_rate = x.wheel_rate + rate / substeps
        pass_on(p, x, demand, h, 1.0 / substeps, wrench)
        if rubs:
            rubbing_step(p, x, wrench, rate, capacity, h)
        else:
            step(p, x.pi, x.motion, wrench, rate, h)
    x.limited = limited + x.wheels_limited
    if diverged(x.motion):
        x.fault = DIVERGED


@kernel
def diverged(motion):
    """Whether a rate of base or joints is beyond the bound, or no number."""
    s = robot_state(motion)
    within = all(abs(s.rates) < BOUND)
    for rate in s.joint_rates:
        within = within and abs(rate) < BOUND
    return not within


def check_initial_joints(values, where):
    """Refuse joints that start past their stops."""
    for i, (angle, low, high) in enumerate(zip(values["initial_joints"], values["lower"], values["upper"])):
        if not low <= angle <= high:
            raise FlightError(f"{where}.initial_joints[{i}]: {angle:g} rad is past the joint's stop; allowed: "
                              f"{low:g} to {high:g} rad")


def plant(topics: spacerobot.Topics) -> type[Component]:
    """The plant of a robot with these topics."""

    class SpaceRobotPlant(Component):
        """A free-flying base with an arm, moved by torques alone; wheels, drives and stops with limits, and a payload.

        Promises: position [m], velocity, attitude, rates, joints, accelerations and torques of the truth, and momentum
        and energy, which nothing but torques and the payload change. Drives, wheels and stops have limits; what was
        limited is counted.

        Bad input: commands beyond a limit are clipped. With `command_timeout` a command that is older counts as zero;
        without it the last one holds. Joints that start past their stops are refused before anything runs.
        """

        parameters, state = plant_parameters(topics.joints), plant_state(topics.joints)
        inputs = {"base_command": topics.base_command, "joint_command": topics.joint_command, "brakes": topics.brakes}
        optional_inputs = ("brakes",)
        outputs = {"truth": topics.truth, "parameters": topics.true_parameters, "wheels": topics.wheel_momentum,
                   "pose": topics.true_pose, "frames": topics.true_frames}
        output_rate_hz = {"pose": 10.0, "frames": 10.0}
        rate_hz = 50.0
        start, output, update, place = start, output, update, place
        formatted = (
            Formatted("tf", TYPE, "frames", moving_frames(topics.frames)), *latched("frames", ground=False),
            Formatted("joint_states", "sensor_msgs/msg/JointState", "frames", true_joints(topics), Role.TELEMETRY))
        faults = {DIVERGED: "the motion has diverged (a rate is beyond 1e4 rad/s)"}

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_robot(values, where, folder)

        @classmethod
        def motion(cls, outputs):
            return motion(outputs)

        @classmethod
        def scene(cls, values):
            return scene(values, topics)

        @classmethod
        def check(cls, values, where):
            check_initial_joints(values, where)

    return SpaceRobotPlant


SpaceRobotPlant = plant(spacerobot.MINI)
