"""Which law drives the wheels of the Cubli rover: the nominal one, or that of a safe state.

Modes. `balance` passes the nominal command. `hold` kills the rates and keeps the attitude; `rest` lets the rover down
on a face and brakes the wheels (laws and argument: `cubli_ros.safe_laws`). In every mode the torque is lessened where
it would lose the ground (`cubli_ros.contact_guard`).

What it does by itself:

========================================================================== ===============================================
the estimate is not valid, or older than estimate_age                      balance -> hold
the nominal command is older than command_age                              balance -> hold
a wheel has failed                                                         balance -> hold, without that wheel, whose
                                                                           drive is switched off
no rate is known (estimate not valid, gyro isolated or silent)             balance, hold -> rest, without torque
several wheels have failed: the way to them, rather                        balance -> hold
lean, spin about the diagonal, a wheel's speed beyond their limits         hold -> rest
hold has lasted hold_time                                                  hold -> rest
the cause of a hold of its own has been gone for return_time               hold -> balance, return_limit times
a request                                                                  the mode; balance only without a cause, and from
                                                                           rest to nothing else: a rover that leans far
                                                                           cannot come back
========================================================================== ===============================================

A hold that was requested stays until another request, or until it has lasted hold_time. Before an estimate has been
there once, its absence is no cause for `start_time`.
"""

import math

from cubli_ros.appc_controller import RoverModel
from cubli_ros.attitude import is_fix, is_known
from cubli_ros.contact_guard import kept_share
from cubli_ros.safe_laws import brake_torque, hold_torque, rest_axis, rest_torque, within, without_wheel
from cubli_ros.sensor_admission import UP
from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import State, field
from flight_graph.timebase import SECOND
from flight_math import (
    Quaternion,
    Vec3,
    cos,
    cross,
    kernel,
    largest,
    minimum,
    norm,
    normalised,
    quaternion_from_rotation_vector,
    rotate_back,
    rotation_vector,
    same,
    total,
)
from msg_schemas import cubli

BALANCE, HOLD, REST = 0, 1, 2  # modes
ITSELF, START = -2.0, -1.0  # causes, beside the number of an actionpoint
ESTIMATE, GYRO, NO_RATE = 2.0, 1.0, 0.0  # sources of the rate
SOUND, SEVERAL = -1, -2  # lost wheels, beside the number of one
FORCE_LIMIT = 10.0  # [-] of g: a larger averaged specific force is none
SMALL = 1e-9  # [-] a level direction that is no direction


class ModeManagerParameters(RoverModel):
    wheel_inertia: float = field(1.0e-3, unit="kg m^2", gt=0, doc="of each wheel about its axis")
    guard_friction: float = field(0.5, unit="1", gt=0, doc="friction coefficient that the guard reckons with")
    guard_normal_force: float = field(0.2, unit="1", ge=0, lt=1, doc="smallest normal force, in m g, that it allows")
    estimate_age: float = field(0.1, unit="s", gt=0, doc="an older estimate is none")
    command_age: float = field(0.1, unit="s", gt=0, doc="an older nominal command is none")
    start_time: float = field(2.0, unit="s", ge=0, doc="until then nothing is missed that has not been there yet")
    return_time: float = field(5.0, unit="s", gt=0, doc="without a cause for so long: back to balance")
    return_limit: int = field(2, ge=0, doc="how often, at most")
    hold_time: float = field(30.0, unit="s", gt=0, doc="longest hold")
    lean_limit: float = field(0.3, unit="rad", gt=0, doc="largest lean in hold")
    spin_limit: float = field(0.3, unit="rad/s", gt=0, doc="largest rate about the body diagonal in hold")
    wheel_limit: float = field(500.0, unit="rad/s", gt=0, doc="largest wheel speed in hold")
    vertical_time: float = field(5.0, unit="s", gt=0, doc="time constant of the accelerometer's vertical")
    hold_damping: float = field(1.0, unit="1/s", gt=0, doc="d of hold")
    hold_stiffness: float = field(0.25, unit="1/s^2", gt=0, doc="k of hold; d^2 / 4 is critically damped")
    lost_wheel_lean: float = field(0.1, unit="1", ge=0, lt=1, doc="sine of the lean up to which it balances")
    lost_wheel_rate: float = field(0.15, unit="1/s", gt=0, doc="q of the law without a wheel")
    rest_damping: float = field(0.5, unit="1/s", gt=0, doc="d of rest")
    rest_rate: float = field(0.02, unit="rad/s", gt=0, doc="w of rest")
    rest_ramp: float = field(10.0, unit="s", gt=0, doc="time in which w is reached")
    lying_angle: float = field(0.6, unit="rad", gt=0, doc="a rover that leans further and is still lies")
    still_rate: float = field(2e-3, unit="rad/s", gt=0, doc="slower is still")
    still_time: float = field(3.0, unit="s", gt=0, doc="for so long")
    brake_rate: float = field(0.02, unit="1/s", gt=0, doc="of the wheels' speed once it lies")
    brake_limit: float = field(1e-4, unit="N m", gt=0, doc="largest braking torque: below m g l / 2")


