"""Which sensors the attitude estimate of the Cubli rover trusts: tests, isolation, re-admission, and a referee.

Gyro. A sample is refused when an axis is beyond `rate_limit`; when an axis has changed faster than torques can turn
the rover, |dw| > acceleration_limit dt + 6 sqrt(2) gyro_sigma since the last sample that was taken; or when an axis
has read the same number `frozen_limit` times in a row, which noise does not do. Until `gyro_limit` samples in a row
are refused, the last good one is used again. Then the gyro is *isolated*: the rate is held, and what it may change
becomes the walk of the "bias", `coasting_walk` a sample, so that the same filter goes on as one of constant rate,
corrected by the star tracker. The gyro is *re-admitted* when `gyro_readmit` samples in a row differ by less than
`bias_limit` from the rate so found; bias = sample - rate then, with that rate's covariance, so that a constant offset
is learned and no more.

Star tracker. A measurement is refused when it equals the last one bit for bit, or when its innovation is beyond the
chi-square gate (`cubli_ros.attitude_filter`). After `tracker_limit` in a row the tracker is isolated: measurements
are looked at but not taken, until `tracker_readmit` in a row are within the gate, which widens as the covariance of
dead reckoning grows.

Referee. A gyro whose bias jumps by little makes the tracker look wrong. Two things tell them apart while the tracker
is isolated. A gyro's bias makes a difference that grows smoothly, and no faster than a step that the gyro's own test
lets through (unless that test has just refused one); a tracker's makes one that stays, or scatters. And the
accelerometer: the corner rests, so its specific force f, turned into the balance frame by an attitude and averaged
over `vertical_time`, must point along [1, 1, 1]; an estimate that is off by `referee_angle`, which is above the
accelerations of balancing, is wrong if the tracker is nearer. It overrules the growth, but it does not see turns
about the vertical. After so many `votes` in a row of either for the tracker the estimate is *reopened*: it begins
again at the tracker's attitude, with a bias that may be off by `reopened_bias_sigma`. A second reopening within
`reopen_again` isolates the gyro too. While the gyro is isolated, a tracker that does not scatter is all there is, and
it is believed. A tracker that drifts slowly passes for a biased gyro.
"""

import math

from cubli_ros import attitude_filter
from flight_math import Vec3, conjugate, diagonal, kernel, largest, norm, rotate, same, where

UP = Vec3(*[1.0 / math.sqrt(3.0)] * 3)  # [-] balance frame, level ground
TRUSTED = 0.5  # [-] of g: an averaged specific force that differs by more from g is no vertical
SMOOTH = 12.0  # [-] of star_tracker_sigma: largest second difference of a smooth growth, 5 of its standard deviations
GROWN = 10.0  # [-] of star_tracker_sigma: beyond twice the first difference, what has grown
NOISE = 6.0 * math.sqrt(2.0)  # [-] of gyro_sigma: largest difference of two samples


# -- gyro --------------------------------------------------------------------------------------------------------------
@kernel
def is_sound(p, x, gyro):
    """Whether a gyro sample [rad/s] may be used; x.gyro_repeats counts how often each axis has read the same number."""
    x.gyro_repeats = where(gyro == x.gyro_raw, x.gyro_repeats + 1.0, 0.0)
    x.gyro_raw = gyro
    if not largest(abs(gyro)) <= p.rate_limit:
        return False
    if p.frozen_limit > 0 and largest(x.gyro_repeats) >= p.frozen_limit:
        return False
    if x.gyro_lost:
        return largest(abs(gyro - x.known_bias - (x.gyro_before - x.bias))) <= p.bias_limit
    return x.gyro_age < 0.0 or largest(abs(gyro - x.gyro_before)) <= largest_step(p, x.gyro_age + p.period)


@kernel
def largest_step(p, span):
    """What a gyro axis may change by [rad/s] within a span [s]."""
    return p.acceleration_limit * span + NOISE * p.gyro_sigma


@kernel
def admit_gyro(p, x, gyro, fresh):
    """The sample to go on with [rad/s]: this one, or the last good one. Isolates and re-admits. fresh: it is of now."""
    if not x.gyro_lost and x.gyro_age == 0.0 and norm(gyro - x.gyro_raw) < norm(gyro - x.gyro_before):
        x.gyro_before = x.gyro_raw  # the same number in two places: one of them was upset
    sound = fresh and is_sound(p, x, gyro)
    x.gyro_refused_for = x.gyro_refused_for + p.period if sound else 0.0
    x.gyro_streak = x.gyro_streak + 1 if sound == x.gyro_lost else 0
    if x.gyro_lost and x.gyro_streak >= p.gyro_readmit:
        x.bias += gyro - x.gyro_before
        x.gyro_lost, x.gyro_streak = False, 0
        x.gyro_before = gyro
    if sound and not x.gyro_lost:
        x.gyro_age = 0.0
        return gyro
    x.gyro_rejected += not sound
    x.gyro_age += p.period if x.gyro_age >= 0.0 else 0.0
    if not x.gyro_lost and x.gyro_age >= 0.0 and x.gyro_streak >= p.gyro_limit:
        isolate_gyro(x)
    return x.gyro_before


