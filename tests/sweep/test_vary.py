"""The vary block: numbering of cases, distributions against scipy, and what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats

from flight_graph.errors import FlightError
from flight_graph.graphs.vary import Vary
from tests.sweep.sweep_scenarios import swept


def drawn(distribution, count=2000):
    vary = Vary({"random": {"plant.x": distribution}, "runs": count}, "test")
    return np.array([vary.overrides(case)["plant.x"] for case in range(count)])


def test_cases_are_outermost_and_the_last_grid_key_is_innermost():
    vary = Vary({"cases": [{"name": "slow", "c.k": 1, "c.l": 2}, {"name": "fast", "c.k": 3, "c.l": 4}],
                 "grid": {"c.rate_hz": [20, 50], "p.g": {"geometric": [1.0, 100.0, 3]}}}, "test")
    assert vary.count == 12
    assert vary.overrides(0) == {"c.k": 1, "c.l": 2, "c.rate_hz": 20, "p.g": 1.0}
    assert vary.overrides(4) == {"c.k": 1, "c.l": 2, "c.rate_hz": 50, "p.g": pytest.approx(10.0)}
    assert (vary.name(5), vary.name(6)) == ("slow", "fast")
    assert Vary({"grid": {"p.g": {"linear": [0, 1, 5]}}}, "test").overrides(1)["p.g"] == 0.25


@settings(deadline=None, max_examples=40)
@given(some.integers(1, 50), some.integers(1, 400), some.integers(0, 399))
def test_a_case_does_not_depend_on_how_many_runs_there_are(few, many, case):
    block = {"grid": {"p.a": [1, 2, 3]}, "random": {"p.x": {"normal": [0, 1]}, "seed": {"count": 7}}}
    one, other = Vary({**block, "runs": few}, "test"), Vary({**block, "runs": many}, "test")
    assert one.overrides(case) == other.overrides(case)
    assert one.overrides(case)["p.a"] == case % 3 + 1 and one.overrides(case)["seed"] == 7 + case // 3


def test_combinations_meet_the_same_draws_and_keys_differ():
    vary = Vary({"grid": {"p.a": [1, 2]}, "random": {"p.x": {"uniform": [0, 1]}, "p.y": {"uniform": [0, 1]}}}, "test")
    assert vary.overrides(6)["p.x"] == vary.overrides(7)["p.x"] != vary.overrides(8)["p.x"]
    assert vary.overrides(6)["p.x"] != vary.overrides(6)["p.y"]


@pytest.mark.parametrize(("distribution", "expected"), [
    ({"uniform": [-1.0, 3.0]}, stats.uniform(-1.0, 4.0)),
    ({"normal": [2.0, 0.5]}, stats.norm(2.0, 0.5)),
    ({"loguniform": [1e-3, 1e2]}, stats.loguniform(1e-3, 1e2)),
])
def test_scalar_distributions(distribution, expected):
    assert stats.kstest(drawn(distribution), expected.cdf).pvalue > 1e-3


def test_vectors_are_independent_and_bounded():
    values = drawn({"uniform": [[-1.0, 0.0, 5.0], [1.0, 2.0, 6.0]]})
    assert values.shape == (2000, 3) and (values >= [-1, 0, 5]).all() and (values <= [1, 2, 6]).all()
    assert abs(np.corrcoef(values.T) - np.eye(3)).max() < 0.08
    assert drawn({"normal": [0.0, 1.0], "size": 4}, 5).shape == (5, 4)


def test_directions_are_uniform_on_the_sphere():
    values = drawn({"direction": [0.0, 0.5]})
    length = np.linalg.norm(values, axis=1)
    assert stats.kstest(length, stats.uniform(0.0, 0.5).cdf).pvalue > 1e-3
    for axis in range(3):  # Archimedes: each coordinate of a random direction is uniform
        assert stats.kstest(values[:, axis] / length, stats.uniform(-1.0, 2.0).cdf).pvalue > 1e-3


def test_cones():
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    angle = np.arccos(drawn({"cone": {"axis": [1, 2, -2], "angle": 0.4, "uniform_in": "angle"}}) @ axis)
    assert stats.kstest(angle, stats.uniform(0.0, 0.4).cdf).pvalue > 1e-3
    cosine = drawn({"cone": {"axis": [1, 2, -2], "angle": 0.4}}) @ axis
    assert stats.kstest(cosine, stats.uniform(math.cos(0.4), 1.0 - math.cos(0.4)).cdf).pvalue > 1e-3


def test_choices():
    values = drawn({"choice": ["a", "b", "c"]})
    assert stats.chisquare([(values == word).sum() for word in "abc"]).pvalue > 1e-3


def joint(number, seed):
    return {"plant.inertia": 1.0 + number, "plant.angle": [0.1 * seed, 0.0, 0.0]}


def test_joint_function():
    scenario = swept({"function": "tests.sweep.test_vary:joint", "runs": 3, "seed": 2})
    assert scenario.vary.overrides(2) == {"plant.inertia": 3.0, "plant.angle": [0.2, 0.0, 0.0]}


@pytest.mark.parametrize(("block", "words"), [
    ({}, "nothing is varied"),
    ({"grids": {}}, "there is no such key; allowed here: cases, grid, fraction"),
    ({"grid": {"plant.inertia": []}}, "has no values"),
    ({"grid": {"plant.inertia": [1.0, -1.0]}}, "plant.inertia: -1.0 is not allowed"),
    ({"grid": {"plant.inertai": [1.0]}}, "did you mean 'inertia'"),
    ({"grid": {"plnt.inertia": [1.0]}}, "no component called 'plnt'; did you mean 'plant'"),
    ({"grid": {"title": ["x"]}}, "'title' cannot be varied"),
    ({"grid": {"plant.inertia": {"geometric": [0.0, 1.0, 3]}}}, "ends of one sign"),
    ({"grid": {"plant.inertia": [1.0]}, "runs": 3}, "equal runs"),
    ({"grid": {"seed": [1]}, "random": {"seed": {"count": 1}}}, "varied twice, in grid and in random"),
    ({"cases": [{"name": "a", "seed": 1}, {"name": "a", "seed": 2}]}, "two cases are called 'a'"),
    ({"random": {"plant.inertia": {"unifrom": [1, 2]}}}, "there is no such key; allowed here: uniform"),
    ({"random": {"plant.inertia": {"uniform": [2, 1]}}}, "from < to"),
    ({"random": {"plant.inertia": {"uniform": [1, 2], "normal": [1, 2]}}}, "exactly one of"),
    ({"random": {"plant.inertia": {"normal": [1, -2]}}}, "standard deviation >= 0"),
    ({"random": {"plant.inertia": {"loguniform": [0, 2]}}}, "both > 0"),
    ({"random": {"plant.inertia": {"uniform": [1, float("inf")]}}}, "finite"),
    ({"random": {"plant.inertia": {"direction": 1.0}}}, "plant.inertia"),
    ({"random": {"plant.angle": {"cone": {"axis": [0, 0, 0], "angle": 1}}}}, "no direction"),
    ({"random": {"plant.inertia": {"uniform": [1, 2]}}, "runs": 0}, "greater than or equal to 1"),
    ({"function": "no.such:thing"}, "cannot be loaded"),
])
def test_refusals(block, words):
    with pytest.raises(FlightError) as caught:
        swept(block)
    assert words in str(caught.value) and "toy.yaml" in str(caught.value), str(caught.value)
