"""Intervals and tests against scipy, closed forms and published numbers."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats

from flight_graph.statistics import percentiles, sensitivities
from flight_graph.statistics.pairs import differences, rate_difference, tango
from flight_graph.statistics.percentiles import bound, percentile, ranks, runs_needed, runs_needed_between
from flight_graph.statistics.rates import clopper_pearson, rate, upper_bound
from flight_graph.statistics.sensitivities import rank_correlations, sobol_indices
from tests.statistics.known import ISHIGAMI_FIRST, ISHIGAMI_TOTAL, ishigami_design, partial_rank


@settings(deadline=None, max_examples=60)
@given(some.integers(1, 10**6), some.floats(0.0, 1.0), some.sampled_from([0.5, 0.9, 0.95, 0.999]))
def test_clopper_pearson_is_that_of_scipy(runs, share, confidence):
    hits = round(share * runs)
    expected = stats.binomtest(hits, runs).proportion_ci(confidence, method="exact")
    assert clopper_pearson(hits, runs, confidence) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_rates_of_none_and_of_all():
    assert (rate(0, 0).low, rate(0, 0).high) == (0.0, 1.0) and math.isnan(rate(0, 0).value)
    assert rate(0, 50).high == pytest.approx(1.0 - 0.025 ** (1 / 50)) and rate(50, 50).high == 1.0
    assert upper_bound(0, 3000) == pytest.approx(1.0 - 0.05 ** (1 / 3000))  # about 3 / n
    with pytest.raises(ValueError, match="0 <= successes <= runs"):
        clopper_pearson(5, 4)


def test_runs_that_a_percentile_needs():
    """Wilks' table: 59 runs for 95 %/95 %, 93 between the ends; 99.73 % with 90 % needs 852."""
    assert (runs_needed(0.95, 0.95), runs_needed_between(0.95, 0.95)) == (59, 93)
    assert (runs_needed(0.9, 0.9), runs_needed(0.99, 0.99), runs_needed(0.9973, 0.9)) == (22, 459, 852)
    few, enough = bound(np.arange(851.0), 0.9973, 0.9), bound(np.arange(852.0), 0.9973, 0.9)
    assert few.value is None and enough.value == 851.0
    assert few.sentence() == ("99.73 % with 90 % confidence needs 852 runs, there are 851: too few (they give 90 %)")
    assert bound(np.arange(852.0), 0.9973, 0.9, upper=False).value == 0.0
    with pytest.raises(ValueError, match="0.9973 is 99.73 %"):
        runs_needed(99.73, 0.9)


@settings(deadline=None, max_examples=80)
@given(some.integers(1, 3000), some.floats(0.001, 0.999), some.sampled_from([0.5, 0.9, 0.95, 0.999]))
def test_ranks_are_the_tightest_with_their_tails(n, share, confidence):
    low, high = ranks(n, share, confidence)
    tail = 0.5 * (1.0 - confidence)
    below, above = (lambda r: stats.binom.cdf(r - 1, n, share)), (lambda s: stats.binom.sf(s - 1, n, share))
    assert (low == 0 or below(low) <= tail * (1 + 1e-9)) and (low == n or below(low + 1) > tail * (1 - 1e-9))
    assert (high == n + 1 or above(high) <= tail * (1 + 1e-9)) and (high == 1 or above(high - 1) > tail * (1 - 1e-9))


def test_percentiles_are_those_of_numpy_and_say_what_they_lack():
    values = np.sort(np.random.default_rng(1).standard_cauchy(500))
    for share in (0.001, 0.25, 0.5, 0.77, 0.999):
        assert percentile(values, share).value == pytest.approx(np.quantile(values, share))
    found = percentile(values, 0.999)
    assert found.high is None and found.low is not None and found.needed == runs_needed(0.999, 0.975)
    assert percentile(np.array([]), 0.5).value is None
    assert percentile(np.array([1.0, np.inf, np.inf]), 0.9).value == np.inf
    assert percentiles.ranks(10**6, 0.9973, 0.9)[0] == stats.binom.ppf(0.05, 10**6, 0.9973)


def test_paired_differences():
    a, b = np.array([1.0, 2.0, np.nan, 4.0, np.nan, 5.0]), np.array([1.5, 2.0, 3.0, np.nan, np.nan, 4.0])
    found = differences(a, b)
    assert (found.pairs, found.only_a, found.only_b, found.neither) == (3, 1, 1, 1)
    assert (found.larger, found.smaller, found.equal, found.median) == (1, 1, 1, 0.0)
    expected = stats.ttest_rel([1.5, 2.0, 4.0], [1.0, 2.0, 5.0]).confidence_interval(0.95)
    assert (found.mean_low, found.mean_high) == pytest.approx(tuple(expected))
    assert found.median_low is None and differences([np.nan], [1.0]).mean is None


