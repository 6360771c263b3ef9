"""Hover and abort: the law against its closed form, its geometry, and what it costs against what was computed before."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flight_math import DualVector, Quaternion, Vec3, uncompiled, view
from lander_ros.constraints import clearance
from lander_ros.landing_law import LandingLaw
from lander_ros.safe_states import SafeStates, Station, abort_station, facing, line_of_sight, safe_wrench
from tests.lander.reference_landing import record

UPRIGHT, UP = Quaternion(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 1.0)
MODE, BUDGET, TRUTH = "lander/mode", "lander/maneuver_budget", "lander/truth"
HOVER, ABORT = 1.0, 2.0


def parameters(**values):
    return view(SafeStates.record({"site_spin": [0.0, 0.0, 0.0], "site_position": [0.0, 0.0, 1e4], **values})[0], SafeStates.kinds)


def test_speed_error_and_distance_decay_as_the_law_says():
    """Without limits: the poles of s^2 + k_v s + k_v k_p, against their closed form."""
    p = parameters(climb_speed=1e3, acceleration_limit=1e3, force_limit=1e6)
    law, h = uncompiled(safe_wrench), 0.05
    r, v, station = -10.0, 0.3, Station(Vec3(0.0, 0.0, 0.0), UPRIGHT, UP)
    first, second = np.roots([1.0, p.velocity_gain, p.velocity_gain * p.approach_gain])
    a = (v - second * r) / (first - second)
    for step in range(1200):
        wrench = law(p, (Vec3(0.0, 0.0, r), UPRIGHT, DualVector(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, v))), station,
                     Vec3(0.0, 0.0, 0.0))
        v, r = v + h * wrench.real.z / p.mass, r + h * v + 0.5 * h * h * wrench.real.z / p.mass
        if step % 200 == 199:
            t = (step + 1) * h
            assert r == pytest.approx(a * math.exp(first * t) + (-10.0 - a) * math.exp(second * t), abs=0.03)
            assert r < 0.0  # no overshoot


def test_limits_keep_directions():
    """A large lateral and a large upward gap: each speed is limited along its own direction, the force by its size."""
    p, still = parameters(), DualVector(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))
    wrench = uncompiled(safe_wrench)(p, (Vec3(300.0, 400.0, 0.0), UPRIGHT, still), Station(Vec3(0.0, 0.0, 500.0), UPRIGHT, UP),
                                     Vec3(0.0, 0.0, 0.0))
    force = np.array([*wrench.real])
    assert np.linalg.norm(force) == pytest.approx(p.mass * p.acceleration_limit)
    np.testing.assert_allclose(force / np.linalg.norm(force), np.array([-0.6, -0.8, 1.0]) / math.sqrt(2.0))


def test_the_nominal_axis_turns_onto_the_line_by_the_least_rotation():
    random = np.random.default_rng(4)
    for _ in range(20):
        q, up, axis = Rotation.random(random_state=random), random.normal(size=3), random.normal(size=3)
        up, axis = up / np.linalg.norm(up), axis / np.linalg.norm(axis)
        turned = Rotation.from_quat([*uncompiled(facing)(Quaternion(*q.as_quat()), Vec3(*axis), Vec3(*up))])
        np.testing.assert_allclose(turned.apply(axis), up, atol=1e-12)
        assert (turned * q.inv()).magnitude() == pytest.approx(math.acos(np.clip(q.apply(axis) @ up, -1.0, 1.0)), abs=1e-7)


def test_a_climb_along_the_line_of_sight_loses_no_clearance():
    """From any place that is clear of the keep-out funnel, 20 m and more from the goal, upwards of 45 degrees or not."""
    funnel, random = record(LandingLaw), np.random.default_rng(6)
    tried = 0
    while tried < 60:
        r = random.uniform([-300.0, -300.0, 0.0], [300.0, 300.0, 300.0])
        d = uncompiled(clearance)(funnel, Vec3(*r))
        if d < 1.0 or np.linalg.norm(r) < 20.0:
            continue
        tried += 1
        up = np.array([*uncompiled(line_of_sight)(Vec3(*r))])
        assert up[2] >= math.sqrt(0.5) - 1e-12 or np.allclose(up, r / np.linalg.norm(r))
        heights = [uncompiled(clearance)(funnel, Vec3(*(r + s * up))) for s in np.linspace(0.0, 300.0, 12)]
        assert (np.diff(heights) > 0.0).all(), r


def test_an_abort_holds_at_its_distance_or_beyond_where_it_begins():
    p = parameters()
    for distance, held in ((50.0, 150.0), (129.0, 150.0), (200.0, 220.0)):
        station = uncompiled(abort_station)(p, Vec3(0.0, 0.0, distance), UPRIGHT)
        np.testing.assert_allclose([*station.position], [0.0, 0.0, held])


@pytest.mark.parametrize("at", [60.0, 170.0])
def test_what_an_abort_costs_is_below_what_was_computed_before_it(broken, at):
    """Thrust spent in climb and hold against the cost published before, which counts the hold by its full time."""
    run = broken("plant.parameters.force_leak[0]", "stuck", value=1.0, from_s=at)
    t, mode = run.times(MODE), run[MODE]["mode"]
    begin = t[np.argmax(mode == ABORT)]
    before, end = run.at(BUDGET, begin - 0.1), run[BUDGET][-1]
    hold_time = run.scenario.graph.nodes["modes"].values["hold_time"]
    climbed = t[-1] - begin
    weight = 4.6e-3  # [m/s^2] of the lander at the site: the share of the hold that the run does not reach costs that much
    unreached = weight * (before["abort_time"] + hold_time - climbed)
    spent = end["spent"] - before["spent"]
    assert 0.5 * (before["abort_delta_v"] - unreached) < spent < before["abort_delta_v"] - unreached + 0.1 * weight * climbed
    assert spent < before["abort_delta_v"] and before["abort_allowed"] == 1.0
    force = np.linalg.norm(run["lander/safe_command"]["wrench"]["force"], axis=1)
    assert force[(t >= begin)].sum() * 0.1 / 500.0 == pytest.approx(spent, rel=0.01)


def test_hover_keeps_its_place_and_attitude(broken):
    run = broken("controller", "crash", from_s=60, changes={"duration_s": 88})
    assert run[MODE]["mode"][-1] == HOVER
    rows = run.times(TRUTH) > 84.0
    truth = run[TRUTH][rows]
    assert np.linalg.norm(truth["site_velocity"], axis=1).max() < 0.05  # [m/s] 7 s at 0.05 m/s^2, then as exp(-0.145 t)
    assert run[BUDGET]["distance_to_go"][-1] < 0.3
    assert np.diff(run[BUDGET]["distance_to_go"][run.times(BUDGET) > 61.0]).max() < 5e-3  # [m] noise of the estimate: it does not turn back


def test_an_abort_climbs_with_its_speed_and_holds(broken):
    run = broken("plant.parameters.force_leak[0]", "stuck", value=1.0, from_s=60)
    end = run[TRUTH][-1]
    assert np.linalg.norm(end["site_position"]) == pytest.approx(150.0, abs=1.0)
    assert np.linalg.norm(end["site_velocity"]) < 0.02
    speed = np.linalg.norm(run[TRUTH]["site_velocity"][run.times(TRUTH) > 90.0], axis=1)
    assert speed.max() == pytest.approx(0.5, abs=0.02)
