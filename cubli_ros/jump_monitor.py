"""The jump monitor as a component: how far the rover is from losing the ground, at control rate; a verdict at 10 Hz.

The criteria are in `cubli_ros.jump_condition`. The contact force comes from the model: attitude, rates and the torque that
is commanded now, without the disturbance, which nobody on board knows.
"""

from cubli_ros import jump_condition
from cubli_ros.appc_controller import RoverModel
from cubli_ros.attitude import gravity_torque, is_known, level_gravity
from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import State, field
from flight_math import cos, inverse, kernel, largest, maximum, minimum, norm, rotate_back
from msg_schemas import cubli
from msg_schemas.definitions import TYPESTORE

STATUS_PERIOD_NS = 100_000_000  # [ns] 10 Hz
OK, WARNING, ERROR = 0.0, 1.0, 2.0
_TEXTS = ("clear of jumping", "close to jumping", "jump condition violated")


class JumpMonitorParameters(RoverModel):
    friction: float = field(0.6, unit="1", gt=0, doc="friction coefficient of the ground")
    tilt: float = field(0.0, unit="rad", ge=0, lt=1.5, doc="angle between up and the ground's normal, eq. (9)")
    warn_margin: float = field(0.2, unit="1", ge=0, le=1, doc="warn when a margin is below this")
    clear_margin: float = field(0.3, unit="1", ge=0, le=1, doc="back to ok when all margins are above this")


class JumpMonitorState(State):
    """Verdict, and the extremes since the last one."""

    level: float
    axis_margin: float = 1.0
    across_margin: float = 1.0
    normal_force: float = 1.0
    friction_ratio: float


@kernel
def monitor(t_ns, p, x, attitude, command, margins, status):
    if is_known(attitude):
        measure(p, attitude, command, margins)
        x.axis_margin = minimum(x.axis_margin, margins.axis_margin)
        x.across_margin = minimum(x.across_margin, margins.across_margin)
        x.normal_force = minimum(x.normal_force, margins.normal_force)
        x.friction_ratio = maximum(x.friction_ratio, margins.friction_ratio)
    if t_ns % STATUS_PERIOD_NS == 0:
        x.level = judged(p, x)
        status.level = x.level
        status.axis_margin, status.across_margin = x.axis_margin, x.across_margin
        status.normal_force, status.friction_ratio = x.normal_force, x.friction_ratio
        x.axis_margin, x.across_margin, x.normal_force, x.friction_ratio = 1.0, 1.0, 1.0, 0.0


@kernel
def measure(p, attitude, command, margins):
    """Rates against their limits, and the contact force, from the estimate and the commanded torque."""
    omega, cosine = attitude.angular_velocity, cos(p.tilt)
    margins.planar_limit = jump_condition.planar_rate_limit(p.gravity, p.length, cosine)
    margins.corner_limit = jump_condition.corner_rate_limit(p.gravity, p.length, cosine)
    margins.axis_rate = largest(abs(omega))
    margins.rate_norm = norm(omega)
    margins.rate_across = jump_condition.rate_across_diagonal(omega)
    margins.axis_margin = margin(margins.axis_rate, margins.planar_limit)
    margins.norm_margin = margin(margins.rate_norm, margins.planar_limit)
    margins.across_margin = margin(margins.rate_across, margins.corner_limit)
    margins.normal_force, margins.friction_ratio = 0.0, jump_condition.LOST_CONTACT_RATIO
    if p.gravity > 0.0:
        gravity = rotate_back(attitude.orientation, level_gravity(p))
        acceleration = inverse(p.inertia) @ (gravity_torque(p, gravity) + command.effort)
        margins.normal_force, _, margins.friction_ratio = jump_condition.contact(
            omega, acceleration, gravity, -gravity / p.gravity, p.length)


@kernel
def margin(rate, limit):
    """1 - (rate / limit)^2; -LOST_CONTACT_RATIO where nothing holds the rover down."""
    if limit <= 0.0:
        return -jump_condition.LOST_CONTACT_RATIO
    return 1.0 - rate / limit * (rate / limit)


@kernel
def judged(p, x):
    """Error when a criterion is violated, warning near it, and back to ok only above the clear margin."""
    margin = minimum(minimum(x.axis_margin, x.across_margin), minimum(x.normal_force, 1.0 - x.friction_ratio / p.friction))
    if margin < 0.0:
        return ERROR
    if margin < p.warn_margin:
        return WARNING
    return OK if margin > p.clear_margin or x.level == OK else WARNING


def diagnostics(record):
    """The verdict as a DiagnosticArray."""
    types = TYPESTORE.types
    level = int(record.level)
    values = [types["diagnostic_msgs/msg/KeyValue"](name, f"{float(getattr(record, name)):.6g}")
              for name in ("axis_margin", "across_margin", "normal_force", "friction_ratio")]
    time = types["builtin_interfaces/msg/Time"](int(record.header.stamp.sec), int(record.header.stamp.nanosec))
    return types["diagnostic_msgs/msg/DiagnosticArray"](types["std_msgs/msg/Header"](time, ""), [
        types["diagnostic_msgs/msg/DiagnosticStatus"](level, "jump_monitor", _TEXTS[level], "cubli", values)])


class JumpMonitor(Component):
    """Watches whether the Cubli rover stays on the ground: rate limits, normal force, friction.

    Promises: margins to losing the ground at every firing: rates [rad/s] against eq. (9), by axis, by norm and about
    the corner, normal force [m g] and friction ratio of the model; and the worst of them ten times a second as a
    verdict, ok, warning or error, with hysteresis, also on /diagnostics. The disturbance, which nobody on board knows,
    is not in the contact force.

    Bad input: while no attitude with a known orientation is there nothing is measured, and the verdict is ok. Without
    gravity the normal force is 0 and the friction ratio 1e6: an error.
    """

    parameters, state = JumpMonitorParameters, JumpMonitorState
    inputs = {"attitude": cubli.ATTITUDE, "command": cubli.COMMAND}
    outputs = {"margins": cubli.JUMP_MARGINS, "status": cubli.JUMP_STATUS}
    output_rate_hz = {"status": 10.0}
    rate_hz = 100.0
    kernel = monitor
    formatted = (Formatted("diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "status", diagnostics),)
