"""Sampling plans: draws depend on nothing but their number, lie where the plan says, and have the distributions asked for."""

import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import special, stats

from flight_graph.errors import FlightError
from flight_graph.graphs.vary import Vary
from flight_graph.sampling import normal
from flight_graph.sampling.correlated import Correlated
from flight_graph.sampling.distributions import Distribution
from flight_graph.sampling.plan import Sampling
from flight_graph.sampling.sampler import Sampler

PLANS = [Sampling(), Sampling(plan="latin_hypercube", block=50), Sampling(plan="sobol"), Sampling(plan="saltelli")]
RANDOM = {"p.a": Distribution(uniform=(0.0, 1.0)), "p.b": Distribution(normal=(1.0, 2.0), size=2),
          "p.c": Distribution(choice=["x", "y", "z"]), "p.d": Distribution(normal=(0.0, 1.0), truncated=(0.5, None)),
          "p.e": Distribution(cone={"axis": [0, 0, 1], "angle": 0.2}), "seed": Distribution(count=7)}
TOGETHER = [Correlated(keys=["p.m", "p.v"], mean=[1.0, [0.0, 2.0]], covariance=[[1.0, 0.5, 0.0], [0.5, 1.0, 0.2], [0.0, 0.2, 4.0]])]


def sampler(plan, random=None, together=(), seed=3):
    return Sampler(plan, RANDOM if random is None else random, list(together), seed)


def column(plan, distribution, count):
    drawn = sampler(plan, {"p.x": distribution})
    return np.array([drawn.draw(number)["p.x"] for number in range(count)])


def test_independent_draws_are_those_of_earlier_versions():
    """SHA-256 of values that were written down before there were plans."""
    block = {"random": {"p.a": {"uniform": [0, 1]}, "p.b": {"normal": [1, [2, 3]]}, "p.c": {"loguniform": [1e-3, 1], "size": 3},
                        "p.d": {"choice": [1, "x"], "size": 4}, "p.e": {"direction": 2.0}, "p.f": {"direction": [1, 2]},
                        "p.g": {"cone": {"axis": [1, 2, 3], "angle": 0.3}}, "seed": {"count": 4},
                        "p.h": {"choice": [[1, 2], [3]]}, "p.i": {"uniform": [[1, 2], [3, 4]]}},
             "grid": {"p.q": [1, 2]}, "runs": 500, "seed": 9}
    vary = Vary(block, "test")
    text = repr([vary.overrides(case) for case in range(200)])
    assert hashlib.sha256(text.encode()).hexdigest() == "53104cdd7ebd991357d55c1e6abcbbb830a184b468d8187a5fe87e37126f65f0"


def test_planned_draws_are_the_same_on_every_machine():
    """SHA-256 of values that were written down when the plans were made."""
    text = repr([sampler(plan, together=TOGETHER).draw(number) for plan in PLANS[1:] for number in (0, 1, 70, 3000)])
    assert hashlib.sha256(text.encode()).hexdigest() == "4cb727c1c747b022707308c4b5facf7291fe0acdbeacf1462a5acb041ae88b2d"


@settings(deadline=None, max_examples=25)
@given(some.sampled_from(PLANS), some.lists(some.integers(0, 5000), min_size=1, max_size=6))
def test_a_draw_depends_on_its_number_alone(plan, numbers):
    """Whatever was drawn before, in any order, and however many there are to be."""
    one = sampler(plan, together=TOGETHER)
    assert one.draws(numbers) == [sampler(plan, together=TOGETHER).draw(number) for number in numbers]
    with pytest.raises(IndexError):
        one.draw(-1)


@pytest.mark.parametrize("plan", PLANS[:3], ids=lambda plan: plan.plan)
def test_a_key_that_is_added_at_the_end_changes_no_other(plan):
    more = sampler(plan, RANDOM | {"p.z": Distribution(uniform=(0.0, 1.0))}).draw(11)
    assert {key: more[key] for key in RANDOM} == sampler(plan).draw(11)


