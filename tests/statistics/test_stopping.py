"""The stopping rule: fixed looks in case order, that no later run changes."""

import numpy as np
import pytest
from pydantic import ValidationError

from flight_graph.statistics.rates import rate
from flight_graph.statistics.stopping import StoppingRule, Until

UNTIL = Until(metric="landed", half_width=0.02, confidence=0.95)


def test_looks_follow_from_the_rule_and_the_chunk_alone():
    short, long = StoppingRule(UNTIL, 1500, 100), StoppingRule(UNTIL, 10**6, 100)
    assert short.looks[:-1] == long.looks[:len(short.looks) - 1] and short.looks[-1] == 1500
    assert short.levels == long.levels[:len(short.levels)]
    assert all(look % 100 == 0 for look in long.looks) and long.looks == sorted(set(long.looks))
    first = long.looks[0]  # before it not even runs without any event are enough, but for the step of a chunk
    assert rate(0, first - 100, 0.95).half_width > 0.02
    assert long.looks[-2] < 10**6 / 50, "half of the runs successes are known after some thousands"


def test_the_level_is_dearer_than_one_look_and_cheaper_than_the_union_bound():
    rule = StoppingRule(UNTIL, 10**6)
    union = 0.05 / (len(rule.looks) - 1)
    assert all(union < level < 0.05 for level in rule.levels) and max(rule.levels) > 0.024


def test_it_stops_at_the_first_look_that_is_narrow_enough():
    successes = np.random.default_rng(5).random(10_000) < 0.93
    rule = StoppingRule(UNTIL, 10_000, 50)
    ended = next(verdict for look in rule.looks if (verdict := rule.judge(successes[:look])).stop)
    (found,) = ended.rates
    assert ended.enough and found.half_width <= 0.02 and found.successes == successes[:ended.runs].sum()
    before = rule.judge(successes[:rule.looks[rule.looks.index(ended.runs) - 1]])
    assert not before.stop and before.rates[0].half_width > 0.02
    assert rule.judge(successes[:51]) is None
    last = StoppingRule(UNTIL, 300, 50).judge(successes[:300])
    assert last.stop and not last.enough, "it ran out of runs"


def test_groups_are_judged_apart_and_all_have_to_be_known():
    rule = StoppingRule(UNTIL, 10**5, 10, groups=4)
    assert all(look % 20 == 0 for look in rule.looks[:-1])  # the least multiple of both
    found = rule.verdict(rule.looks[-3], [(0, 3000), (3000, 3000), (0, 3000), (1500, 3000)])
    assert not found.stop and [one.half_width <= 0.02 for one in found.rates] == [True, True, True, False]


def test_what_counts_as_a_success():
    assert [UNTIL.success(value) for value in (True, 1, 0, False, None, float("nan"), 2.5, "yes")] == [
        True, True, False, False, False, False, True, False]
    below = Until(metric="lateral_m", half_width=0.01, below=1.0)
    assert [below.success(value) for value in (1.0, 1.1, None, float("nan"), float("inf"))] == [True] + 4 * [False]
    for wrong in ({"half_width": 0.5}, {"half_width": 0.01, "below": 1.0, "above": 2.0}, {"half_width": 0.01, "confidence": 1.0},
                  {"half_width": float("nan")}, {"half_width": 0.01, "widht": 1}):
        with pytest.raises(ValidationError):
            Until(metric="x", **wrong)
