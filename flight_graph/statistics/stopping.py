"""When a campaign has runs enough: a rate's interval is narrow enough, looked at after fixed numbers of runs.

    until: {metric: landed, half_width: 0.002, confidence: 0.99}
    until: {metric: lateral_m, below: 1.0, half_width: 0.01, confidence: 0.95}

A look counts the first n cases, in the order of their numbers, so where a campaign ends does not depend on who finished
first. Looking again and again has a price: the interval at which it stops is chosen by what was seen. It is paid in the
levels of the looks. At look k the interval (Clopper and Pearson) misses the true rate p with at most a_k, whatever p is. It
is the last look only if it is narrow, or the campaign's last, and the look before was not narrow, so

    P(the last interval misses p) <= sum over k of min(a_k, P_p(narrow at k), P_p(not narrow at k - 1))

The levels a_k are the largest, found by iteration, for which the right side stays at or below 1 - confidence for every p,
wherever the campaign's runs end. For one p few looks can be the last, so a_k is a third to a half of 1 - confidence
after the first looks, where a union bound over all looks would leave a thirtieth. They follow from the rule and the chunk's
size alone: a campaign that is extended keeps its looks.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from scipy import special

from flight_graph.statistics.rates import Rate, clopper_pearson, rate

RATIO = 1.25  # [-] runs from one look to the next
PROBABILITIES = 300  # [-] true rates at which the level is checked, from 0 to 1/2
STEPS = 40  # [-] of bisections
ROUNDS, BLAMED = 60, 0.02  # [-] of the search for levels; share of a level that counts


class Until(BaseModel):
    """The key ``until``: which rate, and how well it is to be known.

    metric: a run is a success where it is true (not 0), or, with below or above, at or beyond that limit. A run without
    the metric is no success.
    """

    model_config = ConfigDict(extra="forbid")
    metric: str = Field(min_length=1, max_length=200)
    half_width: float = Field(gt=0.0, lt=0.5)
    confidence: float = Field(0.95, gt=0.5, lt=1.0)
    below: float | None = Field(None, allow_inf_nan=False)
    above: float | None = Field(None, allow_inf_nan=False)

    @model_validator(mode="after")
    def _one(self):
        if self.below is not None and self.above is not None:
            raise ValueError("allowed: below or above, not both")
        return self

    def success(self, value) -> bool:
        """Whether a run with this value of the metric counts (None: it has none)."""
        if value is None or isinstance(value, str) or value != value:
            return False
        if self.below is not None:
            return value <= self.below
        return value >= self.above if self.above is not None else bool(value)


@dataclass(frozen=True)
class Verdict:
    """What a look says. stop: the campaign ends here; enough: because its intervals are narrow.

    rates: of each group, at the level of the look.
    """

    runs: int
    stop: bool
    enough: bool
    rates: tuple[Rate, ...]


class StoppingRule:
    """Looks at a campaign of at most ``runs`` cases.

    step: looks come after multiples of it (the chunk's size). groups: combinations whose rates are judged apart, in case
    order (case K is of group K mod groups); it stops when all are known well enough.
    looks: numbers of cases, increasing; the last is ``runs``. levels: how often the interval of each may miss.
    """

    def __init__(self, until: Until, runs: int, step: int = 1, groups: int = 1):
        self.until, self.runs, self.groups = until, runs, groups
        looks = _schedule(until, int(np.lcm(step, groups)), groups)
        union = np.full(len(looks), (1.0 - until.confidence) / len(looks))  # where a group stops depends on the others
        levels = _rounded(_levels(looks, until) if groups == 1 else union)
        count = int(np.searchsorted(looks, runs))
        self.looks = [*looks[:count].tolist(), runs]
        self.levels = levels[:count + 1].tolist() if count < len(looks) else [*levels.tolist(), float(levels[-1])]

    def judge(self, successes) -> Verdict | None:
        """The verdict of a look; None where ``len(successes)`` is not one of the looks.

        successes: (n,) booleans of cases 0 to n - 1.
        """
        successes = np.asarray(successes, dtype=bool)
        if len(successes) not in self.looks:
            return None
        counts = [(int(successes[g::self.groups].sum()), len(successes[g::self.groups])) for g in range(self.groups)]
        return self.verdict(len(successes), counts)

    def verdict(self, runs: int, counts: list[tuple[int, int]]) -> Verdict:
        """The verdict of the look after ``runs`` cases, from (successes, runs) of each group. Raises ValueError."""
        level = self.levels[self.looks.index(runs)]
        rates = tuple(rate(hits, among, 1.0 - level) for hits, among in counts)
        enough = all(found.half_width <= self.until.half_width for found in rates)
        return Verdict(runs, enough or runs == self.runs, enough, rates)


def _schedule(until, step, groups) -> np.ndarray:
    """Numbers of cases of all looks, from the first that can be narrow to the first that must be."""
    tail, wide = 0.5 * (1.0 - until.confidence), 2.0 * until.half_width
    wanted = groups * np.log(tail) / np.log1p(-wide)  # no event at all: 1 - tail^(1/n) wide
    certain = groups * (special.ndtri(1.0 - 0.01 * tail) / wide + 2.0) ** 2  # half of them events
    looks = []
    while not looks or looks[-1] < certain:
        looks.append(int(-(-wanted // step)) * step)
        wanted = max(looks[-1] * RATIO, looks[-1] + step)
    return np.array(looks)


def _levels(looks, until) -> np.ndarray:
    """a_k of the looks (see the module's text)."""
    allowed = 1.0 - until.confidence
    p = np.concatenate([[0.0], np.geomspace(1e-3 * until.half_width, 0.5, PROBABILITIES)])[:, None]
    levels = np.full(len(looks), 0.5 * allowed)
    for _ in range(ROUNDS):
        parts, bound = _missed(looks, until.half_width, levels, p)
        if bound.max() <= allowed:
            return levels
        blamed = np.where(parts > BLAMED * levels, (allowed / np.maximum(bound, allowed))[:, None], 1.0)
        levels = levels * np.maximum(blamed.min(axis=0), 0.5)
    return np.full(len(looks), allowed / len(looks))


def _rounded(levels):
    """Levels cut to three digits, so that the last bits of a special function decide nothing."""
    unit = 10.0 ** (np.floor(np.log10(levels)) - 2.0)
    return np.floor(levels / unit) * unit


def _missed(looks, half_width, levels, p):
    """Bounds of how often the last interval misses the rates p (n, 1): each look's part (n, looks), and the whole (n,)."""
    most = _narrow(looks, half_width, levels)
    narrow = np.where(most >= 0, special.bdtr(most, looks, p) + special.bdtr(most, looks, 1.0 - p), 0.0)
    before = np.concatenate([np.ones((len(p), 1)), 1.0 - narrow[:, :-1]], axis=1)
    ended = np.minimum(levels, before)
    parts = np.minimum(ended, narrow)
    return ended, (np.cumsum(parts, axis=1) - parts + ended).max(axis=1)


def _narrow(looks, half_width, levels):
    """Of each look the largest number of events up to half of the runs with a narrow interval; -1 where none has."""
    looks = np.asarray(looks)
    low, high = np.full(len(looks), -1), looks // 2 + 1  # the width grows up to half of the runs
    for _ in range(STEPS):
        middle = (low + high) // 2
        ends = clopper_pearson(np.clip(middle, 0, looks), looks, 1.0 - levels)
        fits = 0.5 * (ends[1] - ends[0]) <= half_width
        low, high = np.where(fits & (middle >= 0), middle, low), np.where(fits, high, middle)
        high = np.maximum(high, low + 1)
    return low
