"""Desired motion as a component: a step, a quintic slew, or harmonics of base attitude and joints.

Source: Aerospace 2023, 10(10), 679, sections 4.1 and 4.3; the motions are in `spacerobot_ros.trajectory`.
Channels: roll, pitch, yaw (Euler ZYX), then the joints.
"""

import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from flight_graph.timebase import SECOND
from msg_schemas import spacerobot
from spacerobot_ros.kinematics import attitude_difference, rotation_vector
from spacerobot_ros.robot_parameters import NO_LIMIT, resolve_robot, robot_parameters
from spacerobot_ros.trajectory import euler_attitude, harmonic_reference, hold_within, slew_reference, step_reference

STEP, SLEW, HARMONIC = 0, 1, 2


def generator_parameters(joints):
    """Parameters of the generator for a robot with this many joints."""
    channels = 3 + joints

    class TrajectoryParameters(robot_parameters(joints)):
        lower: Array(joints) = field(-NO_LIMIT, unit="rad", doc="lower stops")
        upper: Array(joints) = field(NO_LIMIT, unit="rad", doc="upper stops")
        motion: Choice("step", "slew", "harmonic") = field("step", source="sections 4.1, 4.3", doc="kind of motion")
        target: Array(channels) = field(0.0, unit="rad", doc="step, slew: where to; harmonic: the mean")
        begin: Array(channels) = field(0.0, unit="rad", doc="slew: where from")
        duration: float = field(20.0, unit="s", gt=0, doc="slew: how long")
        amplitude: Array(channels) = field(0.0, unit="rad", doc="harmonic")
        cycle: Array(channels) = field(20.0, unit="s", gt=0, doc="harmonic: period of each channel")
        phase: Array(channels) = field(0.0, unit="rad", doc="harmonic: at t = 0")

    return TrajectoryParameters


def generator_state(joints):
    """State of the generator: the slew's turn, and scratch arrays."""

    class TrajectoryState(State):
        q: Array(4)
        q_start: Array(4)
        difference: Array(4)
        turn: Vec3
        base_motion: Array(2, 3)
        joint_motion: Array(3, joints)
        work: Array(3, 3)

    return TrajectoryState


@kernel
def start(p, x):
    for k in range(3):
        x.work[0, k] = 0.0
    euler_attitude(p.target[0:3], x.work[0], x.work[0], x.q[:], x.base_motion[0], x.base_motion[1])
    euler_attitude(p.begin[0:3], x.work[0], x.work[0], x.q_start[:], x.base_motion[0], x.base_motion[1])
    attitude_difference(x.q_start[:], x.q[:], x.difference[:])
    rotation_vector(x.difference[:], x.turn[:])


@kernel
def generate(t_ns, p, x, reference):
    """The desired motion at t."""
    t = t_ns / SECOND
    if p.motion == STEP:
        step_reference(p.target[:], x.q[:], x.base_motion[0], x.base_motion[1], x.joint_motion[0],
                       x.joint_motion[1], x.joint_motion[2], x.work[:])
    elif p.motion == SLEW:
        slew_reference(t, p.duration, x.q_start[:], x.turn[:], p.begin[3:], p.target[3:], x.q[:], x.base_motion[0],
                       x.base_motion[1], x.joint_motion[0], x.joint_motion[1], x.joint_motion[2], x.work[0])
    else:
        harmonic_reference(t, p.target[:], p.amplitude[:], p.cycle[:], p.phase[:], x.q[:], x.base_motion[0],
                           x.base_motion[1], x.joint_motion[0], x.joint_motion[1], x.joint_motion[2], x.work[:])
    reference.held = float(hold_within(x.joint_motion[0], x.joint_motion[1], x.joint_motion[2], p.lower[:], p.upper[:]))
    reference.attitude[3] = x.q[0]
    for k in range(3):
        reference.attitude[k] = x.q[1 + k]
        reference.rates[k] = x.base_motion[0, k]
        reference.angular_acceleration[k] = x.base_motion[1, k]
    for i in range(x.joint_motion.shape[1]):
        reference.joints[i] = x.joint_motion[0, i]
        reference.joint_rates[i] = x.joint_motion[1, i]
        reference.joint_accelerations[i] = x.joint_motion[2, i]


def check_stops(values, where):
    """Refuse a motion that would take a joint past its stop."""
    target, begin, amplitude = (np.array(values[name])[3:] for name in ("target", "begin", "amplitude"))
    low = high = target
    if values["motion"] == "harmonic":
        low, high = target - np.abs(amplitude), target + np.abs(amplitude)
    if values["motion"] == "slew":
        low, high = np.minimum(begin, target), np.maximum(begin, target)
    for i, (lower, upper) in enumerate(zip(values["lower"], values["upper"])):
        if low[i] < lower - 1e-12 or high[i] > upper + 1e-12:
            raise FlightError(
                f"{where}.target: joint {i + 1} is commanded to [{np.degrees(low[i]):.6g}, {np.degrees(high[i]):.6g}] "
                f"deg, past its stop; allowed: [{np.degrees(lower):.6g}, {np.degrees(upper):.6g}] deg")


def generator(topics: spacerobot.Topics) -> type[Component]:
    """The trajectory generator of a robot with these topics."""

    class TrajectoryGenerator(Component):
        """Desired motion of base attitude and joints: step, quintic slew, or harmonics."""

        parameters, state = generator_parameters(topics.joints), generator_state(topics.joints)
        outputs = {"reference": topics.reference}
        rate_hz = 50.0
        start, kernel = start, generate

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_robot(values, where, folder)

        @classmethod
        def check(cls, values, where):
            check_stops(values, where)

    return TrajectoryGenerator


TrajectoryGenerator = generator(spacerobot.MINI)
