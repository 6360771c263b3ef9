"""The truth: balances of momentum and energy with wheels, stops and outer forces; actuators against closed forms."""

import math

import numpy as np
import pytest

from sim_nodes.spacerobot_actuators import limit_torque, wheel_momentum, wheel_step
from sim_nodes.spacerobot_dynamics import momentum_and_energy, state_rate, state_size, step, stop_torque, work_size
from spacerobot_ros.kinematics import rotation_matrix
from spacerobot_ros.reaction_wheels import effective_base_torque, wheel_demand
from tests.spacerobot.spacerobot_cases import random_robot
from tests.spacerobot.spacerobot_loop import ROBOT, initial_state

FREE = (np.full(4, -np.inf), np.full(4, np.inf), 0.0, 0.0)


def advance(robot, state, wrench, wheel_rate, stops, period, steps):
    work = np.zeros(work_size(robot.joints))
    for _ in range(steps):
        step(
            robot.parent, robot.fixed_rotation, robot.offset, robot.axis, robot.pi, state, wrench, wheel_rate, *stops,
            period, work,
        )  # fmt: skip


def balances(robot, state):
    """Linear momentum, angular momentum with the wheels', kinetic energy."""
    linear, angular, attitude = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    energy = momentum_and_energy(
        robot.parent, robot.fixed_rotation, robot.offset, robot.axis, robot.pi, state, linear, angular,
        np.zeros(work_size(robot.joints)),
    )  # fmt: skip
    rotation_matrix(state[6:10], attitude)
    return linear, angular + attitude @ state[-3:], energy


@pytest.mark.parametrize("joints", [0, 1, 4, 9])
def test_momentum_and_energy_under_all_forces(joints):
    """Outer force and moment, joint torques and accelerating wheels on a random tree with an initial tumble."""
    rng = np.random.default_rng(joints)
    robot = random_robot(rng, joints)
    state = np.zeros(state_size(joints))
    state[6] = 1.0
    state[3:6], state[10:13], state[13:] = rng.standard_normal(3), 0.3 * rng.standard_normal(3), 0.0
    state[-3:] = 0.5 * rng.standard_normal(3)
    wrench, wheel_rate = 0.05 * rng.standard_normal(6 + joints), 0.02 * rng.standard_normal(3)
    stops = (np.full(joints, -np.inf), np.full(joints, np.inf), 0.0, 0.0)
    before = balances(robot, state)
    start = state.copy()
    advance(robot, state, wrench, wheel_rate, stops, 1e-3, 1000)
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
        advance(ROBOT, moved, wrench, np.zeros(3), FREE, period, round(5.0 / period))
        after = balances(ROBOT, moved)
        errors.append(max(np.abs(after[0] - before[0]).max(), np.abs(after[1] - before[1]).max()))
    assert errors[0] > 12.0 * errors[1]  # what is left is the integrator's, of order four
    assert errors[2] < 1e-10


def test_a_rigid_body_turns_as_eulers_equations_say():
    """No joints: the torque-free top of `scipy.integrate` with a tight tolerance."""
    from scipy.integrate import solve_ivp

    robot = random_robot(np.random.default_rng(3), 0)
    state = np.zeros(state_size(0))
    state[6], state[10:13] = 1.0, (0.4, -0.2, 0.3)
    xx, xy, xz, yy, yz, zz, *h, m = robot.pi
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - (np.dot(h, h) * np.eye(3) - np.outer(h, h)) / m
    expected = solve_ivp(
        lambda _, w: np.linalg.solve(inertia, -np.cross(w, inertia @ w)), (0, 20), state[10:13], rtol=1e-11, atol=1e-13
    ).y[:, -1]
    advance(robot, state, np.zeros(6), np.zeros(3), (np.zeros(0), np.zeros(0), 0.0, 0.0), 0.01, 2000)
    np.testing.assert_allclose(state[10:13], expected, atol=1e-7)


