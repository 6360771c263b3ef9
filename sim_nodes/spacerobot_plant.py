"""The truth of the space robot as a component: free-floating base, arm, wheels, drives, stops, and a payload to take.

Source: Aerospace 2023, 10(10), 679, equations (5), (7), (21)-(28); the dynamics are in `sim_nodes.spacerobot_dynamics`,
the actuators in `sim_nodes.spacerobot_actuators`.

The payload becomes part of the last body at ``payload_time`` with velocities that match (the grasp gives no jolt): from
then on its momentum is the robot's. Parameters about the body's origin add up, so a payload is ten more numbers.
"""

import math

import numpy as np

from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, Choice, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from flight_graph.timebase import SECOND
from msg_schemas import spacerobot
from msg_schemas.definitions import TYPESTORE
from sim_nodes import spacerobot_dynamics
from sim_nodes.spacerobot_actuators import limit_torque, wheel_step
from spacerobot_ros.dynamics import composite_parameters
from spacerobot_ros.kinematics import joint_rotations, rotation_matrix
from spacerobot_ros.robot_parameters import NO_LIMIT, resolve_robot, robot_parameters, tree_indices
from spacerobot_ros.trajectory import euler_attitude

IDEAL, WHEELS = 0, 1
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
        stop_stiffness: float = field(200.0, unit="N m/rad", ge=0, doc="of the joints' mechanical stops")
        stop_damping: float = field(2.0, unit="s/rad", ge=0, doc="of the stops, Hunt and Crossley")
        payload_time: float = field(-1.0, unit="s", doc="when the payload is taken; negative: never")
        payload_scale: float = field(1.0, unit="1", gt=0, doc="factor on the last body's parameters")
        payload_mass: float = field(0.0, unit="kg", ge=0, doc="of a point payload")
        payload_position: Vec3 = field(0.0, unit="m", doc="of the point payload in the last body's frame")
        largest_step: float = field(0.01, unit="s", gt=0, doc="of the integration (Runge-Kutta, order four)")

    return SpaceRobotPlantParameters


def plant_state(joints):
    """State of the plant; ``motion`` is the state vector of `sim_nodes.spacerobot_dynamics`."""
    n = joints

    class SpaceRobotPlantState(State):
        tree: Array(n)
        pi: Array(10 * (n + 1))
        placed: bool
        taken: bool
        motion: Array(spacerobot_dynamics.state_size(n))
        torque: Array(3 + n)
        demand: Array(3 + n)
        limit: Array(3 + n)
        wrench: Array(6 + n)
        acceleration: Array(6 + n)
        axes: Array(3, 3)
        drive: Vec3
        wheels: Vec3
        wheel_rate: Vec3
        mean_rate: Vec3
        limited: float
        wheels_limited: float
        rotation: Array(n, 3, 3)
        composite: Array(n + 1, 10)
        linear: Vec3
        angular: Vec3
        vectors: Array(3, 3)
        work: Array(spacerobot_dynamics.work_size(n))

    return SpaceRobotPlantState


@kernel
def start(p, x):
    n = p.parent.shape[0]
    tree = x.tree.view(np.int64)
    tree_indices(p.parent[:], tree)
    for k in range(p.pi.shape[0]):
        x.pi[k] = p.pi[k]
    for k in range(3):
        x.axes[k, k] = 1.0
        x.limit[k] = p.base_torque_limit[k]
        x.motion[10 + k] = p.initial_rates[k]
    for i in range(n):
        x.limit[3 + i] = p.joint_torque_limit[i]
        x.motion[13 + i] = p.initial_joints[i]
        x.motion[13 + n + i] = p.initial_joint_rates[i]
    for k in range(3):
        x.vectors[2, k] = 0.0
    euler_attitude(p.initial_attitude[:], x.vectors[2], x.vectors[2], x.motion[6:10], x.vectors[0], x.vectors[1])


@kernel
def place(p, x, tree):
    """Put the system's centre of mass at the inertial origin, at rest."""
    n = p.parent.shape[0]
    joint_rotations(p.fixed_rotation.reshape((n, 3, 3)), p.axis[:], x.motion[13:13 + n], x.rotation[:])
    composite_parameters(tree, x.rotation[:], p.offset[:], x.pi[:], x.composite[:])
    spacerobot_dynamics.momentum_and_energy(
        tree, p.fixed_rotation.reshape((n, 3, 3)), p.offset[:], p.axis[:], x.pi[:], x.motion[:], x.linear[:],
        x.angular[:], x.work[:])
    mass = x.composite[0, 9]
    rotation_matrix(x.motion[6:10], x.vectors[:])
    for k in range(3):
        centre = 0.0
        for m in range(3):
            centre += x.vectors[k, m] * x.composite[0, 6 + m]
        x.motion[k] = -centre / mass
        x.motion[3 + k] = -x.linear[k] / mass


