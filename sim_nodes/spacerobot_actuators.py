"""Actuators of the space robot's truth: reaction wheels of the base and drives of the joints.

The wheels' numbers (torque limit, momentum limit, lag, friction, quantum) are parameters of the caller. A wheel's mass
belongs to the base; only its spin about its axis is its own.
"""

import math

from flight_graph.kernel import kernel


@kernel
def limit_torque(demand, limit, torque):
    """Clip ``demand`` (m,) [N m] to +-``limit`` (m,) into ``torque``; returns how many were clipped. NaN becomes 0."""
    clipped = 0
    for k in range(demand.shape[0]):
        value = demand[k]
        if not (-limit[k] <= value <= limit[k]):
            clipped += 1
            value = limit[k] if value > 0.0 else (-limit[k] if value < 0.0 else 0.0)
        torque[k] = value
    return clipped


@kernel
def wheel_step(demand, axes, drive, momentum, torque_limit, momentum_limit, lag, friction, quantum, period, rate):
    """One period of m wheels with first-order torque lag, Coulomb friction, quantised torque and saturation.

    ``demand`` (3,): torque wanted on the base, base axes [N m]; ``axes`` (m, 3) orthonormal spin axes.
    ``drive`` (m,) motor torque on the rotors [N m] and ``momentum`` (m,) [N m s] are the wheels' state, moved in place.
    ``torque_limit`` [N m], ``momentum_limit`` [N m s], ``lag`` [s], ``friction`` [N m], ``quantum`` [N m] (0: none),
    ``period`` [s]. ``rate`` (3,): mean rate of the wheels' momentum over the period, base axes [N m].
    Returns the number of wheels whose torque or momentum is at its limit.
    """
    for k in range(3):
        rate[k] = 0.0
    settled = 1.0 - math.exp(-period / lag) if lag > 0.0 else 1.0
    at_limit = 0
    for m in range(axes.shape[0]):
        wanted = -(axes[m, 0] * demand[0] + axes[m, 1] * demand[1] + axes[m, 2] * demand[2])
        if quantum > 0.0:
            wanted = quantum * math.floor(wanted / quantum + 0.5)
        limited = min(max(wanted, -torque_limit), torque_limit)
        drive[m] += settled * (limited - drive[m])
        spin = _spin_rate(drive[m], momentum[m], friction, period)
        after = momentum[m] + spin * period
        if abs(after) > momentum_limit and abs(after) > abs(momentum[m]):
            spin = (math.copysign(momentum_limit, after) - momentum[m]) / period
            at_limit += 1
        elif limited != wanted:
            at_limit += 1
        momentum[m] += spin * period
        for k in range(3):
            rate[k] += axes[m, k] * spin
    return at_limit


@kernel
def _spin_rate(drive, momentum, friction, period):
    """Rate of a rotor's momentum [N m]: the drive less Coulomb friction, which stops a rotor but does not turn it."""
    if momentum == 0.0:
        return drive - math.copysign(min(friction, abs(drive)), drive)
    rate = drive - math.copysign(friction, momentum)
    after = momentum + rate * period
    if after * momentum < 0.0 and abs(drive) <= friction:
        return -momentum / period
    return rate


@kernel
def wheel_momentum(axes, momentum, total):
    """total (3,) = sum of the wheels' momenta in base axes [N m s]."""
    for k in range(3):
        total[k] = 0.0
        for m in range(axes.shape[0]):
            total[k] += axes[m, k] * momentum[m]
