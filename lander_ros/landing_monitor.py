"""The landing monitor as a component: are the path constraints kept, and is it still certain that they will be.

Levels (ours): warning where r > 20 m and d < 5 m, where r > 5 m and the view angle is within 5 deg of its limit,
after 5 s of uninterrupted saturation, or below the funnel's gate outside the touchdown funnel; error where a
constraint is violated or L has left the set it started in; stale where the odometry is older than 0.5 s.

Abort advice: the constraints are forward invariant because L(t) <= L(0) bounds the barriers. That is lost when a
constraint is violated, or when L exceeds its value at the start by more than the navigation's noise explains.
"""

import math

from flight_graph.components.component import Component, Formatted, same_stamp
from flight_graph.components.records import Array, Parameters, State, Vec3, field
from flight_graph.kernel import kernel
from flight_graph.timebase import SECOND
from lander_ros.constraints import clearance, view_cosine
from msg_schemas import lander
from msg_schemas.definitions import TYPESTORE

OK, WARNING, ERROR, STALE = 0, 1, 2, 3
CLEARANCE, VIEW, SATURATION, ENERGY, FUNNEL, AGE = 1, 2, 4, 8, 16, 32
STATUS_PERIOD_NS = 500_000_000  # [ns] 2 Hz
REASONS = {CLEARANCE: "clearance", VIEW: "line of sight", SATURATION: "saturation", ENERGY: "Lyapunov function rose",
           FUNNEL: "outside the touchdown funnel", AGE: "no recent odometry"}


class LandingMonitorParameters(Parameters):
    funnel_alpha: float = field(27.0, unit="m^(1/gamma - 2)", gt=0, doc="alpha of the keep-out funnel")
    funnel_beta: float = field(1.2, unit="1", gt=0, doc="beta of the keep-out funnel")
    funnel_gamma: float = field(1.0 / 3.0, unit="1", gt=0, doc="gamma of the keep-out funnel")
    funnel_rho_0: float = field(10.0, unit="m", ge=0, doc="rounding of the funnel's tip")
    funnel_z_0: float = field(1.5, unit="m", ge=0, doc="depth of the funnel's tip below the goal")
    view_half_angle: float = field(math.radians(30.0), unit="rad", gt=0, lt=math.pi, doc="of the view cone")
    view_margin: float = field(math.radians(5.0), unit="rad", ge=0, doc="warn within this of the cone")
    view_range: float = field(5.0, unit="m", ge=0, doc="the view is watched beyond")
    clearance_margin: float = field(5.0, unit="m", ge=0, doc="warn below this clearance")
    clearance_range: float = field(20.0, unit="m", ge=0, doc="the clearance margin is watched beyond")
    saturation_time: float = field(5.0, unit="s", ge=0, doc="warn after this much uninterrupted saturation")
    energy_margin: float = field(0.02, unit="1", ge=0, doc="L may exceed its start by this part")
    gate_height: float = field(1.0, unit="m", gt=0, doc="the touchdown funnel is watched below")
    touchdown_lateral: float = field(0.5, unit="m", gt=0, doc="largest distance from the site's normal")
    touchdown_speed: float = field(0.1, unit="m/s", gt=0, doc="largest speed")
    touchdown_attitude: float = field(math.radians(3.0), unit="rad", gt=0, doc="largest attitude error")
    touchdown_rate: float = field(math.radians(0.2), unit="rad/s", gt=0, doc="largest rate")
    odometry_timeout: float = field(0.5, unit="s", gt=0, doc="stale above this age")


class LandingMonitorState(State):
    position: Vec3
    orientation: Array(4)
    gradient: Vec3
    lyapunov_limit: float
    known: bool
    lowest_clearance: float = 1e9
    widest_view: float
    reasons: float
    errors: float
    ready: float = 1.0


@kernel
def monitor(t_ns, p, x, odometry, constraints, status):
    stamp = odometry.header.stamp
    x.known = x.known or (stamp.sec != 0 and odometry.pose.covariance[0] >= 0.0)
    if x.known and same_stamp(stamp, status.header.stamp):
        look(p, x, odometry, constraints)
    if t_ns % STATUS_PERIOD_NS == 0:
        age = (status.header.stamp.sec - float(stamp.sec)) + (
            float(status.header.stamp.nanosec) - float(stamp.nanosec)) / SECOND
        judge(p, x, age, constraints, status)