@pytest.mark.parametrize("plan", PLANS[:3], ids=lambda plan: plan.plan)
@pytest.mark.parametrize(("distribution", "law"), [
    (Distribution(uniform=(-1.0, 3.0)), stats.uniform(-1.0, 4.0)), (Distribution(normal=(2.0, 0.5)), stats.norm(2.0, 0.5)),
    (Distribution(loguniform=(1e-3, 10.0)), stats.loguniform(1e-3, 10.0)),
    (Distribution(normal=(1.0, 2.0), truncated=(0.0, 2.5)), stats.truncnorm(-0.5, 0.75, 1.0, 2.0)),
    (Distribution(normal=(0.0, 1.0), truncated=(8.0, None)), stats.truncnorm(8.0, np.inf)),
    (Distribution(normal=(0.0, 1.0), truncated=(None, -8.0)), stats.truncnorm(-np.inf, -8.0))])
def test_distributions(plan, distribution, law):
    assert stats.kstest(column(plan, distribution, 1500), law.cdf).pvalue > 1e-3


def test_nothing_beyond_the_ends_is_drawn():
    for low, high in ((0.1, None), (None, -0.1), (0.3, 0.3000000001), (7.7, None)):
        found = column(PLANS[0], Distribution(normal=(0.1, 0.3), truncated=(low, high)), 2000)
        assert found.min() >= (-np.inf if low is None else low) and found.max() <= (np.inf if high is None else high)


def test_a_block_of_a_latin_hypercube_has_one_value_in_each_cell():
    values = column(Sampling(plan="latin_hypercube", block=50), Distribution(uniform=(0.0, 1.0), size=3), 150)
    for block in values.reshape(3, 50, 3):
        assert (np.sort((block * 50).astype(int), axis=0) == np.arange(50)[:, None]).all()
    assert abs(np.corrcoef(values.T) - np.eye(3)).max() < 0.25 and len(np.unique(values)) == 450


def test_scrambled_sobol_points_keep_their_nets():
    """The first 2^m points of two coordinates: one in each box of 2^-k by 2^-(m - k), as in the plain sequence."""
    values = column(Sampling(plan="sobol"), Distribution(uniform=(0.0, 1.0), size=6), 4096)
    for k in range(9):
        boxes = (values[:256, 0] * 2**k).astype(int) * 2**(8 - k) + (values[:256, 1] * 2**(8 - k)).astype(int)
        assert len(np.unique(boxes)) == 256
    assert stats.qmc.discrepancy(values[:1024]) < 0.1 * stats.qmc.discrepancy(np.random.default_rng(1).random((1024, 6)))
    seeds = [sampler(Sampling(plan="sobol"), {"p.x": Distribution(uniform=(0.0, 1.0))}, seed=seed) for seed in range(300)]
    points = [drawn.draw(5)["p.x"] for drawn in seeds]
    assert stats.kstest(points, stats.uniform.cdf).pvalue > 1e-3, "over the seeds a point is uniform"


def test_a_design_of_saltelli_exchanges_one_factor_at_a_time():
    drawn = sampler(Sampling(plan="saltelli"), together=TOGETHER)
    assert drawn.rows == 9 and drawn.factors[-1] == ("p.m", "p.v")
    for base in (0, 4):
        a, b, *mixed = (drawn.draw(base * 9 + k) for k in range(9))
        assert all(a[key] != b[key] for key in ("p.a", "p.b", "p.m", "seed"))
        for keys, row in zip(drawn.factors, mixed):
            assert row == a | {key: b[key] for key in keys}
    seeds = [drawn.draw(base * 9 + k)["seed"] for base in range(5) for k in range(2)]
    assert len(set(seeds)) == 10


def test_correlated_normals():
    values = sampler(PLANS[2], {}, TOGETHER).draws(range(4096))
    table = np.array([[one["p.m"], *one["p.v"]] for one in values])
    assert table.mean(axis=0) == pytest.approx([1.0, 0.0, 2.0], abs=0.02)
    assert np.cov(table.T) == pytest.approx(np.array(TOGETHER[0].covariance), abs=0.05)
    twice = Correlated(keys=["p.a", "p.b"], mean=[0.0, 0.0], covariance=[[1.0, 2.0], [2.0, 4.0]])  # singular: b = 2 a
    drawn = sampler(PLANS[0], {}, [twice]).draw(5)
    assert drawn["p.b"] == pytest.approx(2.0 * drawn["p.a"]) and drawn["p.a"] != 0.0


