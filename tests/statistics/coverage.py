"""How often intervals hold the truth, on distributions whose truth is known: one experiment an interval.

An experiment gives (repetitions whose interval holds the truth, what is promised): ``nominal`` intervals promise 95 %,
``exact`` discrete ones the coverage that follows from the binomial distribution, ``at least`` ones 95 % or more.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from flight_graph.statistics.pairs import differences, tango
from flight_graph.statistics.percentiles import bound, percentile, ranks
from flight_graph.statistics.rates import clopper_pearson
from flight_graph.statistics.sensitivities import rank_correlations, sobol_indices
from flight_graph.statistics.stopping import StoppingRule, Until
from flight_graph.statistics.subset_simulation import subset_simulation
from tests.statistics.known import ISHIGAMI_FIRST, ISHIGAMI_TOTAL, ishigami_design, partial_rank, spearman_of_normal

REPETITIONS = 4000
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Coverage:
    """What an experiment found. promise: nominal, exact or at least; expected: the coverage that is promised."""

    name: str
    covered: float
    promise: str
    expected: float = CONFIDENCE


def rates(rng, repetitions=REPETITIONS):
    """Clopper and Pearson, against the sum of binomial probabilities of the results whose interval holds p."""
    for n, p in ((20, 0.3), (100, 0.02), (1000, 0.5), (3000, 0.999)):
        low, high = clopper_pearson(np.arange(n + 1), np.full(n + 1, n), CONFIDENCE)
        holds = (low <= p) & (p <= high)
        exact = float(stats.binom.pmf(np.arange(n + 1), n, p)[holds].sum())
        yield Coverage(f"rate {p:g} of {n} runs", float(holds[rng.binomial(n, p, repetitions)].mean()), "exact", exact)


def percentiles(rng, repetitions=REPETITIONS):
    """Order statistics of skew and heavy-tailed values, against the binomial sum between the ranks."""
    for n, share, law in ((100, 0.5, stats.expon()), (400, 0.95, stats.t(2)), (2000, 0.9973, stats.norm())):
        low, high = ranks(n, share, CONFIDENCE)
        exact = float(stats.binom.cdf(high - 1, n, share) - stats.binom.cdf(low - 1, n, share))
        values = np.sort(law.rvs((repetitions, n), random_state=rng), axis=1)
        found = [percentile(row, share, CONFIDENCE) for row in values]
        truth = law.ppf(share)
        covered = np.mean([(one.low is None or one.low <= truth) and (one.high is None or truth <= one.high) for one in found])
        yield Coverage(f"{100 * share:g} % of {n} values", float(covered), "exact", exact)


def bounds(rng, repetitions=REPETITIONS):
    """Wilks: how often the bound lies beyond the true quantile."""
    for n, share, confidence in ((59, 0.95, 0.95), (852, 0.9973, 0.9), (3000, 0.99, 0.95)):
        values = np.sort(rng.exponential(size=(repetitions, n)), axis=1)
        found = [bound(row, share, confidence) for row in values]
        covered = np.mean([one.value >= -math.log1p(-share) for one in found])
        yield Coverage(f"bound of {100 * share:g} % with {100 * confidence:g} % of {n}", float(covered), "exact",
                       found[0].covered)


def stopping(rng, repetitions=REPETITIONS):
    """The interval at which a campaign stops, over rates with early and with late ends."""
    for half_width, chunk in ((0.05, 10), (0.01, 100)):
        rule = StoppingRule(Until(metric="x", half_width=half_width, confidence=CONFIDENCE), 10**6, chunk)
        for p in (0.002, 0.02, 0.1, 0.5):
            covered = sum(ends(rule, p, rng)[0] for _ in range(repetitions)) / repetitions
            yield Coverage(f"rate {p:g}, stopped at +-{half_width:g}", covered, "at least")


def ends(rule, p, rng) -> tuple[bool, int]:
    """(the last interval holds p, runs) of one campaign under a stopping rule."""
    seen = successes = 0
    for look in rule.looks:
        successes, seen = successes + rng.binomial(look - seen, p), look
        verdict = rule.verdict(look, [(successes, look)])
        if verdict.stop:
            return verdict.rates[0].low <= p <= verdict.rates[0].high, look
    raise AssertionError("the rule never ended")


def pairs(rng, repetitions=REPETITIONS):
    """Mean and median of differences of two correlated campaigns, and the difference of their rates."""
    n, shift = 60, 0.4
    draws = rng.standard_normal((repetitions, n))
    other = draws + shift + 0.5 * rng.standard_normal((repetitions, n))
    found = [differences(a, b, CONFIDENCE) for a, b in zip(draws, other)]
    yield Coverage("mean of 60 normal differences", np.mean([one.mean_low <= shift <= one.mean_high for one in found]),
                   "nominal")
    low, high = ranks(n, 0.5, CONFIDENCE)
    exact = float(stats.binom.cdf(high - 1, n, 0.5) - stats.binom.cdf(low - 1, n, 0.5))
    yield Coverage("median of 60 normal differences", np.mean([one.median_low <= shift <= one.median_high for one in found]),
                   "exact", exact)
    for n, gained, lost in ((200, 0.1, 0.05), (1000, 0.02, 0.06)):
        counts = rng.multinomial(n, (gained, lost, 1.0 - gained - lost), repetitions)
        known = {}
        for more, less, _ in counts.tolist():
            if (more, less) not in known:
                low, high = tango(more, less, n, CONFIDENCE)
                known[more, less] = low <= gained - lost <= high
        covered = np.mean([known[more, less] for more, less, _ in counts.tolist()])
        yield Coverage(f"difference of rates, {n} pairs, +{gained:g} -{lost:g}", covered, "nominal")


def correlations(rng, repetitions=REPETITIONS):
    """Spearman's and partial rank correlation of normal numbers, whose rank correlations are known."""
    weights, n = np.array([0.8, -0.4]), 200
    covariance = np.eye(3)
    covariance[:2, 2] = covariance[2, :2] = weights
    covariance[2, 2] = weights @ weights + 0.5**2
    ranked = spearman_of_normal(covariance)
    partial, hits, partial_hits = partial_rank(ranked), 0, 0
    for draws in rng.multivariate_normal(np.zeros(3), covariance, (repetitions, n)):
        first, _ = rank_correlations({"a": draws[:, 0], "b": draws[:, 1]}, draws[:, 2], CONFIDENCE)
        hits += first.low <= ranked[0, 2] <= first.high
        partial_hits += first.partial_low <= partial[0] <= first.partial_high
    yield Coverage("rank correlation of 200 rows", hits / repetitions, "nominal")
    yield Coverage("partial rank correlation of 200 rows", partial_hits / repetitions, "nominal")


