"""What a user gets wrong is refused, or warned of, in a sentence with the numbers."""

import math

import pytest

from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_graph.runs import simulate


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"plant.site_height": -3.0}, ["plant", "site_height", "inside the body", "-3.0 m"]),
        ({"plant.start_orientation": [0.0, 0.0, 0.0, 2.0]}, ["start_orientation", "norm 2", "unit quaternion"]),
        ({"plant.mass": 0.0}, ["plant", "mass", "> 0"]),
        ({"controller.mass": -1.0}, ["controller", "mass", "> 0"]),
        ({"plant.inertia": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]}, ["plant", "inertia", "must all be > 0"]),
        ({"controller.inertia": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 5.0]}, ["controller", "no rigid body"]),
        ({"controller.inertia": [1.0, 0.3, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]}, ["controller", "not symmetric"]),
        ({"plant.start_position": [0.0, 0.0, 0.0]}, ["start_position", "goal itself"]),
        ({"plant.semi_axes": [1.0, 0.0, 1.0]}, ["semi_axes", "> 0"]),
        ({"controller.view_half_angle": 4.0}, ["view_half_angle", "< 3.14159"]),
    ],
)
def test_refused_before_the_run(changes, words):
    with pytest.raises(FlightError) as refused:
        load("lander_nominal", changes)
    assert all(word in str(refused.value) for word in words), refused.value


def test_unsafe_starts(fly):
    """Refused with their margins, or flown when asked."""
    sentence = r"inside the keep-out funnel: clearance -39\.794 m .* 18\.00 deg of at most 30"
    with pytest.raises(FlightError, match=sentence):
        simulate(load("lander_nominal", {"plant.start_position": [-900.0, 450.0, 250.0]}))
    outside = {"plant.start_view_error": math.radians(33.0)}
    sentence = r"site in view: view angle 33\.00 deg of at most 30\.00 deg, clearance 50\.206 m"
    with pytest.raises(FlightError, match=sentence):
        simulate(load("lander_nominal", outside))
    found, _ = fly("lander_nominal", plant__start_view_error=math.radians(33.0), controller__refuse_unsafe_start=False)
    assert found["landed"] == 1 and found["los_max_deg"] > 32.9 and found["level_worst"] == 2
    assert found["los_violation_s"] < 60.0  # [s] the clamped barrier still pulls the site back into view


def test_warnings_give_the_numbers():
    assert load("lander_nominal").warnings() == []
    weak = load("lander_nominal", {"controller.pull_gain": 1.2, "controller.rate_hz": 0.25}).warnings()
    assert any("42.00 + 2.51 N is not below force_limit = 40.00 N" in text for text in weak)
    assert any(text.startswith("controller: ") and "4.000 s is not below 2 J/D_w = 3.333 s of axis y" in text
               for text in weak)
    barrier = load("lander_nominal", {"controller.terrain_gain": 50.0}).warnings()
    assert any("absorbs 44.7 J" in text and "151.2 J" in text for text in barrier)
