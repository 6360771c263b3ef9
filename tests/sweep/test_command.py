"""flight sweep and flight run of a campaign's folder: what they print, what they refuse."""

import json
import os

import pytest
from typer.testing import CliRunner

from flight_graph.campaigns import opening
from flight_graph.campaigns.folder import Campaign
from flight_graph.cli.app import app
from flight_graph.errors import FlightError
from tests.sweep.sweep_scenarios import RANDOM, campaign_file, swept


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return str(campaign_file(tmp_path_factory.mktemp("scenario") / "toy.yaml"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return opening.run_here(swept(RANDOM), tmp_path_factory.mktemp("whole") / "c", workers=1)


def flight(*words):
    """What a command prints. The toy's components lie in another folder than its scenario."""
    return CliRunner().invoke(app, [*map(str, words), "--trust"], catch_exceptions=False).stdout


def test_a_campaign_by_its_commands(file, whole, tmp_path):
    rows = list(whole.rows())
    found = json.loads(flight("sweep", file, "--runs", 5, "--workers", 2, "--json", "--out", tmp_path / "a"))
    assert (found["runs"], found["ok"], found["failed"]) == (5, 5, [])
    angles = [row.metrics["angle"] for row in rows[:5]]
    assert found["metrics"]["angle"]["largest"] == max(angles)
    assert found["metrics"]["angle"]["largest_case"] == angles.index(max(angles))
    assert found["metrics"]["angle"]["median"] == sorted(angles)[2]
    assert "12 runs" in flight("sweep", tmp_path / "a", "--runs", 12)
    assert list(Campaign.at(tmp_path / "a").rows()) == rows
    assert "12 runs" in flight("sweep", file, "--resume", "--out", tmp_path / "a")
    again = json.loads(flight("run", tmp_path / "a", "--case", 4, "--json", "--out", tmp_path / "b"))
    assert again["metrics"] == rows[4].metrics and again["differs_from_its_row"] == []
    tasks = json.loads(flight("sweep", tmp_path / "a", "--chunk", "3-4", "--json"))
    assert [row["outcome"] for row in tasks["chunks"]] == ["done again, equal"] * 2


def test_a_run_that_is_not_its_row_is_said(whole, tmp_path):
    assert whole.differences(4, whole.row(4).metrics) == []
    [sentence] = whole.differences(4, {**whole.row(4).metrics, "angle": 1.0})
    assert "has angle 0.2" in sentence and "and here 1.0" in sentence


def test_varied_by_the_command_line(file, tmp_path):
    """Without a copy of the file: a grid, a distribution, and a seed of the draws."""
    words = ["--vary", "controller.kp=0.25:0.75:3", "--vary", "plant.inertia=uniform:1.5,2.5", "--seed", 7, "--json"]
    found = json.loads(flight("sweep", file, "--runs", 6, "--out", tmp_path / "a", *words))
    table = Campaign.at(tmp_path / "a").read()
    assert found["runs"] == 6 and table.column("controller.kp").to_pylist() == [0.25, 0.5, 0.75] * 2
    drawn = table.column("plant.inertia").to_pylist()
    assert all(1.5 <= value <= 2.5 for value in drawn) and len(set(drawn)) == 2
    assert Campaign.at(tmp_path / "a").manifest.vary["seed"] == 7


@pytest.mark.parametrize(("arguments", "words"), [
    (["sweep", "cubli_asteroid"], "nothing to sweep"),
    (["run", "cubli_asteroid", "--case", "0"], "it has no case 0"),
    (["sweep", "FILE", "--runs", "0"], "--runs 0: allowed: 1 to 1000000"),
    (["sweep", "FILE", "--set", "seed=3"], "'seed' is varied by the sweep"),
    (["run", "FILE", "--case", "1", "--seed", "3"], "'seed' is varied"),
    (["run", "FILE", "--case", "-1"], "there is no case -1"),
    (["sweep", "FILE", "--resume"], "name the campaign's folder"),
    (["sweep", "FILE", "--chunk", "1"], "name the folder of a campaign"),
    (["sweep", "FILE", "--chunk-size", "0"], "--chunk-size 0: allowed: 1 to"),
    (["sweep", "FILE", "--workers", "2", "--processes", "2"], "--workers and --processes: allowed: one of them"),
    (["sweep", "FILE", "--on", "slurm"], "--on slurm: allowed: cuda, or dask:ADDRESS"),
    (["sweep", "FILE", "--vary", "plant.inertai=1,2"], "did you mean 'inertia'"),
    (["sweep", "FILE", "--vary", "plant.inertia=gamma:1,2"], "no distribution 'gamma'"),
    (["sweep", "CAMPAIGN"], "is a campaign already"),
    (["sweep", "CAMPAIGN", "--set", "plant.inertia=3"], "has this fixed"),
    (["sweep", "CAMPAIGN", "--runs", "3"], "can be extended, not cut"),
    (["sweep", "CAMPAIGN", "--chunk", "99"], "this campaign has the chunks 0 to 11"),
    (["sweep", "CAMPAIGN", "--chunk", "3-1"], "the last chunk comes before the first"),
    (["sweep", "CAMPAIGN", "--chunk", "a"], "write a number, N, or several, N-M"),
    (["run", "CAMPAIGN"], "--case says which of its runs is meant"),
    (["sweep", "EMPTY", "--resume"], "holds no campaign"),
])
def test_refusals(file, whole, tmp_path, arguments, words):
    places = {"FILE": file, "CAMPAIGN": str(whole.path), "EMPTY": str(tmp_path)}
    trusted = ["--trust"] if {"FILE", "CAMPAIGN"} & set(arguments) else []
    failed = CliRunner().invoke(app, [places.get(word, word) for word in arguments] + trusted)
    assert isinstance(failed.exception, FlightError) and words in str(failed.exception), failed.exception
    assert not os.path.exists("runs/toy-sweep-1")


def test_a_stranger_s_campaign_runs_no_code(whole):
    failed = CliRunner().invoke(app, ["sweep", str(whole.path), "--resume"])
    assert isinstance(failed.exception, FlightError) and "add --trust to run it" in str(failed.exception)
