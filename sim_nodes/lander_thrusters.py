"""What the lander's thrusters make of a wrench command: limits, minimum impulse bit, propellant. Each may be off.

Ideal thrusters on each body axis (no moment from force commands); over a control period the wrench is the mean of the
pulses. Propellant flow of a force f and a torque tau: (sum |f_i| + sum |tau_i|/arm) / (I_sp g_0).
"""

from typing import NamedTuple

from flight_graph.kernel import kernel

STANDARD_GRAVITY = 9.80665  # [m/s^2], definition of the specific impulse


class LanderThrusters(NamedTuple):
    """Parameters of the thrusters: any record with these fields serves as `p`."""

    force_limit: float = 40.0  # [N] per body axis
    torque_limit: float = 10.0  # [N m] per body axis
    force_impulse_bit: float = 0.0  # [N s], smallest impulse of a period per axis; less is not delivered. 0: ideal
    torque_impulse_bit: float = 0.0  # [N m s]
    specific_impulse: float = 0.0  # I_sp [s]; 0: mass constant
    torque_arm: float = 0.0  # [m], lever of the torque thrusters; 0: torque costs no propellant


@kernel
def delivered(command, limit, impulse_bit, period):
    """Mean force [N] or torque [N m] of one axis over a period [s] for its command."""
    value = min(max(command, -limit), limit)
    if abs(value) * period < impulse_bit:
        return 0.0
    return value


@kernel
def apply_thrusters(p, force_command, torque_command, period, force, torque):
    """Delivered force (3,) [N] and torque (3,) [N m] over the period [s]; returns the propellant flow [kg/s]."""
    force_sum = 0.0
    torque_sum = 0.0
    for i in range(3):
        force[i] = delivered(force_command[i], p.force_limit, p.force_impulse_bit, period)
        torque[i] = delivered(torque_command[i], p.torque_limit, p.torque_impulse_bit, period)
        force_sum += abs(force[i])
        torque_sum += abs(torque[i])
    if p.specific_impulse <= 0.0:
        return 0.0
    if p.torque_arm > 0.0:
        force_sum += torque_sum / p.torque_arm
    return force_sum / (p.specific_impulse * STANDARD_GRAVITY)
