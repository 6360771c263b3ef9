"""The rover's safe states: their laws against mechanics written a second time, and each reaction of the mode manager."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cubli_ros import contact_guard, safe_laws
from cubli_ros.mode_manager import ModeManagerParameters
from flight_math import Vec3, plain
from tests.cubli.records import made
from tests.cubli_physical.runs import FULL, LENGTH, MASS, THETA, WHEEL
from tests.faults_rover.rover_runs import BALANCE, CALM, HOLD, REST, Run

G = 0.002  # [m/s^2]
ARM = math.sqrt(3.0) / 2.0 * LENGTH  # [m] corner to centre
ACROSS = 11.0 / 12.0 * MASS * LENGTH**2 - WHEEL  # [kg m^2] that a level torque turns
ALONG = MASS * LENGTH**2 / 6.0 - WHEEL
UP = np.full(3, 1.0 / math.sqrt(3.0))


def parameters(**values):
    return made(ModeManagerParameters, 0.01, inertia=FULL, gravity=G, torque_limit=5e-4, **values)


# -- contact guard -------------------------------------------------------------------------------------------------------
def margins(omega, wheel_speed, up, torque, friction, least):
    """(friction margin, normal force margin) per mass [m/s^2] of a torque, from Newton and Euler about the corner."""
    r = np.full(3, 0.5 * LENGTH)
    inertia = THETA - WHEEL * np.eye(3)
    moment = np.cross(r, -MASS * G * up) + torque - np.cross(omega, inertia @ omega + WHEEL * wheel_speed)
    omega_dot = np.linalg.solve(inertia, moment)
    force = np.cross(omega_dot, r) + np.cross(omega, np.cross(omega, r)) + G * up
    along = force @ up
    return friction * along - np.linalg.norm(force - along * up), along - least * G


def test_the_guard_keeps_the_largest_part_of_a_torque_that_keeps_contact():
    rng = np.random.default_rng(1)
    p = parameters(guard_friction=0.5, guard_normal_force=0.2)
    share_of = plain(contact_guard.kept_share)
    cut = 0
    for _ in range(300):
        up = Rotation.from_rotvec(rng.normal(0.0, 0.15, 3)).apply(UP)
        omega, wheel_speed = rng.normal(0.0, 0.02, 3), rng.normal(0.0, 5.0, 3)
        torque = rng.normal(0.0, 6e-4, 3)
        share = share_of(p, Vec3(*omega), Vec3(*wheel_speed), Vec3(*up), Vec3(*torque))

        def least_margin(s):
            return min(margins(omega, wheel_speed, up, s * torque, 0.5, 0.2))
        if least_margin(1.0) >= 0.0:
            assert share == 1.0
        elif least_margin(0.0) >= 0.0:
            cut += 1
            low, high = 0.0, 1.0  # the allowed parts are an interval that holds 0
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if least_margin(middle) >= 0.0 else (low, middle)
            np.testing.assert_allclose(share, low, atol=1e-9)
        else:
            assert share == (1.0 if least_margin(1.0) > least_margin(0.0) else 0.0)
    assert cut > 50


def test_a_wild_command_does_not_move_the_corner():
    """The nominal law wants its whole torque all at once: the ground's force stays within the guard's cone."""
    limits = {f"{name}.torque_limit": 0.02 for name in ("modes", "plant", "controller")}
    run = Run("controller.command.effort[0]", "stuck", CALM | limits, 16.0, from_s=15.0, value=0.02)
    contact, t = run["truth/contact"], run.t("truth/contact")
    assert run["safe_state"]["guarded"][-1] >= 10 and run.metrics["lift_off_s"] is None
    assert contact["friction_ratio"][(t > 15.0) & (t < 15.2)].max() < 0.51


# -- hold ----------------------------------------------------------------------------------------------------------------
def test_hold_leans_by_gravity_over_stiffness():
    """In equilibrium J k theta = m g r sin(tilt_0 + theta), from the tilt at which it was entered."""
    run = Run("controller", "crash", CALM | {"plant.initial_angles": [-0.05, 0.05, 0.0], "modes.hold_time": 1000.0}, 60.0, from_s=3.0)
    entered = run.modes()[1][0]
    tilts = np.arccos(Rotation.from_quat(run["truth/attitude"]["orientation"]).apply(UP) @ UP)
    tilt_0, tilt = tilts[round(entered * 100)], tilts[-1]
    theta = tilt - tilt_0
    assert run.modes()[-1][1] == HOLD and np.abs(run["truth"]["rates"][-1]).max() < 2e-5
    np.testing.assert_allclose(ACROSS * 0.25 * theta, MASS * G * ARM * math.sin(tilt), rtol=0.05)
    turned = run["safe_state"]["turned"][-1]
    np.testing.assert_allclose(np.linalg.norm(turned), theta, rtol=0.2)


# -- rest ----------------------------------------------------------------------------------------------------------------
def test_a_rover_that_is_let_go_falls_with_its_energy_conserved_and_keeps_contact():
    """Free wheels: only the corner's inertia without them takes part. The argument for rest without torque."""
    run = Run("modes", "crash", CALM, 110.0, from_s=0.5)
    contact, truth = run["truth/contact"], run["truth"]
    assert run.metrics["end"] == "passive" and run.metrics["lift_off_s"] is None
    t = run.t("truth")
    moving = t < run.metrics["touch_s"]
    before_slip = moving & (t < (run.metrics["slip_s"] or 1e9)) & (t > 0.8)
    tilts = np.arccos(np.clip(Rotation.from_quat(run["truth/attitude"]["orientation"]).apply(UP) @ UP, -1.0, 1.0))
    energy = 0.5 * ACROSS * (truth["rates"] ** 2).sum(axis=1) + MASS * G * ARM * np.cos(tilts)
    np.testing.assert_allclose(energy[before_slip], energy[before_slip][0], rtol=5e-6)
    assert contact["normal_force"][moving].min() > 0.2 and run.metrics["touching_speed"] < 0.015


