"""The PD + PD baseline as a component; it knows no path constraint. The law is in `lander_ros.pose_pd`."""

from types import SimpleNamespace

from flight_graph.components.component import Component
from flight_math import DualVector, Vec3, kernel
from lander_ros.landing_checks import require_vehicle
from lander_ros.landing_controller import is_estimate, pose_and_motor
from lander_ros.pose_pd import PosePd, pose_pd
from msg_schemas import lander


@kernel
def control(t_ns, p, x, odometry, gravity, command):
    """Odometry -> force [N] and torque [N m] in B; zero until there is an estimate."""
    wrench = DualVector(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))
    if is_estimate(odometry):
        r, q, motor = pose_and_motor(odometry)
        wrench, _ = pose_pd(p, r, q, motor, gravity.accel.linear)
    command.wrench.force, command.wrench.torque = wrench.real, wrench.dual


class PosePdController(Component):
    """PD law on position and attitude, the baseline of the landing.

    Promises: force [N] and torque [N m] on the body, frame B, within the limits of the thrusters, to the goal. It knows
    no constraint: it is what the landing law is compared with.

    Bad input: zero wrench while the odometry holds no estimate (covariance -1). It does not look at ages.
    """

    parameters = PosePd
    inputs = {"odometry": lander.ODOMETRY, "gravity": lander.GRAVITY}
    outputs = {"command": lander.COMMAND}
    rate_hz = 10.0
    kernel = control

    @classmethod
    def check(cls, values, where):
        require_vehicle(SimpleNamespace(**values), where)
