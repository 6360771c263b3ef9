"""The rate sensors of `spacerobot_ros.sensor_pairs`: believed, doubted, dismissed, replaced by the angles, taken back.

``p``: the estimator's parameters; ``x``: what `pair_state` has; ``u``: the unit.
"""

import math

from flight_math import kernel
from spacerobot_ros.sensor_pairs import angle_sigma, channels, rate_sigma, squared

JUMP = 9.0  # [-] sigmas of the rate beyond which a change may be a jump
NOISY = 20.0  # [-] sigmas of a second difference beyond which it counts as noise
NOISE = 5.0  # [-] of such counts until the sensor is out; a quiet reading takes a quarter of one away
SAME = 6.0  # [-] sigmas within which two biases are one


@kernel
def forget_doubt(x, u):
    """No rate of the unit is in doubt."""
    first, end = channels(u)
    for c in range(first, end):
        x.doubt[c] = 0.0
    x.doubt_time[u] = x.doubt_width[u] = 0.0


@kernel
def dismiss_rate(x, u):
    """The unit's rate sensor is out."""
    first, end = channels(u)
    x.rate_admitted[u] = x.rate_refused[u] = x.rate_agreed[u] = x.rate_count[u] = 0.0
    for c in range(first, end):
        x.rate_sum[c] = 0.0
    forget_doubt(x, u)


@kernel
def accept_rate(x, u, sample):
    """The unit's rate is the reading less the bias."""
    first, end = channels(u)
    for c in range(first, end):
        x.rate[c] = sample.rates[c] - x.bias[c]
    x.rate_known[u] = 1.0
    x.rate_time[u] = x.rate_accepted[u] = sample.t


@kernel
def jump(x, u, sample):
    """How far the reading is from the rate held [rad/s]."""
    first, end = channels(u)
    total = 0.0
    for c in range(first, end):
        difference = sample.rates[c] - x.bias[c] - x.rate[c]
        total += difference * difference
    return math.sqrt(total)


@kernel
def doubt_rate(p, x, u, sample, size):
    """Hold the last rate, and keep where the doubted one leads. Believed when no angle has decided in time."""
    first, end = channels(u)
    if x.doubt_time[u] == 0.0:
        x.doubt_width[u] = 0.5 * p.period * size
    x.doubt_time[u] += p.period
    for c in range(first, end):
        x.doubt[c] += p.period * (sample.rates[c] - x.bias[c] - x.rate[c])
    if x.doubt_time[u] > p.doubt_limit:
        x.p_aa[u] += squared(u, x.doubt)
        for c in range(first, end):
            sample.correction[c] += x.doubt[c]
        forget_doubt(x, u)
        accept_rate(x, u, sample)


@kernel
def look_at_rate(p, x, u, sample):
    """Count how often in a row the unit's rate repeats the one before, bit for bit, and how often its changes are noise."""
    first, end = channels(u)
    same, known, noise = x.rate_seen[u] >= 0.0, x.rate_seen[u] >= 0.0, 0.0
    for c in range(first, end):
        change = sample.rates[c] - x.raw_before[c] if known else 0.0
        same = same and change == 0.0
        noise = max(noise, abs(change - x.change_before[c]))
        x.raw_before[c], x.change_before[c] = sample.rates[c], change
    x.rate_repeats[u] = x.rate_repeats[u] + 1.0 if same else 0.0
    is_noise = noise > NOISY * math.sqrt(6.0) * rate_sigma(p, u)
    x.rate_noise[u] = min(x.rate_noise[u] + 1.0, NOISE) if is_noise else max(x.rate_noise[u] - 0.25, 0.0)


@kernel
def read_rate(p, x, u, sample):
    """A new rate of an admitted or dismissed sensor."""
    first, end = channels(u)
    elapsed = max(sample.t - x.rate_seen[u], p.period)
    look_at_rate(p, x, u, sample)
    x.rate_seen[u] = sample.t
    useless = p.repeats > 0 and x.rate_repeats[u] >= p.repeats or x.rate_noise[u] >= NOISE
    if x.rate_admitted[u] == 0.0:
        x.rate_rejected[u] += 1.0
        x.rate_count[u] = 0.0 if useless else x.rate_count[u] + 1.0
        for c in range(first, end):
            x.rate_sum[c] = 0.0 if useless else x.rate_sum[c] + sample.rates[c]
    elif useless:
        dismiss_rate(x, u)
    elif x.rate_known[u] == 0.0:
        accept_rate(x, u, sample)
    else:
        size = jump(x, u, sample)
        acceleration = p.base_acceleration if u == 0 else p.joint_acceleration
        if size <= acceleration * elapsed + JUMP * rate_sigma(p, u):
            x.rate_rejected[u] += 1.0 if x.doubt_time[u] > 0.0 else 0.0
            x.p_aa[u] += p.period * size * p.period * size / 12.0
            forget_doubt(x, u)
            accept_rate(x, u, sample)
        else:
            doubt_rate(p, x, u, sample, size)


@kernel
def take_rate(p, x, u, sample):
    """The unit's rate at this sample, and its covariance one period on."""
    if sample.has_rates[u] > 0.0:
        read_rate(p, x, u, sample)
    elif x.rate_admitted[u] > 0.0 and x.rate_known[u] > 0.0 and sample.t - x.rate_seen[u] > p.silent_after:
        dismiss_rate(x, u)
    if x.angle_known[u] == 0.0:
        return
    period, sigma = p.period, rate_sigma(p, u)
    if x.rate_accepted[u] == sample.t and x.rate_admitted[u] > 0.0:
        x.p_aa[u] += period * (period * (x.p_bb[u] + sigma * sigma) - 2.0 * x.p_ab[u])
        x.p_ab[u] -= period * x.p_bb[u]
        x.p_bb[u] += period * p.bias_walk * p.bias_walk
    else:
        wide = math.sqrt(x.p_aa[u]) + period * p.coast_sigma
        x.p_aa[u] = wide * wide


@kernel
def derive_rate(x, u, sample, interval):
    """The unit's rate is the difference of its last two angles."""
    first, end = channels(u)
    for c in range(first, end):
        x.rate[c] = sample.increment[c] / interval
    x.rate_time[u] = sample.t


@kernel
def readmit_rate(p, x, u, sample, interval):
    """A rate sensor that is out: does it differ from the angles' rate by a constant?"""
    if x.rate_count[u] == 0.0 or x.rate_noise[u] > 0.0:
        x.rate_agreed[u] = 0.0
        return
    first, end = channels(u)
    noise = math.sqrt(2.0) * angle_sigma(p, u) / interval + rate_sigma(p, u)
    agrees = True
    for c in range(first, end):
        bias = x.rate_sum[c] / x.rate_count[u] - sample.increment[c] / interval
        x.rate_sum[c] = 0.0
        same = x.rate_agreed[u] == 0.0 or abs(bias - x.candidate[c]) < SAME * noise
        agrees = agrees and same and abs(bias) < p.bias_limit
        x.candidate[c] += (bias - x.candidate[c]) / (x.rate_agreed[u] + 1.0)
    x.rate_count[u] = 0.0
    x.rate_agreed[u] = x.rate_agreed[u] + 1.0 if agrees else 0.0
    if x.rate_agreed[u] >= p.readmit_after:
        for c in range(first, end):
            x.bias[c] = x.candidate[c]
        x.rate_admitted[u], x.rate_refused[u] = 1.0, 0.0
        x.p_ab[u], x.p_bb[u] = 0.0, noise * noise / p.readmit_after
