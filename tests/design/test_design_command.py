"""flight design, its parameter file in flight run, and the controller's refusal of a lambda_a that is too large."""

import json
import re

import pytest
import yaml
from typer.testing import CliRunner

from flight_graph.bags.reader import read_bag
from flight_graph.cli.app import app
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load

SITE = ["--gravity", "5e-4", "--disturbance", "5e-3", "--phasing", "120"]


def flight(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.stdout


def test_parameter_file_reaches_the_scenario(tmp_path):
    made = json.loads(flight("design", "cubli", *SITE, "--json", "--out", tmp_path / "rover.yaml"))
    text = (tmp_path / "rover.yaml").read_text()
    assert text == flight("design", "cubli", *SITE)
    assert yaml.safe_load(text)["/**/appc_controller"]["ros__parameters"]["lambda_u"] == made["parameters"]["lambda_u"]
    assert "&" not in text and all(sentence in text for sentence in made["argument"] + made["warnings"])
    found = json.loads(flight("run", "cubli_asteroid_paper", "--params", tmp_path / "rover.yaml", "--set",
                              "plant.rate_hz=100", "--duration", "2", "--json", "--out", tmp_path / "bag"))
    resolved = json.loads(read_bag(found["bag"]).attachments["scenario.json"].data)
    controller = resolved["components"]["controller"]
    assert controller["rate_hz"] == made["rate_hz"]
    assert controller["parameters"]["lambda_u"] == [made["parameters"]["lambda_u"]] * 3
    assert controller["parameters"]["reference_form"] == "minimum_jerk"
    assert resolved["components"]["plant"]["parameters"]["gravity"] == 5e-4


@pytest.mark.parametrize(("text", "words"), [
    ("a: [", "this is no YAML"), ("controller: {lambda_a: 1}", "this is no ROS parameter file"),
    ("/**/nobody: {ros__parameters: {x: 1}}", "none of its sections"),
    ("/**/controller: {ros__parameters: {lambda_b: 1}}", "did you mean"),
])
def test_wrong_parameter_files(tmp_path, text, words):
    path = tmp_path / "wrong.yaml"
    path.write_text(text)
    with pytest.raises(FlightError, match=words):
        flight("run", "cubli_asteroid_paper", "--params", path, "--out", tmp_path / "bag")


def test_refusals(tmp_path):
    with pytest.raises(FlightError, match="there is no design rule for 'lander'; allowed: cubli"):
        flight("design", "lander", *SITE)
    with pytest.raises(FlightError, match="it exists already"):
        flight("design", "cubli", *SITE, "--out", tmp_path)


def test_largest_feasible_gain_is_named():
    """Table 2 with lambda_a a little above 0.046 leaves the rate funnel at once; the named value is the edge."""
    change = {"plant.rate_hz": 100, "controller.rate_hz": 100, "duration_s": 0.1}
    with pytest.raises(FlightError) as caught:
        CompiledRun(load("cubli_asteroid_paper", {**change, "controller.lambda_a": 0.06})).run()
    edge = float(re.search(r"take a lambda_a below \[([0-9.]+),", str(caught.value))[1])
    assert 0.046 < edge < 0.048
    CompiledRun(load("cubli_asteroid_paper", {**change, "controller.lambda_a": 0.9999 * edge})).run()
    with pytest.raises(FlightError, match="outside the funnel rho_u0"):
        CompiledRun(load("cubli_asteroid_paper", {**change, "controller.lambda_a": 1.0001 * edge})).run()
