"""Each reaction of the mode manager that is defined: to the estimate, to the nominal command, to requests, to the budget."""

import numpy as np
import pytest

MODE, BUDGET, STATUS, TRUTH = "lander/mode", "lander/maneuver_budget", "lander/navigation_status", "lander/truth"
DESCEND, HOVER, ABORT = 0.0, 1.0, 2.0
BY_ITSELF = -2.0


def changes_of(run):
    """(time, mode, cause) of each change."""
    mode, t = run[MODE], run.times(MODE)
    at = np.flatnonzero(np.diff(mode["changes"]) > 0.0) + 1
    return [(float(t[i]), float(mode["mode"][i]), float(mode["cause"][i])) for i in at]


def test_the_nominal_command_passes_unchanged(broken):
    run = broken()
    assert changes_of(run) == [] and run.metrics["end"] == "landed" and run.metrics["false_alarms"] == 0
    np.testing.assert_array_equal(run["lander/safe_command"]["wrench"], run["lander/cmd_wrench"]["wrench"])


def test_a_stale_nominal_command_leads_to_hover(broken):
    """The last command is of 59.9 s; monitors would ask after 0.3 s."""
    run = broken("controller", "crash", from_s=60, changes={"duration_s": 70, "modes.command_age": 0.15})
    (time, mode, cause), *_ = changes_of(run)
    assert mode == HOVER and cause == BY_ITSELF and 60.05 <= time <= 60.25


def test_a_dead_navigation_leads_to_a_blind_abort(broken):
    """After estimate_age and patience; the velocity change of the last valid estimate is burnt in body axes."""
    run = broken("navigation", "crash", from_s=60)
    (time, mode, cause), *others = changes_of(run)
    assert mode == ABORT and cause == BY_ITSELF and others == [] and 61.4 <= time <= 61.7
    assert run.at(BUDGET, time + 0.1)["blind"] == 1.0
    before, after = run.at(TRUTH, time), run.at(TRUTH, time + 40.0)
    up = before["site_position"] / np.linalg.norm(before["site_position"])
    assert before["site_velocity"] @ up < -0.5
    assert after["site_velocity"] @ up == pytest.approx(0.5, abs=0.1)  # [m/s] climb_speed
    rows = run.times(TRUTH) > time + 121.0
    assert (run[TRUTH]["force"][rows] == 0.0).all()  # blind_time is over
    assert run.metrics["clearance_min_m"] > 40.0


def test_an_estimate_that_becomes_valid_again_ends_the_blind_part(broken):
    run = broken("navigation", "hang", from_s=60, for_s=5, changes={"duration_s": 200})
    assert run.at(BUDGET, 64.0)["blind"] == 1.0 and run.at(BUDGET, 80.0)["blind"] == 0.0
    assert run[MODE]["mode"][-1] == ABORT and np.linalg.norm(run[TRUTH]["site_velocity"][-1]) < 0.55


def test_a_passing_fault_is_waited_for_in_hover_and_the_landing_goes_on(broken):
    run = broken("altimeter.measured", "drop", from_s=60, for_s=20)
    times = changes_of(run)
    assert [mode for _, mode, _ in times] == [HOVER, DESCEND]
    assert times[1][0] - 80.0 == pytest.approx(20.0, abs=3.0)  # actionpoint resume
    assert run.metrics["end"] == "landed"


def test_abort_is_final(broken):
    run = broken("plant.parameters.force_leak[0]", "stuck", value=2.0, from_s=60, for_s=20)
    modes = [mode for _, mode, _ in changes_of(run)]
    assert modes[-1] == ABORT and modes.count(ABORT) == 1


def test_without_the_budget_hover_and_abort_are_refused_and_the_landing_goes_on(broken):
    run = broken("altimeter.measured", "drop", from_s=60, changes={"modes.delta_v_budget": 4.0})
    assert changes_of(run) == []
    before = run.at(BUDGET, 60.0)
    assert before["abort_allowed"] == before["hover_allowed"] == 0.0
    assert 1.2 * before["abort_delta_v"] > before["left"]
    assert run[BUDGET]["refused"][-1] >= 2.0


def test_a_hover_leaves_while_it_can_still_pay_for_an_abort(broken):
    """Budget for a hover of some minutes: the abort begins with its price and little more in hand."""
    run = broken("star_tracker.measured", "drop", from_s=60, probability=0.6, changes={
        "modes.hold_time": 60.0, "modes.delta_v_budget": 5.0, "duration_s": 900})
    times = changes_of(run)
    assert [mode for _, mode, _ in times] == [HOVER, ABORT] and times[1][2] == BY_ITSELF
    at = run.at(BUDGET, times[1][0])
    assert 1.2 * at["abort_delta_v"] <= at["left"] <= 1.2 * at["abort_delta_v"] + 0.1
    assert run.at(BUDGET, times[1][0] + at["abort_time"] + 60.0)["left"] > 0.0  # climbed, and held for hold_time


def test_the_lost_axis_is_replaced_by_another(broken):
    """Force along z_B is dead from 80 m on: the craft turns x_B up and climbs away."""
    run = broken("plant.parameters.force_stuck[2]", "stuck", value=1.0, from_s=60)
    assert run[MODE]["mode"][-1] == ABORT and run.metrics["end"] == "climbing"
    assert run.metrics["clearance_min_m"] > 20.0 and run[TRUTH]["site_position"][-1, 2] > 100.0


def test_a_committed_descent_is_carried_through(broken):
    run = broken("navigation", "crash", from_s=275)
    assert run.at(BUDGET, 274.0)["committed"] == 1.0 and changes_of(run) == []
    assert run.metrics["end"] == "landed"