def test_stop_pushes_back_and_never_pulls():
    assert stop_torque(0.5, 9.0, -1.0, 1.0, 100.0, 5.0) == 0.0
    assert stop_torque(1.1, 0.2, -1.0, 1.0, 100.0, 5.0) == pytest.approx(-20.0)
    assert stop_torque(-1.1, -0.2, -1.0, 1.0, 100.0, 5.0) == pytest.approx(20.0)
    assert stop_torque(1.01, -9.0, -1.0, 1.0, 100.0, 5.0) == 0.0


def test_joint_rests_at_its_stop_and_the_energy_balances():
    state = initial_state()
    wrench = np.zeros(10)
    wrench[7] = 0.2  # [N m], joint 2 towards 180 deg
    stops = (ROBOT.lower, ROBOT.upper, 50.0, 5.0)
    advance(ROBOT, state, wrench, np.zeros(3), stops, 0.0005, 120000)
    assert state[14] == pytest.approx(np.pi + 0.2 / 50.0, abs=2e-3)
    linear, _, energy = balances(ROBOT, state)
    assert np.linalg.norm(linear) < 1e-8
    assert energy == pytest.approx(state[21], abs=1e-8)


def wheels(demand, momentum=(0.0, 0.0, 0.0), lag=0.0, friction=0.0, quantum=0.0, steps=1, period=0.01):
    drive, spin, rate = np.zeros(3), np.array(momentum, float), np.zeros(3)
    codes = []
    for _ in range(steps):
        codes.append(
            wheel_step(np.array(demand), np.eye(3), drive, spin, 0.05, 0.5, lag, friction, quantum, period, rate)
        )
    return drive, spin, rate, codes


def test_wheel_takes_the_momentum_it_gives():
    _, spin, rate, codes = wheels([0.01, -0.02, 0.03], steps=10)
    np.testing.assert_allclose(rate, [-0.01, 0.02, -0.03])
    np.testing.assert_allclose(spin, 0.1 * rate)
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


def test_wheel_torque_is_quantised():
    drive, *_ = wheels([0.0114, -0.0116, 0.0004], quantum=1e-3)
    np.testing.assert_allclose(drive, [-0.011, 0.012, 0.0], atol=1e-15)


def test_wheel_momentum_in_base_axes():
    axes = np.array([[0, 1.0, 0], [0, 0, 1.0], [1.0, 0, 0]])
    total = np.zeros(3)
    wheel_momentum(axes, np.array([1.0, 2.0, 3.0]), total)
    np.testing.assert_array_equal(total, [3.0, 1.0, 2.0])


def test_wheel_torque_that_reaches_the_base():
    """The base turns under wheels as it does under an outer moment of the same effective torque."""
    state = initial_state()
    state[10:13], state[-3:] = (0.1, -0.2, 0.15), (0.3, 0.1, -0.2)
    pushed = state.copy()
    pushed[-3:] = 0.0
    demand, torque = np.zeros(3), np.zeros(3)
    wanted = np.array([0.01, 0.02, -0.03])
    wheel_demand(wanted, state[10:13], state[-3:], demand)
    effective_base_torque(-demand, state[10:13], state[-3:], torque)
    np.testing.assert_allclose(torque, wanted, atol=1e-17)
    rates = []
    moment = np.concatenate([np.zeros(3), wanted, np.zeros(4)])
    for start, wrench, wheel_rate in ((state, np.zeros(10), -demand), (pushed, moment, np.zeros(3))):
        rate = np.zeros_like(start)
        state_rate(
            ROBOT.parent, ROBOT.fixed_rotation, ROBOT.offset, ROBOT.axis, ROBOT.pi, start, wrench, wheel_rate, *FREE,
            rate, np.zeros(work_size(4)),
        )  # fmt: skip
        rates.append(rate[:21])
    np.testing.assert_allclose(rates[0], rates[1], atol=1e-16)


def test_torque_limit_counts_and_a_nan_is_no_torque():
    torque = np.zeros(4)
    assert limit_torque(np.array([0.1, -2.0, np.nan, np.inf]), np.ones(4), torque) == 3
    np.testing.assert_array_equal(torque, [0.1, -1.0, 0.0, 1.0])
