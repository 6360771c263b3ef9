"""Joints that fail: friction, seized joints and brakes against conserved quantities and Euler's equations; backlash."""

from typing import NamedTuple

import numpy as np
import pytest

from flight_math import Vec3, uncompiled
from sim_nodes.spacerobot.dynamics import momentum_and_energy
from sim_nodes.spacerobot.joint_hardware import friction_capacity, meshed, slowed, step_with_friction
from spacerobot_ros.dynamics import composite_parameters
from tests.spacerobot.spacerobot_cases import tree_at
from tests.spacerobot.spacerobot_loop import ROBOT, initial_state

pytestmark = pytest.mark.xdist_group("joint hardware")  # compiled once

STEP = 0.01  # [s]
ZERO = Vec3(0.0, 0.0, 0.0)


class Plant(NamedTuple):
    """What the plant's kernels read of its parameters."""

    parent: np.ndarray
    fixed_rotation: np.ndarray
    offset: np.ndarray
    axis: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    stop_stiffness: float
    stop_damping: float
    joint_friction: np.ndarray
    joint_viscous: np.ndarray
    joint_seized: np.ndarray
    brake_torque: np.ndarray


def plant(friction=0.0, viscous=0.0, seized=0.0):
    """The mini space robot without stops; friction of all joints, or of each."""
    each = (np.broadcast_to(np.asarray(one, float), 4).copy() for one in (friction, viscous, seized, 10.0))
    return Plant(*ROBOT.geometry, np.full(4, -np.inf), np.full(4, np.inf), 0.0, 0.0, *each)


def fly(p, state, wrench, steps, brakes=(0.0, 0.0, 0.0, 0.0)):
    """States (steps + 1, 28) and friction impulses (steps, 4) under a wrench held."""
    capacity, states, impulses = np.zeros(4), [state.copy()], []
    assert friction_capacity(p, np.asarray(brakes), capacity)
    for _ in range(steps):
        impulse = np.zeros(4)
        step_with_friction(p, ROBOT.pi, state, (wrench, ZERO, STEP), capacity, impulse)
        states.append(state.copy())
        impulses.append(impulse)
    return np.array(states), np.array(impulses)


def tumbling(joint_rates, rates=(0.05, -0.02, 0.03)):
    state = initial_state()
    state[10:13], state[17:21] = rates, joint_rates
    return state


def balances(state):
    linear, angular, energy = momentum_and_energy(plant(), ROBOT.pi, state)
    return np.array([*linear.parts(), *angular.parts()]), energy


@pytest.mark.parametrize("p", [plant(friction=0.03), plant(viscous=0.2), plant(seized=[0.0, 1e3, 0.0, 0.0]),
                               plant(friction=[0.0, 0.01, 0.05, 0.0], viscous=[0.1, 0.0, 0.1, 0.02])])
def test_friction_is_inner_and_its_work_is_the_energy_that_goes(p):
    """Momenta as they were; energy less by what the joints' friction took, which is never given back."""
    state = tumbling([0.2, -0.3, 0.25, 0.4])
    before, energy = balances(state)
    states, _ = fly(p, state, np.zeros(10), 300)
    after, left = balances(state)
    np.testing.assert_allclose(after, before, atol=2e-7)  # [kg m/s, N m s] the integrator's, mostly of the first stop
    assert left - energy == pytest.approx(state[21] - states[0][21], abs=1e-7)  # [J]
    energies = [balances(one)[1] for one in states[::10]]
    assert np.diff(energies).max() < 1e-9 and left < 0.9 * energy


def test_coulomb_friction_takes_torque_times_way():
    """One joint rubs: the energy that goes is the friction's torque times the angle that the joint has turned."""
    state = tumbling([0.2, 0.0, 0.0, 0.0])
    _, energy = balances(state)
    states, impulses = fly(plant(friction=[0.02, 0.0, 0.0, 0.0]), state, np.zeros(10), 50)
    way = np.abs(np.diff(states[:, 13])).sum()
    assert energy - balances(state)[1] == pytest.approx(0.02 * way, rel=1e-3)
    np.testing.assert_allclose(impulses[:, 0], -0.02 * STEP)  # it slides: at its bound, against the motion


def test_viscous_friction_takes_its_power():
    state = tumbling([0.0, 0.3, 0.0, 0.0])
    _, energy = balances(state)
    states, _ = fly(plant(viscous=[0.0, 0.1, 0.0, 0.0]), state, np.zeros(10), 200)
    power = 0.1 * states[:, 18] ** 2
    assert energy - balances(state)[1] == pytest.approx(STEP * (power.sum() - 0.5 * (power[0] + power[-1])), rel=5e-3)


