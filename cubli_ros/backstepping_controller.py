"""Backstepping control as a component: the paper's second baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which gives neither equation nor gains; the law is in
`cubli_ros.backstepping`.
"""

from cubli_ros.backstepping import backstepping
from cubli_ros.pd_controller import BaselineParameters, BaselineState, PdController, act, measure, start
from flight_graph.components.component import Component
from flight_graph.components.records import field
from flight_graph.kernel import kernel
from msg_schemas import cubli


class BacksteppingParameters(BaselineParameters):
    feed_forward: float = field(1.0, unit="1", ge=0, le=1.5, doc="part of the gravity torque that is cancelled")
    c1: float = field(1.0, unit="1/s", gt=0, source="section 5.4 gives none", doc="gain on the attitude error")
    c2: float = field(2.0, unit="1/s", gt=0, source="section 5.4 gives none", doc="gain on the rate error")


@kernel
def backstepping_kernel(t_ns, p, x, attitude, command, tracking):
    """u = I (-G^T e - c2 (omega - alpha) + alpha') - f M_g [N m]; zero torque until a first attitude is there."""
    if measure(p, x, attitude):
        for i in range(3):
            x.gravity_torque[i] *= p.feed_forward
        backstepping(x.angles, x.error, x.omega, p.c1, p.c2, p.inertia, x.gravity_torque, x.demand, x.virtual_rate)
    act(p, x, command, tracking)


class BacksteppingController(Component):
    """Backstepping control of the Cubli rover's attitude."""

    parameters, state = BacksteppingParameters, BaselineState
    inputs = {"attitude": cubli.ATTITUDE}
    outputs = {"command": cubli.COMMAND, "tracking": cubli.TRACKING}
    rate_hz = 100.0
    start, kernel = start, backstepping_kernel
    check = PdController.check
