"""The PD + PD baseline as a component; it knows no path constraint. The law is in `lander_ros.pose_pd`."""

from types import SimpleNamespace

from flight_graph.components.component import Component
from flight_graph.kernel import kernel
from lander_ros.landing_checks import require_vehicle
from lander_ros.landing_controller import PoseState, take_odometry
from lander_ros.pose_pd import PosePd, pose_pd
from msg_schemas import lander


@kernel
def control(t_ns, p, x, odometry, gravity, command):
    """Odometry -> force [N] and torque [N m] in B; zero until there is an estimate."""
    if take_odometry(x, odometry):
        for i in range(3):
            x.gravity[i] = gravity.accel.linear[i]
        pose_pd(p, x.position, x.orientation, x.alpha, x.rate, x.gravity, x.work, x.gradient, x.force, x.torque)
    for i in range(3):
        command.wrench.force[i] = x.force[i]
        command.wrench.torque[i] = x.torque[i]


class PosePdController(Component):
    """PD law on position and attitude, the baseline of the landing."""

    parameters, state = PosePd, PoseState
    inputs = {"odometry": lander.ODOMETRY, "gravity": lander.GRAVITY}
    outputs = {"command": lander.COMMAND}
    rate_hz = 10.0
    kernel = control

    @classmethod
    def check(cls, values, where):
        require_vehicle(SimpleNamespace(**values), where)
