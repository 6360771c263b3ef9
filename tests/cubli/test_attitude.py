"""Attitude kinematics against the printed matrices (symbolically) and SciPy's rotations."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cubli_ros import attitude
from flight_graph.vectors import cross, matrix_vector, transpose_vector

angle = st.floats(-1.4, 1.4)
wide = st.floats(-3.0, 3.0)
ANGLES = [np.array(v) for v in [(0.0, 0.0, 0.0), (-0.3, 0.3, 0.3), (2.5, -1.2, -2.9), (0.1, 1.5, 0.7)]]


@pytest.mark.parametrize("angles", ANGLES)
def test_rotation_matrix_is_the_cardan_sequence(angles):
    """A is the passive 1-2-3 sequence: the transpose of SciPy's intrinsic XYZ rotation."""
    out = np.empty((3, 3))
    attitude.rotation_matrix(angles, out)
    np.testing.assert_allclose(out, Rotation.from_euler("XYZ", angles).as_matrix().T, atol=1e-15)
    vector = np.array([0.3, -1.2, 2.0])
    np.testing.assert_allclose(attitude.to_body(angles, *vector), out @ vector, atol=1e-15)


def test_rate_matrix_follows_from_the_rotation_matrix():
    """Eq. (2) from (1): A' = -[omega x] A, solved symbolically for the angle rates."""
    phi, theta, psi = sympy.symbols("phi theta psi")
    rates = sympy.symbols("p q r")

    def turn(axis, a):
        c, s = sympy.cos(a), sympy.sin(a)
        rows = {
            1: [[1, 0, 0], [0, c, s], [0, -s, c]],
            2: [[c, 0, -s], [0, 1, 0], [s, 0, c]],
            3: [[c, s, 0], [-s, c, 0], [0, 0, 1]],
        }
        return sympy.Matrix(rows[axis])

    a = turn(3, psi) * turn(2, theta) * turn(1, phi)
    spin = -sum((a.diff(x) * rate for x, rate in zip((phi, theta, psi), rates, strict=True)), sympy.zeros(3)) * a.T
    omega = sympy.Matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
    values = {phi: 0.4, theta: -0.8, psi: 1.1}
    inverse = np.array(omega.jacobian(sympy.Matrix(rates)).subs(values), dtype=float)
    angles = np.array([0.4, -0.8, 1.1])
    np.testing.assert_allclose(attitude.body_rates(angles, 1.0, 2.0, 3.0), inverse @ [1, 2, 3], atol=1e-14)
    rates = attitude.cardan_rates(angles, 1.0, 2.0, 3.0)
    np.testing.assert_allclose(rates, np.linalg.solve(inverse, [1, 2, 3]), atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(wide, angle, wide)
def test_angles_and_quaternions(phi, theta, psi):
    angles = np.array([phi, theta, psi])
    rotation = Rotation.from_euler("XYZ", angles)
    q = np.empty(4)
    attitude.quaternion_from_cardan(angles, q)
    expected = rotation.as_quat()
    np.testing.assert_allclose(q * np.sign(q @ expected), expected, atol=1e-14)
    back = np.empty(3)
    attitude.cardan_from_quaternion(q, back)
    np.testing.assert_allclose(back, angles, atol=1e-9)
    vector = np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(attitude.quaternion_to_body(q, *vector), rotation.inv().apply(vector), atol=1e-13)
    np.testing.assert_allclose(attitude.quaternion_to_balance(q, *vector), rotation.apply(vector), atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[wide] * 6))
def test_quaternion_algebra(values):
    a, b = Rotation.from_rotvec(values[:3]), Rotation.from_rotvec(values[3:])
    out = np.empty(4)
    attitude.quaternion_multiply(a.as_quat(), b.as_quat(), out)
    np.testing.assert_allclose(Rotation.from_quat(out).as_matrix(), (a * b).as_matrix(), atol=1e-13)
    attitude.quaternion_difference(a.as_quat(), b.as_quat(), out)
    np.testing.assert_allclose(Rotation.from_quat(out).as_matrix(), (a.inv() * b).as_matrix(), atol=1e-13)
    vector = np.empty(3)
    attitude.rotation_vector_from_quaternion(out, vector)
    assert np.linalg.norm(vector) <= math.pi + 1e-12
    np.testing.assert_allclose(Rotation.from_rotvec(vector).as_matrix(), (a.inv() * b).as_matrix(), atol=1e-12)


@pytest.mark.parametrize("scale", [0.0, 1e-12, 1e-9, 1e-5, 9e-5, 1.1e-4, 0.1, 3.0])
def test_rotation_vectors_of_every_size(scale):
    vector = scale * np.array([0.6, -0.8, 0.0])
    q = np.empty(4)
    attitude.quaternion_from_rotation_vector(*vector, q)
    np.testing.assert_allclose(q, Rotation.from_rotvec(vector).as_quat(), rtol=1e-14, atol=1e-30)
    back = np.empty(3)
    for sign in (1.0, -1.0):
        attitude.rotation_vector_from_quaternion(sign * q, back)
        np.testing.assert_allclose(back, vector, rtol=1e-13, atol=1e-30)


def test_normalising_and_inverting():
    q = np.array([0.0, 3.0, 0.0, 4.0])
    attitude.quaternion_normalise(q)
    np.testing.assert_allclose(q, [0.0, 0.6, 0.0, 0.8])
    q = np.zeros(4)
    attitude.quaternion_normalise(q)
    np.testing.assert_array_equal(q, [0.0, 0.0, 0.0, 1.0])
    matrix = np.array([[4.0, 1.0, -0.5], [0.8, 3.0, 0.2], [-0.4, 0.1, 5.0]])
    out = np.empty((3, 3))
    attitude.invert_3x3(matrix, out)
    np.testing.assert_allclose(out, np.linalg.inv(matrix), rtol=1e-13)
    np.testing.assert_allclose(matrix_vector(matrix, 1.0, 2.0, 3.0), matrix @ [1.0, 2.0, 3.0], rtol=1e-15)
    np.testing.assert_allclose(transpose_vector(matrix, 1.0, 2.0, 3.0), matrix.T @ [1.0, 2.0, 3.0], rtol=1e-15)
    np.testing.assert_array_equal(cross(1.0, 2.0, 3.0, -4.0, 0.5, 6.0), np.cross([1.0, 2.0, 3.0], [-4.0, 0.5, 6.0]))


def test_gravity_torque_is_the_printed_cross_product():
    angles = np.array([-0.3, 0.3, 0.3])
    gravity = np.array([-0.1, -0.3, 0.2])
    matrix = Rotation.from_euler("XYZ", angles).as_matrix().T
    for sign in (1.0, -1.0):
        out = np.empty(3)
        attitude.gravity_torque(angles, gravity, sign, 2.0, 0.2, out)
        np.testing.assert_allclose(out, np.cross(np.full(3, sign * 0.1), matrix @ (2.0 * gravity)), atol=1e-16)
