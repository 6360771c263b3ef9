"""Whether the wheels do as they are told: the torque that each gives, from its speed, against the commanded one.

A wheel's torque on the body is u = -J_w (Omega' + omega'). omega' is left out, so that the verdict does not hang on
the gyro: the rover turns slowly, and J_w omega' is some percent of u (J_w over the inertia that u turns), which
`relative_limit` allows for. The difference of successive speeds over the period is low-passed with the time constant
`filter_time`, and so is the command of the period before. A wheel whose residual stays beyond its limit for
`fail_time` has failed, and is sound again after `clear_time` within half of it. A wheel that is asked for less than
the limit hides its failure.
"""

from flight_graph.components.component import Component, same_stamp
from flight_graph.components.records import Parameters, State, field
from flight_math import Vec3, clip, elementwise, kernel, largest, where
from msg_schemas import cubli


class WheelMonitorParameters(Parameters):
    wheel_inertia: float = field(1.0e-3, unit="kg m^2", gt=0, doc="of each wheel about its axis")
    torque_limit: float = field(0.02, unit="N m", gt=0, doc="each wheel's largest torque")
    filter_time: float = field(0.2, unit="s", gt=0, doc="time constant of the filters")
    residual_limit: float = field(3e-5, unit="N m", gt=0, doc="a larger residual is a failure")
    relative_limit: float = field(0.15, unit="1", ge=0, doc="plus this part of the largest torque that a wheel gives")
    fail_time: float = field(0.3, unit="s", gt=0, doc="for so long")
    clear_time: float = field(5.0, unit="s", gt=0, doc="and half of it or less for so long is none")


class WheelMonitorState(State):
    """Filtered torque and residual, the time [s] of each wheel beyond and within its limits, the speeds before."""

    begun: bool
    speed: Vec3
    torque: Vec3
    residual: Vec3
    beyond: Vec3
    within: Vec3
    failed: Vec3
    age: float = -1.0


@elementwise
def verdict(failed, beyond, within, fail_time, clear_time):
    """1 for a wheel that has failed, 0 for a sound one."""
    if beyond >= fail_time:
        return 1.0
    return 0.0 if within >= clear_time else failed


@kernel
def limited(p, torque):
    """A torque [N m] within twice what a wheel can give: one wild number is not remembered for long."""
    return clip(torque, -2.0 * p.torque_limit, 2.0 * p.torque_limit)


@kernel
def watch(t_ns, p, x, wheels, command, status):
    if same_stamp(wheels.header.stamp, status.header.stamp):
        if x.begun:
            part = p.period / (p.filter_time + p.period)
            torque = limited(p, p.wheel_inertia * (x.speed - wheels.velocity) / p.period)
            x.torque = limited(p, x.torque) + part * (torque - limited(p, x.torque))
            x.residual = limited(p, x.residual) + part * (torque - limited(p, command.effort) - limited(p, x.residual))
            limit = p.residual_limit + p.relative_limit * largest(abs(x.torque))
            x.beyond = where(abs(x.residual) > limit, x.beyond + p.period, 0.0)
            x.within = where(abs(x.residual) > 0.5 * limit, 0.0, x.within + p.period)
            x.failed = verdict(x.failed, x.beyond, x.within, p.fail_time, p.clear_time)
        x.speed, x.begun, x.age = wheels.velocity, True, 0.0
    elif x.begun:
        x.begun = False  # a difference over more than one period is none
        x.age += p.period
    elif x.age >= 0.0:
        x.age += p.period
    status.torque, status.residual, status.failed, status.age = x.torque, x.residual, x.failed, x.age


class WheelMonitor(Component):
    """Watches whether the wheels of the Cubli rover do as they are told; its command is that of the tick before.

    Promises: for each wheel the torque [N m] that its speed tells of, the residual against the command, and `failed`,
    which is 1 once the residual has been beyond `residual_limit` plus `relative_limit` of the largest torque for
    `fail_time` [s]. A wheel that is asked for less than that hides its failure.

    Bad input: no difference is taken over a missing wheel state: the age [s] of the last one grows, and the verdict
    stays. A wild number counts for twice `torque_limit` at most, so that it is not remembered for long.
    """

    parameters, state = WheelMonitorParameters, WheelMonitorState
    inputs = {"wheels": cubli.WHEEL_STATE, "command": cubli.SAFE_COMMAND}
    outputs = {"status": cubli.WHEEL_STATUS}
    rate_hz = 100.0
    kernel = watch
