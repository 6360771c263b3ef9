"""Rigid-body kernels against Pinocchio: the paper's robot in 500 states, and 20 random trees of 1 to 10 joints."""

import numpy as np
import pytest

from sim_nodes.spacerobot.dynamics import momentum_and_energy
from tests.spacerobot.spacerobot_cases import (
    PinocchioTwin,
    Signals,
    forward,
    inertia_matrices,
    inverse,
    plant_of,
    random_robot,
    regress,
    relative,
)  # fmt: skip
from tests.spacerobot.spacerobot_loop import ROBOT, initial_state

pin = pytest.importorskip("pinocchio", reason="Pinocchio, the reference of this test, is not here: make develop")

TOLERANCE = 1e-12  # [-] relative
TREES = [ROBOT] + [random_robot(np.random.default_rng(k), 1 + k % 10) for k in range(20)]
CASES = [(tree, 500 if k == 0 else 10) for k, tree in enumerate(TREES)]
NAMES = [f"{k}-{tree.joints}joints" for k, tree in enumerate(TREES)]


def actual(s):
    return s.w, s.w, s.al, s.a, s.thd, s.thd, s.thdd


@pytest.mark.parametrize("robot, states", CASES, ids=NAMES)
def test_regressor_and_inverse_dynamics(robot, states):
    twin = PinocchioTwin(pin, robot)
    rng = np.random.default_rng(1)
    for _ in range(states):
        s = Signals(rng, robot)
        q, v, a = twin.state(s)
        expected = pin.computeJointTorqueRegressor(twin.model, twin.data, q, v, a)[np.ix_(twin.rows, twin.columns)]
        assert relative(regress(robot, s.theta, *actual(s)), expected) < TOLERANCE
        expected = pin.rnea(twin.model, twin.data, q, v, a)[twin.rows]
        assert relative(inverse(robot, s.theta, *actual(s)), expected) < TOLERANCE


@pytest.mark.parametrize("robot, states", CASES, ids=NAMES)
def test_mass_matrix_and_forward_dynamics(robot, states):
    twin = PinocchioTwin(pin, robot)
    rng = np.random.default_rng(2)
    for _ in range(states):
        s = Signals(rng, robot)
        q, v, _ = twin.state(s)
        expected = pin.crba(twin.model, twin.data, q)
        expected = (np.triu(expected) + np.triu(expected, 1).T)[np.ix_(twin.rows, twin.rows)]
        h, reduced = inertia_matrices(robot, s.theta)
        assert relative(h, expected) < TOLERANCE
        eliminated = expected[3:, 3:] - expected[3:, :3] @ np.linalg.solve(expected[:3, :3], expected[:3, 3:])
        assert relative(reduced, eliminated) < TOLERANCE
        wrench = rng.standard_normal(6 + robot.joints)
        got = forward(robot, s.theta, s.w, s.thd, wrench)
        expected = pin.aba(twin.model, twin.data, q, v, twin.back(wrench))[twin.rows]
        expected[:3] += np.cross(s.w, s.v)
        assert relative(got, expected) < TOLERANCE


@pytest.mark.parametrize("robot", TREES, ids=NAMES)
def test_momentum_and_energy(robot):
    twin = PinocchioTwin(pin, robot)
    model, data = twin.model, twin.data
    rng = np.random.default_rng(3)
    n = robot.joints
    s = Signals(rng, robot)
    q, v, _ = twin.state(s)
    state = np.zeros(20 + 2 * n)
    state[:3] = rng.standard_normal(3)
    turn = pin.Quaternion(*(rng.standard_normal(4))).normalized()
    state[3:6] = turn.toRotationMatrix() @ s.v
    state[6:10] = turn.x, turn.y, turn.z, turn.w
    state[10:13], state[13 : 13 + n], state[13 + n : 13 + 2 * n] = s.w, s.theta, s.thd
    q[:3], q[3:7] = state[:3], turn.coeffs()
    linear, angular, energy = momentum_and_energy(plant_of(robot), robot.pi, state)
    linear, angular = np.array(linear.parts()), np.array(angular.parts())
    pin.computeCentroidalMomentum(model, data, q, v)
    assert relative(linear, data.hg.linear) < TOLERANCE
    assert relative(angular, data.hg.angular + np.cross(data.com[0], data.hg.linear)) < TOLERANCE
    assert abs(energy / pin.computeKineticEnergy(model, data, q, v) - 1.0) < TOLERANCE


def test_initial_state_puts_the_center_of_mass_at_the_origin():
    twin = PinocchioTwin(pin, ROBOT)
    state = initial_state()
    q = np.concatenate([state[:3], [0, 0, 0, 1.0], state[13:17]])
    assert np.abs(pin.centerOfMass(twin.model, twin.data, q)).max() < 1e-15  # [m]
