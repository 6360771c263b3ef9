"""The jump monitor as a component: how far the rover is from losing the ground, at control rate; a verdict at 10 Hz.

The criteria are in `cubli_ros.jump_condition`. The contact force comes from the model: attitude, rates and the torque that
is commanded now, without the disturbance, which nobody on board knows.
"""

import math

from cubli_ros import jump_condition
from cubli_ros.appc_controller import RoverModel
from cubli_ros.attitude import cardan_from_quaternion, diagonal_torque, invert_3x3, to_body
from flight_graph.components.component import Component, Formatted
from flight_graph.components.records import Array, State, Vec3, field
from flight_graph.kernel import kernel
from flight_graph.vectors import matrix_vector
from msg_schemas import cubli
from msg_schemas.definitions import TYPESTORE

OK, WARNING, ERROR = 0, 1, 2
_TEXTS = ("clear of jumping", "close to jumping", "jump condition violated")


class JumpMonitorParameters(RoverModel):
    friction: float = field(0.6, unit="1", gt=0, doc="friction coefficient of the ground")
    tilt: float = field(0.0, unit="rad", ge=0, lt=1.5, doc="angle between up and the ground's normal, eq. (9)")
    warn_margin: float = field(0.2, unit="1", ge=0, le=1, doc="warn when a margin is below this")
    clear_margin: float = field(0.3, unit="1", ge=0, le=1, doc="back to ok when all margins are above this")


class JumpMonitorState(State):
    angles: Vec3
    torque: Vec3
    accelerations: Vec3
    gravity: Vec3
    up: Vec3
    inverse: Array(3, 3)
    level: float
    axis_margin: float = 1.0
    across_margin: float = 1.0
    normal_force: float = 1.0
    friction_ratio: float


@kernel
def start(p, x):
    invert_3x3(p.inertia, x.inverse)


@kernel
def monitor(t_ns, p, x, attitude, command, margins, status):
    known = attitude.header.stamp.sec != 0 and attitude.orientation_covariance[0] >= 0.0
    if known:
        measure(p, x, attitude, command, margins)
        x.axis_margin = min(x.axis_margin, margins.axis_margin)
        x.across_margin = min(x.across_margin, margins.across_margin)
        x.normal_force = min(x.normal_force, margins.normal_force)
        x.friction_ratio = max(x.friction_ratio, margins.friction_ratio)
    if t_ns % STATUS_PERIOD_NS == 0:
        judge(p, x)
        status.level = x.level
        status.axis_margin = x.axis_margin
        status.across_margin = x.across_margin
        status.normal_force = x.normal_force
        status.friction_ratio = x.friction_ratio
        x.axis_margin = 1.0
        x.across_margin = 1.0
        x.normal_force = 1.0
        x.friction_ratio = 0.0


@kernel
def measure(p, x, attitude, command, margins):
    """Rates against their limits, and the contact force, from the estimate and the commanded torque."""
    cardan_from_quaternion(attitude.orientation, x.angles)
    part = -p.gravity / math.sqrt(3.0)
    x.gravity[0], x.gravity[1], x.gravity[2] = to_body(x.angles, part, part, part)
    m_x, m_y, m_z = diagonal_torque(
        float(p.gravity_sign), p.mass, p.length, x.gravity[0], x.gravity[1], x.gravity[2])
    x.accelerations[0], x.accelerations[1], x.accelerations[2] = matrix_vector(
        x.inverse, m_x + command.effort[0], m_y + command.effort[1], m_z + command.effort[2])
    omega = attitude.angular_velocity
    cosine = math.cos(p.tilt)
    margins.planar_limit = jump_condition.planar_rate_limit(p.gravity, p.length, cosine)
    margins.corner_limit = jump_condition.corner_rate_limit(p.gravity, p.length, cosine)
    margins.axis_rate = jump_condition.largest_axis_rate(omega)
    margins.rate_norm = jump_condition.rate_norm(omega)
    margins.rate_across = jump_condition.rate_across_diagonal(omega)
    margins.axis_margin = margin(margins.axis_rate, margins.planar_limit)
    margins.norm_margin = margin(margins.rate_norm, margins.planar_limit)
    margins.across_margin = margin(margins.rate_across, margins.corner_limit)
    margins.normal_force = 0.0
    margins.friction_ratio = jump_condition.LOST_CONTACT_RATIO
    if p.gravity > 0.0:
        for i in range(3):
            x.up[i] = -x.gravity[i] / p.gravity
        margins.normal_force, _, margins.friction_ratio = jump_condition.contact(
            omega, x.accelerations, x.gravity, x.up, p.length)


@kernel
def margin(rate, limit):
    """1 - (rate / limit)^2; -LOST_CONTACT_RATIO where nothing holds the rover down."""
    if limit <= 0.0:
        return -jump_condition.LOST_CONTACT_RATIO
    return 1.0 - rate / limit * (rate / limit)


@kernel
def judge(p, x):
    """Error when a criterion is violated, warning near it, and back to ok only above the clear margin."""
    smallest = min(x.axis_margin, x.across_margin, x.normal_force, 1.0 - x.friction_ratio / p.friction)
    if smallest < 0.0:
        x.level = ERROR
    elif smallest < p.warn_margin:
        x.level = WARNING
    elif smallest > p.clear_margin or x.level == OK:
        x.level = OK
    else:
        x.level = WARNING


STATUS_PERIOD_NS = 100_000_000  # [ns] 10 Hz


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
    """Watches whether the Cubli rover stays on the ground: rate limits, normal force, friction."""

    parameters, state = JumpMonitorParameters, JumpMonitorState
    inputs = {"attitude": cubli.ATTITUDE, "command": cubli.COMMAND}
    outputs = {"margins": cubli.JUMP_MARGINS, "status": cubli.JUMP_STATUS}
    output_rate_hz = {"status": 10.0}
    rate_hz = 100.0
    start, kernel = start, monitor
    formatted = (Formatted("diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "status", diagnostics),)
