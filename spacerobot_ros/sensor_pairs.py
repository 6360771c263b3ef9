"""Two sensors of one motion watch each other: one of an angle, one of its rate (star tracker and gyro, encoder and rate).

Each pair is a small Kalman filter of angle and rate bias, whose covariance (P_aa, P_ab, P_bb) is that of one axis:
P_aa <- P_aa - 2 T P_ab + T^2 P_bb + T^2 s_r^2, P_ab <- P_ab - T P_bb, P_bb <- P_bb + T s_w^2 (Farrenkopf 1978). Between
angles the rate is integrated, without any angle for as long as need be. Who is wrong:

* a reading that repeats the one before bit for bit `repeats` times is stuck: that sensor is out;
* a rate whose changes keep changing by more than twenty sigmas is noise: out;
* a rate that jumps by more than an acceleration allows is in doubt, and the last rate is held. The next angle decides: it
  lies nearer to where the held rate leads, or to where the doubted one leads;
* a rate that changes by d does so at an unknown moment of its period: the angle's variance grows by (T d)^2 / 12;
* an angle whose squared residual over its variance is above the gate (chi-square, 1e-6) is refused. After `isolate_after`
  refusals in a row: residuals that came without a jump, or grow evenly, accuse the rate (a bias, a drift); others accuse
  the angle (a jump, noise). An angle that drifts by itself cannot be told from a rate with a bias.

A sensor that is out comes back after `readmit_after` readings in a row that agree; a rate sensor with the bias that they
agree on. With the rate sensor out, rates are differences of angles.

``x``: what `pair_state` has; units u = 0 (attitude, channels 0 to 2) and 1 to n (joint u, channel 2 + u).
"""

from typing import NamedTuple

import numpy as np

from flight_graph.components.records import Array, State
from flight_math import kernel


class Sample(NamedTuple):
    """What is new: t [s]; rates (m,) [rad/s] and whether unit u has new ones; increment (m,) [rad] of the angle readings
    since the ones before; residual (m,) [rad] of the angle readings, angle less estimate, and whether unit u has new ones;
    correction (m,) [rad], to be added to the angles, is filled."""

    t: float
    rates: np.ndarray
    has_rates: np.ndarray
    increment: np.ndarray
    residual: np.ndarray
    has_angles: np.ndarray
    correction: np.ndarray


def pair_state(joints: int) -> type[State]:
    """State of the attitude's pair and the joints'; times in s, negative: never."""
    units, channels = 1 + joints, 3 + joints

    class PairState(State):
        rate: Array(channels)
        used_rate: Array(channels)
        bias: Array(channels)
        p_aa: Array(units)
        p_ab: Array(units)
        p_bb: Array(units)
        angle_known: Array(units)
        angle_admitted: Array(units)
        angle_seen: Array(units)
        angle_time: Array(units)
        angle_repeats: Array(units)
        angle_refused: Array(units)
        angle_agreed: Array(units)
        angle_rejected: Array(units)
        innovation: Array(units)
        first_residual: Array(channels)
        last_residual: Array(channels)
        scatter: Array(units)
        onset: Array(units)
        rate_known: Array(units)
        rate_admitted: Array(units)
        rate_seen: Array(units)
        rate_time: Array(units)
        rate_accepted: Array(units)
        rate_repeats: Array(units)
        rate_noise: Array(units)
        rate_refused: Array(units)
        rate_agreed: Array(units)
        rate_rejected: Array(units)
        raw_before: Array(channels)
        change_before: Array(channels)
        rate_sum: Array(channels)
        rate_count: Array(units)
        candidate: Array(channels)
        doubt: Array(channels)
        doubt_time: Array(units)
        doubt_width: Array(units)

    return PairState


@kernel
def start_pairs(p, x):
    """Every sensor is trusted; nothing has been read."""
    for u in range(len(x.p_aa)):
        x.angle_admitted[u] = x.rate_admitted[u] = 1.0
        x.angle_seen[u] = x.angle_time[u] = x.rate_seen[u] = x.rate_time[u] = x.rate_accepted[u] = -1.0
        x.p_bb[u] = p.bias_sigma * p.bias_sigma


@kernel
def channels(u):
    """First channel of a unit, and the one after its last."""
    return (0, 3) if u == 0 else (2 + u, 3 + u)


@kernel
def angle_sigma(p, u):
    """Noise of an angle reading [rad]."""
    return p.star_tracker_sigma if u == 0 else p.encoder_sigma


@kernel
def rate_sigma(p, u):
    """Noise of a rate reading [rad/s]."""
    return p.gyro_sigma if u == 0 else p.joint_rate_sigma


@kernel
def squared(u, values):
    """Sum of the squares of a unit's channels."""
    first, end = channels(u)
    total = 0.0
    for c in range(first, end):
        total += values[c] * values[c]
    return total
