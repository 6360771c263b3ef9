"""Two campaigns on the same draws: differences case by case, which the dispersion of the draws does not hide.

Mean difference: Student's interval (of normal differences exact, else for many pairs). Median difference: order statistics,
no distribution assumed (sign test; Thompson 1936). Rates: Q. McNemar, Psychometrika 12 (1947) 153-157, as an exact binomial
test of the pairs that differ, and the score interval of the difference by T. Tango, Statistics in Medicine 17 (1998)
891-908.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special, stats

from flight_graph.statistics.percentiles import ranks

NARROWEST = 1e-12  # [-] of a root of the score


@dataclass(frozen=True)
class Differences:
    """b - a of the pairs that both have. only_a, only_b, neither: pairs left out, by who has a value.

    mean and median with the ends of their intervals; None: too few pairs. larger, smaller, equal: pairs where b is.
    """

    pairs: int
    only_a: int
    only_b: int
    neither: int
    mean: float | None
    mean_low: float | None
    mean_high: float | None
    median: float | None
    median_low: float | None
    median_high: float | None
    larger: int
    smaller: int
    equal: int
    confidence: float


@dataclass(frozen=True)
class RateDifference:
    """Rate of b less rate of a. only_a, only_b: successes of one alone, which are all that tells them apart.

    probability: of McNemar's exact test, that chance alone makes them so different.
    """

    pairs: int
    both: int
    only_a: int
    only_b: int
    value: float
    low: float
    high: float
    confidence: float
    probability: float


def differences(a, b, confidence: float = 0.95) -> Differences:
    """Compare a metric (n,) of two campaigns, case by case; NaN: the case has none."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    has_a, has_b = ~np.isnan(a), ~np.isnan(b)
    both = has_a & has_b
    with np.errstate(invalid="ignore"):
        found = np.where(a[both] == b[both], 0.0, b[both] - a[both])  # equal infinities too
    n = len(found)
    counts = (n, int((has_a & ~has_b).sum()), int((has_b & ~has_a).sum()), int((~has_a & ~has_b).sum()))
    middle = float(np.median(found)) if n else None
    ordered = np.sort(found)
    low, high = ranks(n, 0.5, confidence)
    ends = (float(ordered[low - 1]) if low >= 1 else None, float(ordered[high - 1]) if high <= n else None)
    return Differences(*counts, *_mean(found, confidence), middle, *ends, int((found > 0).sum()), int((found < 0).sum()),
                       int((found == 0).sum()), confidence)


def rate_difference(a, b, confidence: float = 0.95) -> RateDifference:
    """Compare successes (n,) of two campaigns, case by case. Raises ValueError when there is no pair."""
    a, b = np.asarray(a, dtype=bool), np.asarray(b, dtype=bool)
    if not len(a) or len(a) != len(b):
        raise ValueError("allowed: as many cases of one campaign as of the other, at least one")
    n, both, only_a, only_b = len(a), int((a & b).sum()), int((a & ~b).sum()), int((b & ~a).sum())
    low, high = tango(only_b, only_a, n, confidence)
    apart = only_a + only_b
    chance = stats.binomtest(only_a, apart, 0.5).pvalue if apart else 1.0
    return RateDifference(n, both, only_a, only_b, (only_b - only_a) / n, low, high, confidence, float(chance))


def tango(more: int, less: int, n: int, confidence: float) -> tuple[float, float]:
    """Ends of the interval of (more - less) / n, of n pairs of which so many changed: where the score is z."""
    z = float(special.ndtri(0.5 + 0.5 * confidence))

    def score(delta):  # falls with delta
        a, b, c = 2.0 * n, (2.0 * n - more + less) * delta - more - less, -less * delta * (1.0 - delta)
        fewer = (math.sqrt(max(b * b - 4.0 * a * c, 0.0)) - b) / (2.0 * a)  # most likely rate of a loss
        variance = n * (2.0 * fewer + delta * (1.0 - delta))
        gap = more - less - n * delta
        return gap / math.sqrt(variance) if variance > 0.0 else math.copysign(math.inf, gap) if gap else 0.0

    centre = (more - less) / n

    def end(side):
        far = side * (1.0 - NARROWEST)
        if abs(centre - far) < 1e-9 or abs(score(far)) < z:
            return float(side)
        return float(optimize.brentq(lambda delta: math.atan(score(delta)) + side * math.atan(z), *sorted((centre, far)),
                                     xtol=NARROWEST))

    return end(-1), end(1)


def _mean(found, confidence):
    if not len(found) or not np.isfinite(found).all():
        return None, None, None
    mean = float(np.mean(found))
    if len(found) < 2:
        return mean, None, None
    reach = float(stats.t.ppf(0.5 + 0.5 * confidence, len(found) - 1) * np.std(found, ddof=1) / math.sqrt(len(found)))
    return mean, mean - reach, mean + reach
