"""Modes of the space robot: what reaches its actuators, and when.

track  the controller's torques, as they are. The only mode in which the inertial parameters may be learned.
hold   the joints' brakes are engaged, their drives are told zero; the base is damped, tau = -D w within its limits. With
       braked joints the robot is one rigid body of any inertia, and the power -w.D w of the law is never positive: rates
       decay whatever the parameters pi are believed to be, and whatever a drive does that its brake can hold.
free   no torque, brakes released. Nothing that the software believes can put energy into the motion: angular momentum
       stays what it is. For the case that not even the rates are known.

By itself it goes from track to hold when the estimate has been invalid or old for `estimate_patience`, or the controller's
command is older than `command_age`; and to free when the rates have been invalid or old for `rates_patience`. A request is
obeyed once; track becomes hold where the estimate or the command is not there. What it left by itself it comes back to
after `return_after` without a reason to stay away; after a request it waits for the next.
"""

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, Vec3, field
from flight_graph.timebase import SECOND
from flight_math import clip, kernel, stack_array
from msg_schemas import spacerobot
from msg_schemas.modes import mode, mode_request
from spacerobot_ros.ages import age
from spacerobot_ros.robot_parameters import NO_LIMIT

TRACK, HOLD, FREE = 0, 1, 2
START, ITSELF = -1.0, -2.0  # [-] causes


class ModeParameters(Parameters):
    estimate_age: float = field(0.1, unit="s", gt=0, doc="age at which the estimate, or its status, is old")
    estimate_patience: float = field(0.2, unit="s", ge=0, doc="track to hold: how long the estimate may be invalid or old")
    command_age: float = field(0.1, unit="s", gt=0, doc="track to hold: age of the controller's command")
    rates_patience: float = field(1.0, unit="s", ge=0, doc="to free: how long the rates may be invalid or old")
    return_after: float = field(2.0, unit="s", ge=0, doc="time without a reason after which it comes back; 0: never")
    learning: float = field(1.0, unit="1", ge=0, le=1, doc="0: adaptation rests in track too; for monitors to set")
    base_damping: Vec3 = field(2.0, unit="N m s/rad", gt=0, doc="hold: D")
    base_torque_limit: Vec3 = field(NO_LIMIT, unit="N m", gt=0, doc="hold: of the damping torque")


class ModeState(State):
    """mode now, when it was entered [s], how often it has changed, why; requests seen; times [s] since the estimate, the
    rates, and everything for the present mode's return have been bad, bad and good."""

    mode: float
    entered: float
    changes: float
    cause: float
    requests: float
    estimate_bad: float
    rates_bad: float
    good: float


@kernel
def start(p, x):
    x.mode, x.cause = TRACK, START


@kernel
def enter(x, wanted, cause, t):
    """Take a mode; nothing happens when it is the present one."""
    if x.mode != wanted:
        x.mode, x.cause, x.entered, x.good = wanted, cause, t, 0.0
        x.changes += 1.0


@kernel
def lasting(time, is_so, period):
    """How long something has been so [s]."""
    return time + period if is_so else 0.0


@kernel
def possible(wanted, can_track):
    """The wanted mode, or hold in the place of a track that has not what it needs."""
    return HOLD if wanted == TRACK and not can_track else wanted


@kernel
def choose(p, x, request, t, can_track):
    """The mode of this tick: what is asked, then what must be."""
    if request.requests != x.requests:
        x.requests = request.requests
        enter(x, possible(request.mode, can_track), request.cause, t)
    if x.rates_bad > p.rates_patience:
        enter(x, FREE, ITSELF, t)
    elif x.mode == FREE and x.cause == ITSELF and x.good > p.return_after > 0.0:
        enter(x, HOLD, ITSELF, t)
    elif x.mode == HOLD and x.cause == ITSELF and x.good > p.return_after > 0.0 and can_track:
        enter(x, TRACK, ITSELF, t)