@kernel
def look(p, x, odometry, constraints):
    """Constraints and touchdown funnel at the pose; collects what is wrong until the next status."""
    for i in range(3):
        x.position[i] = odometry.pose.pose.position[i]
    for i in range(4):
        x.orientation[i] = odometry.pose.pose.orientation[i]
    d = clearance(x.position, p.funnel_alpha, p.funnel_beta, p.funnel_gamma, p.funnel_rho_0, p.funnel_z_0, x.gradient)
    view = math.acos(min(max(view_cosine(x.position, x.orientation), -1.0), 1.0))
    distance = length(x.position)
    x.lowest_clearance = min(x.lowest_clearance, d)
    warnings, errors = 0, 0
    if d < 0.0:
        errors |= CLEARANCE
    elif distance > p.clearance_range and d < p.clearance_margin:
        warnings |= CLEARANCE
    if distance > p.view_range:
        x.widest_view = max(x.widest_view, view)
        if view > p.view_half_angle:
            errors |= VIEW
        elif view > p.view_half_angle - p.view_margin:
            warnings |= VIEW
    if constraints.header.stamp.sec != 0:
        if x.lyapunov_limit == 0.0:
            x.lyapunov_limit = constraints.lyapunov * (1.0 + p.energy_margin)
        if constraints.saturated_for > p.saturation_time:
            warnings |= SATURATION
        if constraints.lyapunov > x.lyapunov_limit:
            errors |= ENERGY
    x.ready = 1.0
    if x.position[2] < p.gate_height and distance < p.clearance_range:
        turn = 2.0 * math.asin(min(1.0, length(x.orientation)))
        lateral = math.sqrt(x.position[0] * x.position[0] + x.position[1] * x.position[1])
        if (lateral > p.touchdown_lateral or length(odometry.twist.twist.linear) > p.touchdown_speed
                or turn > p.touchdown_attitude or length(odometry.twist.twist.angular) > p.touchdown_rate):
            warnings |= FUNNEL
            x.ready = 0.0
    x.reasons = float(int(x.reasons) | warnings | errors)
    x.errors = float(int(x.errors) | errors)


@kernel
def length(vector):
    """|vector| of the first three components."""
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@kernel
def judge(p, x, age, constraints, status):
    """The verdict on everything since the last status."""
    status.level = float(OK)
    if x.reasons > 0.0:
        status.level = float(WARNING)
    if x.errors > 0.0:
        status.level = float(ERROR)
    status.abort = 1.0 if x.errors > 0.0 else 0.0
    status.reasons = x.reasons
    if not x.known or age > p.odometry_timeout:
        status.level = float(STALE)
        status.reasons = float(int(x.reasons) | AGE)
    status.odometry_age = age if x.known else 0.0
    status.clearance = x.lowest_clearance
    status.view_angle = x.widest_view
    status.distance = length(x.position)
    status.potential = constraints.potential
    status.lyapunov = constraints.lyapunov
    status.lyapunov_limit = x.lyapunov_limit
    status.saturated_for = constraints.saturated_for
    status.touchdown_ready = x.ready
    status.twistor_norm = constraints.twistor_norm
    status.shadow = constraints.shadow
    x.reasons = 0.0
    x.errors = 0.0
    x.lowest_clearance = 1e9
    x.widest_view = 0.0


def diagnostics(record):
    """The verdict as a DiagnosticArray."""
    types = TYPESTORE.types
    level, reasons = int(record.level), int(record.reasons)
    text = ", ".join(words for bit, words in REASONS.items() if reasons & bit) or "constraints kept"
    values = [types["diagnostic_msgs/msg/KeyValue"](name, f"{float(getattr(record, name)):.6g}") for name in (
        "abort", "clearance", "view_angle", "distance", "potential", "lyapunov", "lyapunov_limit", "saturated_for",
        "odometry_age", "touchdown_ready", "twistor_norm", "shadow")]
    time = types["builtin_interfaces/msg/Time"](int(record.header.stamp.sec), int(record.header.stamp.nanosec))
    return types["diagnostic_msgs/msg/DiagnosticArray"](types["std_msgs/msg/Header"](time, ""), [
        types["diagnostic_msgs/msg/DiagnosticStatus"](
            level, "landing_monitor", f"abort: {text}" if record.abort else text, "lander", values)])


class LandingMonitor(Component):
    """Watches the path constraints of the landing, their invariance, and the touchdown funnel."""

    parameters, state = LandingMonitorParameters, LandingMonitorState
    inputs = {"odometry": lander.ODOMETRY, "constraints": lander.CONSTRAINTS}
    outputs = {"status": lander.STATUS}
    optional_inputs = ("constraints",)
    output_rate_hz = {"status": 2.0}
    rate_hz = 10.0
    kernel = monitor
    formatted = (Formatted("diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "status", diagnostics),)
