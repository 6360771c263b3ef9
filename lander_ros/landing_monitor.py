"""The landing monitor as a component: are the path constraints kept, and is it still certain that they will be.

Levels (ours): warning where r > 20 m and d < 5 m, where r > 5 m and the view angle is within 5 deg of its limit,
after 5 s of uninterrupted saturation, or below the funnel's gate outside the touchdown funnel; error where a
constraint is violated or L has left the set it started in; stale where the odometry is older than 0.5 s.

Abort advice: the constraints are forward invariant because L(t) <= L(0) bounds the barriers. That is lost when a
constraint is violated, or when L exceeds its value at the start by more than the navigation's noise explains.
"""

import math

from flight_graph.components.component import Component, Formatted, same_stamp
from flight_graph.components.records import Parameters, State, field
from flight_graph.timebase import SECOND
from flight_math import asin, kernel, norm, vector_part
from lander_ros.constraints import clearance, view_angle, view_cosine
from msg_schemas import lander
from msg_schemas.definitions import TYPESTORE

OK, WARNING, ERROR, STALE = 0, 1, 2, 3
CLEARANCE, VIEW, SATURATION, ENERGY, FUNNEL, AGE = 1, 2, 4, 8, 16, 32
STATUS_PERIOD_NS = 500_000_000  # [ns] 2 Hz
NOTHING_SEEN = 1e9  # [m] lowest clearance before a first look
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
    """The last pose's distance [m], and what has been seen since the last status: extremes and sums of reasons."""

    known: bool
    distance: float
    ready: bool = True
    lyapunov_limit: float
    lowest_clearance: float = NOTHING_SEEN
    widest_view: float
    reasons: int
    errors: int


@kernel
def monitor(t_ns, p, x, odometry, constraints, status):
    stamp, now = odometry.header.stamp, status.header.stamp
    x.known = x.known or (stamp.sec != 0 and odometry.pose.covariance[0] >= 0.0)
    if x.known and same_stamp(stamp, now):
        look(p, x, odometry.pose.pose, odometry.twist.twist)
        if constraints.header.stamp.sec != 0:
            watch_law(p, x, constraints)
    if t_ns % STATUS_PERIOD_NS == 0:
        age = (now.sec - float(stamp.sec)) + (float(now.nanosec) - float(stamp.nanosec)) / SECOND
        judge(p, x, age, constraints, status)


@kernel
def look(p, x, pose, twist):
    """Constraints and touchdown funnel at the pose; collects what is wrong until the next status."""
    r, q = pose.position, pose.orientation
    d, view = clearance(p, r), view_angle(view_cosine(r, q))
    x.distance = norm(r)
    x.lowest_clearance = min(x.lowest_clearance, d)
    if d < 0.0:
        blame(x, CLEARANCE, True)
    elif x.distance > p.clearance_range and d < p.clearance_margin:
        blame(x, CLEARANCE, False)
    if x.distance > p.view_range:
        x.widest_view = max(x.widest_view, view)
        if view > p.view_half_angle:
            blame(x, VIEW, True)
        elif view > p.view_half_angle - p.view_margin:
            blame(x, VIEW, False)
    x.ready = True
    if r.z < p.gate_height and x.distance < p.clearance_range:
        turn = 2.0 * asin(min(1.0, norm(vector_part(q))))
        x.ready = (math.sqrt(r.x * r.x + r.y * r.y) <= p.touchdown_lateral and norm(twist.linear) <= p.touchdown_speed
                   and turn <= p.touchdown_attitude and norm(twist.angular) <= p.touchdown_rate)
        if not x.ready:
            blame(x, FUNNEL, False)


@kernel
def watch_law(p, x, constraints):
    """Saturation, and whether the Lyapunov function has left the set it started in."""
    if x.lyapunov_limit == 0.0:
        x.lyapunov_limit = constraints.lyapunov * (1.0 + p.energy_margin)
    if constraints.saturated_for > p.saturation_time:
        blame(x, SATURATION, False)
    if constraints.lyapunov > x.lyapunov_limit:
        blame(x, ENERGY, True)


@kernel
def blame(x, reason, error):
    """Add a reason to those since the last status, of a warning or of an error."""
    x.reasons = x.reasons | reason
    x.errors = x.errors | reason if error else x.errors


@kernel
def judge(p, x, age, constraints, status):
    """The verdict on everything since the last status."""
    stale = not x.known or age > p.odometry_timeout
    verdict = STALE if stale else ERROR if x.errors > 0 else WARNING if x.reasons > 0 else OK
    status.level = float(verdict)
    status.abort = 1.0 if x.errors > 0 else 0.0
    status.reasons = float(x.reasons | AGE if stale else x.reasons)
    status.odometry_age = age if x.known else 0.0
    status.clearance = x.lowest_clearance
    status.view_angle = x.widest_view
    status.distance = x.distance
    status.potential = constraints.potential
    status.lyapunov = constraints.lyapunov
    status.lyapunov_limit = x.lyapunov_limit
    status.saturated_for = constraints.saturated_for
    status.touchdown_ready = 1.0 if x.ready else 0.0
    status.twistor_norm = constraints.twistor_norm
    status.shadow = constraints.shadow
    x.reasons, x.errors = 0, 0
    x.lowest_clearance, x.widest_view = NOTHING_SEEN, 0.0


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
    """Watches the path constraints of the landing, their invariance, and the touchdown funnel.

    Promises: twice a second a verdict on everything since the last one: ok, warning, error or stale, its reasons, the
    lowest clearance [m] and the widest view angle [rad]; and advice to abort once a constraint is violated or the
    Lyapunov function has left the set it started in. Also on /diagnostics.

    Bad input: stale before a first estimate, and while the odometry is older than `odometry_timeout` [s]. Without the
    law's telemetry the pose alone is judged.
    """

    parameters, state = LandingMonitorParameters, LandingMonitorState
    inputs = {"odometry": lander.ODOMETRY, "constraints": lander.CONSTRAINTS}
    outputs = {"status": lander.STATUS}
    optional_inputs = ("constraints",)
    output_rate_hz = {"status": 2.0}
    rate_hz = 10.0
    kernel = monitor
    formatted = (Formatted("diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "status", diagnostics),)
