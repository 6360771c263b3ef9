"""Attitude kinematics against the printed matrices (symbolically) and SciPy's rotations."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cubli_ros import attitude
from cubli_ros.appc_controller import RoverModel
from flight_math import (
    Mat3,
    Quaternion,
    Vec3,
    conjugate,
    inverse,
    quaternion_from_rotation_vector,
    quaternion_rates,
    rotate,
    rotate_back,
    rotation_vector,
    sincos,
)
from tests.cubli.records import made

angle = st.floats(-1.4, 1.4)
wide = st.floats(-3.0, 3.0)
ANGLES = [np.array(v) for v in [(0.0, 0.0, 0.0), (-0.3, 0.3, 0.3), (2.5, -1.2, -2.9), (0.1, 1.5, 0.7)]]


@pytest.mark.parametrize("angles", ANGLES)
def test_rotation_matrix_is_the_cardan_sequence(angles):
    """A is the passive 1-2-3 sequence: the transpose of SciPy's intrinsic XYZ rotation."""
    turn = sincos(Vec3(*angles))
    matrix = np.reshape(attitude.rotation_matrix(turn).parts(), (3, 3))
    np.testing.assert_allclose(matrix, Rotation.from_euler("XYZ", angles).as_matrix().T, atol=1e-15)
    vector = Vec3(0.3, -1.2, 2.0)
    np.testing.assert_allclose(attitude.to_body(turn, vector), matrix @ np.array(vector), atol=1e-15)


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
    printed = np.array(omega.jacobian(sympy.Matrix(rates)).subs(values), dtype=float)
    turn, v = sincos(Vec3(0.4, -0.8, 1.1)), Vec3(1.0, 2.0, 3.0)
    np.testing.assert_allclose(attitude.body_rates(turn, v), printed @ [1, 2, 3], atol=1e-14)
    np.testing.assert_allclose(attitude.cardan_rates(turn, v), np.linalg.solve(printed, [1, 2, 3]), atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(wide, angle, wide)
def test_angles_and_quaternions(phi, theta, psi):
    angles = np.array([phi, theta, psi])
    rotation = Rotation.from_euler("XYZ", angles)
    q = attitude.quaternion_from_cardan(Vec3(*angles))
    expected = rotation.as_quat()
    np.testing.assert_allclose(np.array(q) * np.sign(np.array(q) @ expected), expected, atol=1e-14)
    np.testing.assert_allclose(attitude.cardan_from_quaternion(q), angles, atol=1e-9)
    vector = Vec3(1.0, -2.0, 0.5)
    np.testing.assert_allclose(rotate_back(q, vector), rotation.inv().apply(vector), atol=1e-13)
    np.testing.assert_allclose(rotate(q, vector), rotation.apply(vector), atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[wide] * 6))
def test_quaternion_algebra(values):
    a, b = Rotation.from_rotvec(values[:3]), Rotation.from_rotvec(values[3:])
    q, r = Quaternion(*a.as_quat()), Quaternion(*b.as_quat())
    np.testing.assert_allclose(Rotation.from_quat(q * r).as_matrix(), (a * b).as_matrix(), atol=1e-13)
    difference = conjugate(q) * r
    np.testing.assert_allclose(Rotation.from_quat(difference).as_matrix(), (a.inv() * b).as_matrix(), atol=1e-13)
    vector = np.array(rotation_vector(difference))
    assert np.linalg.norm(vector) <= math.pi + 1e-12
    np.testing.assert_allclose(Rotation.from_rotvec(vector).as_matrix(), (a.inv() * b).as_matrix(), atol=1e-12)


@pytest.mark.parametrize("scale", [0.0, 1e-12, 1e-9, 1e-5, 9e-5, 1.1e-4, 0.1, 3.0])
def test_rotation_vectors_of_every_size(scale):
    vector = scale * Vec3(0.6, -0.8, 0.0)
    q = quaternion_from_rotation_vector(vector)
    np.testing.assert_allclose(q, Rotation.from_rotvec(vector).as_quat(), rtol=1e-14, atol=1e-30)
    for sign in (1.0, -1.0):
        np.testing.assert_allclose(rotation_vector(sign * q), vector, rtol=1e-13, atol=1e-30)


def test_inverse():
    matrix = np.array([[4.0, 1.0, -0.5], [0.8, 3.0, 0.2], [-0.4, 0.1, 5.0]])
    found = np.reshape(inverse(Mat3(*matrix.ravel())).parts(), (3, 3))
    np.testing.assert_allclose(found, np.linalg.inv(matrix), rtol=1e-13)


def test_gravity_torque_is_the_printed_cross_product():
    angles = Vec3(-0.3, 0.3, 0.3)
    gravity = Vec3(-0.1, -0.3, 0.2)
    matrix = Rotation.from_euler("XYZ", angles).as_matrix().T
    for sign in (1, -1):
        torque = attitude.gravity_torque(made(RoverModel, gravity_sign=sign), attitude.to_body(sincos(angles), gravity))
        np.testing.assert_allclose(torque, np.cross(np.full(3, sign * 0.1), matrix @ (2.0 * np.array(gravity))), atol=1e-16)


def test_level_gravity_points_against_the_diagonal():
    gravity = attitude.level_gravity(made(RoverModel, gravity=0.7))
    np.testing.assert_allclose(gravity, -0.7 / math.sqrt(3.0) * np.ones(3), rtol=1e-15)


@pytest.mark.parametrize("rate", [(0.3, -0.2, 0.5), (0.0, 0.0, 0.0)])
def test_quaternion_rates_are_the_slope_of_a_turn(rate):
    q, h = Rotation.from_rotvec([0.4, -0.2, 0.9]), 1e-6
    after, before = ((q * Rotation.from_rotvec(step * np.array(rate))).as_quat() for step in (h, -h))
    found = quaternion_rates(Quaternion(*q.as_quat()), Vec3(*rate))
    np.testing.assert_allclose(found, (after - before) / (2.0 * h), atol=1e-10)
