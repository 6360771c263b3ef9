"""The arithmetic of the claims tables."""

import pytest

from flight_graph.claims.claim_expressions import Several, evaluate, names
from flight_graph.errors import FlightError

RESULTS = {
    "a": {"x": 3.0, "y": -2.0, "never": None, "stopped": False},
    "fallen": {"stopped": True, "stopped_s": 0.5},
    "all": Several({"one": {"x": 1.0, "t": 4.0}, "two": {"x": 2.0, "t": None}, "three": {"stopped": True}}),
}


@pytest.mark.parametrize(("text", "value"), [
    ("a.x", 3.0), ("a.x / a.y", -1.5), ("-a.y + 2 * 3 - 1", 7.0), ("abs(a.y)", 2.0), ("max(a.x, a.y, 7)", 7.0),
    ("min(a.x, a.y)", -2.0), ("a.x > 2 and a.y < 0", True), ("not a.x > 2", False), ("1 < a.x <= 3", True),
    ("a.x == 3 or a.never", True), ("a.never", None), ("a.never + 1", None), ("max(a.x, a.never)", None),
    ("a.x / 0", None), ("fallen.stopped", True), ("fallen.x", None), ("fallen.x < 1", None),
])
def test_values_of_single_runs(text, value):
    assert evaluate(text, RESULTS) == value


def test_a_run_of_several_cases_gives_a_value_for_each():
    assert evaluate("2 * all.x + a.x", RESULTS) == {"one": 5.0, "two": 7.0, "three": None}
    assert evaluate("all.x / all.t", RESULTS) == {"one": 0.25, "two": None, "three": None}
    assert evaluate("max(all.x, 1.5)", RESULTS) == {"one": 1.5, "two": 2.0, "three": None}


def test_min_max_mean_and_count_reduce_several_values():
    results = {"r": Several({"p": {"x": 1.0}, "q": {"x": 4.0}, "s": {"x": 10.0}})}
    assert evaluate("min(r.x)", results) == 1.0
    assert evaluate("max(r.x)", results) == 10.0
    assert evaluate("mean(r.x)", results) == 5.0
    assert evaluate("count(r.x > 3)", results) == 2
    assert evaluate("max(all.t)", RESULTS) is None


def test_names_are_the_runs():
    assert names("max(a.x, 2) / all.t - 3") == {"a", "all"}


@pytest.mark.parametrize(("text", "part"), [
    ("a.x +", "is no expression"), ("a.x ** 2", "allowed are"), ("open('x')", "allowed are"), ("a.x[0]", "allowed are"),
    ("a.x is None", "allowed are"), ("a.unknown", "no metric called 'unknown'"), ("all.unknown", "no metric called"),
    ("'text'", "allowed are"), ("max(a.x, key=abs)", "allowed are"),
])
def test_what_is_refused(text, part):
    with pytest.raises(FlightError, match=part.replace("(", r"\(")):
        evaluate(text, RESULTS)


def test_cases_that_do_not_match_are_refused():
    results = {"r": Several({"p": {"x": 1.0}}), "s": Several({"q": {"x": 1.0}})}
    with pytest.raises(FlightError, match="'p' is missing"):
        evaluate("r.x + s.x", results)
