"""Cases: the prepared records of a campaign give the rows of scenarios that are made one by one; bad runs are rows."""

import math

import pytest

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.campaigns.cases import Batch, Cases
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import RunStopped
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load, vary_case
from flight_graph.recordings.recording import BagSignals
from tests.sweep.sweep_scenarios import RANDOM, campaign_file, digest, swept


def by_hand(scenario, number):
    """Status and metrics of a case whose scenario, graph and memory are made for it alone."""
    alone = vary_case(scenario, number)
    try:
        return "ok", metrics.compute(alone, CompiledRun(alone).run())
    except RunStopped as stop:
        return stop.reason, {}


@pytest.mark.parametrize(("name", "numbers"), [
    ("cubli_faults", (0, 101, 74, 250)), ("lander_monte_carlo_perturbed", (7, 3)), ("spacerobot_faults", (70,))])
def test_rows_are_those_of_scenarios_made_one_by_one(name, numbers):
    scenario = load(name, {"duration_s": 6.0})
    for row in Cases(scenario).rows(numbers):
        finite = {key: None if isinstance(value, float) and not math.isfinite(value) else value
                  for key, value in row.metrics.items()}
        assert (row.status, finite) == by_hand(scenario, row.case), row.case


MIXED = {"grid": {"controller.rate_hz": [50, 100], "controller.law": ["pd", "p"], "duration_s": [0.5, 1.0]},
         "random": {"plant.angle": {"uniform": [-0.5, 0.5], "size": 3}, "seed": {"count": 9}}, "runs": 3}


@pytest.mark.parametrize("width", [1, 3])
def test_rates_laws_and_durations_share_nothing_wrongly(width):
    """Whatever ran before a case in the same memory, and beside it: its digest of every recorded byte is its own."""
    scenario, flown = swept(MIXED), []

    def advance(flights, ticks, watch):
        flown.append(len(flights))
        for flight in reversed(flights):
            flight.advance(ticks)

    forward = Cases(scenario, Batch(width, advance)).rows(range(24))
    assert max(flown) <= width and {row.status for row in forward} == {"ok"}
    assert len({row.metrics["digest"] for row in forward}) == 24
    again = Cases(scenario)
    for row in reversed(forward):
        assert again.row(row.case) == row
    for number in (0, 13, 23):
        assert by_hand(scenario, number) == ("ok", forward[number].metrics)


def test_events_change_what_was_drawn():
    """A parameter that is drawn, and set to another value while the graph runs; and one that is drawn beside it."""
    scenario = swept({"random": {"controller.kp": {"uniform": [0.2, 0.9]}, "plant.inertia": {"uniform": [1.5, 2.5]}}, "runs": 3},
                     events=[{"at_s": 0.4, "set": {"controller.kp": 0.1}}])
    rows = Cases(scenario).rows(range(3))
    assert [("ok", row.metrics) for row in rows] == [by_hand(scenario, number) for number in range(3)]
    assert len({row.metrics["digest"] for row in rows}) == 3


def test_the_topics_that_metrics_ask_for_are_found_out():
    """A function that reads one topic or another: what was left out of the log is flown again with it."""
    scenario = swept(RANDOM, metrics="tests.sweep.sweep_scenarios:patchy")
    rows = Cases(scenario).rows(range(12))
    assert [row.metrics["count"] for row in rows] == [200, 100] * 6  # the truth is published at 200 Hz, the command at 100 Hz
    assert [row.metrics.get("sometimes", "absent") for row in rows[:2]] == [None, pytest.approx(math.nan, nan_ok=True)]


@pytest.mark.parametrize("case", [0, 7])
def test_one_case_alone_to_a_bag_is_the_same_run(case, tmp_path):
    scenario = load(str(campaign_file(tmp_path / "toy.yaml")), case=case)
    row = Cases(swept(RANDOM)).row(case)
    outcome = runs.execute(scenario, out=tmp_path / "bag")
    assert outcome.metrics == row.metrics
    assert digest(scenario, BagSignals(read_bag(outcome.bag), scenario))["digest"] == outcome.metrics["digest"]
    assert scenario.seed == 50 + case == row.seed


def test_runs_that_end_badly_are_rows():
    cases = [{"name": "good", "plant.inertia": 2.0}, {"name": "fault", "controller.angle_limit": 0.01},
             {"name": "nonfinite", "plant.stiffness": 1e308, "plant.inertia": 1e-3},
             {"name": "refused", "watcher.rate_hz": 25}, {"name": "error", "plant.inertia": 3.0},
             {"name": "range", "plant.inertia": 1.0}, {"name": "good again", "plant.inertia": 2.0}]
    scenario = swept({"cases": cases})
    rows = Cases(scenario).rows(range(7))
    assert [row.status for row in rows] == ["ok", "fault", "nonfinite", "refused", "error", "ok", "ok"]
    words = ["", "the angle left the limit of 0.01 rad", "only finite numbers are published", "no multiple",
             "an inertia of 3 is not judged", "", ""]
    for row, text in zip(rows, words):
        assert text in row.sentence
    assert rows[6].metrics == rows[0].metrics and [row.metrics for row in rows[1:5]] == [{}] * 4


def test_a_draw_that_leaves_the_range_is_refused_with_the_sentence_of_its_scenario():
    scenario = swept({"random": {"controller.kd": {"normal": [9.5, 1.0]}}, "runs": 8, "seed": 2})
    rows = Cases(scenario).rows(range(8))
    refused = [row for row in rows if row.status == "refused"]
    assert 0 < len(refused) < 8
    for row in refused:
        assert row.varied["controller.kd"] > 10 and "components.controller.parameters.kd" in row.sentence
