"""The landing law as a component: odometry and model gravity in, wrench and the state of the constraints out.

Source: Nonlinear Dynamics 100, 2427-2448 (2020), in the reconstruction of `lander_ros.landing_law`.
"""

import math
from types import SimpleNamespace

from flight_graph.components.component import Component
from flight_graph.components.records import Array, State, Vec3, field
from flight_graph.kernel import kernel
from lander_ros.landing_checks import gain_warnings, require_vehicle
from lander_ros.landing_law import LandingLaw, landing_law, lyapunov, lyapunov_rate, lyapunov_rate_of_wrench
from lander_ros.potential import potential
from lander_ros.twistor import twistor_from_pose
from msg_schemas import lander

KEEP_OUT, OUT_OF_VIEW = 1, 2


class LandingControllerParameters(LandingLaw):
    refuse_unsafe_start: bool = field(True, doc="stop at a first pose in the keep-out funnel or out of the view cone")
    site_gravity: float = field(5.03e-3, unit="m/s^2", ge=0, doc="|g| at the site, for the warnings on gains only")


class PoseState(State):
    """Pose (B to D), velocity and rates in B, gravity in D, scratch, and the wrench in B."""

    position: Vec3
    orientation: Array(4)
    alpha: Vec3
    rate: Vec3
    gravity: Vec3
    work: Array(3, 3)
    gradient: Array(6)
    force: Vec3
    torque: Vec3


class LandingControllerState(PoseState):
    begun: bool
    twistor: Array(8)
    clearance: float
    view_deg: float
    view_limit_deg: float
    saturated_for: float
    saturated: float


@kernel
def take_odometry(x, odometry):
    """Copy pose and motor into the state; tells whether there is an estimate."""
    if odometry.header.stamp.sec == 0 or odometry.pose.covariance[0] < 0.0:
        return False
    for i in range(3):
        x.position[i] = odometry.pose.pose.position[i]
        x.alpha[i] = odometry.twist.twist.linear[i]
        x.rate[i] = odometry.twist.twist.angular[i]
    for i in range(4):
        x.orientation[i] = odometry.pose.pose.orientation[i]
    return True


@kernel
def control(t_ns, p, x, odometry, gravity, command, constraints, twistor):
    """Odometry -> force [N] and torque [N m] in B; zero until there is an estimate."""
    if not take_odometry(x, odometry):
        for i in range(3):
            command.wrench.force[i] = 0.0
            command.wrench.torque[i] = 0.0
        return
    for i in range(3):
        x.gravity[i] = gravity.accel.linear[i]
    u_t, u_r, u_1, u_2, d, c = potential(p, x.position, x.orientation, x.work, x.gradient)
    if not x.begun:
        x.begun = True
        require_start(p, x, d, c)
    clipped = landing_law(p, x.position, x.orientation, x.alpha, x.rate, x.gravity, x.work, x.gradient, x.force,
                          x.torque)
    if clipped > 0:
        x.saturated_for += p.period
        x.saturated += p.period
    else:
        x.saturated_for = 0.0
    for i in range(3):
        command.wrench.force[i] = x.force[i]
        command.wrench.torque[i] = x.torque[i]
    constraints.clearance = d
    constraints.view_cosine = c
    constraints.view_angle = math.acos(min(max(c, -1.0), 1.0))
    constraints.potential_terms[0] = u_t
    constraints.potential_terms[1] = u_r
    constraints.potential_terms[2] = u_1
    constraints.potential_terms[3] = u_2
    constraints.potential = u_t + u_r + u_1 + u_2
    constraints.saturated_axes = float(clipped)
    report(p, x, constraints, twistor)


@kernel
def require_start(p, x, d, c):
    """Set the fault of a first pose that breaks a constraint."""
    distance = math.sqrt(x.position[0] * x.position[0] + x.position[1] * x.position[1]
                         + x.position[2] * x.position[2])
    x.clearance = d
    x.view_deg = math.degrees(math.acos(min(max(c, -1.0), 1.0)))
    x.view_limit_deg = math.degrees(p.view_half_angle)
    if not p.refuse_unsafe_start:
        return
    if distance > p.view_cutoff_radius and not c > math.cos(p.view_half_angle):
        x.fault = OUT_OF_VIEW
    if not d > 0.0:
        x.fault = KEEP_OUT


@kernel
def report(p, x, constraints, twistor):
    """Lyapunov function and its rate, twistor and motor, of the pose and wrench in x."""
    constraints.lyapunov = lyapunov(p, constraints.potential, x.alpha, x.rate)
    constraints.lyapunov_rate = lyapunov_rate_of_wrench(
        p, x.position, x.orientation, x.alpha, x.rate, x.gravity, x.gradient, x.force, x.torque)
    constraints.lyapunov_rate_formula = lyapunov_rate(p, x.alpha, x.rate)
    for i in range(6):
        constraints.gradient[i] = x.gradient[i]
    constraints.saturated_for = x.saturated_for
    constraints.saturated = x.saturated
    twistor_from_pose(x.position, x.orientation, x.twistor)
    constraints.twistor_norm = math.sqrt(
        x.twistor[0] * x.twistor[0] + x.twistor[1] * x.twistor[1] + x.twistor[2] * x.twistor[2])
    constraints.shadow = 1.0 if x.orientation[3] < 0.0 else 0.0
    constraints.distance = math.sqrt(x.position[0] * x.position[0] + x.position[1] * x.position[1]
                                     + x.position[2] * x.position[2])
    for i in range(8):
        twistor.twistor[i] = x.twistor[i]
    for i in range(3):
        twistor.motor[i] = x.rate[i]
        twistor.motor[4 + i] = x.alpha[i]


class LandingController(Component):
    """Twistor-based landing law with path constraints, after Zhang and Cai (reconstruction)."""

    parameters, state = LandingControllerParameters, LandingControllerState
    inputs = {"odometry": lander.ODOMETRY, "gravity": lander.GRAVITY}
    outputs = {"command": lander.COMMAND, "constraints": lander.CONSTRAINTS, "twistor": lander.TWISTOR}
    rate_hz = 10.0
    kernel = control
    faults = {
        KEEP_OUT: "the start is inside the keep-out funnel: clearance {clearance:.3f} m (must be > 0), view angle "
                  "{view_deg:.2f} deg of at most {view_limit_deg:.2f} deg; start higher, or set refuse_unsafe_start to "
                  "false",
        OUT_OF_VIEW: "the start does not have the site in view: view angle {view_deg:.2f} deg of at most "
                     "{view_limit_deg:.2f} deg, clearance {clearance:.3f} m; turn -z_B to the site, or set "
                     "refuse_unsafe_start to false",
    }

    @classmethod
    def check(cls, values, where):
        require_vehicle(SimpleNamespace(**values), where)

    @classmethod
    def warnings(cls, values, period_s):
        """Gains for which saturation must be expected, in numbers."""
        return gain_warnings(SimpleNamespace(**values), values["site_gravity"], period_s)
