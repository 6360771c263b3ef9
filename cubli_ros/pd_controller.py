"""Proportional-derivative control as a component: the paper's first baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which gives no gains; the law is in `cubli_ros.pd`.
"""

from cubli_ros.appc import torque_demand
from cubli_ros.appc_controller import RoverModel
from cubli_ros.attitude import cardan_from_quaternion, gravity_torque, is_known, level_gravity
from cubli_ros.pd import proportional_derivative
from flight_graph.components.component import Component
from flight_graph.components.records import field
from flight_graph.errors import FlightError
from flight_math import Vec3, clip, kernel, rotate_back, same, sincos
from msg_schemas import cubli


class BaselineParameters(RoverModel):
    """What both baselines have beyond the rover's model."""

    feed_forward: float = field(0.0, unit="1", ge=0, le=1.5, doc="part of the gravity torque that is cancelled")


class PdParameters(BaselineParameters):
    kp: Vec3 = field(1.0, unit="1/s^2", ge=0, source="section 5.4 gives none", doc="gain on the attitude error")
    kd: Vec3 = field(1.0, unit="1/s", ge=0, source="section 5.4 gives none", doc="gain on the body rate")


@kernel
def measured(p, attitude):
    """The angles' sincos, the error of the angles [rad], the body rates [rad/s] and the moment of gravity M_g [N m]."""
    angles = cardan_from_quaternion(attitude.orientation)
    gravity = rotate_back(attitude.orientation, level_gravity(p))
    return sincos(angles), angles - p.reference, attitude.angular_velocity, gravity_torque(p, gravity)


@kernel
def act(p, demand, error, virtual_rate, command, tracking):
    """The demand [N m], limited, as the command; and what is to be told of it."""
    command.effort = clip(demand, -p.torque_limit, p.torque_limit)
    tracking.attitude_error, tracking.virtual_rate = error, virtual_rate
    tracking.torque_demand, tracking.torque = demand, command.effort


@kernel
def pd_kernel(t_ns, p, x, attitude, command, tracking):
    """u = I (-kp e - kd omega) - f M_g [N m]; zero torque until a first attitude is there."""
    if is_known(attitude):
        _, error, omega, moment = measured(p, attitude)
        demand = torque_demand(p, proportional_derivative(p, error, omega), moment)
        act(p, demand, error, same(0.0), command, tracking)


class PdController(Component):
    """Proportional-derivative control of the Cubli rover's attitude.

    Promises: a torque on the body by each wheel [N m], axes of `cubli_base`, u = I (-kp e - kd omega) - f M_g, none
    beyond `torque_limit`. It promises no bound on the error: it is the paper's first baseline.

    Bad input: zero torque until a first attitude with a known orientation. An attitude that is unknown later
    (covariance -1) is left unanswered: the last torque stays. It does not look at ages.
    """

    parameters = PdParameters
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND, "tracking": cubli.TRACKING}
    rate_hz = 100.0
    kernel = pd_kernel

    @classmethod
    def check(cls, values, where):
        if values["gravity_sign"] == 0:
            raise FlightError(f"{where}.gravity_sign: 0 is not allowed; allowed: 1 or -1")
