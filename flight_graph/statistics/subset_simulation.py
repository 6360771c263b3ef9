"""The probability of a rare event by subset simulation over standard normal numbers.

S.-K. Au and J. L. Beck, Probabilistic Engineering Mechanics 16 (2001) 263-277: the event {g >= b} is reached over levels
b_1 < b_2 < ... < b, of which each has a probability of about ``share`` given the one before, so P is the product of
probabilities that a few hundred runs can tell. Samples of a level come from Markov chains that start at those of the level
before; a step is the conditional sampling of I. Papaioannou, W. Betz, K. Zwirglmaier and D. Straub, ibid. 41 (2015) 89-103,
whose acceptance does not fall with the number of dimensions; its width follows the acceptance.

The coefficient of variation is counted by families. Samples that go back to one sample of the first level belong together;
the first samples are independent, so the families are, and the relative error of P is the sum over families of

    psi_e = sum over levels j of sum over samples i of e (indicator_ij - p_j) / (N p_j)

with variance sum psi_e^2, and (sum psi_e^2)^2 / sum psi_e^4 degrees of freedom for a Student interval of log P. This
holds what one chain has in common, what chains from one ancestor have, and what one level hands to the next; the formula
of Au and Beck takes chains and levels for independent, and says too little.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

WANTED_ACCEPTANCE = 0.44  # [-] of a chain's step
GROUPS = 10  # [-] of a level's chains; the width is changed from one to the next
MOST_LEVELS = 30
NARROWEST, WIDEST = 1e-3, 1.0  # [-] width of a step: 1 forgets where it came from


class Stuck(ValueError):
    """A metric that takes one value in most runs of a level, so no higher level can be set."""


@dataclass(frozen=True)
class Level:
    """threshold: of g; probability: given the level before; variation: its coefficient of variation.

    acceptance: of the steps of the chains that filled the level, None for the first one, which is drawn independently.
    """

    threshold: float
    probability: float
    variation: float
    acceptance: float | None


@dataclass(frozen=True)
class RareEvent:
    """Probability of the event and its coefficient of variation.

    low, high: a Student interval of the logarithm, on the safe side (a 95 % one covers 96 to 99 %: see the documentation).
    runs: evaluations; missing: those that gave no number, which count as the event. bound: True where even the last level
    saw no event, so the probability is below ``probability``.
    samples: (n, dimensions) of the last level in the event, and their g.
    """

    probability: float
    variation: float
    low: float
    high: float
    confidence: float
    bound: bool
    runs: int
    missing: int
    levels: tuple[Level, ...]
    samples: np.ndarray
    values: np.ndarray


def subset_simulation(evaluate, dimensions: int, threshold: float, runs: int = 1000, share: float = 0.1, seed: int = 0,
                      confidence: float = 0.95, most_levels: int = MOST_LEVELS, progress=None) -> RareEvent:
    """P(g(z) >= threshold), z standard normal.

    evaluate: (n, dimensions) -> (n,) values of g; NaN counts as the event. runs: a level. most_levels: where it gives up,
    at a probability of share**most_levels. progress(runs done, level, its threshold) is called after each batch.
    Raises ValueError, Stuck.
    """
    if dimensions < 1:
        raise ValueError("there is nothing to draw: no standard normal number is behind a case")
    if not (0.0 < share <= 0.5 and runs * share >= 2):
        raise ValueError(f"{runs} runs a level with a share of {share}; allowed: a share up to 0.5, and two runs of it")
    if not math.isfinite(threshold):
        raise ValueError(f"a threshold of {threshold} is not allowed; allowed: a finite number")
    rng, count = np.random.default_rng(seed), _Counted(evaluate, progress)
    samples = rng.standard_normal((runs, dimensions))
    values, families, errors = count(samples), np.arange(runs), np.zeros(runs)
    levels, width, acceptance = [], 0.6, None
    while True:
        step = min(float(np.partition(values, -round(runs * share))[-round(runs * share)]), threshold)
        inside = values >= step
        p = float(inside.mean())
        part = np.bincount(families, inside - p, minlength=runs) / (runs * p)
        errors += part
        levels.append(Level(step, p, float(np.linalg.norm(part)), acceptance))
        count.level, count.threshold = len(levels), step
        if step >= threshold or len(levels) >= most_levels:
            break
        if p > 0.5 or len(levels) > 1 and step <= levels[-2].threshold:
            raise Stuck(f"{100 * p:.3g} % of the runs of level {len(levels)} have {step:.6g} or more, and no "
                        "level can be set between; a metric of few values is no measure of how near a run is to the event")
        chosen = rng.permutation(np.flatnonzero(inside))
        samples, values, acceptance, width = _chains(count, samples[chosen], values[chosen], step, runs, width, rng)
        families = np.tile(families[chosen], -(-runs // len(chosen)))[:runs]
    found = math.prod(level.probability for level in levels)
    variation = float(np.linalg.norm(errors))
    event = values >= threshold
    low, high = _interval(found, errors, confidence)
    return RareEvent(found, variation, 0.0 if step < threshold else low, high, confidence, step < threshold, count.runs,
                     count.missing, tuple(levels), samples[event], values[event])


def _interval(found, errors, confidence):
    squares = float(np.sum(errors**2))
    if squares == 0.0:
        return found, found
    freedom = squares**2 / float(np.sum(errors**4))
    reach = special.stdtrit(freedom, 0.5 + 0.5 * confidence) * math.sqrt(math.log1p(squares))
    with np.errstate(over="ignore"):
        return float(found * np.exp(-reach)), float(min(1.0, found * np.exp(reach)))


class _Counted:
    """Evaluations, counted; a value that is no number is +infinity, and counted."""

    def __init__(self, evaluate, progress):
        self._evaluate, self._progress = evaluate, progress
        self.runs = self.missing = self.level = 0
        self.threshold = -math.inf

    def __call__(self, samples):
        values = np.array(self._evaluate(samples), dtype=float)
        if values.shape != (len(samples),):
            raise ValueError(f"{len(samples)} samples gave values of shape {values.shape}")
        self.runs, self.missing = self.runs + len(values), self.missing + int(np.isnan(values).sum())
        values[np.isnan(values)] = math.inf
        if self._progress:
            self._progress(self.runs, self.level, self.threshold)
        return values


def _chains(count, seeds, values, threshold, runs, width, rng):
    """Samples of a level: chains from its seeds, (runs, dimensions), step by step with all chains of a group side by side.

    They are sorted by step, then chain: sample k * chains + j is step k of chain j.
    """
    length = -(-runs // len(seeds))
    all_samples = np.empty((length, *seeds.shape))
    all_values = np.empty((length, len(seeds)))
    all_samples[0], all_values[0] = seeds, values
    accepted = tried = 0
    for group, part in enumerate(np.array_split(np.arange(len(seeds)), min(GROUPS, len(seeds)))):
        met = 0
        for step in range(1, length):
            here, level = all_samples[step - 1, part], all_values[step - 1, part]
            there = math.sqrt(1.0 - width * width) * here + width * rng.standard_normal(here.shape)
            found = count(there)
            moved = found >= threshold
            all_samples[step, part] = np.where(moved[:, None], there, here)
            all_values[step, part] = np.where(moved, found, level)
            met += int(moved.sum())
        accepted, tried = accepted + met, tried + (length - 1) * len(part)
        rate = met / max(1, (length - 1) * len(part))
        width = float(np.clip(width * math.exp((rate - WANTED_ACCEPTANCE) / math.sqrt(group + 1)), NARROWEST, WIDEST))
    samples, values = all_samples.reshape(-1, seeds.shape[1])[:runs], all_values.reshape(-1)[:runs]
    return samples, values, accepted / max(1, tried), width