def test_seized_joint_stops_at_once_and_does_not_creep():
    state = tumbling([0.2, -0.3, 0.25, 0.4])
    wrench = np.zeros(10)
    wrench[7] = 0.4  # [N m] its drive pushes on
    states, _ = fly(plant(seized=[0.0, 1e3, 0.0, 0.0]), state, wrench, 300)
    assert np.abs(states[1:, 18]).max() < 1e-12  # [rad/s]
    assert np.abs(states[2:, 14] - states[1, 14]).max() < 1e-5  # [rad]


def test_joint_breaks_away_above_its_friction_only():
    for torque, moves in ((0.049, False), (0.051, True)):
        state, wrench = initial_state(), np.zeros(10)
        wrench[6:] = torque * np.array([0.0, 1.0, 0.0, 0.0])
        states, impulses = fly(plant(friction=[1e3, 0.05, 1e3, 1e3]), state, wrench, 50)
        assert (abs(states[-1, 18]) > 1e-4) == moves
        if not moves:
            np.testing.assert_allclose(impulses[:, 1], -torque * STEP, rtol=1e-6)


def test_robot_with_all_brakes_engaged_is_one_rigid_body():
    """Base rates against Euler's equations of the composite body, by `scipy.integrate` with a tight tolerance."""
    from scipy.integrate import solve_ivp
    state = tumbling(np.zeros(4), (0.3, -0.2, 0.25))
    composite = np.zeros(50)
    composite_parameters(tree_at(ROBOT, state[13:17]), ROBOT.pi, composite)
    xx, xy, xz, yy, yz, zz, *h, m = composite[:10]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - (np.dot(h, h) * np.eye(3) - np.outer(h, h)) / m
    expected = solve_ivp(lambda _, w: np.linalg.solve(inertia, -np.cross(w, inertia @ w)), (0.0, 5.0), state[10:13],
                         rtol=1e-11, atol=1e-13).y[:, -1]
    states, _ = fly(plant(), state, np.zeros(10), 500, brakes=(1.0, 1.0, 1.0, 1.0))
    np.testing.assert_allclose(state[10:13], expected, atol=1e-5)  # [rad/s]
    assert np.abs(states[:, 13:17] - states[0, 13:17]).max() < 1e-4  # [rad]


def test_brake_slips_above_its_torque():
    state, wrench = initial_state(), np.zeros(10)
    wrench[9] = 10.5  # [N m] brake_torque is 10
    states, _ = fly(plant(), state, wrench, 20, brakes=(1.0, 1.0, 1.0, 1.0))
    assert states[-1, 20] > 0.1


def test_slowed_is_the_closed_form():
    law = uncompiled(slowed)
    assert law(0.3, 2.0, 0.1, 0.0) == pytest.approx(0.1)
    assert law(-0.3, 2.0, 0.1, 0.0) == pytest.approx(-0.1)
    assert law(0.1, 2.0, 0.1, 5.0) == 0.0
    assert law(-0.3, 2.0, 0.0, 1.0) == pytest.approx(-0.1)  # w+ (1 + m c h) = w


class Play(NamedTuple):
    backlash: np.ndarray
    drive_rate: float


def test_drive_crosses_its_play_before_it_pushes():
    """From one flank to the other: backlash / (drive_rate - rate of the joint), without torque on the way."""
    p, play, passed = Play(np.array([0.05]), 0.5), -0.025, []
    for _ in range(30):
        play, torque = meshed(p, 0, 0.2, 0.1, play, STEP)
        passed.append(torque)
    crossing = 0.05 / (0.5 - 0.1)  # [s]
    assert passed.count(0.0) == pytest.approx(crossing / STEP, abs=1.0) and passed[-1] == 0.2
    play, torque = meshed(p, 0, -0.2, 0.1, play, STEP)
    assert torque == 0.0 and play == pytest.approx(0.025 + STEP * (-0.5 - 0.1))


def test_joint_that_runs_ahead_of_its_drive_feels_no_torque():
    p, play = Play(np.array([0.05]), 0.5), 0.025
    for _ in range(3):
        play, torque = meshed(p, 0, 0.2, 0.6, play, STEP)
    assert torque == 0.0 and play < 0.025


def test_a_joint_that_stops_shakes_the_base():
    """The base's rates jump; momenta are kept within the error of one step of order four."""
    state = tumbling([0.0, 0.0, 0.0, 0.5], (0.0, 0.0, 0.0))
    before, _ = balances(state)
    fly(plant(seized=[0.0, 0.0, 0.0, 1e3]), state, np.zeros(10), 1)
    assert np.linalg.norm(state[10:13]) > 1e-3  # [rad/s]
    np.testing.assert_allclose(balances(state)[0], before, atol=1e-7)
