"""Dense algebra against NumPy; Runge-Kutta of fourth order: its order, and the forms of a state."""

import math
import typing

import numpy as np
import pytest

from flight_math import Quaternion, Vec3, kernel, plain, quaternion, rk4, rk4_array, rk4_between, stack_array, vec3
from flight_math.dense import cholesky, cholesky_solve, copy, symmetric_eigen
from tests.flight_math.value_cases import bits


def definite(size, seed, spread=1.0):
    """A symmetric positive definite matrix."""
    half = np.random.default_rng(seed).normal(size=(size, size)) * spread ** np.arange(size)
    return half @ half.T + 1e-3 * np.eye(size)


@pytest.mark.parametrize("size", [1, 2, 5, 12])
def test_cholesky_is_that_of_numpy(size):
    matrix, right = definite(size, size), np.arange(1.0, size + 1.0)
    factor = np.full((size + 1, size + 2), 7.0)
    factor[:size, :size] = matrix
    smallest = cholesky(factor, size)
    lower = np.linalg.cholesky(matrix)
    np.testing.assert_allclose(np.tril(factor[:size, :size]), lower, rtol=1e-9, atol=1e-12)
    assert smallest == pytest.approx(np.min(np.diag(lower) ** 2), rel=1e-9)
    cholesky_solve(factor, size, right)
    np.testing.assert_allclose(matrix @ right, np.arange(1.0, size + 1.0), rtol=1e-9, atol=1e-9)
    assert (factor[size] == 7.0).all() and (factor[:, size:] == 7.0).all()


def test_copy_of_an_array_of_any_layout():
    target = np.zeros((4, 2))
    copy(np.arange(4.0), target[:, 1])
    np.testing.assert_array_equal(target, [[0, 0], [0, 1], [0, 2], [0, 3]])


def test_cholesky_tells_what_is_not_definite():
    assert cholesky(np.array([[1.0, 2.0], [2.0, 1.0]]), 2) == -3.0


@pytest.mark.parametrize("size, spread", [(1, 1.0), (3, 1.0), (4, 0.01), (9, 0.3)])
def test_jacobi_finds_the_eigenvalues_of_numpy(size, spread):
    matrix = definite(size, size + 40, spread)
    work, vectors = matrix.copy(), np.zeros((size, size))
    symmetric_eigen(work, vectors, size)
    order = np.argsort(np.diag(work))
    np.testing.assert_allclose(np.diag(work)[order], np.linalg.eigvalsh(matrix), rtol=1e-12, atol=1e-15 * np.abs(matrix).max())
    np.testing.assert_allclose(vectors @ vectors.T, np.eye(size), atol=1e-14)
    np.testing.assert_allclose(vectors.T @ np.diag(np.diag(work)) @ vectors, matrix, rtol=1e-12, atol=1e-13)


@kernel
def with_work_on_the_stack(matrix):
    work = stack_array(3, 3)
    for i in range(3):
        work[i] = vec3(matrix[i])
    return cholesky(work, 3)


def test_dense_algebra_takes_arrays_of_the_stack():
    matrix = definite(3, 1)
    assert with_work_on_the_stack(matrix) == cholesky(matrix.copy(), 3)


# -- Runge-Kutta -----------------------------------------------------------------------------------------------------------
class Motion(typing.NamedTuple):
    place: Vec3
    turn: Quaternion
    mass: float


@kernel
def motion_rate(rate, t, state):
    """Harmonic motion, a turn about z at 2 rad/s, mass that decays: all with known solutions."""
    return Motion(Vec3(-rate * state.place.y, rate * state.place.x, math.cos(t)),
                  0.5 * state.turn * quaternion(Vec3(0.0, 0.0, 2.0), 0.0), -state.mass)


@kernel
def fly(steps):
    state, h = Motion(Vec3(1.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0), 1.0), 1.0 / steps
    for number in range(steps):
        state = rk4(motion_rate, 1.0, number * h, state, h)
    return state


def error(steps):
    """Largest difference from the solution at t = 1."""
    place, turn, mass = fly(steps)
    exact = [math.cos(1.0), math.sin(1.0), math.sin(1.0), 0.0, 0.0, math.sin(1.0), math.cos(1.0), math.exp(-1.0)]
    return np.abs(np.array([*place, *turn, mass]) - exact).max()


def test_the_order_is_four():
    ratios = [error(n) / error(2 * n) for n in (8, 16, 32)]
    assert all(14.5 < ratio < 17.5 for ratio in ratios), ratios


def test_compiled_and_plain_states_are_equal():
    found, expected = fly(8), plain(fly)(8)
    assert bits(tuple(found)) == bits(tuple(expected))


@kernel
def pushed(given, push, state):
    """Of a pair: velocity, push."""
    place, velocity = state
    return velocity, push - given * place


@kernel
def pushed_at(given, t, state):
    return pushed(given, Vec3(t, 0.0, t * t), state)


@kernel
def both_ways(h):
    state = (Vec3(1.0, 2.0, 3.0), Vec3(0.0, 0.0, 1.0))
    by_time = rk4(pushed_at, 2.0, 0.5, state, h)
    begin, middle, end = 0.5, 0.5 + 0.5 * h, 0.5 + h
    samples = (Vec3(begin, 0.0, begin * begin), Vec3(middle, 0.0, middle * middle), Vec3(end, 0.0, end * end))
    return by_time, rk4_between(pushed, 2.0, samples, state, h)


def test_known_samples_give_the_same_step():
    by_time, by_samples = both_ways(0.1)
    assert repr(by_time) == repr(by_samples)


@kernel
def decay_rates(given, t, state, rate):
    for i in range(state.shape[0]):
        rate[i] = -given * (i + 1) * t * state[i]


@kernel
def decay(state, steps):
    for number in range(steps):
        rk4_array(decay_rates, 2.0, number / steps, state, 1.0 / steps)


def test_states_that_are_arrays():
    errors = []
    for steps in (16, 32):
        state = np.ones(3)
        decay(state, steps)
        errors.append(np.abs(state - np.exp(-np.arange(1.0, 4.0))).max())
    assert 14.0 < errors[0] / errors[1] < 20.0


@kernel
def one_number(steps):
    x = 1.0
    for number in range(steps):
        x = rk4(growth, 1.0, number / steps, x, 1.0 / steps)
    return x


@kernel
def growth(given, t, x):
    return given * x


def test_a_state_may_be_a_number():
    assert one_number(64) == pytest.approx(math.e, rel=1e-8)
    assert one_number(1) == 1.0 + (1.0 / 6.0) * (1.0 + 2.0 * 1.5 + 2.0 * 1.75 + 2.75)
