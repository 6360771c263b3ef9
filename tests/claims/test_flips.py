"""Every row of every paper can become another one: its change is made, and the verdict is the one that it says.

Rows whose change needs long runs are left out here; `flight claims --flips` makes all.
"""

import pytest

from flight_graph.claims import claims, claims_file, flips
from flight_graph.claims.claims_file import ClaimsFile
from flight_graph.errors import FlightError
from flight_graph.graphs.papers import papers

LONG = {  # ids of rows
    "appc": {"adaptation-matters", "asymptotic", "asymptotic-undisturbed", "bounded-gains", "disturbance-frequency",
             "disturbance-rejection", "earth-torque", "earth-wheel", "filter-nees", "filter-nis",
             "infeasible-others-gains", "jump-other-disturbances", "ranking-accuracy-gains", "ranking-effort-gains",
             "ranking-overshoot-gains", "ranking-pd-gains", "ranking-speed-gains", "sampled-asteroid", "seeds-limits",
             "seeds-settling"},
    "lander": set(),
    "spacerobot": set(),
}


@pytest.mark.parametrize("paper", sorted(papers()))
def test_no_row_is_vacuous(paper):
    content = claims_file.read(paper)
    assert LONG[paper] <= {claim.id for claim in content.claims}
    found = flips.flip(paper, [claim.id for claim in content.claims if claim.id not in LONG[paper]])
    assert {one.claim.id: one.judged.verdict for one in found if not one.as_said} == {}


def row(**flip):
    values = {"id": "one", "statement": "ours", "where": "here", "says": "x", "expect": "holds", "because": "it is",
              "flip": {"change": "it", "to": "does not hold", **flip}}
    if "arguments" in flip:
        values["check"] = "tests.claims.test_flips:is_small"
    else:
        values |= {"value": "plain.xi_a_max / long.xi_a_max", "relation": {"below": 1.0}}
    runs = {"plain": {"scenario": "cubli_asteroid"}, "long": {"scenario": "cubli_asteroid", "set": {"duration_s": 90}},
            "cases": {"scenario": "cubli_gains", "case": "case 1"}}
    content = ClaimsFile.model_validate({"title": "t", "source": "s", "runs": runs, "claims": [values]})
    return content, content.claims[0]


def nothing():
    return {}


def is_small(size=1.0, count=2):
    return size < 3.0 and count < 3, f"{size}, {count}"


def test_a_change_is_of_all_runs_or_of_those_named():
    content, claim = row(set={"controller.lambda_a": 0.05})
    assert [flips.changed_run(content, claim, name).set for name in ("plain", "long")] == [
        {"controller.lambda_a": 0.05}, {"duration_s": 90, "controller.lambda_a": 0.05}]
    content, claim = row(set={"controller.lambda_a": 0.05}, of=["long"])
    assert flips.changed_run(content, claim, "plain") == content.runs["plain"]


def test_another_run_stands_in_the_place_of_one():
    content, claim = row(instead={"plain": "cases"})
    assert flips.changed_run(content, claim, "plain") == content.runs["cases"]
    assert not flips.is_gradual(content, claim)


@pytest.mark.parametrize(("change", "half"), [
    ({"controller.lambda_a": 0.061}, {"controller.lambda_a": [0.051, 0.051, 0.051]}),
    ({"controller.lambda_a": [0.041, 0.041, 0.061]}, {"controller.lambda_a": [0.041, 0.041, 0.051]}),
    ({"duration_s": 30}, {"duration_s": 45.0}), ({"controller.rate_hz": 20}, {"controller.rate_hz": 20}),
    ({"plant.gravity_sign": -1}, {"plant.gravity_sign": -1}), ({"controller.law": "implicit"}, {"controller.law": "implicit"}),
])
def test_half_of_a_change_is_halfway_for_numbers_and_all_of_it_for_others(change, half):
    content, claim = row(set=change, of=["plain"])
    found = flips.changed_run(content, claim, "plain", 0.5).set
    for path, value in half.items():
        assert found[path] == pytest.approx(value)
    assert flips.is_gradual(content, claim) == (half != change)


def test_an_argument_that_a_check_does_not_have_is_refused():
    content, claim = row(arguments={"sise": 4.0})
    with pytest.raises(FlightError, match="the flip of one: no argument called 'sise'; did you mean 'size'"):
        flips.flip_rows(content, [(claim, 1.0)])


def test_a_check_that_answers_nothing_is_no_row_that_holds():
    content, claim = row(arguments={"size": 4.0})
    with pytest.raises(FlightError, match="one: its check answers nothing"):
        claims.row(claim.model_copy(update={"check": "tests.claims.test_flips:nothing"}), {})


def test_a_check_has_its_arguments_changed():
    content, claim = row(arguments={"size": 4.0, "count": 5})
    assert flips.changed_arguments(claim, 0.5) == {"size": 2.5, "count": 5}
    whole, part = flips.flip_rows(content, [(claim, 1.0), (claim, 0.5)])
    assert (whole.judged.verdict, whole.as_said, whole.judged.found) == ("does not hold", True, {"": "4.0, 5"})
    assert flips.is_gradual(content, claim)
