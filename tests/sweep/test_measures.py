"""Measures: what a scenario's messages are reduced to, against the metrics functions and NumPy on the same records."""

import numpy as np
import pytest

from flight_graph import runs
from flight_graph.campaigns import opening
from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load
from tests.sweep.sweep_scenarios import RANDOM, swept

ROVER = {
    "rate_axis": {"largest": "plant.truth.rates", "of": "absolute"}, "rate_norm": {"largest": "plant.truth.rates", "of": "norm"},
    "peak": {"largest": "controller.command.effort", "of": "absolute"},
    "settled": {"settling": "plant.truth.angles", "within": 0.008},
    "work": {"integral": "controller.command.effort", "of": "squared"},
    "gain": {"final": "controller.funnel.adaptive_a[1]"},
}


def test_the_numbers_of_the_rover_s_metrics():
    """Every one of these is also a metric of papers.appc.metrics, computed there by other lines."""
    scenario = load("cubli_asteroid", {"measures": ROVER})
    found = metrics.compute(scenario, runs.simulate(scenario))
    for mine, theirs in {"rate_axis": "rate_axis_max", "rate_norm": "rate_norm_max", "peak": "torque_peak",
                         "settled": "settling_time_s", "gain": "adaptive_a_y"}.items():
        assert found[mine] == found[theirs] is not None, mine
    assert found["work"] == pytest.approx(found["effort"], rel=1e-12)


def test_crossings_and_ends():
    """Of a constant, of what starts beyond the limit, of what never comes, and of what ends outside."""
    block = {"low": {"least": "plant.truth.angle[0]"}, "high": {"largest": "plant.truth.angle[0]"},
             "crossed": {"first": "plant.truth.angle[0]", "below": 0.0}, "at once": {"first": "plant.truth.angle", "above": 0.05},
             "never": {"first": "plant.truth.rate", "above": 1e3}, "inside": {"settling": "plant.truth.rate", "within": 1e3},
             "outside": {"settling": "plant.truth.angle", "within": 1e-9, "about": 5.0}}
    scenario = swept(RANDOM, measures=block, metrics=None, duration_s=4.0)
    recording = runs.simulate(scenario)
    angle = recording["toy/truth"]["angle"][:, 0]
    found = metrics.compute(scenario, recording)
    assert (found["low"], found["high"]) == (angle.min(), angle.max())
    assert found["crossed"] == pytest.approx(np.argmax(angle < 0) / 200.0) and found["crossed"] > 0
    assert (found["at once"], found["never"], found["inside"], found["outside"]) == (0.0, None, 0.0, None)


def test_a_campaign_logs_what_its_measures_read(tmp_path):
    block = {"high": {"largest": "plant.truth.angle", "of": "norm", "unit": "rad"}}
    campaign = opening.run_here(swept(RANDOM, measures=block, metrics=None), tmp_path / "c", chunk=5)
    assert ("high", "rad", "metric", "double") in [(c.name, c.unit, c.kind, c.type) for c in campaign.columns()]
    assert all(0 < value < 1 for value in campaign.read().column("high").to_pylist())


@pytest.mark.parametrize(("entry", "words"), [
    ({}, "exactly one of largest, least"), ({"largest": "plant.truth.angle", "least": "plant.truth.angle"}, "exactly one of"),
    ({"largest": "plant.truth.angel"}, "did you mean 'angle'"), ({"largest": "plnt.truth.angle"}, "did you mean 'plant'"),
    ({"largest": "plant"}, "no field of an output"), ({"largest": "plant.parameters.inertia"}, "no field of an output"),
    ({"first": "plant.truth.angle"}, "one limit"), ({"largest": "plant.truth.angle", "above": 1.0}, "one limit"),
    ({"settling": "plant.truth.angle"}, "goes with within"), ({"final": "plant.truth.angle"}, "has 3 numbers"),
    ({"largest": "plant.truth.angle", "off": 1}, "there is no such key"),
    ({"first": "plant.truth.angle", "above": float("nan")}, "finite"),
])
def test_refusals(entry, words):
    with pytest.raises(FlightError) as caught:
        swept(RANDOM, measures={"it": entry})
    assert words in str(caught.value) and "measures.it" in str(caught.value), str(caught.value)


def test_a_name_is_given_once():
    scenario = swept(RANDOM, measures={"angle": {"least": "plant.truth.angle"}})
    with pytest.raises(FlightError, match="gives a number of this name too"):
        metrics.compute(scenario, runs.simulate(scenario))
