"""Twistors against dual-quaternion algebra and scipy's rotations: group laws, round trips, double cover, rates."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flight_math import (
    DualQuaternion,
    DualVector,
    Quaternion,
    Vec3,
    dual_quaternion,
    dual_vector_part,
    norm,
    rotate,
    rotate_back,
)
from lander_ros import twistor as tw
from lander_ros.twistor_kinematics import (
    gamma_blocks,
    kinematic_matrix,
    pi_inverse_transpose,
    pi_matrix,
    twistor_rate,
)
from tests.lander.reference_landing import matrix

finite = st.floats(-1.0, 1.0, allow_nan=False, width=64)
vector = st.tuples(finite, finite, finite).map(np.array)
rotation = st.tuples(vector, st.floats(0.0, 1.0)).map(
    lambda a: Rotation.from_rotvec(a[0] / max(np.linalg.norm(a[0]), 1e-9) * a[1] * 3.1)
)
pose = st.tuples(vector.map(lambda v: 1000.0 * v), rotation)
few = settings(max_examples=40, deadline=None)


def twistor_of(r, rotation):
    return tw.from_pose(r, rotation.as_quat())


IDENTITY = DualVector(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))


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
    dual = tw.dual_from_twistor(b)
    np.testing.assert_allclose(tw.twistor_from_dual(dual).parts(), b.parts(), rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(tw.pose_from_dual(dual)[0], r, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(tw.dual_from_pose(Vec3(*r), q).parts(), dual.parts(), rtol=0.0, atol=1e-11)
    assert norm(b.real) <= 1.0 + 1e-15


@few
@given(pose)
def test_modified_rodrigues_parameters_are_scipys(pose):
    np.testing.assert_allclose(twistor_of(*pose).real, pose[1].as_mrp(), rtol=0.0, atol=1e-14)


@few
@given(pose, pose, pose)
def test_poses_form_a_group(a, b, c):
    a, b, c = twistor_of(*a), twistor_of(*b), twistor_of(*c)
    same_pose(tw.compose(tw.compose(a, b), c), tw.compose(a, tw.compose(b, c)), 1e-9)
    same_pose(tw.compose(a, IDENTITY), a, 1e-10)
    same_pose(tw.compose(a, tw.inverse(a)), IDENTITY, 1e-9)


@few
@given(pose, pose)
def test_composition_is_that_of_homogeneous_transforms(a, b):
    r, q = tw.to_pose(tw.compose(twistor_of(*a), twistor_of(*b)))
    np.testing.assert_allclose(r, a[0] + a[1].apply(b[0]), rtol=0.0, atol=1e-9)
    assert ((a[1] * b[1]) * Rotation.from_quat(q).inv()).magnitude() < 1e-13


@few
@given(pose)
def test_double_cover_shadow_is_the_same_pose(pose):
    b = twistor_of(*pose)
    if norm(b.real) < 1e-3:
        return
    shadow = tw.shadow(b)
    (r, q), (r_s, q_s) = tw.pose_from_twistor(b), tw.pose_from_twistor(shadow)
    np.testing.assert_allclose(q_s, -q, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(r_s, r, rtol=1e-12, atol=1e-9)
    # B^s = B^-1 as a dual quaternion
    product = dual_quaternion(b) * dual_quaternion(shadow)
    scale = 1.0 + np.abs(b.parts()).max() * np.abs(shadow.parts()).max()
    np.testing.assert_allclose(product.parts(), [0, 0, 0, 1, 0, 0, 0, 0], rtol=0.0, atol=1e-12 * scale)


def test_the_switch_keeps_the_pose_and_respects_its_threshold():
    q = Rotation.from_rotvec([0.0, 0.0, math.radians(182.0)]).as_quat()
    b = tw.twistor_from_dual(tw.dual_from_pose(Vec3(3.0, -4.0, 5.0), Quaternion(*(q if q[2] * q[3] < 0 else -q))))
    assert norm(b.real) > 1.0
    same, switched = tw.switch_to_shadow(b, 1.1)
    assert not switched and same.parts() == b.parts()
    other, switched = tw.switch_to_shadow(b, 1.0)
    assert switched and norm(other.real) < 1.0
    np.testing.assert_allclose(tw.to_pose(other)[0], tw.to_pose(b)[0], rtol=0.0, atol=1e-13)


@few
@given(pose)
def test_position_from_the_twistor(pose):
    """r^B = Pi^-T b', b' = Pi r^D, |r| = 4 |b'| / (1 + |b|^2), R_DB = N^2/S^2."""
    r, rotation = pose
    twistor = twistor_of(r, rotation)
    b, d = np.array(twistor.real), np.array(twistor.dual)
    pi, pi_it, n = (matrix(kernel(twistor)) for kernel in (pi_matrix, pi_inverse_transpose, kinematic_matrix))
    s = 1.0 + b @ b
    np.testing.assert_allclose(pi @ r, d, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(pi_it @ d, rotation.inv().apply(r), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(pi_it, np.linalg.inv(pi).T, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(4.0 * np.linalg.norm(d) / s, np.linalg.norm(r), rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(n @ n / s**2, rotation.as_matrix(), rtol=0.0, atol=1e-13)
    q, v = Quaternion(*rotation.as_quat()), Vec3(*r)
    np.testing.assert_allclose(rotate(q, v), rotation.apply(r), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(rotate_back(q, v), rotation.inv().apply(r), rtol=0.0, atol=1e-9)


@few
@given(pose, vector, vector)
def test_rate_is_the_derivative_of_a_moving_pose(pose, w, alpha):
    """Central differences of the pose moved by a constant motor against (1/4)(1 + B) V (1 - B) and (1/4) Gamma^T V."""
    r, rotation = pose
    r = r / 100.0
    b, motor = twistor_of(r, rotation), DualVector(Vec3(*w), Vec3(*alpha))
    rate, size = np.array(twistor_rate(b, motor).parts()), 1.0 + np.abs(b.parts()).max()
    first, second = map(matrix, gamma_blocks(b))
    gamma = np.block([[first, second], [np.zeros((3, 3)), first]])
    np.testing.assert_allclose(rate, 0.25 * gamma.T @ np.array(motor.parts()), rtol=0.0, atol=1e-13 * size)
    one = DualQuaternion(Quaternion(0.0, 0.0, 0.0, 1.0), Quaternion(0.0, 0.0, 0.0, 0.0))
    product = (one + dual_quaternion(b)) * dual_quaternion(motor) * (one - dual_quaternion(b))
    np.testing.assert_allclose(rate, 0.25 * np.array(dual_vector_part(product).parts()), rtol=0.0, atol=1e-13 * size)
    step = 1e-5  # [s]

    def moved(t):
        q = Quaternion(*(rotation * Rotation.from_rotvec(w * t)).as_quat())
        place = Vec3(*(r + t * rotation.apply(alpha)))
        near = q if np.dot(q, rotation.as_quat()) > 0 else -q
        near = -near if rotation.as_quat()[3] < 0 else near
        return np.array(tw.twistor_from_dual(tw.dual_from_pose(place, near)).parts())

    difference = (moved(step) - moved(-step)) / (2.0 * step)
    np.testing.assert_allclose(difference, rate, rtol=0.0, atol=2e-8 * size)


def test_motors_are_ros_twists():
    turn = Rotation.from_euler("z", 90.0, degrees=True)
    motor = tw.motor_of([1.0, 0.0, 0.0], turn.as_quat(), [4.0, 5.0, 6.0])
    np.testing.assert_array_equal(motor.real, [4.0, 5.0, 6.0])
    np.testing.assert_allclose(motor.dual, [0.0, -1.0, 0.0], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(tw.site_velocity(motor, turn.as_quat()), [1.0, 0.0, 0.0], rtol=0.0, atol=1e-15)
    motor = DualVector(Vec3(4.0, 5.0, 6.0), Vec3(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(tw.eight_numbers(motor), [4, 5, 6, 0, 1, 2, 3, 0])


@pytest.mark.parametrize("orientation", [(0, 0, 0, 1.01), (0, 0, 0, 0), (1, 0, 0), (math.nan, 0, 0, 1)])
def test_a_quaternion_that_is_no_attitude_is_refused(orientation):
    with pytest.raises(ValueError, match="orientation"):
        tw.from_pose([0.0, 0.0, 1.0], orientation)