class ModeManagerState(State):
    """Mode and its history; what the laws remember: bias [rad/s], averaged specific force, turn, axis of rest; causes."""

    mode: int
    entered: float
    changes: int
    cause: float = START
    requested: bool
    requests: float
    seen: bool
    clear_for: float
    returns: int
    bias: Vec3
    force: Vec3
    turned: Quaternion
    axis: Vec3
    lost: int = SOUND
    wheel_failed: bool
    still_for: float
    guarded: int
    share: float = 1.0
    estimate_lost: bool
    command_lost: bool
    source: float


@kernel
def start(p, x):
    x.turned = Quaternion(0.0, 0.0, 0.0, 1.0)


@kernel
def age(now, stamp):
    """Age [s] of a message; large where none has come."""
    return (now.sec - stamp.sec) + (1e-9 * now.nanosec - 1e-9 * stamp.nanosec)


@kernel
def manage(t_ns, p, x, inputs, outputs):
    now, t = outputs.command.header.stamp, t_ns / SECOND
    omega, up = observe(t, p, x, now, inputs)
    decide(t, p, x, inputs.request, omega, up, inputs.wheels.velocity)
    torque = demanded(t, p, x, omega, up, inputs.wheels.velocity, inputs.nominal.effort)
    if x.lost >= 0 and x.mode != BALANCE and x.source != NO_RATE:
        torque = without_wheel(p, torque, x.lost, omega, up)
    x.share = kept_share(p, omega, inputs.wheels.velocity, up, torque)
    x.guarded += x.share < 1.0
    torque = x.share * torque if x.share < 1.0 else torque
    outputs.command.effort = within(torque, p.torque_limit)
    outputs.power.on = powered(x)
    tell(x, outputs)


@kernel
def observe(t, p, x, now, inputs):
    """The rates [rad/s] and up (unit vector, body frame) by what is to be trusted; and what is lost, into the state."""
    attitude, status, imu = inputs.attitude, inputs.status, inputs.imu
    usable = is_known(attitude) and age(now, attitude.header.stamp) <= p.estimate_age and (
        age(now, status.header.stamp) <= p.estimate_age and status.valid > 0.0)
    x.seen = x.seen or usable
    x.estimate_lost = not usable and (x.seen or t >= p.start_time)
    x.command_lost = age(now, inputs.nominal.header.stamp) > p.command_age and t >= p.command_age
    omega, x.source = same(0.0), NO_RATE
    if usable:
        omega, x.source = attitude.angular_velocity, ESTIMATE
        if same_stamp(attitude.header.stamp, imu.header.stamp) and status.gyro_admitted > 0.0:
            x.bias = imu.angular_velocity - omega
    elif age(now, imu.header.stamp) <= p.estimate_age and not (
            age(now, status.header.stamp) <= p.estimate_age and status.gyro_admitted == 0.0 and x.seen):
        omega, x.source = imu.angular_velocity - x.bias, GYRO
    mend(p, x)
    step = quaternion_from_rotation_vector(p.period * omega)
    if same_stamp(imu.header.stamp, now):
        average(p, x, step, imu.linear_acceleration)
    up = UP
    if usable:
        up = rotate_back(attitude.orientation, UP)
    elif norm(x.force) > 0.0:
        up = normalised(x.force)
    x.turned = normalised(x.turned * step)
    lose_wheels(x, inputs.wheel_status.failed)
    return omega, up


@kernel
def mend(p, x):
    """What an upset memory cell has made impossible begins anew."""
    if not is_fix(x.turned):
        x.turned = Quaternion(0.0, 0.0, 0.0, 1.0)
    if not norm(x.force) <= FORCE_LIMIT * p.gravity:
        x.force = same(0.0)


@kernel
def average(p, x, step, specific_force):
    """The averaged specific force [m/s^2], body frame, which has turned by ``step`` since the last tick."""
    if norm(x.force) > 0.0:
        before = rotate_back(step, x.force)
        x.force = before + p.period / (p.period + p.vertical_time) * (specific_force - before)
    else:
        x.force = specific_force


@kernel
def lose_wheels(x, failed):
    """Which wheel the laws do without: a failed one, until balance is taken up again. Several: the way to them, rather."""
    count = total(failed)
    x.wheel_failed = count > 0.0
    if count > 1.0:
        x.lost = SEVERAL
    elif count > 0.0 and x.lost == SOUND:
        x.lost = 0 if failed.x > 0.0 else 1 if failed.y > 0.0 else 2
    elif x.mode == BALANCE:
        x.lost = SOUND


