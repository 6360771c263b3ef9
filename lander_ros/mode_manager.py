"""Who flies the lander: the landing law, or a safe state. The last component before the thrusters.

  descend  the landing law's command, as it is
  hover    come to rest and hold the place, site in view (`lander_ros.safe_states`)
  abort    climb along the line of sight, then hold. Without a valid estimate blind: the velocity change of the last valid
           one, in body axes; then the weight as it was, for blind_time; then nothing; attitude held while it is known

By itself: an estimate that is invalid or older than estimate_age for `patience` leads to abort; a nominal command older
than command_age, in descend, to hover; a hover leaves for abort while it can still pay for one. For a first valid estimate
it waits acquisition_time. By request: hover from descend, with an estimate that was valid within `patience`; descend from
hover, with a fresh nominal command besides; abort, which is final (asked for again, it takes its line and attitude anew).
Hover and abort are allowed while the budget covers their cost times `margin`; both are computed at each firing and
published before anybody asks. What is not allowed is refused and counted; where not even an abort can be paid for, the
landing goes on. A descent that a valid estimate has seen below commit_height is committed: from then on it is final.
"""

from flight_graph.components.component import Component
from flight_graph.components.records import Quaternion, State, field
from flight_graph.timebase import SECOND
from flight_math import DualVector, Vec3, kernel, norm, normalised, rotate, rotate_back
from lander_ros.feed_forward import clip_wrench, feed_forward
from lander_ros.landing_controller import is_estimate, pose_and_motor
from lander_ros.safe_states import (
    SafeStates,
    Station,
    abort_cost,
    abort_station,
    facing,
    hover_cost,
    hover_station,
    line_of_sight,
    safe_wrench,
    weight,
)
from lander_ros.stamps import seconds_between
from msg_schemas import lander
from msg_schemas.modes import mode, mode_request

DESCEND, HOVER, ABORT = range(3)
AT_START, BY_ITSELF = -1.0, -2.0  # causes
LAST_CALL = 5.0  # [s] of weight that a hover keeps beyond the price of an abort
NONE = Vec3(0.0, 0.0, 0.0)


class ModeManagerParameters(SafeStates):
    delta_v_budget: float = field(30.0, unit="m/s", ge=0, doc="of the whole landing")
    margin: float = field(1.2, unit="1", ge=1, doc="factor on the cost of a safe state")
    estimate_age: float = field(0.5, unit="s", gt=0, doc="an older estimate or status is stale")
    command_age: float = field(0.5, unit="s", gt=0, doc="an older nominal command is stale")
    patience: float = field(1.0, unit="s", gt=0, doc="with an estimate that is invalid or stale")
    acquisition_time: float = field(60.0, unit="s", ge=0, doc="for the first valid estimate")
    commit_height: float = field(0.8, unit="m", ge=0, doc="below which a descent is carried through")
    blind_time: float = field(120.0, unit="s", ge=0, doc="for which a blind abort carries the weight")
    blind_attitude_sigma: float = field(0.02, unit="rad", gt=0, doc="up to which a blind abort holds the attitude")


class ModeManagerState(State):
    """The mode, since when, how often changed and by whom; requests seen and refused; what has been spent [m/s]; time
    without a good estimate [s]; the station of hover or abort; of a blind abort what is left to do."""

    mode: int
    entered: float
    changes: float
    cause: float = AT_START
    requests: float
    refused: float
    spent: float
    acquired: bool
    bad_for: float
    station_position: Vec3
    station_orientation: Quaternion
    station_line: Vec3
    blind: bool
    blind_for: float
    burn_left: float
    burn_direction: Vec3
    velocity_change: Vec3
    weight_force: Vec3
    carried: float
    committed: bool
    hover_delta_v: float
    abort_delta_v: float
    abort_time: float