def test_rest_lets_down_at_the_rate_of_its_law():
    run = Run("controller", "crash", CALM | {"modes.hold_time": 1.0}, 110.0, from_s=2.0)
    assert [mode for _, mode in run.modes()] == [BALANCE, HOLD, REST] and run.metrics["end"] == "let down"
    t, touch = run.t("truth"), run.metrics["touch_s"]
    rates = np.linalg.norm(run["truth"]["rates"], axis=1)
    tilts = np.arccos(Rotation.from_quat(run["truth/attitude"]["orientation"]).apply(UP) @ UP)
    late = (t > run.modes()[-1][0] + 15.0) & (t < touch - 0.1)
    law = 0.02 + MASS * G * ARM * np.sin(tilts) / (ACROSS * 0.5)
    lagging = np.interp(t - 2.0, t, law)  # the lag 1 / d
    np.testing.assert_allclose(rates[late], lagging[late], rtol=0.04)
    assert run.metrics["touching_speed"] < 0.2 * rates[late].max() < 0.01
    assert run["truth/contact"]["friction_ratio"][t < touch].max() < 0.5


def test_wheels_are_braked_as_a_clipped_exponential():
    p = parameters(brake_rate=0.02, brake_limit=1e-5)
    speed, speeds = np.array([2.0, -0.3, 0.0]), []
    for _ in range(30000):
        torque = np.array(plain(safe_laws.brake_torque)(p, Vec3(*speed)))
        speed = speed - torque / WHEEL * 0.01
        speeds.append(speed)
    t = 0.01 * np.arange(1, 30001)
    linear = (2.0 - 0.5) / 0.01  # [s] until b J_w Omega is below the limit, at 0.5 rad/s
    exact = np.where(t < linear, 2.0 - 0.01 * t, 0.5 * np.exp(-0.02 * (t - linear)))
    np.testing.assert_allclose(np.array(speeds)[:, 0], exact, atol=2e-4)
    np.testing.assert_allclose(np.array(speeds)[:, 1], -0.3 * np.exp(-0.02 * t), atol=1e-4)
    assert made(ModeManagerParameters).brake_limit < 0.5 * MASS * G * LENGTH  # m g l / 2 tips it


