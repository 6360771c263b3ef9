"""Thrusters that stick and leak, the watchdog of commands, the altimeter's second echo."""

import numpy as np
import pytest
from scipy.stats import binom

from flight_math import DualVector, Vec3
from sim_nodes.lander.safe_end import named
from sim_nodes.lander.thruster_failures import failed
from sim_nodes.lander.thrusters import LanderThrusters, apply_thrusters

COMMAND = DualVector(Vec3(10.0, -20.0, 50.0), Vec3(1.0, -2.0, 30.0))


def test_healthy_thrusters_keep_every_bit_also_of_a_negative_zero():
    force, torque = failed(LanderThrusters(), Vec3(-0.0, 1.5, -0.0), Vec3(0.0, -0.0, 2.0))
    assert np.signbit([*force]).tolist() == [True, False, True]
    assert np.signbit([*torque]).tolist() == [False, True, False]


def test_stuck_valves_deliver_what_they_are_stuck_at():
    thrusters = LanderThrusters(force_stuck=Vec3(1.0, 0.0, 1.0), force_stuck_at=Vec3(0.0, 7.0, 40.0),
                                torque_stuck=Vec3(0.0, 1.0, 0.0), torque_stuck_at=Vec3(0.0, -0.5, 0.0))
    wrench, _ = apply_thrusters(thrusters, COMMAND)
    np.testing.assert_array_equal(wrench.real, [0.0, -20.0, 40.0])
    np.testing.assert_array_equal(wrench.dual, [1.0, -0.5, 10.0])


def test_a_leak_makes_force_and_moment_beyond_the_limit_and_costs_propellant():
    thrusters = LanderThrusters(force_leak=Vec3(0.0, 2.0, 0.0), leak_place=Vec3(0.5, 0.0, 0.2), torque_leak=Vec3(0.0, 0.0, 0.1),
                                specific_impulse=220.0)
    wrench, flow = apply_thrusters(thrusters, COMMAND)
    np.testing.assert_allclose(wrench.real, [10.0, -18.0, 40.0])
    moment = np.cross([0.5, 0.0, 0.2], [0.0, 2.0, 0.0])
    np.testing.assert_allclose(wrench.dual, moment + [1.0, -2.0, 10.1])
    assert flow == pytest.approx((10.0 + 18.0 + 40.0) / (220.0 * 9.80665))


def test_a_command_that_nobody_renews_counts_as_zero_after_its_time(broken):
    """The mode manager dies at 60 s; its last command, of 59.9 s, is obeyed for command_timeout = 1 s."""
    run = broken("modes", "crash", from_s=60, changes={"duration_s": 65})
    t, size = run.times("lander/truth"), np.linalg.norm(run["lander/truth"]["force"], axis=1)
    assert (size[(t > 60.0) & (t < 60.85)] > 0.5).all()  # [N] the weight is 2.5 N
    assert (size[t > 61.05] == 0.0).all()


def test_without_a_timeout_the_last_command_is_held(broken):
    run = broken("modes", "crash", from_s=60, changes={"duration_s": 65, "plant.command_timeout": 0.0})
    t, force = run.times("lander/truth"), run["lander/truth"]["force"]
    assert (force[t > 60.1] == force[-1]).all() and np.linalg.norm(force[-1]) > 0.5


def test_second_echoes_are_as_frequent_as_said_and_longer_by_the_excess(broken):
    changes = {"duration_s": 100, "altimeter.multipath_probability": 0.3, "altimeter.multipath_excess": 12.0}
    run = broken(changes=changes)
    truth, measured = run["lander/truth"], run["lander/altimeter"]
    rows = np.searchsorted(run.times("lander/truth"), run.times("lander/altimeter"))
    to_mark = truth["site_position"][rows] + [0.0, 0.0, 1.5]
    excess = measured["range"] - np.linalg.norm(to_mark, axis=1)
    echoes = excess > 6.0
    assert np.abs(excess[echoes] - 12.0).max() < 1.0 and np.abs(excess[~echoes]).max() < 1.0  # [m] noise below 0.2 m
    low, high = binom.ppf([0.0005, 0.9995], len(excess), 0.3)
    assert low <= echoes.sum() <= high


@pytest.mark.parametrize(("changes", "velocity", "end"), [
    ({"landed": 1.0, "speed": 0.05}, -1.0, "landed"),
    ({"landed": 1.0, "speed": 0.2}, -1.0, "hit"),
    ({"landed": 1.0, "lateral": 3.0}, -1.0, "hit"),
    ({"clearance_min_all": -0.1}, 0.0, "below"),
    ({"speed": 0.05}, -1.0, "holding"),
    ({"speed": 0.5}, 0.5, "climbing"),
    ({"speed": 0.5}, -0.5, "descending"),
])
def test_ends_have_names(changes, velocity, end):
    last = {"landed": 0.0, "lateral": 0.1, "speed": 0.0, "attitude_error": 0.01, "rate": 0.0, "clearance_min_all": 5.0} | changes
    assert named(last, {"site_velocity": np.array([0.0, 0.0, velocity]), "site_position": np.array([0.0, 0.0, 50.0])}) == end


def test_a_craft_that_falls_back_after_a_blind_abort_is_not_called_safe(broken):
    run = broken("navigation", "crash", from_s=60)
    assert run.metrics["end"] == "descending" and not run.metrics["is_safe"]
    assert broken("controller", "hang", from_s=60, for_s=2, changes={"duration_s": 250}).metrics["is_safe"]
