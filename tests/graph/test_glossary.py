"""Every metric has a unit and a meaning, declared once, and none stands for what is missing."""

import math

import numpy as np
import pytest

from cubli_ros import jump_condition
from flight_graph import runs
from flight_graph.cli import handbook
from flight_graph.graphs import glossary, metrics
from flight_graph.graphs.metric_entry import FLAG, NUMBER, WORD
from flight_graph.graphs.scenario import load
from papers.appc.metrics import overshoot
from papers.lander.terrain import terrain

UNITS = {"1", "%", "s", "m", "m/s", "rad", "rad/s", "deg", "deg/s", "N", "N m", "N m s", "N^2 m^2 s", "m g", "J", "kg", "kg m/s",
         "kg m^2", "1/s"}
KINDS = {NUMBER: (int, float), FLAG: bool, WORD: str}
FLOWN = {"cubli_asteroid": 3.0, "cubli_physical": 3.0, "cubli_faults": 20.0, "spacerobot_noise": 3.0, "lander_nominal": 70.0,
         "lander_estimated": 70.0, "lander_faults": 100.0}


@pytest.mark.parametrize("name", handbook.metric_tables())
def test_declarations_are_complete(name):
    entries = handbook.metric_tables()[name]
    assert len({entry.name for entry in entries}) == len(entries)
    for entry in entries:
        assert entry.meaning and (entry.unit in UNITS if entry.kind == NUMBER else entry.unit == ""), entry.name


@pytest.mark.parametrize("name, duration", FLOWN.items())
def test_a_run_has_only_what_is_declared_and_no_number_stands_for_what_is_missing(name, duration):
    scenario = load(name, {"duration_s": duration})
    signals = runs.simulate(scenario)
    known, found = glossary.of(scenario), metrics.compute(scenario, signals)
    for metric, value in found.items():
        entry = known.metrics[metric]
        if value is None:
            assert entry.missing, f"{metric} is missing, and its declaration does not say what that means"
        else:
            assert isinstance(value, KINDS[entry.kind]) and (entry.kind == FLAG or not isinstance(value, bool)), metric
            assert not isinstance(value, float) or abs(value) < 1e5, metric
    for trace in known.traces:
        t, values = trace.function(scenario, signals)
        assert t.shape == values.shape and len(t) and np.isfinite(values).all() and 0.0 <= t[0] and t[-1] < duration, trace.name


def test_overshoot_is_of_the_whole_turn_not_of_an_axis_that_starts_near_zero():
    angles = np.array([[0.2, 1e-5, -0.1], [0.1, -0.01, 0.0], [-0.02, 0.0, 0.01], [0.0, 0.0, 0.0]])
    assert overshoot(angles) == pytest.approx(100.0 * 0.02 / 0.2)
    assert overshoot(0.001 * angles) is None  # there is no turn to overshoot
    assert overshoot(np.array([[0.0, 0.0, 0.2], [0.1, -0.1, 0.1]])) == pytest.approx(0.0, abs=1e-12)  # those have no other side


def test_a_friction_ratio_without_contact_is_missing():
    assert jump_condition.largest_ratio(np.array([0.1, jump_condition.LOST_CONTACT_RATIO, 0.2])) is None
    assert jump_condition.largest_ratio(np.array([0.1, 0.3])) == 0.3


def test_numbers_that_are_none_are_none():
    for value in (math.nan, math.inf, np.float64("nan"), np.array([-math.inf]), None):
        assert metrics._plain(value, "here", finite=True) is None


def test_the_ground_is_the_body_s():
    scenario = load("lander_nominal")
    values = scenario.graph.nodes["plant"].values
    x, y = np.meshgrid([-300.0, 0.0, 40.0], [-100.0, 0.0, 7.0])
    z = terrain(scenario, x, y)
    position, rotation = scenario.graph.nodes["plant"].component.site(values, "here")[:2]
    places = np.array(position.parts()) + np.stack([x, y, z], axis=-1) @ np.reshape(rotation.parts(), (3, 3)).T
    assert ((places / values["semi_axes"]) ** 2).sum(axis=-1) == pytest.approx(1.0, abs=1e-12)
    assert z[1, 1] == pytest.approx(-values["site_height"], abs=1e-9)
