"""Twistors against dual-quaternion algebra and scipy's rotations: group laws, round trips, double cover, rates."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lander_ros import twistor as tw
from lander_ros.rotation import to_body, to_site
from lander_ros.twistor_kinematics import (
    gamma_matrix,
    kinematic_matrix,
    pi_inverse_transpose,
    pi_matrix,
    twistor_rate,
)

finite = st.floats(-1.0, 1.0, allow_nan=False, width=64)
vector = st.tuples(finite, finite, finite).map(np.array)
rotation = st.tuples(vector, st.floats(0.0, 1.0)).map(
    lambda a: Rotation.from_rotvec(a[0] / max(np.linalg.norm(a[0]), 1e-9) * a[1] * 3.1)
)
pose = st.tuples(vector.map(lambda v: 1000.0 * v), rotation)
few = settings(max_examples=40, deadline=None)


def twistor_of(r, rotation):
    return tw.from_pose(r, rotation.as_quat())


def compose(a, b):
    out = np.zeros(8)
    tw.compose(a, b, np.zeros((3, 8)), out)
    return out


def same_pose(a, b, metres):
    (ra, qa), (rb, qb) = tw.to_pose(a), tw.to_pose(b)
    np.testing.assert_allclose(ra, rb, rtol=0.0, atol=metres)
    assert (Rotation.from_quat(qa) * Rotation.from_quat(qb).inv()).magnitude() < 1e-12


@few
@given(pose)
def test_pose_and_dual_quaternion_round_trips(pose):
    r, rotation = pose
    b = twistor_of(r, rotation)
    back, q = tw.to_pose(b)
    np.testing.assert_allclose(back, r, rtol=0.0, atol=1e-10)
    assert (Rotation.from_quat(q) * rotation.inv()).magnitude() < 1e-13
    dual, again, r2, q2 = np.zeros(8), np.zeros(8), np.zeros(3), np.zeros(4)
    tw.dual_from_twistor(b, dual)
    tw.twistor_from_dual(dual, again)
    np.testing.assert_allclose(again, b, rtol=0.0, atol=1e-11)
    tw.pose_from_dual(dual, r2, q2)
    np.testing.assert_allclose(r2, r, rtol=0.0, atol=1e-10)
    direct = np.zeros(8)
    tw.dual_from_pose(r, q, direct)
    np.testing.assert_allclose(direct, dual, rtol=0.0, atol=1e-11)
    assert np.linalg.norm(b[:3]) <= 1.0 + 1e-15


@few
@given(pose)
def test_modified_rodrigues_parameters_are_scipys(pose):
    np.testing.assert_allclose(twistor_of(*pose)[:3], pose[1].as_mrp(), rtol=0.0, atol=1e-14)


@few
@given(pose, pose, pose)
def test_poses_form_a_group(a, b, c):
    a, b, c = twistor_of(*a), twistor_of(*b), twistor_of(*c)
    same_pose(compose(compose(a, b), c), compose(a, compose(b, c)), 1e-9)
    same_pose(compose(a, np.zeros(8)), a, 1e-10)
    inverse = np.zeros(8)
    tw.inverse(a, inverse)
    same_pose(compose(a, inverse), np.zeros(8), 1e-9)


@few
@given(pose, pose)
def test_composition_is_that_of_homogeneous_transforms(a, b):
    r, q = tw.to_pose(compose(twistor_of(*a), twistor_of(*b)))
    np.testing.assert_allclose(r, a[0] + a[1].apply(b[0]), rtol=0.0, atol=1e-9)
    assert ((a[1] * b[1]) * Rotation.from_quat(q).inv()).magnitude() < 1e-13


@few
@given(pose)
def test_double_cover_shadow_is_the_same_pose(pose):
    b = twistor_of(*pose)
    if np.linalg.norm(b[:3]) < 1e-3:
        return
    shadow, r, q, r_s, q_s = np.zeros(8), np.zeros(3), np.zeros(4), np.zeros(3), np.zeros(4)
    tw.shadow(b, shadow)
    tw.pose_from_twistor(b, r, q)
    tw.pose_from_twistor(shadow, r_s, q_s)
    np.testing.assert_allclose(q_s, -q, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(r_s, r, rtol=1e-12, atol=1e-9)
    # B^s = B^-1 as a dual quaternion
    product = np.zeros(8)
    tw.dual_multiply(b, shadow, product)
    scale = 1.0 + np.abs(b).max() * np.abs(shadow).max()
    np.testing.assert_allclose(product, [0, 0, 0, 1, 0, 0, 0, 0], rtol=0.0, atol=1e-12 * scale)


def test_the_switch_keeps_the_pose_and_respects_its_threshold():
    b = np.zeros(8)
    q = Rotation.from_rotvec([0.0, 0.0, math.radians(182.0)]).as_quat()
    dual = np.zeros(8)
    tw.dual_from_pose(np.array([3.0, -4.0, 5.0]), q if q[2] * q[3] < 0 else -q, dual)
    tw.twistor_from_dual(dual, b)
    assert np.linalg.norm(b[:3]) > 1.0
    before = tw.to_pose(b)
    assert not tw.switch_to_shadow(b, 1.1)
    assert tw.switch_to_shadow(b, 1.0)
    assert np.linalg.norm(b[:3]) < 1.0
    np.testing.assert_allclose(tw.to_pose(b)[0], before[0], rtol=0.0, atol=1e-13)


@few
@given(pose)
def test_position_from_the_twistor(pose):
    """r^B = Pi^-T b', b' = Pi r^D, |r| = 4 |b'| / (1 + |b|^2), R_DB = N^2/S^2."""
    r, rotation = pose
    b = twistor_of(r, rotation)
    pi, pi_it, n = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    pi_matrix(b, pi)
    pi_inverse_transpose(b, pi_it)
    kinematic_matrix(b, n)
    s = 1.0 + b[:3] @ b[:3]
    np.testing.assert_allclose(pi @ r, b[4:7], rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(pi_it @ b[4:7], rotation.inv().apply(r), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(pi_it, np.linalg.inv(pi).T, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(4.0 * np.linalg.norm(b[4:7]) / s, np.linalg.norm(r), rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(n @ n / s**2, rotation.as_matrix(), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(to_site(rotation.as_quat(), *r), rotation.apply(r), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(to_body(rotation.as_quat(), *r), rotation.inv().apply(r), rtol=0.0, atol=1e-9)


@few
@given(pose, vector, vector)
def test_rate_is_the_derivative_of_a_moving_pose(pose, w, alpha):
    """Central differences of the pose moved by a constant motor against (1/4)(1 + B) V (1 - B) and (1/4) Gamma^T V."""
    r, rotation = pose
    r = r / 100.0
    b, rate, gamma = twistor_of(r, rotation), np.zeros(8), np.zeros((8, 8))
    motor = tw.motor_from_twist(alpha, w)
    twistor_rate(b, motor, rate)
    gamma_matrix(b, gamma)
    np.testing.assert_allclose(rate, 0.25 * gamma.T @ motor, rtol=0.0, atol=1e-13 * (1.0 + np.abs(b).max()))
    step = 1e-5  # [s]

    def moved(t):
        turned = rotation * Rotation.from_rotvec(w * t)
        q = turned.as_quat()
        out, dual = np.zeros(8), np.zeros(8)
        tw.dual_from_pose(r + t * rotation.apply(alpha), q if q @ rotation.as_quat() > 0 else -q, dual)
        if rotation.as_quat()[3] < 0:
            dual = -dual
        tw.twistor_from_dual(dual, out)
        return out

    difference = (moved(step) - moved(-step)) / (2.0 * step)
    np.testing.assert_allclose(difference, rate, rtol=0.0, atol=2e-8 * (1.0 + np.abs(b).max()))


def test_twists_are_ros_twists():
    motor = tw.motor_from_twist([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])
    np.testing.assert_array_equal(motor, [4, 5, 6, 0, 1, 2, 3, 0])
    linear, angular = tw.twist_from_motor(motor)
    np.testing.assert_array_equal([linear, angular], [[1, 2, 3], [4, 5, 6]])
    turn = Rotation.from_euler("z", 90.0, degrees=True)
    motor = tw.body_twist([1.0, 0.0, 0.0], turn.as_quat(), [0.0, 0.0, 0.1])
    np.testing.assert_allclose(motor[4:7], [0.0, -1.0, 0.0], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(tw.site_velocity(motor, turn.as_quat()), [1.0, 0.0, 0.0], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("orientation", [(0, 0, 0, 1.01), (0, 0, 0, 0), (1, 0, 0), (math.nan, 0, 0, 1)])
def test_a_quaternion_that_is_no_attitude_is_refused(orientation):
    with pytest.raises(ValueError, match="orientation"):
        tw.from_pose([0.0, 0.0, 1.0], orientation)
