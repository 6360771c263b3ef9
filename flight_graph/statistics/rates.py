"""The rate of an event in independent runs, with an exact interval.

C. J. Clopper and E. S. Pearson, Biometrika 26 (1934) 404-413: the interval holds every rate under which what was seen, or
something as far out, has at least half of 1 - confidence. It covers the true rate with at least its confidence.
"""

from dataclasses import dataclass

import numpy as np
from scipy import special


@dataclass(frozen=True)
class Rate:
    """successes of runs; low, high: ends of the interval at this confidence (0..1)."""

    successes: int
    runs: int
    confidence: float
    low: float
    high: float

    @property
    def value(self) -> float:
        """Successes over runs [1]; NaN of no runs."""
        return self.successes / self.runs if self.runs else float("nan")

    @property
    def half_width(self) -> float:
        """Half of the interval [1]."""
        return 0.5 * (self.high - self.low)


def rate(successes: int, runs: int, confidence: float = 0.95) -> Rate:
    """The rate and its interval; of no runs it is everything between 0 and 1."""
    low, high = clopper_pearson(successes, runs, confidence)
    return Rate(int(successes), int(runs), confidence, float(low), float(high))


def clopper_pearson(successes, runs, confidence=0.95):
    """Ends of the interval, arrays of the shape of successes and runs (integers). Raises ValueError."""
    successes, runs = np.asarray(successes), np.asarray(runs)
    if not ((0 <= successes) & (successes <= runs)).all():
        raise ValueError("allowed: 0 <= successes <= runs")
    if not np.all((0.0 < np.asarray(confidence)) & (np.asarray(confidence) < 1.0)):
        raise ValueError(f"a confidence of {confidence} is not allowed; allowed: between 0 and 1")
    tail = 0.5 * (1.0 - confidence)
    with np.errstate(invalid="ignore"):
        low = np.where(successes > 0, special.betaincinv(np.maximum(successes, 1), runs - successes + 1.0, tail), 0.0)
        high = np.where(successes < runs,
                        special.betaincinv(successes + 1.0, np.maximum(runs - successes, 1), 1.0 - tail), 1.0)
    return low, high


def upper_bound(events: int, runs: int, confidence: float = 0.95) -> float:
    """The largest rate of an event that these runs leave possible, one-sided: 3 / runs of none at 95 %."""
    return float(clopper_pearson(events, runs, 2.0 * confidence - 1.0)[1]) if confidence > 0.5 else float("nan")
