"""`flight identify`: ranks that the theory gives, as one JSON object."""

import json

import pytest
from typer.testing import CliRunner

from flight_graph.cli.app import app


def identify(*arguments):
    done = CliRunner().invoke(app, ["identify", "spacerobot", "--json", *arguments])
    assert done.exit_code == 0, done.output
    return json.loads(done.output)


@pytest.mark.parametrize("trajectory, rows, rank", [
    ("random", "moments", 37), ("random", "all", 38), ("random", "joints", 28),
    ("spacerobot_harmonic", "moments", 27), ("spacerobot_harmonic", "all", 28), ("spacerobot_harmonic", "joints", 21),
])
def test_ranks(trajectory, rows, rank):
    """38 = 10 + 4 * 7: each revolute joint merges three parameters; seven rows lose the base's mass."""
    found = identify("--trajectory", trajectory, "--rows", rows)
    assert found["rank"] == rank
    assert len(found["combinations"]) == rank and len(found["singular_values"]) == 50


def test_parameters_on_their_own():
    found = identify("--rows", "all")
    assert found["individual"] == [
        "B0.Ixy", "B0.Iyz", "B0.hy", "B1.Ixy", "B1.Ixz", "B1.Iyz", "B1.hx", "B2.Ixy", "B2.Iyz", "B2.hy", "B3.Ixz",
        "B3.Iyz", "B4.Ixy", "B4.Ixz", "B4.Iyz", "B4.Izz", "B4.hx", "B4.hy"]


def test_unknown_choice_is_a_sentence():
    from flight_graph.errors import FlightError
    done = CliRunner().invoke(app, ["identify", "spacerobot", "--rows", "most"])
    assert isinstance(done.exception, FlightError) and "moments" in str(done.exception)
