"""The truth: balances of momentum and energy with wheels, stops and outer forces; actuators against closed forms."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from flight_math import Vec3, quaternion4, rotate, vec3
from sim_nodes.spacerobot.actuators import limit_torque, wheels_step
from sim_nodes.spacerobot.dynamics import Held, momentum_and_energy, state_rate, state_size, step, stop_torque
from spacerobot_ros.reaction_wheels import effective_base_torque, wheel_demand
from tests.spacerobot.spacerobot_cases import plant_of, random_robot
from tests.spacerobot.spacerobot_loop import ROBOT, initial_state


def advance(plant, pi, state, wrench, wheel_rate, period, steps):
    for _ in range(steps):
        step(plant, pi, state, wrench, Vec3(*wheel_rate), period)


def balances(robot, state):
    """Linear momentum, angular momentum with the wheels', kinetic energy."""
    linear, angular, energy = momentum_and_energy(plant_of(robot), robot.pi, state)
    angular = angular + rotate(quaternion4(state[6:10]), vec3(state[-3:]))
    return np.array(linear.parts()), np.array(angular.parts()), energy


@pytest.mark.parametrize("joints", [0, 1, 4, 9])
def test_momentum_and_energy_under_all_forces(joints):
    """Outer force and moment, joint torques and accelerating wheels on a random tree with an initial tumble."""
    rng = np.random.default_rng(joints)
    robot = random_robot(rng, joints)
    state = np.zeros(state_size(joints))
    state[9] = 1.0
    state[3:6], state[10:13], state[13:] = rng.standard_normal(3), 0.3 * rng.standard_normal(3), 0.0
    state[-3:] = 0.5 * rng.standard_normal(3)
    wrench, wheel_rate = 0.05 * rng.standard_normal(6 + joints), 0.02 * rng.standard_normal(3)
    before = balances(robot, state)
    start = state.copy()
    advance(plant_of(robot), robot.pi, state, wrench, wheel_rate, 1e-3, 1000)
    after = balances(robot, state)
    assert np.linalg.norm(after[0] - before[0]) == pytest.approx(np.linalg.norm(wrench[:3]), rel=0.2)  # it turns
    impulse = state[14 + 2 * joints : 17 + 2 * joints]
    np.testing.assert_allclose(after[1] - before[1], impulse, atol=1e-11)
    assert after[2] - before[2] == pytest.approx(state[13 + 2 * joints], abs=1e-11)
    np.testing.assert_allclose(state[-3:] - start[-3:], wheel_rate, atol=1e-12)


def test_internal_torques_conserve_both_momenta():
    state = initial_state()
    state[17:21] = 0.3, -0.2, 0.4, -0.5
    before = balances(ROBOT, state)
    wrench = np.concatenate([np.zeros(6), [0.1, -0.2, 0.1, 0.02]])
    errors = []
    for period in (0.01, 0.005, 0.001):  # [s]
        moved = state.copy()
        advance(plant_of(ROBOT), ROBOT.pi, moved, wrench, np.zeros(3), period, round(5.0 / period))
        after = balances(ROBOT, moved)
        errors.append(max(np.abs(after[0] - before[0]).max(), np.abs(after[1] - before[1]).max()))
    assert errors[0] > 12.0 * errors[1]  # what is left is the integrator's, of order four
    assert errors[2] < 1e-10


def test_a_rigid_body_turns_as_eulers_equations_say():
    """No joints: the torque-free top of `scipy.integrate` with a tight tolerance."""
    from scipy.integrate import solve_ivp

    robot = random_robot(np.random.default_rng(3), 0)
    state = np.zeros(state_size(0))
    state[9], state[10:13] = 1.0, (0.4, -0.2, 0.3)
    xx, xy, xz, yy, yz, zz, *h, m = robot.pi
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - (np.dot(h, h) * np.eye(3) - np.outer(h, h)) / m
    expected = solve_ivp(
        lambda _, w: np.linalg.solve(inertia, -np.cross(w, inertia @ w)), (0, 20), state[10:13], rtol=1e-11, atol=1e-13
    ).y[:, -1]
    advance(plant_of(robot), robot.pi, state, np.zeros(6), np.zeros(3), 0.01, 2000)
    np.testing.assert_allclose(state[10:13], expected, atol=1e-7)


def test_stop_pushes_back_and_never_pulls():
    plant = plant_of(ROBOT, np.full(4, -1.0), np.full(4, 1.0), 100.0, 5.0)
    assert stop_torque(plant, 2, 0.5, 9.0) == 0.0
    assert stop_torque(plant, 2, 1.1, 0.2) == pytest.approx(-20.0)
    assert stop_torque(plant, 2, -1.1, -0.2) == pytest.approx(20.0)
    assert stop_torque(plant, 2, 1.01, -9.0) == 0.0


def test_joint_rests_at_its_stop_and_the_energy_balances():
    state = initial_state()
    wrench = np.zeros(10)
    wrench[7] = 0.2  # [N m], joint 2 towards 180 deg
    plant = plant_of(ROBOT, ROBOT.lower, ROBOT.upper, 50.0, 5.0)
    advance(plant, ROBOT.pi, state, wrench, np.zeros(3), 0.0005, 120000)
    assert state[14] == pytest.approx(np.pi + 0.2 / 50.0, abs=2e-3)
    linear, _, energy = balances(ROBOT, state)
    assert np.linalg.norm(linear) < 1e-8
    assert energy == pytest.approx(state[21], abs=1e-8)


