"""A controller of your own in one file: sliding mode with a boundary layer for the Cubli rover.

s = omega + c e,   u = I0 (-c omega - k tanh(s / width)) - M_g
"""

import math

from cubli_ros.attitude import cardan_from_quaternion, gravity_torque
from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from msg_schemas import cubli


class SlidingParameters(Parameters):
    slope: float = field(0.3, unit="1/s", gt=0, doc="c: how fast the attitude slides home")
    reach: float = field(0.05, unit="rad/s^2", gt=0, doc="k: more than the disturbance")
    width: float = field(0.01, unit="rad/s", gt=0, doc="boundary layer")
    gravity: float = field(0.002, unit="m/s^2", ge=0, doc="gravity the law reckons with")


class SlidingState(State):
    angles: Vec3
    gravity: Vec3
    moment: Vec3


@kernel
def slide(t_ns, p, x, attitude, command):
    cardan_from_quaternion(attitude.orientation, x.angles)
    for i in range(3):
        x.gravity[i] = -p.gravity / math.sqrt(3.0)
    gravity_torque(x.angles, x.gravity, 1.0, 2.0, 0.2, x.moment)
    inertia = 2.0 * 0.2 * 0.2 / 6.0  # [kg m^2]
    for i in range(3):
        omega = attitude.angular_velocity[i]
        s = omega + p.slope * x.angles[i]
        command.effort[i] = inertia * (-p.slope * omega - p.reach * math.tanh(s / p.width)) - x.moment[i]


class SlidingController(Component):
    """Sliding mode attitude control of the Cubli rover."""

    parameters, state = SlidingParameters, SlidingState
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND}
    rate_hz = 100.0
    kernel = slide
