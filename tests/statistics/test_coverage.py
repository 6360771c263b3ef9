"""Intervals hold the truth as often as they promise, on distributions whose truth is known (4000 repetitions where that is
cheap; benchmarks/interval_coverage.py repeats all of them as often)."""

import math

import numpy as np
import pytest
from scipy import stats

from flight_graph.statistics.stopping import StoppingRule, Until
from tests.statistics import coverage


@pytest.mark.parametrize(("experiment", "repetitions"), [
    (coverage.rates, 4000), (coverage.percentiles, 1000), (coverage.bounds, 2000), (coverage.stopping, 150),
    (coverage.pairs, 4000), (coverage.correlations, 4000), (coverage.indices, 4000), (coverage.rare_events, 100)])
def test_intervals_hold_the_truth_as_often_as_they_promise(experiment, repetitions):
    for found in experiment(np.random.default_rng(3), repetitions):
        scatter = math.sqrt(found.expected * (1.0 - found.expected) / repetitions)
        assert found.covered >= found.expected - 3.0 * scatter, found
        if found.promise == "exact":
            assert abs(found.covered - found.expected) <= 3.5 * scatter, found
        if found.promise == "nominal":
            assert 0.94 <= found.covered <= 0.96, found


def test_a_stopped_rate_is_covered_for_every_truth():
    """The exact probability that the last interval misses, by the distribution of successes from look to look."""
    rule = StoppingRule(Until(metric="x", half_width=0.1, confidence=0.9), 10**6, 5)
    looks = rule.looks[:-1]
    ends = {look: [rule.verdict(look, [(hits, look)]) for hits in range(look + 1)] for look in looks}
    for p in np.linspace(0.003, 0.5, 80):
        alive, missed, seen = np.ones(1), 0.0, 0
        for look in looks:
            alive = np.convolve(alive, stats.binom.pmf(np.arange(look - seen + 1), look - seen, p))
            seen = look
            for hits, verdict in enumerate(ends[look]):
                if verdict.enough:
                    missed += 0.0 if verdict.rates[0].low <= p <= verdict.rates[0].high else alive[hits]
                    alive[hits] = 0.0
        assert alive.sum() < 1e-12, "the rule ends before its last look"
        assert missed <= 0.1, p