@kernel
def manage(t_ns, p, x, inputs, outputs):
    """One tick."""
    t, now, status = t_ns / SECOND, outputs.mode.header.stamp, inputs.status
    fresh = max(age(now, status.header.stamp), age(now, inputs.odometry.header.stamp)) <= p.estimate_age
    rates, valid = fresh and status.rates_valid > 0.0, fresh and status.valid > 0.0
    command = max(age(now, inputs.nominal_base.header.stamp), age(now, inputs.nominal_joints.header.stamp))
    commanded = command <= p.command_age
    x.estimate_bad, x.rates_bad = lasting(x.estimate_bad, not valid, p.period), lasting(x.rates_bad, not rates, p.period)
    x.good = lasting(x.good, rates if x.mode == FREE else valid and commanded, p.period)
    choose(p, x, inputs.request, t, valid and commanded)
    if x.mode == TRACK and (x.estimate_bad > p.estimate_patience or not commanded):
        enter(x, HOLD, ITSELF, t)
    act(p, x, inputs, rates, outputs)
    report, adaptation, monitor = outputs.mode, outputs.adaptation, inputs.monitor
    report.mode, report.entered, report.changes, report.cause = x.mode, x.entered, x.changes, x.cause
    adaptation.prediction_error, adaptation.saturated, adaptation.unread = (
        monitor.prediction_error, monitor.saturated, monitor.unread)
    learns = x.mode == TRACK and status.healthy > 0.0 and monitor.freeze == 0.0 and p.learning > 0.0
    adaptation.freeze = 0.0 if learns else 1.0


@kernel
def act(p, x, inputs, rates, outputs):
    """The torques and brakes of the mode. Outputs keep what they were, so that each is written in each mode."""
    n = len(outputs.brakes.engaged)
    base, joints, engaged = Vec3(0.0, 0.0, 0.0), stack_array(n), stack_array(n)
    if x.mode == TRACK:
        base = inputs.nominal_base.wrench.torque
        joints[:] = inputs.nominal_joints.effort
    elif x.mode == HOLD:
        engaged[:] = 1.0
        if rates:
            base = clip(-p.base_damping * inputs.odometry.twist.twist.angular, -p.base_torque_limit, p.base_torque_limit)
    outputs.base_command.wrench.torque, outputs.joint_command.effort, outputs.brakes.engaged = base, joints, engaged


def manager(topics: spacerobot.Topics) -> type[Component]:
    """The mode manager of a robot with these topics."""
    vehicle = topics.safe_base_command.topic.rpartition("/")[0]

    class ModeManager(Component):
        """Lets the controller's torques through, or takes a safe state: joints braked and base damped, or no torque.

        Promises: at every firing the torques of base and joints [N m] and the brakes of the mode: track (those of the
        controller), hold (joints braked, base damped) or free (none); whether the parameters may be learned now; the
        mode, since when and why. No mode but track adds energy.

        Bad input: an estimate that is invalid or old for `estimate_patience`, or a command older than `command_age`,
        leads to hold; rates that are invalid or old for `rates_patience` lead to free. It comes back by itself from
        what it left by itself. A request for track without estimate or command becomes hold.
        """

        modes = ("track", "hold", "free")
        parameters, state = ModeParameters, ModeState
        inputs = {"nominal_base": topics.base_command, "nominal_joints": topics.joint_command,
                  "odometry": topics.odometry, "status": topics.state_status, "monitor": topics.monitor,
                  "request": mode_request(vehicle, spacerobot.BASE)}
        optional_inputs = ("monitor", "request")
        outputs = {"base_command": topics.safe_base_command, "joint_command": topics.safe_joint_command,
                   "brakes": topics.brakes, "mode": mode(vehicle, spacerobot.BASE), "adaptation": topics.adaptation}
        rate_hz = 50.0
        start, kernel = start, manage

    return ModeManager


ModeManager = manager(spacerobot.MINI)
