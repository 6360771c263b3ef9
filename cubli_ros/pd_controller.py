"""Proportional-derivative control as a component: the paper's first baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which gives no gains; the law is in `cubli_ros.pd`.
"""

import math

from cubli_ros import appc
from cubli_ros.appc_controller import RoverModel
from cubli_ros.attitude import cardan_from_quaternion, gravity_torque
from cubli_ros.pd import proportional_derivative
from flight_graph.components.component import Component
from flight_graph.components.records import State, Vec3, field
from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from msg_schemas import cubli


class BaselineParameters(RoverModel):
    """What both baselines have beyond the rover's model."""

    feed_forward: float = field(0.0, unit="1", ge=0, le=1.5, doc="part of the gravity torque that is cancelled")


class PdParameters(BaselineParameters):
    kp: Vec3 = field(1.0, unit="1/s^2", ge=0, source="section 5.4 gives none", doc="gain on the attitude error")
    kd: Vec3 = field(1.0, unit="1/s", ge=0, source="section 5.4 gives none", doc="gain on the body rate")


class BaselineState(State):
    """Scratch arrays."""

    angles: Vec3
    omega: Vec3
    error: Vec3
    virtual_rate: Vec3
    gravity: Vec3
    gravity_torque: Vec3
    demand: Vec3


@kernel
def start(p, x):
    for i in range(3):
        x.gravity[i] = -p.gravity / math.sqrt(3.0)


@kernel
def measure(p, x, attitude):
    """Angles, rates and error into the state, and the gravity torque there. False until a first attitude is there."""
    if attitude.header.stamp.sec == 0 or attitude.orientation_covariance[0] < 0.0:
        return False
    cardan_from_quaternion(attitude.orientation, x.angles)
    for i in range(3):
        x.omega[i] = attitude.angular_velocity[i]
        x.error[i] = x.angles[i] - p.reference[i]
    gravity_torque(x.angles, x.gravity, p.gravity_sign, p.mass, p.length, x.gravity_torque)
    return True


@kernel
def act(p, x, command, tracking):
    """The demand in x, limited, as the command; and what is to be told of it."""
    appc.limit_torque(x.demand, p.torque_limit, command.effort)
    for i in range(3):
        tracking.attitude_error[i] = x.error[i]
        tracking.virtual_rate[i] = x.virtual_rate[i]
        tracking.torque_demand[i] = x.demand[i]
        tracking.torque[i] = command.effort[i]


@kernel
def pd_kernel(t_ns, p, x, attitude, command, tracking):
    """u = I (-kp e - kd omega) - f M_g [N m]; zero torque until a first attitude is there."""
    if measure(p, x, attitude):
        proportional_derivative(x.error, x.omega, p.kp, p.kd, p.inertia, x.demand)
        for i in range(3):
            x.demand[i] -= p.feed_forward * x.gravity_torque[i]
    act(p, x, command, tracking)


class PdController(Component):
    """Proportional-derivative control of the Cubli rover's attitude."""

    parameters, state = PdParameters, BaselineState
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND, "tracking": cubli.TRACKING}
    rate_hz = 100.0
    start, kernel = start, pd_kernel

    @classmethod
    def check(cls, values, where):
        if values["gravity_sign"] == 0:
            raise FlightError(f"{where}.gravity_sign: 0 is not allowed; allowed: 1 or -1")
