"""Actuators of the space robot's truth: reaction wheels along the base's axes, and drives of the joints.

``p``: the plant's parameters. A wheel's mass belongs to the base; only its spin about its axis is its own.
"""

import math

from flight_math import Vec3, clip, exp, kernel

IDEAL, WHEELS = 0, 1  # what gives the torque on the base: choices of `base_actuator`


@kernel
def limit_torque(demand, limit):
    """(torque, clipped): a torque [N m] within +-``limit``, and whether it was not. NaN becomes no torque."""
    if -limit <= demand <= limit:
        return demand, False
    return (limit if demand > 0.0 else (-limit if demand < 0.0 else 0.0)), True


@kernel
def motor_torque(p, wanted):
    """Torque that a wheel's motor is told [N m]: quantised, and within the limit; and whether it was limited."""
    if p.wheel_quantum > 0.0:
        wanted = p.wheel_quantum * math.floor(wanted / p.wheel_quantum + 0.5)
    limited = clip(wanted, -p.wheel_torque_limit, p.wheel_torque_limit)
    return limited, limited != wanted


@kernel
def spin_rate(drive, momentum, friction, period):
    """Rate of a rotor's momentum [N m]: the drive less Coulomb friction, which stops a rotor but does not turn it."""
    if momentum == 0.0:
        return drive - math.copysign(min(friction, abs(drive)), drive)
    rate = drive - math.copysign(friction, momentum)
    after = momentum + rate * period
    if after * momentum < 0.0 and abs(drive) <= friction:
        return -momentum / period
    return rate


@kernel
def wheel_step(p, demand, drive, momentum, drag, period):
    """One period [s] of one wheel: first-order lag of the torque, Coulomb friction, quantised torque, saturation.

    ``demand``: torque wanted on the base along the wheel's axis [N m]; ``drive``: of the motor on the rotor [N m];
    ``momentum`` [N m s]; ``drag``: Coulomb friction [N m] and viscous friction [1/s] of this wheel. Returns drive, mean
    rate of the momentum [N m], and whether torque or momentum is at its limit.
    """
    told, at_limit = motor_torque(p, -demand)
    drive += (1.0 - exp(-period / p.wheel_lag) if p.wheel_lag > 0.0 else 1.0) * (told - drive)
    friction, viscous = drag
    turning = drive - viscous * momentum if viscous > 0.0 else drive
    rate = spin_rate(turning, momentum, friction, period)
    after = momentum + rate * period
    if abs(after) > p.wheel_momentum_limit and abs(after) > abs(momentum):
        return drive, (math.copysign(p.wheel_momentum_limit, after) - momentum) / period, True
    return drive, rate, at_limit


@kernel
def wheel_drag(p, i):
    """Coulomb friction [N m] and viscous friction [1/s] of wheel i."""
    return p.wheel_friction + p.wheel_drag[i], p.wheel_viscous[i]


@kernel
def wheels_step(p, demand, drive, momentum, period):
    """`wheel_step` of the three wheels: drive, rate of the momentum, and how many wheels are at a limit."""
    drive_x, rate_x, limit_x = wheel_step(p, demand.x, drive.x, momentum.x, wheel_drag(p, 0), period)
    drive_y, rate_y, limit_y = wheel_step(p, demand.y, drive.y, momentum.y, wheel_drag(p, 1), period)
    drive_z, rate_z, limit_z = wheel_step(p, demand.z, drive.z, momentum.z, wheel_drag(p, 2), period)
    return Vec3(drive_x, drive_y, drive_z), Vec3(rate_x, rate_y, rate_z), int(limit_x) + int(limit_y) + int(limit_z)