@kernel
def manage(t_ns, p, x, inputs, outputs):
    now = outputs.command.header.stamp
    fresh = is_fresh(inputs.odometry.header.stamp, now, p.estimate_age) and is_estimate(inputs.odometry)
    fresh = fresh and is_fresh(inputs.status.header.stamp, now, p.estimate_age)
    good = fresh and inputs.status.valid > 0.5
    x.acquired = x.acquired or good
    x.bad_for = 0.0 if good or not (x.acquired or t_ns > p.acquisition_time * SECOND) else x.bad_for + p.period
    if good:
        reckon(p, x, inputs.odometry, inputs.gravity.accel.linear)
    nominal_is_fresh = is_fresh(inputs.nominal.header.stamp, now, p.command_age)
    obey(t_ns, p, x, inputs, fresh and x.acquired and x.bad_for <= p.patience, nominal_is_fresh)
    look_after(t_ns, p, x, inputs, nominal_is_fresh)
    steady = fresh and 0.0 < inputs.status.attitude_sigma <= p.blind_attitude_sigma
    wrench = flown(p, x, inputs, steady)
    x.spent += p.period * norm(wrench.real) / p.mass
    outputs.command.wrench.force, outputs.command.wrench.torque = wrench.real, wrench.dual
    outputs.mode.mode, outputs.mode.entered = float(x.mode), x.entered
    outputs.mode.changes, outputs.mode.cause = x.changes, x.cause
    show(p, x, inputs.odometry, outputs.budget)


@kernel
def is_fresh(stamp, now, age):
    """Whether a message has come, and not longer ago than age [s]."""
    return stamp.sec != 0 and seconds_between(stamp, now) <= age + 1e-6


@kernel
def reckon(p, x, odometry, gravity):
    """What hover and abort would cost from here, and what a blind abort would have to do."""
    r, q, motor = pose_and_motor(odometry)
    v = rotate(q, motor.dual)
    forward = feed_forward(p, r, q, gravity)
    x.carried = weight(p, forward)
    x.committed = x.committed or (x.mode == DESCEND and r.z < p.commit_height)
    cost = abort_cost(p, r, v, x.carried)
    x.abort_delta_v, x.abort_time = cost.delta_v, cost.time
    x.hover_delta_v = hover_cost(p, v, x.carried).delta_v
    x.velocity_change = rotate_back(q, p.climb_speed * line_of_sight(r) - v)
    x.weight_force = forward.real


@kernel
def left(p, x):
    """What is left of the budget [m/s]."""
    return p.delta_v_budget - x.spent


@kernel
def abort_allowed(p, x):
    """Whether the budget covers an abort."""
    return p.margin * x.abort_delta_v <= left(p, x)


@kernel
def hover_allowed(p, x):
    """Whether the budget covers a hover and an abort after it."""
    return p.margin * (x.hover_delta_v + x.abort_delta_v) <= left(p, x)


@kernel
def obey(t_ns, p, x, inputs, usable, nominal_is_fresh):
    """Act on a new request, or refuse it; usable: the estimate."""
    request = inputs.request
    if request.requests == x.requests:
        return
    x.requests = request.requests
    wanted = int(request.mode)
    if wanted == x.mode:
        if wanted == ABORT and usable:
            turn_abort(p, x, inputs.odometry)
        return
    if x.committed:
        x.refused += 1.0
    elif wanted == DESCEND and x.mode == HOVER and usable and nominal_is_fresh:
        enter(t_ns, x, DESCEND, request.cause)
    elif wanted == HOVER and x.mode == DESCEND and usable and hover_allowed(p, x):
        enter_hover(t_ns, p, x, inputs.odometry, request.cause)
    elif wanted == ABORT and abort_allowed(p, x):
        enter_abort(t_ns, p, x, inputs.odometry, request.cause)
    else:
        x.refused += 1.0


@kernel
def look_after(t_ns, p, x, inputs, nominal_is_fresh):
    """What the manager does by itself."""
    is_bad = x.bad_for > p.patience
    if x.mode != ABORT and not x.committed:
        if is_bad and abort_allowed(p, x):
            enter_abort(t_ns, p, x, inputs.odometry, BY_ITSELF)
        elif not is_bad and x.mode == DESCEND and x.acquired and not nominal_is_fresh:
            if hover_allowed(p, x):
                enter_hover(t_ns, p, x, inputs.odometry, BY_ITSELF)
            elif abort_allowed(p, x):
                enter_abort(t_ns, p, x, inputs.odometry, BY_ITSELF)
        elif x.mode == HOVER and p.margin * x.abort_delta_v + LAST_CALL * x.carried > left(p, x):
            enter_abort(t_ns, p, x, inputs.odometry, BY_ITSELF)
    if x.mode == ABORT and is_bad and not x.blind:
        x.blind, x.blind_for, x.burn_left = True, 0.0, norm(x.velocity_change)
        x.burn_direction = normalised(x.velocity_change) if x.burn_left > 0.0 else NONE
    elif x.blind and x.bad_for == 0.0:
        aim_abort(p, x, inputs.odometry)