@kernel
def decide(t, p, x, request, omega, up, wheel_speed):
    """The mode of this tick."""
    cause = x.estimate_lost or x.command_lost or x.wheel_failed
    x.clear_for = 0.0 if cause else x.clear_for + p.period
    wanted, why = x.mode, ITSELF
    beyond = abs(total(omega)) > math.sqrt(3.0) * p.spin_limit or largest(abs(wheel_speed)) > p.wheel_limit or (
        up @ UP < cos(p.lean_limit))
    no_rate = x.source == NO_RATE and (x.seen or t >= p.start_time)
    if request.requests != x.requests:
        x.requests = request.requests
        wanted, why = int(request.mode), request.cause
        if x.mode == REST or (wanted == BALANCE and cause):
            wanted = x.mode
        x.requested = wanted == HOLD or (x.requested and wanted == x.mode)
    if wanted == BALANCE and cause:
        wanted, why = HOLD, ITSELF
    if wanted == HOLD and x.mode == HOLD and (beyond or t - x.entered >= p.hold_time):
        wanted, why = REST, ITSELF
    if no_rate:
        why = why if wanted == REST else ITSELF
        wanted = REST
    may_return = x.mode == HOLD and not x.requested and x.clear_for >= p.return_time and x.returns < p.return_limit
    if wanted == HOLD and may_return:
        wanted, why = BALANCE, ITSELF
        x.returns += 1
    if wanted != x.mode:
        enter(t, p, x, wanted, why, omega, up)


@kernel
def enter(t, p, x, mode, why, omega, up):
    """A mode begins."""
    x.mode, x.entered, x.cause = mode, t, why
    x.changes += 1
    x.requested = x.requested and mode == HOLD
    x.turned, x.still_for = Quaternion(0.0, 0.0, 0.0, 1.0), 0.0
    level = cross(up, UP)  # M_g = r x m g, r along UP in the body and g along -up
    if norm(level) < SMALL:
        level = omega - total(omega) / 3.0
    x.axis = rest_axis(level if norm(level) > SMALL else Vec3(1.0, -1.0, 0.0), x.lost)


@kernel
def demanded(t, p, x, omega, up, wheel_speed, nominal):
    """The torque [N m] that the mode wants."""
    if x.mode == BALANCE:
        return nominal
    if x.source == NO_RATE:
        return same(0.0)
    if x.mode == HOLD:
        return hold_torque(p, omega, rotation_vector(x.turned))
    still = norm(omega) < p.still_rate and up @ UP < cos(p.lying_angle)
    x.still_for = x.still_for + p.period if still else 0.0
    if x.still_for >= p.still_time:
        return brake_torque(p, wheel_speed)
    return rest_torque(p, omega, minimum(1.0, (t - x.entered) / p.rest_ramp) * p.rest_rate * x.axis)


@kernel
def powered(x):
    """1 for each drive that has power: outside of balance, a lost wheel's has none, so that it cannot run away."""
    off = x.lost if x.mode != BALANCE else SOUND
    return Vec3(0.0 if off == 0 else 1.0, 0.0 if off == 1 else 1.0, 0.0 if off == 2 else 1.0)


@kernel
def tell(x, outputs):
    """The mode, and what the manager knows and does."""
    mode, told = outputs.mode, outputs.safe_state
    mode.mode, mode.entered, mode.changes, mode.cause = x.mode, x.entered, x.changes, x.cause
    told.estimate_lost, told.command_lost, told.wheel_lost = x.estimate_lost, x.command_lost, x.lost
    told.rate_source, told.guarded, told.share, told.returns = x.source, x.guarded, x.share, x.returns
    told.turned = rotation_vector(x.turned)


class ModeManager(Component):
    """Mode manager of the Cubli rover: balance, hold, rest, and a torque that keeps the corner on the ground.

    Promises: at every firing one torque on the body by each wheel [N m], axes of `cubli_base`, none beyond
    `torque_limit`, lessened where the model says that the corner would lose the ground; the drives' power switches; the
    mode, since when and why.

    Bad input: an estimate that is not valid or older than `estimate_age`, a command older than `command_age`, or a
    failed wheel leads from balance to hold; no rate at all leads to rest without torque. A request that cannot be
    obeyed is not. A memory cell that an upset has made impossible begins anew.
    """

    modes = ("balance", "hold", "rest")
    parameters, state = ModeManagerParameters, ModeManagerState
    inputs = {"nominal": cubli.COMMAND, "attitude": cubli.ATTITUDE, "status": cubli.ESTIMATOR_STATUS, "imu": cubli.IMU,
              "wheels": cubli.WHEEL_STATE, "wheel_status": cubli.WHEEL_STATUS, "request": cubli.MODE_REQUEST}
    outputs = {"command": cubli.SAFE_COMMAND, "power": cubli.WHEEL_POWER, "mode": cubli.MODE,
               "safe_state": cubli.SAFE_STATE}
    optional_inputs = ("request",)
    rate_hz = 100.0
    start, kernel = start, manage
