"""The landing law as a component: odometry and model gravity in, wrench and the state of the constraints out.

Source: Nonlinear Dynamics 100, 2427-2448 (2020), in the reconstruction of `lander_ros.landing_law`.
"""

import math
from types import SimpleNamespace

from flight_graph.components.component import Component
from flight_graph.components.records import State, field
from flight_math import DualVector, Vec, Vec3, cos, kernel, norm
from lander_ros.constraints import view_angle
from lander_ros.feed_forward import clip_wrench, feed_forward
from lander_ros.landing_checks import gain_warnings, require_vehicle
from lander_ros.landing_law import LandingLaw, landing_wrench, lyapunov, lyapunov_rate, lyapunov_rate_of_wrench
from lander_ros.potential import potential
from lander_ros.twistor import eight_numbers, twistor_from_pose
from msg_schemas import lander

KEEP_OUT, OUT_OF_VIEW = 1, 2
DEGREES = 180.0 / math.pi  # in a radian
Vec4, Vec6 = Vec(4), Vec(6)


class LandingControllerParameters(LandingLaw):
    refuse_unsafe_start: bool = field(True, doc="stop at a first pose in the keep-out funnel or out of the view cone")
    site_gravity: float = field(5.03e-3, unit="m/s^2", ge=0, doc="|g| at the site, for the warnings on gains only")


class LandingControllerState(State):
    """begun: a first pose has come, with the clearance and the view that a refusal names; time with an axis clipped."""

    begun: bool
    clearance: float
    view_deg: float
    view_limit_deg: float
    saturated_for: float
    saturated: float


@kernel
def is_estimate(odometry):
    """Whether an odometry holds an estimate."""
    return odometry.header.stamp.sec != 0 and odometry.pose.covariance[0] >= 0.0


@kernel
def pose_and_motor(odometry):
    """r^D [m], q (B -> D) and V = w + eps alpha of an odometry."""
    pose, twist = odometry.pose.pose, odometry.twist.twist
    return pose.position, pose.orientation, DualVector(twist.angular, twist.linear)


@kernel
def control(t_ns, p, x, inputs, outputs):
    """Odometry -> force [N] and torque [N m] in B; zero until there is an estimate."""
    command, constraints = outputs.command.wrench, outputs.constraints
    if not is_estimate(inputs.odometry):
        command.force = Vec3(0.0, 0.0, 0.0)
        command.torque = Vec3(0.0, 0.0, 0.0)
        return
    r, q, motor = pose_and_motor(inputs.odometry)
    terms, d, c, gradient = potential(p, r, q)
    if not x.begun:
        x.begun = True
        require_start(p, x, norm(r), d, c)
    forward = feed_forward(p, r, q, inputs.gravity.accel.linear)
    wrench, clipped = clip_wrench(p, landing_wrench(p, motor, gradient, forward))
    x.saturated_for = x.saturated_for + p.period if clipped > 0 else 0.0
    x.saturated = x.saturated + p.period if clipped > 0 else x.saturated
    command.force, command.torque = wrench.real, wrench.dual
    constraints.clearance, constraints.view_cosine, constraints.view_angle = d, c, view_angle(c)
    report_energy(p, terms, motor, gradient, wrench - forward, constraints)
    constraints.saturated_axes = float(clipped)
    constraints.saturated_for, constraints.saturated = x.saturated_for, x.saturated
    twistor = twistor_from_pose(r, q)
    constraints.twistor_norm = norm(twistor.real)
    constraints.shadow = 1.0 if q.w < 0.0 else 0.0
    constraints.distance = norm(r)
    outputs.twistor.twistor, outputs.twistor.motor = eight_numbers(twistor), eight_numbers(motor)


@kernel
def require_start(p, x, distance, d, c):
    """Set the fault of a first pose that breaks a constraint."""
    x.clearance, x.view_deg, x.view_limit_deg = d, DEGREES * view_angle(c), DEGREES * p.view_half_angle
    if p.refuse_unsafe_start and distance > p.view_cutoff_radius and not c > cos(p.view_half_angle):
        x.fault = OUT_OF_VIEW
    if p.refuse_unsafe_start and not d > 0.0:
        x.fault = KEEP_OUT


@kernel
def report_energy(p, terms, motor, gradient, excess, constraints):
    """Potential, its gradient, the Lyapunov function and its rate under the wrench F = F_ff + excess."""
    u_t, u_r, u_1, u_2 = terms
    constraints.potential = u_t + u_r + u_1 + u_2
    constraints.potential_terms = Vec4(u_t, u_r, u_1, u_2)
    constraints.lyapunov = lyapunov(p, constraints.potential, motor)
    constraints.lyapunov_rate = lyapunov_rate_of_wrench(p, motor, gradient, excess)
    constraints.lyapunov_rate_formula = lyapunov_rate(p, motor)
    by_turn, by_place = gradient.real, gradient.dual
    constraints.gradient = Vec6(by_turn.x, by_turn.y, by_turn.z, by_place.x, by_place.y, by_place.z)


class LandingController(Component):
    """Twistor-based landing law with path constraints, after Zhang and Cai (reconstruction).

    Promises: force [N] and torque [N m] on the body, frame B, within the limits of the thrusters, to the goal at rest.
    As long as nothing saturates and the odometry is right, clearance stays above zero and the site in the view cone,
    because the Lyapunov function does not rise. Clearance [m], view angle [rad], energy, its rate and the time of
    saturation [s] are said at every firing.

    Bad input: zero wrench while the odometry holds no estimate (covariance -1). It does not look at ages: the mode
    manager does. A first pose that breaks a constraint ends the run, unless `refuse_unsafe_start` is false. Gains with
    which saturation must be expected are warned of before the run, with the numbers.
    """

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