@kernel
def isolate_gyro(x):
    """The rate is held from now on, and corrected by the star tracker."""
    x.known_bias = x.bias
    x.gyro_lost, x.gyro_streak = True, 0
    x.gyro_isolations += 1


# -- star tracker ------------------------------------------------------------------------------------------------------
@kernel
def admit_tracker(p, x, measured):
    """Test a measured attitude, take it or not, isolate and re-admit the tracker. Returns whether it was taken."""
    repeats = norm(measured - x.measured_before) == 0.0
    x.measured_before = measured
    if repeats:
        refuse(p, x)
        return False
    spread = attitude_filter.innovate(p, x, measured)
    fits = x.innovation_squared <= p.gate
    if x.tracker_lost:
        x.tracker_streak = x.tracker_streak + 1 if fits else 0
        if x.tracker_streak < p.tracker_readmit:
            x.tracker_rejected += 1
            return not fits and judged_right(p, x, measured)
        x.tracker_lost = False
    if not fits:
        refuse(p, x)
        return False
    attitude_filter.correct(p, x, spread)
    x.tracker_streak = 0
    return True


@kernel
def refuse(p, x):
    """A measurement is refused; so many in a row isolate the tracker."""
    x.tracker_rejected += 1
    x.tracker_streak = 0 if x.tracker_lost else x.tracker_streak + 1
    if not x.tracker_lost and x.tracker_streak >= p.tracker_limit:
        x.tracker_lost, x.tracker_streak = True, 0
        x.tracker_isolations += 1
        x.votes, x.steady, x.growth_before = 0, 0, same(0.0)
        x.first_innovation, x.innovation_before = x.innovation, x.innovation


# -- referee -----------------------------------------------------------------------------------------------------------
@kernel
def average_vertical(p, x, specific_force):
    """Average of the specific force [m/s^2] in the balance frame, by the estimate; x.vertical_age [s] of its length."""
    force = rotate(x.quaternion, specific_force)
    x.vertical = x.vertical + p.period / p.vertical_time * (force - x.vertical) if x.vertical_age > 0.0 else force
    x.vertical_age += p.period


@kernel
def has_vertical(p, x):
    """Whether the average is one of a rover that stands: long enough, and about as large as gravity."""
    return x.vertical_age >= p.vertical_time and abs(norm(x.vertical) - p.gravity) < TRUSTED * p.gravity


@kernel
def tilt_residual(p, x):
    """Distance of the accelerometer's vertical from the estimate's [rad, for small ones]; 0 where there is none."""
    return norm(x.vertical / norm(x.vertical) - UP) if has_vertical(p, x) else 0.0


@kernel
def judged_right(p, x, measured):
    """Vote on an isolated tracker's measurement; reopen the estimate when it has been right often enough."""
    turn = measured * conjugate(x.quaternion)
    growth, x.innovation_before = x.innovation - x.innovation_before, x.innovation
    smooth = largest(abs(growth - x.growth_before)) < SMOOTH * p.star_tracker_sigma
    x.growth_before = growth
    allowed = largest_step(p, p.period) * x.measured_for + SMOOTH * p.star_tracker_sigma
    plausible = largest(abs(growth)) <= allowed or x.gyro_refused_for < p.reopen_again
    grown = norm(x.innovation) > 2.0 * norm(x.first_innovation) + GROWN * p.star_tracker_sigma
    x.steady = x.steady + 1 if smooth and (grown and plausible or x.gyro_lost) else 0
    if has_vertical(p, x):
        mine = x.vertical / norm(x.vertical)
        theirs = rotate(turn, mine)
        if norm(mine - theirs) >= p.referee_angle:
            for_tracker = norm(theirs - UP) < norm(mine - UP) and norm(mine - UP) >= p.referee_angle
            x.votes = x.votes + 1 if for_tracker else 0
            x.steady = x.steady if for_tracker else 0
    if x.votes < p.votes and x.steady < p.votes:
        return False
    reopen(p, x, measured, turn)
    return True


@kernel
def reopen(p, x, measured, turn):
    """Begin again at a measured attitude, which is ``turn`` times the estimate's."""
    if x.reopened > 0 and x.reopened_for < p.reopen_again and not x.gyro_lost:
        isolate_gyro(x)
    bias = x.bias
    attitude_filter.start(p, x, measured)
    x.bias = bias
    x.bias_covariance = diagonal(same(p.reopened_bias_sigma * p.reopened_bias_sigma))
    x.vertical = rotate(turn, x.vertical)
    x.tracker_lost, x.tracker_streak, x.votes, x.steady = False, 0, 0, 0
    x.reopened += 1
    x.reopened_for = 0.0
