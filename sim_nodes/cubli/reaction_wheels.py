"""Three reaction wheels along the cube's axes: limits of torque and speed, the wheels' own rotation, and how they fail.

Wheel speed Omega [rad/s] is relative to the body. The motor's torque u [N m] acts on the body and -u on the wheel:
J_w (omega' + Omega') = -u (per axis). p: wheel_inertia J_w [kg m^2], torque_limit, speed_limit, period.

Failures, all off by default: `wheel_effectiveness`, the motor's true torque constant over the one it is driven with;
`wheel_runaway`, a torque that the drive gives whatever it is told; `command_timeout`, after which a drive that hears
nothing new gives none; and bearings with friction. A bearing's torque acts between wheel and body as the motor's does, so
that it moves momentum from one to the other and makes none.
"""

from flight_math import clip, kernel, minimum, same, sign, where


@kernel
def wheel_torque(p, x, command, powered):
    """Torque u [N m] of motors and bearings on the body, held over one period.

    x: wheel_speed, and the drives' watchdog; powered: 0 for each drive that is switched off (its wheel turns freely).
    """
    demand = command.effort
    if p.command_timeout > 0.0 and silence(p, x, command.header.stamp) > p.command_timeout:
        demand = same(0.0)
    demand = p.wheel_effectiveness * demand
    if any(p.wheel_runaway != 0.0):
        demand = where(p.wheel_runaway != 0.0, p.wheel_runaway, demand)
    if any(powered == 0.0):
        demand = where(powered == 0.0, 0.0, demand)
    torque = deliverable_torque(p, demand, x.wheel_speed)
    if any(p.wheel_viscous > 0.0) or any(p.wheel_coulomb > 0.0):
        torque += bearing_torque(p, torque, x.wheel_speed)
    return torque


@kernel
def silence(p, x, stamp):
    """Time [s] since a command with another stamp came: drives have no clock that they share with the computer."""
    if stamp.sec != x.command_sec or stamp.nanosec != x.command_nanosec:
        x.command_sec, x.command_nanosec, x.command_silence = stamp.sec, stamp.nanosec, 0.0
    else:
        x.command_silence += p.period
    return x.command_silence


@kernel
def bearing_torque(p, torque, wheel_speed):
    """Torque [N m] of the bearings on the body: viscous b Omega, and Coulomb c sgn(Omega), which never turns a wheel round.

    The direction is that of the speed which the motor's torque alone would leave after one period; what would more than
    stop the wheel stops it (so a wheel sticks, and a motor below c does not turn it).
    """
    free = wheel_speed - torque * p.period / p.wheel_inertia
    size = minimum(p.wheel_viscous * abs(wheel_speed) + p.wheel_coulomb, p.wheel_inertia * abs(free) / p.period)
    return sign(free) * size


@kernel
def deliverable_torque(p, demand, wheel_speed):
    """Torque the wheels deliver over one period: clipped to the limit, and to what takes a wheel just to its top speed.

    Torque that slows a wheel down is never cut by the speed limit. Large limits mean an ideal wheel.
    """
    highest = clip(p.wheel_inertia * (wheel_speed + p.speed_limit) / p.period, 0.0, p.torque_limit)
    lowest = clip(p.wheel_inertia * (wheel_speed - p.speed_limit) / p.period, -p.torque_limit, 0.0)
    return clip(demand, lowest, highest)


@kernel
def spun(p, wheel_speed, torque, rate_change):
    """Wheel speed one period on: Omega - u h / J_w - (omega(t + h) - omega(t)), exact for a torque that was held."""
    return wheel_speed - torque * p.period / p.wheel_inertia - rate_change