@kernel
def accelerate(p, x, tree):
    """Accelerations now, under the torque of the last interval."""
    n = p.parent.shape[0]
    w = x.motion[10:13]
    momentum = x.motion[17 + 2 * n:20 + 2 * n]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        x.torque[k] = x.demand[k]
        if p.base_actuator == WHEELS:
            x.torque[k] = -x.mean_rate[k] - (w[i] * momentum[j] - w[j] * momentum[i])
        x.wrench[k] = 0.0
    for k in range(3 + n):
        x.wrench[3 + k] = x.torque[k]
    for i in range(n):
        x.wrench[6 + i] += spacerobot_dynamics.stop_torque(
            x.motion[13 + i], x.motion[13 + n + i], p.lower[i], p.upper[i], p.stop_stiffness, p.stop_damping)
    joint_rotations(p.fixed_rotation.reshape((n, 3, 3)), p.axis[:], x.motion[13:13 + n], x.rotation[:])
    spacerobot_dynamics.forward_dynamics(
        tree, x.rotation[:], p.offset[:], p.axis[:], x.pi[:], w, x.motion[13 + n:13 + 2 * n], x.wrench[:],
        x.acceleration[:], x.work[:])


@kernel
def take_payload(t, p, x):
    """At payload_time the last body's parameters change; velocities do not."""
    if x.taken or p.payload_time < 0.0 or t < p.payload_time:
        return
    x.taken = True
    first = p.pi.shape[0] - 10
    for c in range(10):
        x.pi[first + c] = p.payload_scale * p.pi[first + c]
    m = p.payload_mass
    a, b, c = p.payload_position[0], p.payload_position[1], p.payload_position[2]
    x.pi[first] += m * (b * b + c * c)
    x.pi[first + 1] -= m * a * b
    x.pi[first + 2] -= m * a * c
    x.pi[first + 3] += m * (a * a + c * c)
    x.pi[first + 4] -= m * b * c
    x.pi[first + 5] += m * (a * a + b * b)
    x.pi[first + 6] += m * a
    x.pi[first + 7] += m * b
    x.pi[first + 8] += m * c
    x.pi[first + 9] += m


@kernel
def output(t_ns, p, x, truth, parameters, wheels, pose):
    n = p.parent.shape[0]
    tree = x.tree.view(np.int64)
    if not x.placed:
        x.placed = True
        place(p, x, tree)
    take_payload(t_ns / SECOND, p, x)
    accelerate(p, x, tree)
    truth.kinetic_energy = spacerobot_dynamics.momentum_and_energy(
        tree, p.fixed_rotation.reshape((n, 3, 3)), p.offset[:], p.axis[:], x.pi[:], x.motion[:], x.linear[:],
        x.angular[:], x.work[:])
    for k in range(3):
        truth.position[k] = x.motion[k]
        truth.velocity[k] = x.motion[3 + k]
        truth.attitude[k] = x.motion[7 + k]
        truth.rates[k] = x.motion[10 + k]
        truth.acceleration[k] = x.acceleration[k]
        truth.angular_acceleration[k] = x.acceleration[3 + k]
        truth.base_torque[k] = x.torque[k]
        truth.momentum[k] = x.linear[k]
        truth.angular_momentum[k] = x.angular[k]
        truth.impulse[k] = x.motion[14 + 2 * n + k]
        truth.wheel_momentum[k] = x.motion[17 + 2 * n + k]
        wheels.momentum[k] = x.motion[17 + 2 * n + k]
        pose.pose.position[k] = x.motion[k]
        pose.pose.orientation[k] = x.motion[7 + k]
    truth.attitude[3] = x.motion[6]
    pose.pose.orientation[3] = x.motion[6]
    for i in range(n):
        truth.joints[i] = x.motion[13 + i]
        truth.joint_rates[i] = x.motion[13 + n + i]
        truth.joint_accelerations[i] = x.acceleration[6 + i]
        truth.joint_torque[i] = x.torque[3 + i]
    truth.work = x.motion[13 + 2 * n]
    truth.limited = x.limited
    wheels.limited = x.wheels_limited
    for k in range(x.pi.shape[0]):
        parameters.pi[k] = x.pi[k]


