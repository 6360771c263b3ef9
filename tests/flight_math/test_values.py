"""Operators and functions of values: the same bits compiled and in plain Python, and right by NumPy and SciPy."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import flight_math
from flight_math import (
    DualQuaternion,
    DualVector,
    Mat,
    Mat3,
    Quaternion,
    Vec,
    Vec3,
    clip,
    conjugate,
    cross,
    kernel,
    plain,
    quaternion,
    rotate,
    rotate_back,
    rotation_matrix,
    solve,
    where,
)
from tests.flight_math.value_cases import CASES, bits, vector

NUMBERS = st.lists(st.floats(width=64) | st.sampled_from([0.0, -0.0, 1.0, -1.0, 5e-324, 1e308]), min_size=20, max_size=20)
FINITE = st.lists(st.floats(-10.0, 10.0), min_size=20, max_size=20)


def arguments(kinds, numbers):
    """Arguments of a case from a list of numbers."""
    numbers = list(numbers)
    made = []
    for kind in kinds:
        if kind is int:
            made.append(len(made) % 3 - 1)
        elif kind is float:
            made.append(numbers.pop())
        else:
            made.append(vector(kind, numbers))
            del numbers[:kind.count]
    return made


@pytest.mark.parametrize("name", CASES)
def test_compiled_and_plain_give_equal_bits(name):
    function, kinds = CASES[name]

    @settings(max_examples=150, deadline=None, derandomize=True)
    @given(NUMBERS)
    def check(numbers):
        given_ = arguments(kinds, numbers)
        for compiled, plain_one in zip(function(*given_), plain(function)(*given_)):
            assert bits(compiled) == bits(plain_one), (given_, compiled, plain_one)
    check()


# -- against NumPy and SciPy, in plain Python (the bits above are the same) -----------------------------------------------
def near(value, expected, scale=1.0):
    """Equal within a few roundings of numbers of this size."""
    np.testing.assert_allclose(np.asarray(value), expected, rtol=1e-14, atol=4e-15 * scale)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(FINITE)
def test_arithmetic_is_that_of_numpy(numbers):
    a, b, s = vector(Vec3, numbers), vector(Vec3, numbers[3:]), numbers[6]
    x, y = np.array(numbers[:3]), np.array(numbers[3:6])
    with np.errstate(all="ignore"):
        for found, expected in ((a + b, x + y), (a - b, x - y), (a * b, x * y), (a / b, x / y), (a + s, x + s), (s - a, s - x),
                                (s / a, s / x), (-a, -x), (abs(a), np.abs(x)), (clip(a, -1.0, b), np.where(
                                    x > y, y, np.where(x < -1.0, -1.0, x))), (where(a < b, a, s), np.where(x < y, x, s))):
            np.testing.assert_array_equal(np.asarray(found), expected)
    np.testing.assert_array_equal((a < b).parts(), x < y)
    near(a @ b, x @ y, 300.0)
    near(cross(a, b), np.cross(x, y), 300.0)
    near(flight_math.norm(a), np.linalg.norm(x), 20.0)
    near(flight_math.total(a), x.sum(), 30.0)
    assert flight_math.largest(a) == x.max() and flight_math.smallest(a) == x.min()
    np.testing.assert_array_equal(np.asarray(flight_math.sign(a)), np.sign(x))
    np.testing.assert_array_equal(np.asarray(flight_math.maximum(a, b)), np.maximum(x, y))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(FINITE)
def test_matrices_are_those_of_numpy(numbers):
    m, a = Mat3(*numbers[:9]), Vec3(*numbers[9:12])
    big, small = Mat(2, 4)(*numbers[:8]), Mat(4, 3)(*numbers[8:20])
    x, v = np.array(numbers[:9]).reshape(3, 3), np.array(numbers[9:12])
    near(m @ a, x @ v, 300.0)
    near(m @ m, x @ x, 300.0)
    near(big @ small, np.array(numbers[:8]).reshape(2, 4) @ np.array(numbers[8:20]).reshape(4, 3), 400.0)
    near(big @ Vec(4)(*numbers[:4]), np.array(numbers[:8]).reshape(2, 4) @ np.array(numbers[:4]), 400.0)
    np.testing.assert_array_equal(np.asarray(flight_math.transpose(small)), np.array(numbers[8:20]).reshape(4, 3).T)
    np.testing.assert_array_equal(np.asarray(flight_math.outer(a, Vec(2)(1.0, 2.0))), np.outer(v, [1.0, 2.0]))
    near(flight_math.skew(a) @ Vec3(*numbers[:3]), np.cross(v, numbers[:3]), 300.0)
    np.testing.assert_array_equal(np.asarray(flight_math.row(m, 1)), x[1])
    np.testing.assert_array_equal(np.asarray(flight_math.column(m, -1)), x[:, -1])
    np.testing.assert_array_equal(np.asarray(flight_math.diagonal(flight_math.diagonal_of(m))), np.diag(np.diag(x)))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(FINITE)
def test_symmetric_systems_are_solved(numbers):
    half = np.array(numbers[:16]).reshape(4, 4)
    matrix, right = half @ half.T + np.eye(4), np.array(numbers[16:20])
    found = solve(Mat(4, 4)(matrix), Vec(4)(right))
    near(matrix @ np.asarray(found), right, 1e4)
    near(found, np.linalg.solve(matrix, right), np.linalg.cond(matrix) * 10.0)


def unit(numbers):
    """A unit quaternion, or None."""
    length = np.linalg.norm(numbers[:4])
    return Quaternion(*(np.array(numbers[:4]) / length)) if length > 1e-3 else Quaternion(0.0, 0.0, 0.0, 1.0)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(FINITE)
def test_quaternions_are_those_of_scipy(numbers):
    q, r, v = unit(numbers), unit(numbers[4:]), Vec3(*numbers[8:11])
    p, o = Rotation.from_quat(np.asarray(q)), Rotation.from_quat(np.asarray(r))
    near(rotate(q, v), p.apply(np.asarray(v)), 30.0)
    near(rotate_back(q, v), p.inv().apply(np.asarray(v)), 30.0)
    near(rotation_matrix(q), p.as_matrix())
    near(rotation_matrix(q * r), (p * o).as_matrix(), 2.0)
    near(conjugate(q) * q, [0.0, 0.0, 0.0, 1.0])
    near(flight_math.normalised(3.0 * q), np.asarray(q))


def pose(q, r):
    """q + eps (1/2) r q: attitude q and position r."""
    return DualQuaternion(q, 0.5 * quaternion(r, 0.0) * q)


def homogeneous(q, r):
    """The same as a matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_quat(np.asarray(q)).as_matrix(), np.asarray(r)
    return matrix