class Wheels(NamedTuple):
    """The wheels' part of the plant's parameters."""

    wheel_torque_limit: float
    wheel_momentum_limit: float
    wheel_lag: float
    wheel_friction: float
    wheel_quantum: float
    wheel_drag: Vec3
    wheel_viscous: Vec3


def wheels(demand, momentum=(0.0, 0.0, 0.0), lag=0.0, friction=0.0, quantum=0.0, steps=1, period=0.01,
           drag=(0.0, 0.0, 0.0), viscous=(0.0, 0.0, 0.0)):
    drive, spin, rate, codes = Vec3(0.0, 0.0, 0.0), Vec3(*momentum), Vec3(0.0, 0.0, 0.0), []
    for _ in range(steps):
        p = Wheels(0.05, 0.5, lag, friction, quantum, Vec3(*drag), Vec3(*viscous))
        drive, rate, at_limit = wheels_step(p, Vec3(*map(float, demand)), drive, spin, period)
        spin = spin + rate * period
        codes.append(at_limit)
    return drive, spin, rate, codes


def test_wheel_takes_the_momentum_it_gives():
    _, spin, rate, codes = wheels([0.01, -0.02, 0.03], steps=10)
    np.testing.assert_allclose(rate.parts(), [-0.01, 0.02, -0.03])
    np.testing.assert_allclose(spin.parts(), (0.1 * rate).parts())
    assert codes == [0] * 10


def test_wheel_lag_is_first_order():
    drive, *_ = wheels([0.01, 0, 0], lag=0.02, steps=7)
    assert drive[0] == pytest.approx(-0.01 * (1 - math.exp(-0.07 / 0.02)), rel=1e-12)


def test_wheel_limits_of_torque_and_momentum():
    drive, _, _, codes = wheels([0.2, 0, 0])
    assert drive[0] == -0.05 and codes == [1]
    _, spin, rate, codes = wheels([-0.04, 0, 0], momentum=(0.4999, 0, 0), steps=3)
    assert spin[0] == 0.5 and rate[0] == 0.0 and codes[-1] == 1
    _, spin, _, codes = wheels([0.04, 0, 0], momentum=(0.5, 0, 0))
    assert spin[0] == pytest.approx(0.5 - 0.0004) and codes == [0]


def test_wheel_friction_stops_a_free_rotor_and_holds_it():
    _, spin, _, _ = wheels([0.0, 0, 0], momentum=(1e-4, 0, 0), friction=5e-4, steps=100)
    assert spin[0] == 0.0
    _, spin, rate, _ = wheels([4e-4, 0, 0], friction=5e-4, steps=10)
    assert spin[0] == 0.0 and rate[0] == 0.0
    _, _, rate, _ = wheels([0.01, 0, 0], friction=5e-4)
    assert rate[0] == pytest.approx(-0.0095)


def test_drag_of_one_wheel_adds_to_the_friction_of_all():
    _, _, rate, _ = wheels([0.01, 0.01, 0], friction=5e-4, drag=(0.004, 0.0, 0.0))
    np.testing.assert_allclose(rate.parts()[:2], [-0.0055, -0.0095])


def test_viscous_wheel_runs_down_exponentially():
    _, spin, _, _ = wheels([0.0, 0, 0], momentum=(0.3, 0.3, 0), viscous=(0.5, 0.0, 0.0), steps=2000, period=0.001)
    assert spin[0] == pytest.approx(0.3 * math.exp(-0.5 * 2.0), rel=1e-3) and spin[1] == 0.3


def test_wheel_torque_is_quantised():
    drive, *_ = wheels([0.0114, -0.0116, 0.0004], quantum=1e-3)
    np.testing.assert_allclose(drive.parts(), [-0.011, 0.012, 0.0], atol=1e-15)


def test_wheel_torque_that_reaches_the_base():
    """The base turns under wheels as it does under an outer moment of the same effective torque."""
    state = initial_state()
    state[10:13], state[-3:] = (0.1, -0.2, 0.15), (0.3, 0.1, -0.2)
    pushed = state.copy()
    pushed[-3:] = 0.0
    wanted, w, momentum = Vec3(0.01, 0.02, -0.03), vec3(state[10:13]), vec3(state[-3:])
    demand = wheel_demand(wanted, w, momentum)
    torque = effective_base_torque(-demand, w, momentum)
    np.testing.assert_allclose(torque.parts(), wanted.parts(), atol=1e-17)
    rates = []
    moment = np.concatenate([np.zeros(3), wanted.parts(), np.zeros(4)])
    for start, wrench, wheel_rate in ((state, np.zeros(10), -demand), (pushed, moment, Vec3(0.0, 0.0, 0.0))):
        rate = np.zeros_like(start)
        state_rate(Held(plant_of(ROBOT), ROBOT.pi, wrench, wheel_rate), 0.0, start, rate)
        rates.append(rate[:21])
    np.testing.assert_allclose(rates[0], rates[1], atol=1e-16)


def test_torque_limit_counts_and_a_nan_is_no_torque():
    found = [limit_torque(demand, 1.0) for demand in (0.1, -2.0, np.nan, np.inf)]
    assert found == [(0.1, False), (-1.0, True), (0.0, True), (1.0, True)]