@kernel
def enter(t_ns, x, mode, cause):
    """Take a mode."""
    x.mode, x.entered, x.cause = mode, t_ns / SECOND, cause
    x.changes += 1.0
    x.blind = False


@kernel
def enter_hover(t_ns, p, x, odometry, cause):
    """Take the mode hover, at the station that belongs to the estimate."""
    enter(t_ns, x, HOVER, cause)
    r, q, motor = pose_and_motor(odometry)
    put_station(x, hover_station(p, r, q, rotate(q, motor.dual)))


@kernel
def enter_abort(t_ns, p, x, odometry, cause):
    """Take the mode abort."""
    enter(t_ns, x, ABORT, cause)
    aim_abort(p, x, odometry)


@kernel
def aim_abort(p, x, odometry):
    """The station of an abort that begins, or goes on, at the estimate."""
    x.blind = False
    r, q, _ = pose_and_motor(odometry)
    put_station(x, abort_station(p, r, q))


@kernel
def turn_abort(p, x, odometry):
    """The station of an abort, at the distance that it had, on the line and in the attitude of the estimate."""
    r, q, _ = pose_and_motor(odometry)
    up = line_of_sight(r)
    put_station(x, Station(norm(x.station_position) * up, facing(q, p.thrust_axis, up), up))


@kernel
def put_station(x, station):
    """Remember a station."""
    x.station_position, x.station_orientation, x.station_line = station.position, station.orientation, station.line


@kernel
def flown(p, x, inputs, steady):
    """The wrench [N, N m] of the mode."""
    if x.mode == DESCEND:
        return DualVector(inputs.nominal.wrench.force, inputs.nominal.wrench.torque)
    station = Station(x.station_position, x.station_orientation, x.station_line)
    held = safe_wrench(p, pose_and_motor(inputs.odometry), station, inputs.gravity.accel.linear)
    if not x.blind:
        return held
    force = NONE
    if x.blind_for <= p.blind_time:
        force = x.weight_force
    if x.burn_left > 0.0:
        burn = min(p.acceleration_limit, x.burn_left / p.period)
        x.burn_left -= burn * p.period
        force = force + p.mass * burn * x.burn_direction
    x.blind_for += p.period
    wrench, _ = clip_wrench(p, DualVector(force, held.dual if steady else NONE))
    return wrench


@kernel
def show(p, x, odometry, budget):
    """What the safe states cost, and whether they are allowed."""
    budget.spent, budget.left = x.spent, left(p, x)
    budget.abort_delta_v, budget.abort_time, budget.hover_delta_v = x.abort_delta_v, x.abort_time, x.hover_delta_v
    budget.abort_allowed = 1.0 if abort_allowed(p, x) else 0.0
    budget.hover_allowed = 1.0 if hover_allowed(p, x) else 0.0
    budget.distance_to_go = norm(x.station_position - odometry.pose.pose.position) if x.mode != DESCEND else 0.0
    budget.blind = 1.0 if x.blind else 0.0
    budget.committed, budget.refused = 1.0 if x.committed else 0.0, x.refused


class ModeManager(Component):
    """Descend, hover or abort: lets the landing law through or flies a safe state, and says what that would cost.

    Promises: at every firing one wrench [N, N m], frame B: that of the landing law, of hover or of abort; which of the
    two safe states the budget [m/s] covers, and what each would cost, before anybody asks.

    Bad input: an estimate that is invalid or older than `estimate_age` for `patience` [s] leads to abort, blind while
    it lasts: the last known velocity change and weight, in body axes, then nothing. A nominal command older than
    `command_age` leads to hover. A request that is not allowed is refused and counted. Below `commit_height` a descent
    is carried through.
    """

    modes = ("descend", "hover", "abort")
    parameters, state = ModeManagerParameters, ModeManagerState
    inputs = {"nominal": lander.COMMAND, "odometry": lander.ODOMETRY, "status": lander.NAVIGATION_STATUS,
              "gravity": lander.GRAVITY, "request": mode_request("lander", lander.BASE)}
    outputs = {"command": lander.SAFE_COMMAND, "mode": mode("lander", lander.BASE), "budget": lander.MANEUVER_BUDGET}
    optional_inputs = ("request",)
    rate_hz = 10.0
    kernel = manage
