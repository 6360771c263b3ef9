"""Backstepping control as a component: the paper's second baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which gives neither equation nor gains; the law is in
`cubli_ros.backstepping`.
"""

from cubli_ros.appc import torque_demand
from cubli_ros.attitude import is_known
from cubli_ros.backstepping import backstepping
from cubli_ros.pd_controller import BaselineParameters, PdController, act, measured
from flight_graph.components.component import Component
from flight_graph.components.records import field
from flight_math import kernel
from msg_schemas import cubli


class BacksteppingParameters(BaselineParameters):
    feed_forward: float = field(1.0, unit="1", ge=0, le=1.5, doc="part of the gravity torque that is cancelled")
    c1: float = field(1.0, unit="1/s", gt=0, source="section 5.4 gives none", doc="gain on the attitude error")
    c2: float = field(2.0, unit="1/s", gt=0, source="section 5.4 gives none", doc="gain on the rate error")


@kernel
def backstepping_kernel(t_ns, p, x, attitude, command, tracking):
    """u = I (-G^T e - c2 (omega - alpha) + alpha') - f M_g [N m]; zero torque until a first attitude is there."""
    if is_known(attitude):
        turn, error, omega, moment = measured(p, attitude)
        virtual_rate, acceleration = backstepping(p, turn, error, omega)
        act(p, torque_demand(p, acceleration, moment), error, virtual_rate, command, tracking)


class BacksteppingController(Component):
    """Backstepping control of the Cubli rover's attitude.

    Promises: a torque on the body by each wheel [N m], axes of `cubli_base`, u = I (-G^T e - c2 (omega - alpha) +
    alpha') - f M_g, none beyond `torque_limit`. It promises no bound on the error: it is the paper's second baseline.

    Bad input: zero torque until a first attitude with a known orientation. An attitude that is unknown later
    (covariance -1) is left unanswered: the last torque stays. It does not look at ages.
    """

    parameters = BacksteppingParameters
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND, "tracking": cubli.TRACKING}
    rate_hz = 100.0
    kernel = backstepping_kernel
    check = PdController.check
