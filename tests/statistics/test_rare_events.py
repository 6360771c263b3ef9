"""Subset simulation over runs of a scenario, whose metric is a drawn number: then the probability is known."""

import json

import pytest
import yaml
from scipy import stats
from typer.testing import CliRunner

from flight_graph.campaigns.rare_events import Event, rare_event
from flight_graph.cli.app import app
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from tests.graph import toy

DRAWN = {"random": {"plant.angle": {"normal": [0.0, 0.05], "size": 3}, "seed": {"count": 50}}}


def first_angle(scenario, signals) -> dict:
    """The first drawn angle, and a word; an angle above 0.5 has none."""
    angle = scenario.graph.nodes["plant"].values["angle"][0]
    return {"angle": angle if angle < 0.5 else None, "word": "x", "seen": len(signals["toy/truth"]), "seed": scenario.seed}


def drawing(vary=DRAWN):
    data = toy.scenario(metrics="tests.statistics.test_rare_events:first_angle", duration_s=0.05)
    return Scenario({**data, "vary": vary}, "toy.yaml")


def test_a_known_probability_and_runs_that_show_it():
    truth = stats.norm.sf(3.0)  # 0.15 at a deviation of 0.05
    found = rare_event(drawing(), Event("angle", above=0.15), 150, seed=1, workers=2)
    assert found.estimate.low <= truth <= found.estimate.high and found.estimate.probability == pytest.approx(truth, rel=1.5)
    assert found.runs and all(run["angle"] >= 0.15 and run["values"]["plant.angle"][0] == run["angle"] for run in found.runs)
    assert len({run["values"]["seed"] for run in found.runs}) > 1, "noise is drawn anew for every run"
    again = rare_event(drawing(), Event("angle", below=-0.15), 100, seed=1, workers=1)
    assert again.estimate.low <= truth <= again.estimate.high and all(run["angle"] <= -0.15 for run in again.runs)
    alone = rare_event(drawing(), Event("angle", above=0.15), 150, seed=1, workers=1)
    assert alone.plain() == found.plain(), "the number of threads changes nothing"


def test_the_command(tmp_path):
    path = tmp_path / "toy.yaml"
    path.write_text(yaml.safe_dump(drawing().file.model_dump(by_alias=True, exclude_none=True)))
    words = ["rare", str(path), "--metric", "angle", "--above", "0.1", "--runs", "60", "--trust"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0 and "coefficient of variation" in result.output and "--set plant.angle=" in result.output
    far = CliRunner().invoke(app, [*words[:4], "--above", "0.4", "--runs", "40", "--down-to", "1e-2", "--trust"])
    assert "the event was not reached: its probability is below about 0.01" in far.output
    found = json.loads(CliRunner().invoke(app, [*words, "--json"]).output)
    assert found["low"] <= stats.norm.sf(2.0) <= found["high"] and found["event"] == "angle >= 0.1"


@pytest.mark.parametrize(("event", "vary", "runs", "words"), [
    ({"metric": "angel", "above": 1.0}, DRAWN, 100, "did you mean 'angle'"),
    ({"metric": "word", "above": 1.0}, DRAWN, 100, "this is a text, no number"),
    ({"metric": "seen", "above": 100.0}, DRAWN, 100, "a metric of few values"),
    ({"metric": "angle", "above": 1.0}, DRAWN, 10, "20 to 1000000"),
    ({"metric": "angle", "above": 1.0}, {**DRAWN, "grid": {"plant.inertia": [1.0, 2.0]}}, 100, "has 2 combinations"),
    ({"metric": "angle", "above": 1.0}, {"random": {"seed": {"count": 1}}}, 100, "nothing is drawn but counted keys"),
    ({"metric": "angle"}, DRAWN, 100, "give --above or --below"),
    ({"metric": "angle", "above": float("nan")}, DRAWN, 100, "a finite number")])
def test_what_is_refused(event, vary, runs, words):
    with pytest.raises(FlightError, match=words):
        rare_event(drawing(vary), Event(**event), runs)
