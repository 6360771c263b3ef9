"""Desired motion as a component: a step, a quintic slew, or harmonics of base attitude and joints.

Source: Aerospace 2023, 10(8), 679, sections 4.1 and 4.3; the motions are in `spacerobot_ros.trajectory`.
Channels: roll, pitch, yaw (Euler ZYX), then the joints.
"""

import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.records import Array, Choice, field
from flight_graph.errors import FlightError
from flight_graph.timebase import SECOND
from flight_math import kernel, stack_array
from msg_schemas import spacerobot
from spacerobot_ros.robot_parameters import NO_LIMIT, resolve_robot, robot_parameters
from spacerobot_ros.trajectory import harmonic_reference, hold_within, slew_reference, step_reference

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


@kernel
def generate(t_ns, p, x, reference):
    """The desired motion at t."""
    t, joints = t_ns / SECOND, stack_array(3, len(p.parent))
    if p.motion == STEP:
        desired = step_reference(p, joints)
    elif p.motion == SLEW:
        desired = slew_reference(p, t, joints)
    else:
        desired = harmonic_reference(p, t, joints)
    reference.held = hold_within(p, joints)
    reference.attitude, reference.rates, reference.angular_acceleration = desired
    reference.joints, reference.joint_rates, reference.joint_accelerations = joints[0], joints[1], joints[2]


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
        """Desired motion of base attitude and joints: step, quintic slew, or harmonics.

        Promises: desired attitude (x, y, z, w), rates [rad/s] and accelerations [rad/s^2] of the base, and of the
        joints, as functions of time alone; joints are held within their stops.

        Bad input: it has no inputs. A motion that would take a joint past its stop is refused before anything runs,
        with the joint and the angles.
        """

        parameters = generator_parameters(topics.joints)
        outputs = {"reference": topics.reference}
        rate_hz = 50.0
        kernel = generate

        @classmethod
        def resolve(cls, values, where, folder=None):
            return resolve_robot(values, where, folder)

        @classmethod
        def check(cls, values, where):
            check_stops(values, where)

    return TrajectoryGenerator


TrajectoryGenerator = generator(spacerobot.MINI)
