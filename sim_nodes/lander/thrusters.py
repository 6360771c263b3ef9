"""What the lander's thrusters make of a wrench command: limits, minimum impulse bit, propellant, failures. Each may be off.

Ideal thrusters on each body axis (no moment from force commands); over a control period the wrench is the mean of the
pulses. Propellant flow of a force f and a torque tau: (sum |f_i| + sum |tau_i|/arm) / (I_sp g_0).
"""

from typing import NamedTuple

from flight_math import DualVector, Vec3, clip, kernel, total, where
from sim_nodes.lander.thruster_failures import failed

NONE = Vec3(0.0, 0.0, 0.0)
STANDARD_GRAVITY = 9.80665  # [m/s^2], definition of the specific impulse


class LanderThrusters(NamedTuple):
    """Parameters of the thrusters: any record with these fields serves as `p`."""

    period: float = 0.1  # [s] over which a command is held
    force_limit: float = 40.0  # [N] per body axis
    torque_limit: float = 10.0  # [N m] per body axis
    force_impulse_bit: float = 0.0  # [N s], smallest impulse of a period per axis; less is not delivered. 0: ideal
    torque_impulse_bit: float = 0.0  # [N m s]
    specific_impulse: float = 0.0  # I_sp [s]; 0: mass constant
    torque_arm: float = 0.0  # [m], lever of the torque thrusters; 0: torque costs no propellant
    force_stuck: Vec3 = NONE  # of this and the following see `sim_nodes.lander.thruster_failures`
    force_stuck_at: Vec3 = NONE  # [N]
    torque_stuck: Vec3 = NONE
    torque_stuck_at: Vec3 = NONE  # [N m]
    force_leak: Vec3 = NONE  # [N]
    torque_leak: Vec3 = NONE  # [N m]
    leak_place: Vec3 = NONE  # [m]


@kernel
def delivered(command, limit, impulse_bit, period):
    """Mean force [N] or torque [N m] over a period [s] for a command, axis by axis."""
    limited = clip(command, -limit, limit)
    return where(abs(limited) * period < impulse_bit, 0.0, limited)


@kernel
def apply_thrusters(p, command):
    """Delivered wrench, force [N] + eps torque [N m], and propellant flow [kg/s] over a period, of a commanded one."""
    force = delivered(command.real, p.force_limit, p.force_impulse_bit, p.period)
    torque = delivered(command.dual, p.torque_limit, p.torque_impulse_bit, p.period)
    force, torque = failed(p, force, torque)
    thrust = total(abs(force))
    if p.torque_arm > 0.0:
        thrust = thrust + total(abs(torque)) / p.torque_arm
    flow = thrust / (p.specific_impulse * STANDARD_GRAVITY) if p.specific_impulse > 0.0 else 0.0
    return DualVector(force, torque), flow