# -- a lost wheel --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("lost", [0, 1, 2])
def test_two_wheels_give_the_torque_about_e_and_no_more_is_asked_of_the_third(lost):
    p, torque = parameters(), Vec3(1e-4, -2e-4, 5e-5)
    u = np.array(plain(safe_laws.without_wheel)(p, torque, lost, Vec3(0.0, 0.0, 0.0), Vec3(*UP)))
    e = np.cross(UP, np.eye(3)[lost])
    e /= np.linalg.norm(e)
    np.testing.assert_allclose(u @ e, np.array(torque) @ e, rtol=1e-12)
    assert abs(u[lost]) < 1e-18


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_cart_and_pole_have_their_poles_where_the_law_puts_them(lost):
    """Linearised about upright, from the torques that the law gives and the mechanics of the corner."""
    q, law, p = 0.15, plain(safe_laws.without_wheel), parameters(lost_wheel_rate=0.15)
    across = np.ones(3) - 3.0 * np.eye(3)[lost]
    across /= np.linalg.norm(across)
    matrix = np.zeros((3, 3))
    matrix[0, 1], matrix[1, 0] = 1.0, MASS * G * ARM / ACROSS
    for column, (lean, rate, spin) in enumerate(1e-6 * np.eye(3)):
        up = UP - np.cross(lean * across, UP)
        omega = rate * across + spin * UP
        u = np.array(law(p, Vec3(0.0, 0.0, 0.0), lost, Vec3(*omega), Vec3(*up)))
        matrix[1, column] += u @ across / ACROSS / 1e-6
        matrix[2, column] += u @ UP / ALONG / 1e-6
    np.testing.assert_allclose(np.poly(matrix), np.poly([-q, -q, -q]), rtol=1e-5)


@pytest.mark.parametrize("entry, value", [("wheel_effectiveness[0]", 0.0), ("wheel_runaway[1]", 5e-4), ("wheel_coulomb[2]", 2e-4)])
def test_a_lost_wheel_is_switched_off_held_without_and_let_down(entry, value):
    run = Run(f"plant.parameters.{entry}", "stuck", {"modes.return_limit": 0}, 110.0, unit="wheels", from_s=16.0, value=value)
    wheel = "xyz".index({"0": "x", "1": "y", "2": "z"}[entry[-2]])
    assert [mode for _, mode in run.modes()] == [BALANCE, HOLD, REST] and run.metrics["end"] == "let down"
    held = run.t("wheel_power") > run.modes()[1][0]
    np.testing.assert_array_equal(run["wheel_power"]["on"][held].min(axis=0), [float(i != wheel) for i in range(3)])
    assert run.metrics["fault_isolated"] and run.metrics["spin_max"] < 0.1 and run.metrics["lift_off_s"] is None


# -- reactions -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("place", ["controller", "estimator"])
def test_silence_means_hold_and_then_balance_again(place):
    run = Run(place, "hang", {}, 40.0, from_s=15.0, for_s=1.0)
    (_, first), (hold_at, hold), (back_at, back) = run.modes()
    assert (first, hold, back) == (BALANCE, HOLD, BALANCE)
    np.testing.assert_allclose(hold_at, 14.99 + 0.11, atol=0.0101)  # the first tick at which it is older than 0.1 s
    np.testing.assert_allclose(back_at, 16.0 + 5.0, atol=0.05)
    assert run.metrics["end"] == "balanced"


def test_an_estimate_that_says_it_is_not_valid_means_hold():
    run = Run("estimator.status.valid", "off", {}, 30.0, from_s=15.0, for_s=2.0)
    assert [mode for _, mode in run.modes()] == [BALANCE, HOLD, BALANCE]
    np.testing.assert_allclose(run.modes()[1][0], 15.0, atol=0.011)
    assert run.at("safe_state", "rate_source", 16.0) == 1.0  # the gyro


def test_the_manager_goes_back_by_itself_no_more_often_than_it_may():
    run = Run("controller", "hang", {"modes.return_limit": 1, "modes.return_time": 2.0}, 60.0, from_s=15.0, every_s=6.0, for_s=1.0)
    assert [mode for _, mode in run.modes()] == [BALANCE, HOLD, BALANCE, HOLD, REST]
    assert run["safe_state"]["returns"][-1] == 1.0


def test_a_requested_hold_stays_and_ends_in_rest():
    run = Run("controller.command.effort[2]", "stuck", {}, 60.0, from_s=15.0, for_s=1.0, value=5e-4)
    assert [mode for _, mode in run.modes()] == [BALANCE, HOLD, REST]
    assert run.metrics["fault_detected_by"] == "law_wild" and run["mode"]["cause"][-1] == -2.0
    np.testing.assert_allclose(run.modes()[2][0] - run.modes()[1][0], 30.0, atol=0.02)


def test_a_plant_that_hears_nothing_goes_to_no_torque_and_touches_down_slowly():
    run = Run("modes", "crash", {}, 110.0, from_s=15.0)
    assert not run["truth"]["torque"][run.t("truth") > 15.25].any()
    assert run.metrics["end"] == "passive" and run.metrics["is_safe"]
