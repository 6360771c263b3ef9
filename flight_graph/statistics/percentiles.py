"""Percentiles of a metric with a confidence that no distribution is assumed for: order statistics.

Of n independent values, sorted to X_1 <= ... <= X_n, the number below the true quantile x_q is binomial (n, q), so

    P(X_r <= x_q <= X_s) >= P(r <= Bin(n, q) <= s - 1)

S. S. Wilks, Annals of Mathematical Statistics 12 (1941) 91-96; W. R. Thompson, ibid. 7 (1936) 122-128. Equality holds for
a continuous distribution. Where n is too small for an end, there is none, and `runs_needed` says how many runs it takes.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

MOST_RUNS_NEEDED = 10**12


@dataclass(frozen=True)
class Percentile:
    """The share q of the values is below ``value``. low, high: ends of the interval at this confidence; None: too few runs.

    needed: runs from which on there are both ends. runs: values that it is made of.
    """

    share: float
    value: float | None
    low: float | None
    high: float | None
    confidence: float
    runs: int
    needed: int


@dataclass(frozen=True)
class Bound:
    """At least the share q of all runs stays at or below (``upper``) or above ``value``, with this confidence.

    value: None where runs < needed: then there is no such statement. covered: the confidence that the value has (>= the one
    that was asked for; with too few runs that of the largest value).
    """

    share: float
    confidence: float
    upper: bool
    value: float | None
    covered: float
    runs: int
    needed: int

    def sentence(self) -> str:
        """Whether there are enough runs, for a person."""
        text = (f"{100 * self.share:.10g} % with {100 * self.confidence:g} % confidence needs {self.needed} runs, "
                f"there are {self.runs}")
        return text if self.value is not None else f"{text}: too few (they give {100 * self.covered:.3g} %)"


def percentile(ordered: np.ndarray, share: float, confidence: float = 0.95) -> Percentile:
    """The percentile of sorted values (n,), none of them NaN, between the two order statistics that hold it.

    share: between 0 and 1. value: the linear interpolation of NumPy. Raises ValueError.
    """
    _check(share, confidence)
    n = len(ordered)
    low, high = ranks(n, share, confidence)
    return Percentile(share, _at(ordered, share), float(ordered[low - 1]) if low >= 1 else None,
                      float(ordered[high - 1]) if high <= n else None, confidence, n,
                      _both_ends(share, confidence))


def ranks(n: int, share: float, confidence: float) -> tuple[int, int]:
    """Ranks (r, s), counted from 1, of the interval with equal tails; 0 and n + 1 stand for no end."""
    tail = 0.5 * (1.0 - confidence)
    low = _last(n, share, tail)  # the largest r with P(Bin <= r - 1) <= tail
    return low, n + 1 - _last(n, 1.0 - share, tail)


def bound(ordered: np.ndarray, share: float, confidence: float = 0.9, upper: bool = True) -> Bound:
    """A bound of sorted values (n,) that at least this share of all runs keeps, one-sided."""
    _check(share, confidence)
    n = len(ordered)
    rank = _last(n, 1.0 - share, 1.0 - confidence)  # counted from the largest value
    covered = 1.0 - float(special.bdtr(max(rank, 1) - 1, n, 1.0 - share)) if n else 0.0
    value = None if rank < 1 else float(ordered[-rank] if upper else ordered[rank - 1])
    return Bound(share, confidence, upper, value, covered, n, runs_needed(share, confidence))


def runs_needed(share: float, confidence: float) -> int:
    """Runs whose largest value exceeds the share of all with this confidence: the least n with 1 - q^n >= confidence."""
    _check(share, confidence)
    return _least(lambda n: -math.expm1(n * math.log(share)) >= confidence)


def runs_needed_between(share: float, confidence: float) -> int:
    """Runs whose smallest and largest value hold the share of all between them with this confidence (Wilks 1941)."""
    _check(share, confidence)
    return _least(lambda n: 1.0 - share**n - n * (1.0 - share) * share ** (n - 1) >= confidence)


def _both_ends(share, confidence) -> int:
    return runs_needed(max(share, 1.0 - share), 0.5 * (1.0 + confidence))


def _last(n, share, tail) -> int:
    """The largest r with P(Bin(n, share) <= r - 1) <= tail; 0 where there is none."""
    guess = int(special.bdtrik(tail, n, share)) + 2 if n and tail > (1.0 - share) ** n else 1
    rank = min(max(guess, 0), n)
    while rank and special.bdtr(rank - 1, n, share) > tail:
        rank -= 1
    return rank


def _at(ordered, share):
    """The quantile between neighbours in rank, infinite ones too."""
    if not len(ordered):
        return None
    place = share * (len(ordered) - 1)
    below = ordered[int(place)]
    above = ordered[min(int(place) + 1, len(ordered) - 1)]
    return float(below) if below == above else float(below + (place - int(place)) * (above - below))


def _least(enough) -> int:
    high = 1
    while not enough(high):
        high *= 2
        if high > MOST_RUNS_NEEDED:
            raise ValueError(f"more than {MOST_RUNS_NEEDED} runs would be needed")
    low = high // 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def _check(share, confidence):
    if not 0.0 < share < 1.0:
        raise ValueError(f"a share of {share} is not allowed; allowed: between 0 and 1 (0.9973 is 99.73 %)")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"a confidence of {confidence} is not allowed; allowed: between 0 and 1")