def indices(rng, repetitions=REPETITIONS):
    """Sobol indices of the Ishigami function from independent base samples."""
    hits, total_hits = np.zeros(3), np.zeros(3)
    for _ in range(repetitions):
        found = sobol_indices(ishigami_design(rng.random((2, 800, 3))), ["a", "b", "c"], CONFIDENCE).factors
        hits += [one.first_low <= truth <= one.first_high for one, truth in zip(found, ISHIGAMI_FIRST)]
        total_hits += [one.total_low <= truth <= one.total_high for one, truth in zip(found, ISHIGAMI_TOTAL)]
    for j, name in enumerate("abc"):
        yield Coverage(f"first order index of {name}, 800 samples", hits[j] / repetitions, "nominal")
        if ISHIGAMI_TOTAL[j] > 0.0:
            yield Coverage(f"total index of {name}, 800 samples", total_hits[j] / repetitions, "nominal")


def rare_events(rng, repetitions=REPETITIONS):
    """The linear limit state: P(sum z / sqrt(d) >= beta) = Phi(-beta)."""
    for dimensions, beta, runs in ((2, 3.0902, 500), (100, 3.0902, 500)):
        truth, hits = stats.norm.sf(beta), 0
        for _ in range(repetitions):
            found = subset_simulation(lambda z: z.sum(axis=1) / math.sqrt(dimensions), dimensions, beta, runs,
                                      seed=int(rng.integers(2**62)))
            hits += found.low <= truth <= found.high
        yield Coverage(f"rare event of 1e-3, {dimensions} dimensions, 500 runs a level", hits / repetitions, "at least")