def test_values_that_belong_to_given_standard_normal_numbers():
    drawn = sampler(PLANS[0], together=TOGETHER)
    z = np.random.default_rng(2).standard_normal(drawn.dimensions)
    values = drawn.from_normals(z, 5)
    assert drawn.dimensions == 1 + 2 + 1 + 1 + 2 + 0 + 3 and values["seed"] == 12
    assert values["p.a"] == pytest.approx(stats.norm.cdf(z[0])) and values["p.b"] == pytest.approx(list(1.0 + 2.0 * z[1:3]))
    assert values["p.d"] == pytest.approx(stats.truncnorm(0.5, np.inf).ppf(stats.norm.cdf(z[4])))
    factor = np.linalg.cholesky(np.array(TOGETHER[0].covariance))
    assert [values["p.m"], *values["p.v"]] == pytest.approx(list(np.array([1.0, 0.0, 2.0]) + factor @ z[7:]))
    far = sampler(PLANS[0], {"p.x": Distribution(uniform=(0.0, 1.0))}).from_normals([40.0])["p.x"]
    assert 0.0 < far <= 1.0
    with pytest.raises(ValueError, match="a draw is made of 10"):
        drawn.from_normals([0.0])


def test_the_normal_distribution_and_its_inverse_are_those_of_scipy():
    p = np.concatenate([10.0 ** -np.arange(1, 300, 3.7), np.linspace(0.001, 0.999, 200), 1.0 - 10.0 ** -np.arange(1, 15)])
    assert [normal.quantile(one) for one in p] == pytest.approx(list(special.ndtri(p)), rel=4e-15, abs=1e-15)
    z = np.linspace(-37.0, 9.0, 300)
    assert [normal.distribution(one) for one in z] == pytest.approx(list(special.ndtr(z)), rel=1e-12)


def block(**given):
    return Vary({"random": {"p.x": {"uniform": [0, 1]}}, **given}, "vary.yaml")


@pytest.mark.parametrize(("given", "words"), [
    ({"sampling": "sobl"}, "sampling.plan"), ({"sampling": {"plan": "sobol", "block": 5}}, "'block' has no meaning with sobol"),
    ({"sampling": {"plan": "latin_hypercube", "size": 5}}, "allowed here: plan, block"),
    ({"sampling": "sobol", "random": {}, "grid": {"p.y": [1, 2]}}, "sobol has nothing to place"),
    ({"sampling": "saltelli", "function": "tests.sweep.test_vary:joint"}, "what a function draws cannot be exchanged"),
    ({"correlated": [{"keys": ["p.a"], "mean": [1, 2], "covariance": [[1]]}]}, "1 keys and 2 means"),
    ({"correlated": [{"keys": ["p.a", "p.b"], "mean": [1, 2], "covariance": [[1]]}]}, "2 rows with 2 numbers"),
    ({"correlated": [{"keys": ["p.a", "p.b"], "mean": [1, 2], "covariance": [[1, 2], [2, 1]]}]}, "not positive semidefinite"),
    ({"correlated": [{"keys": ["p.a", "p.b"], "mean": [1, 2], "covariance": [[1, 0.5], [0, 1]]}]}, "symmetric"),
    ({"correlated": [{"keys": ["p.a"], "mean": [float("nan")], "covariance": [[1]]}]}, "finite"),
    ({"correlated": [{"keys": ["p.x"], "mean": [0], "covariance": [[1]]}]}, "varied twice, in random and in correlated.0"),
    ({"random": {"p.x": {"normal": [0, 1], "truncated": [2, 1]}}}, "from < to"),
    ({"random": {"p.x": {"normal": [0, 1], "truncated": [50, 60]}}}, "nothing of the distribution lies between"),
    ({"random": {"p.x": {"uniform": [0, 1], "truncated": [0, 1]}}}, "it goes with normal"),
    ({"until": {"metric": "landed", "half_width": 0.01}, "sampling": "sobol"}, "needs independent draws"),
    ({"until": {"metric": "landed", "half_width": 0.01, "width": 1}}, "allowed here: metric, half_width"),
    ({"sampling": "saltelli", "random": {f"p.{i}": {"uniform": [0, 1], "size": 10_000} for i in "ab"}}, "allowed: 21201"),
    ({"fraction": {"p.g": ["p.h"]}}, "'p.g' is no key of the grid"),
])
def test_refusals(given, words):
    with pytest.raises(FlightError) as caught:
        block(**given)
    assert words in str(caught.value) and "vary.yaml: vary" in str(caught.value), str(caught.value)