@kernel
def update(t_ns, p, x, base_command, joint_command):
    """One period under the commanded torques, as far as the actuators can give them."""
    n = p.parent.shape[0]
    tree = x.tree.view(np.int64)
    for k in range(3):
        x.torque[k] = base_command.wrench.torque[k]
        if p.base_actuator == WHEELS:
            x.torque[k] = 0.0
        x.mean_rate[k] = 0.0
        x.wrench[k] = 0.0
    for i in range(n):
        x.torque[3 + i] = joint_command.effort[i]
    x.limited = float(limit_torque(x.torque[:], x.limit[:], x.demand[:]))
    x.wheels_limited = 0.0
    for k in range(3 + n):
        x.torque[k] = x.demand[k]
        x.wrench[3 + k] = x.torque[k]
    substeps = int(math.ceil(p.period / p.largest_step - 1e-9))
    step = p.period / substeps
    for _ in range(substeps):
        for k in range(3):
            x.wheel_rate[k] = 0.0
        if p.base_actuator == WHEELS:
            at_limit = wheel_step(
                base_command.wrench.torque, x.axes[:], x.drive[:], x.wheels[:], p.wheel_torque_limit,
                p.wheel_momentum_limit,
                p.wheel_lag, p.wheel_friction, p.wheel_quantum, step, x.wheel_rate[:])
            x.wheels_limited = max(x.wheels_limited, float(at_limit))
        for k in range(3):
            x.mean_rate[k] += x.wheel_rate[k] / substeps
        spacerobot_dynamics.step(
            tree, p.fixed_rotation.reshape((n, 3, 3)), p.offset[:], p.axis[:], x.pi[:], x.motion[:], x.wrench[:],
            x.wheel_rate[:],
            p.lower[:], p.upper[:], p.stop_stiffness, p.stop_damping, step, x.work[:])
    x.limited += x.wheels_limited
    for k in range(3 + n):
        if not abs(x.motion[10 + k if k < 3 else 10 + n + k]) < BOUND:
            x.fault = DIVERGED


def transform(record):
    """inertial -> space_robot_base as a TFMessage."""
    types = TYPESTORE.types
    time = types["builtin_interfaces/msg/Time"](int(record.header.stamp.sec), int(record.header.stamp.nanosec))
    pose = record.pose
    return types["tf2_msgs/msg/TFMessage"]([types["geometry_msgs/msg/TransformStamped"](
        types["std_msgs/msg/Header"](time, spacerobot.INERTIAL), spacerobot.BASE,
        types["geometry_msgs/msg/Transform"](
            types["geometry_msgs/msg/Vector3"](*map(float, pose.position)),
            types["geometry_msgs/msg/Quaternion"](*map(float, pose.orientation))))])


def check_initial_joints(values, where):
    """Refuse joints that start past their stops."""
    for i, (angle, low, high) in enumerate(zip(values["initial_joints"], values["lower"], values["upper"])):
        if not low <= angle <= high:
            raise FlightError(f"{where}.initial_joints[{i}]: {angle:g} rad is past the joint's stop; allowed: "
                              f"{low:g} to {high:g} rad")


def plant(topics: spacerobot.Topics) -> type[Component]:
    """The plant of a robot with these topics."""

    class SpaceRobotPlant(Component):
        """A free-flying base with an arm, moved by torques alone; wheels, drives and stops with limits, and a
        payload."""

        parameters, state = plant_parameters(topics.joints), plant_state(topics.joints)
        inputs = {"base_command": topics.base_command, "joint_command": topics.joint_command}
        outputs = {"truth": topics.truth, "parameters": topics.true_parameters, "wheels": topics.wheel_state,
                   "pose": topics.true_pose}
        output_rate_hz = {"pose": 10.0}
        rate_hz = 50.0
        start, output, update = start, output, update
        formatted = (Formatted("tf", "tf2_msgs/msg/TFMessage", "pose", transform),)
        faults = {DIVERGED: "the motion has diverged (a rate is beyond 1e4 rad/s)"}

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_robot(values, where, folder)

        @classmethod
        def check(cls, values, where):
            check_initial_joints(values, where)

    return SpaceRobotPlant


SpaceRobotPlant = plant(spacerobot.MINI)