def test_paired_rates():
    a = np.repeat([True, True, False, False], [36, 12, 2, 0])
    b = np.repeat([True, False, True, False], [36, 12, 2, 0])
    found = rate_difference(b, a)
    assert (found.both, found.only_a, found.only_b, found.value) == (36, 2, 12, 0.2)
    assert found.low < 0.2 < found.high
    assert found.probability == pytest.approx(2 * stats.binom.cdf(2, 14, 0.5))
    assert rate_difference([True] * 9, [True] * 9).probability == 1.0
    assert tango(9, 0, 9, 0.95)[1] == 1.0 and tango(0, 9, 9, 0.95)[0] == -1.0
    for more, less, n in ((12, 2, 50), (3, 9, 40), (0, 5, 100), (0, 0, 30)):  # the score at the ends is z
        for end, side in zip(tango(more, less, n, 0.9), (1, -1)):
            p = _likeliest(more, less, n, end)
            assert side * (more - less - n * end) / math.sqrt(n * (2 * p + end * (1 - end))) == pytest.approx(
                stats.norm.ppf(0.95), rel=1e-4)


def _likeliest(more, less, n, delta):
    """The rate of a loss with the largest likelihood, when the difference is delta: by search."""
    from scipy.optimize import minimize_scalar
    rest = n - more - less

    def unlikely(p):
        parts = ((more, p + delta), (less, p), (rest, 1.0 - 2.0 * p - delta))
        return -sum(count * math.log(max(share, 1e-300)) for count, share in parts if count)

    return minimize_scalar(unlikely, bounds=(max(0.0, -delta), 0.5 * (1.0 - delta)), method="bounded",
                           options={"xatol": 1e-12}).x


def test_sobol_indices_are_those_of_scipy_and_of_ishigami():
    n = 2**12
    u = stats.qmc.Sobol(6, rng=4).random(n)
    values = ishigami_design(np.stack([u[:, :3], u[:, 3:]]))
    found = sobol_indices(values, ["a", "b", "c"])
    rows = values.reshape(n, 5)
    scipys = stats.sobol_indices(func={"f_A": rows[:, 0], "f_B": rows[:, 1], "f_AB": rows[:, 2:].T[:, None]}, n=n)
    assert [one.first for one in found.factors] == pytest.approx(list(scipys.first_order.ravel()), abs=1e-12)
    assert [one.total for one in found.factors] == pytest.approx(list(scipys.total_order.ravel()), abs=1e-12)
    assert [one.first for one in found.factors] == pytest.approx(ISHIGAMI_FIRST, abs=0.02)
    assert [one.total for one in found.factors] == pytest.approx(ISHIGAMI_TOTAL, abs=0.02)
    values[7] = np.nan  # of base sample 1
    less = sobol_indices(values[:-1], ["a", "b", "c"])
    assert (less.samples, less.left_out) == (n - 2, 2) and less.factors[1].first == pytest.approx(ISHIGAMI_FIRST[1], abs=0.02)
    assert sobol_indices(np.ones(50), ["a", "b", "c"]).factors == ()


def test_rank_correlations_are_those_of_scipy(monkeypatch):
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 300))
    y = np.exp(a) - b**3 + rng.normal(size=300)
    y[:7] = np.nan
    first, second, still = rank_correlations({"a": a, "b": b, "c": np.ones(300)}, y)
    assert first.value == pytest.approx(stats.spearmanr(a[7:], y[7:]).statistic) and first.rows == 293 and first.left_out == 7
    ranked = stats.spearmanr(np.column_stack([a, b, y])[7:]).statistic
    assert (first.partial, second.partial) == pytest.approx(partial_rank(ranked))
    assert still.value is None and first.low < first.value < first.high
    monkeypatch.setattr(sensitivities, "MOST_ROWS", 150)
    fewer = rank_correlations({"a": a, "b": b}, y)[0]
    assert (fewer.value, fewer.partial) == (first.value, pytest.approx(first.partial))
    assert fewer.high - fewer.low == pytest.approx(first.high - first.low, rel=0.2), "the variance of a part of the rows"
    assert fewer.partial_high - fewer.partial_low == pytest.approx(first.partial_high - first.partial_low, rel=0.2)
    together = rank_correlations({"a": a, "twin": 2 * a}, y)
    assert together[0].partial is None and together[0].value is not None
    assert rank_correlations({"a": a[:2]}, y[:2])[0].value is None
