"""The angle sensors of `spacerobot_ros.sensor_pairs`: taken, refused, and what their residuals say of either sensor.

``p``: the estimator's parameters; ``x``: what `pair_state` has; ``u``: the unit.
"""

import math

from flight_math import kernel
from spacerobot_ros.rate_sensors import accept_rate, derive_rate, dismiss_rate, forget_doubt, readmit_rate
from spacerobot_ros.sensor_pairs import angle_sigma, channels, squared


@kernel
def decide_doubt(p, x, u, sample, interval):
    """An angle decides whether the doubted rate was right."""
    first, end = channels(u)
    doubted = 0.0
    for c in range(first, end):
        difference = sample.residual[c] - x.doubt[c]
        doubted += difference * difference
    if doubted < squared(u, sample.residual):
        for c in range(first, end):
            sample.residual[c] -= x.doubt[c]
            sample.correction[c] += x.doubt[c]
        x.p_aa[u] += x.doubt_width[u] * x.doubt_width[u]
        x.rate_refused[u] = 0.0
        if sample.has_rates[u] > 0.0:
            accept_rate(x, u, sample)
    elif x.angle_admitted[u] > 0.0:
        x.rate_refused[u] += 1.0
        x.rate_rejected[u] += 1.0
        derive_rate(x, u, sample, interval)
        if x.rate_refused[u] >= p.isolate_after:
            dismiss_rate(x, u)
    forget_doubt(x, u)


@kernel
def correct(p, x, u, sample):
    """Take the angle: the filter's step."""
    first, end = channels(u)
    sigma = angle_sigma(p, u)
    variance = x.p_aa[u] + sigma * sigma
    gain, bias_gain = x.p_aa[u] / variance, x.p_ab[u] / variance
    if x.rate_admitted[u] == 0.0 or x.rate_accepted[u] < sample.t:
        bias_gain = 0.0
    for c in range(first, end):
        sample.correction[c] += gain * sample.residual[c]
        x.bias[c] += bias_gain * sample.residual[c]
    x.p_aa[u] -= gain * x.p_aa[u]
    x.p_bb[u] -= bias_gain * x.p_ab[u]
    x.p_ab[u] -= gain * x.p_ab[u]
    x.angle_time[u] = sample.t


@kernel
def set_angle(p, x, u, sample):
    """The angle is the reading."""
    first, end = channels(u)
    sigma = angle_sigma(p, u)
    for c in range(first, end):
        sample.correction[c] += sample.residual[c]
    x.angle_known[u] = 1.0
    x.angle_time[u] = sample.t
    x.p_aa[u], x.p_ab[u] = sigma * sigma, 0.0


@kernel
def watch_streak(x, u, sample):
    """Keep how a streak of refusals begins, and how evenly its residuals grow."""
    first, end = channels(u)
    x.angle_refused[u] += 1.0
    if x.angle_refused[u] == 1.0:
        x.scatter[u] = x.onset[u] = 0.0
    for c in range(first, end):
        change = sample.residual[c] - x.last_residual[c]
        if x.angle_refused[u] == 1.0:
            x.onset[u] += change * change
            x.first_residual[c] = sample.residual[c]
        else:
            x.scatter[u] += change * change


@kernel
def remember_residual(x, u, sample):
    """Keep the residual for the next angle."""
    first, end = channels(u)
    for c in range(first, end):
        x.last_residual[c] = sample.residual[c]


@kernel
def gate(p, u):
    """Of a unit's squared residual over its variance."""
    return p.attitude_gate if u == 0 else p.joint_gate


@kernel
def rate_is_accused(p, x, u, sample):
    """Whether the residuals accuse the rate: they came to the gate without a jump, or have grown evenly since, by more than
    two readings' noise and in steps that scatter less than they add."""
    first, end = channels(u)
    steps, grown = x.angle_refused[u] - 1.0, 0.0
    if steps < 1.0:
        return False
    for c in range(first, end):
        change = sample.residual[c] - x.first_residual[c]
        grown += change * change
    noise = 2.0 * angle_sigma(p, u) * angle_sigma(p, u)
    mean = grown / (steps * steps)
    if x.onset[u] < gate(p, u) * noise:
        return True
    return grown > gate(p, u) * noise and mean > x.scatter[u] / steps - mean - (end - first) * noise


@kernel
def refuse(p, x, u, sample, interval):
    """An angle beyond the gate; who is wrong is said after enough of them."""
    x.angle_agreed[u] = 0.0
    x.angle_rejected[u] += 1.0
    watch_streak(x, u, sample)
    remember_residual(x, u, sample)
    if x.angle_refused[u] < p.isolate_after or x.angle_admitted[u] == 0.0:
        return
    if x.rate_admitted[u] > 0.0 and x.angle_repeats[u] == 0.0 and rate_is_accused(p, x, u, sample):
        dismiss_rate(x, u)
        set_angle(p, x, u, sample)
        derive_rate(x, u, sample, interval)
        x.angle_refused[u] = 0.0
    else:
        x.angle_admitted[u] = 0.0


@kernel
def take_angle(p, x, u, sample):
    """A new angle of the unit, if there is one: judged, and taken or refused."""
    if sample.has_angles[u] == 0.0:
        return
    known_before, interval = x.angle_seen[u] >= 0.0, sample.t - x.angle_seen[u]
    x.angle_seen[u] = sample.t
    if not known_before:
        set_angle(p, x, u, sample)
        return
    x.angle_repeats[u] = x.angle_repeats[u] + 1.0 if squared(u, sample.increment) == 0.0 else 0.0
    if x.doubt_time[u] > 0.0:
        decide_doubt(p, x, u, sample, interval)
    sigma, axes = angle_sigma(p, u), 3.0 if u == 0 else 1.0
    distance = squared(u, sample.residual) / (x.p_aa[u] + sigma * sigma)
    x.innovation[u] = math.sqrt(distance / axes)
    stuck = p.repeats > 0 and x.angle_repeats[u] >= p.repeats
    if stuck:
        x.angle_admitted[u] = 0.0
    if stuck or distance > gate(p, u):
        refuse(p, x, u, sample, interval)
        return
    remember_residual(x, u, sample)
    x.angle_refused[u] = 0.0
    x.angle_agreed[u] += 1.0
    if x.angle_admitted[u] == 0.0 and x.angle_agreed[u] >= p.readmit_after:
        x.angle_admitted[u] = 1.0
    if x.angle_admitted[u] > 0.0:
        correct(p, x, u, sample)
        if x.rate_admitted[u] == 0.0:
            derive_rate(x, u, sample, interval)
            readmit_rate(p, x, u, sample, interval)
