"""A controller of your own in one file: sliding mode with a boundary layer for the Cubli rover.

s = omega + c e,   u = I (-c omega - k tanh(s / width)) - M_g
"""

from cubli_ros.appc_controller import RoverModel
from cubli_ros.attitude import cardan_from_quaternion, gravity_torque, level_gravity
from flight_graph.components.component import Component
from flight_graph.components.records import field
from flight_math import kernel, rotate_back, tanh
from msg_schemas import cubli


class SlidingParameters(RoverModel):
    slope: float = field(0.3, unit="1/s", gt=0, doc="c: how fast the attitude slides home")
    reach: float = field(0.05, unit="rad/s^2", gt=0, doc="k: more than the disturbance")
    width: float = field(0.01, unit="rad/s", gt=0, doc="boundary layer")


@kernel
def slide(t_ns, p, x, attitude, command):
    omega = attitude.angular_velocity
    error = cardan_from_quaternion(attitude.orientation) - p.reference
    s = omega + p.slope * error
    acceleration = -p.slope * omega - p.reach * tanh(s / p.width)
    gravity = rotate_back(attitude.orientation, level_gravity(p))
    command.effort = p.inertia @ acceleration - gravity_torque(p, gravity)


class SlidingController(Component):
    """Sliding mode attitude control of the Cubli rover."""

    parameters = SlidingParameters
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND}
    rate_hz = 100.0
    kernel = slide
