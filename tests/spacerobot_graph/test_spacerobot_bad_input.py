"""Bad input of the space robot's scenarios: sentences, and a covariance that is repaired and reported."""

from importlib import resources

import numpy as np
import pytest
import yaml

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario, load
from msg_schemas.spacerobot import MINI
from spacerobot_ros.adaptation_monitor import diagnostics

DATA = yaml.safe_load((resources.files("spacerobot_ros") / "models" / "mini_space_robot.yaml").read_text())


def model_file(tmp_path, change):
    data = yaml.safe_load(yaml.safe_dump(DATA))
    change(data)
    path = tmp_path / "robot.yaml"
    path.write_text(yaml.safe_dump(data))
    return str(path)


def close_a_loop(data):
    data["joints"][0]["parent"] = "B3"


def take_the_mass(data):
    data["joints"][2]["body"]["mass"] = 0.0


def break_the_inertia(data):
    data["joints"][3]["body"]["inertia"].update(xx=1.0, yy=0.01, zz=0.01)


def drop_a_joint(data):
    del data["joints"][3]


@pytest.mark.parametrize("change, words", [
    (close_a_loop, ["loop", "B3"]),
    (take_the_mass, ["B3", "positive mass"]),
    (break_the_inertia, ["B4", "triangle inequality"]),
    (drop_a_joint, ["3 joints", "built for 4"]),
])
def test_a_robot_that_cannot_be(tmp_path, change, words):
    with pytest.raises(FlightError) as error:
        load("spacerobot_step", {"plant.model": model_file(tmp_path, change)})
    assert "plant.parameters.model" in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_unknown_robot():
    with pytest.raises(FlightError, match="mini_space_robot"):
        load("spacerobot_step", {"plant.model": "maxi"})


def test_joint_commanded_past_its_stop():
    target = [0.0, 0.0, 0.0, 1.5, -0.2, 0.7, 0.0]
    with pytest.raises(FlightError, match=r"joint 2 is commanded .* past its stop; allowed: \[0, 180\] deg"):
        load("spacerobot_step", {"trajectory.target": target})


def test_harmonic_past_a_stop():
    with pytest.raises(FlightError, match="joint 2"):
        load("spacerobot_harmonic", {"trajectory.amplitude": [0.1, 0, 0, 0, 0.9, 0.1, 0.1]})


def test_start_past_a_stop():
    with pytest.raises(FlightError, match=r"initial_joints\[1\]"):
        load("spacerobot_step", {"plant.initial_joints": [0.0, -0.5, 0.0, 0.0]})


def test_prior_with_the_wrong_count():
    with pytest.raises(FlightError, match="50 numbers"):
        load("spacerobot_harmonic", {"controller.prior_source": "given", "controller.prior": [1.0] * 49})


def test_resolved_scenario_resolves_to_itself():
    first = load("spacerobot_harmonic_rls")
    again = Scenario(first.resolved(), "again")
    assert again.resolved() == first.resolved()


@pytest.mark.xdist_group("spacerobot_rls")
def test_spoiled_covariance_is_repaired_and_reported():
    """G loses symmetry, then positivity, between two samples: the run goes on with a positive G and counts both."""
    ticks = 10
    flight = CompiledRun(load("spacerobot_harmonic_rls", {"duration_s": 0.2})).start(ticks)
    arrays = flight.arrays
    g = arrays["X_estimator"]["g"][0]

    def until(tick):
        flight.advance(tick)
        assert not flight.stop
        return arrays["O_estimator.telemetry"]["repaired"][0]

    assert until(4) == 0.0
    g[0, 1] += 1e-3
    assert until(5) == 1.0 and np.array_equal(g, g.T)
    g[7, 7] = -1.0
    assert until(6) == 2.0
    assert np.linalg.eigvalsh(g / np.sqrt(np.outer(np.diag(g), np.diag(g)))).min() > 0.0
    assert until(ticks) >= 2.0 and np.isfinite(arrays["O_estimator.parameters"]["pi"]).all()


def test_health_report_names_what_is_wrong():
    record = MINI.health.zeros(1).view(np.recarray)
    record.level[0], record.impossible[0] = 1, 2
    status = diagnostics(record[0]).status[0]
    assert status.level == 1 and "2 bodies" in status.message