@settings(max_examples=40, deadline=None, derandomize=True)
@given(FINITE)
def test_dual_quaternions_compose_poses(numbers):
    q, r, a, b = unit(numbers), unit(numbers[4:]), Vec3(*numbers[8:11]), Vec3(*numbers[11:14])
    both = pose(q, a) * pose(r, b)
    position = 2.0 * both.dual * conjugate(both.real)
    expected = homogeneous(q, a) @ homogeneous(r, b)
    near(rotation_matrix(both.real), expected[:3, :3], 2.0)
    near(position, [*expected[:3, 3], 0.0], 100.0)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(FINITE)
def test_cross_of_dual_vectors_is_that_of_twists(numbers):
    a, b = DualVector(Vec3(*numbers[:3]), Vec3(*numbers[3:6])), DualVector(Vec3(*numbers[6:9]), Vec3(*numbers[9:12]))
    def wedge(v):
        return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    adjoint = np.block([[wedge(numbers[:3]), np.zeros((3, 3))], [wedge(numbers[3:6]), wedge(numbers[:3])]])
    near(cross(a, b), adjoint @ numbers[6:12], 600.0)


# -- elementary functions of vectors ---------------------------------------------------------------------------------------
@kernel
def lifted(v, s):
    a, b = flight_math.sincos(v)
    return flight_math.exp(v), a, b, flight_math.atan2(v, s), flight_math.tanh(v), flight_math.exp(s)


def test_elementary_functions_go_component_by_component():
    """Equal components, signed zeros beside each other: each gets what the number alone gets."""
    exp, sincos = flight_math.elementary.exp, flight_math.elementary.sincos
    for v in (Vec3(0.3, 0.3, 0.3), Vec3(0.0, -0.0, 0.0), Vec3(1.0, 2.0, 2.0), Vec3(float("nan"), 1.0, float("inf"))):
        found = lifted(v, -0.0)
        assert bits(found) == bits(plain(lifted)(v, -0.0))
        assert bits(found[0]) == bits(Vec3(*[exp(float(part)) for part in v]))
        assert bits(found[1]) == bits(Vec3(*[sincos(float(part))[0] for part in v]))


# -- objects ---------------------------------------------------------------------------------------------------------------
def test_values_are_copied_pickled_and_hashed():
    for value in (Vec3(1.0, 2.0, 3.0), Vec(7)(*range(7)), Mat(2, 3)(*range(6)), Quaternion(0.0, 0.0, 0.0, 1.0),
                  DualVector(Vec3(1.0, 2.0, 3.0), Vec3(4.0, 5.0, 6.0)), Vec3(1.0, 2.0, 3.0) < 2.0):
        for again in (copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert type(again) is type(value) and again.parts() == value.parts() and hash(again) == hash(value)
    assert pickle.loads(pickle.dumps(Vec(11))) is Vec(11) and Vec(3) is Vec3 and Mat(3, 3) is Mat3


def test_numbers_of_other_kinds_stay_what_they_are():
    """In plain Python: symbols of sympy, complex numbers."""
    sympy = pytest.importorskip("sympy")
    x, y, z = sympy.symbols("x y z")
    assert cross(Vec3(x, y, z), Vec3(z, y, x)).parts() == (x * y - y * z, z * z - x * x, x * y - y * z)
    assert (Quaternion(x, 0, 0, y) * Quaternion(x, 0, 0, y)).w == y * y - x * x
    assert (Vec3(1j, 0, 0) * 2.0).x == 2j


def test_numpy_numbers_on_the_left_and_arrays():
    v = np.float64(2.0) * Vec3(1.0, 2.0, 3.0)
    assert type(v) is Vec3 and v.parts() == (2.0, 4.0, 6.0)
    assert np.asarray(Mat3(*range(9))).tolist() == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]
    assert Vec3(np.arange(3.0)).parts() == (0.0, 1.0, 2.0) and flight_math.mat3(np.arange(9.0))[2, 0] == 6.0
