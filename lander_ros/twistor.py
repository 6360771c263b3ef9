"""Twistors: the pose of a spacecraft relative to its landing site, in eight numbers.

Source: Zhang and Cai, "Twistor-based pose control for asteroid landing with path constraints", Nonlinear Dynamics 100,
2427-2448 (2020), Appendix A. The definition B = (Q - 1)(Q + 1)^-1 is not printed in the parts of the paper that are
public; every matrix of Appendix A follows from it exactly (tests/lander/test_appendix_a.py).

Dual quaternion  Q = q + eps q',  q rotates B -> D,  q' = (1/2) r^D q = (1/2) q r^B,  r from the origin of D to B's.
Twistor          B = b + eps b',  b = q_v / (1 + q_0) = n tan(theta / 4), the modified Rodrigues parameters.
Both are arrays (8,) in the paper's order [vector, scalar | vector, scalar]; the scalars b4 and b8 of a twistor are 0.
"""

import math

import numpy as np

from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from flight_graph.vectors import cross
from lander_ros.rotation import multiply, to_body, to_site

UNIT_TOLERANCE = 1e-6  # [-] how far the norm of a quaternion given by a user may be from 1


@kernel
def dual_multiply(a, b, out):
    """Product of two dual quaternions (8,): a b = a_r b_r + eps (a_r b_d + a_d b_r); ``out`` (8,) is neither."""
    multiply(a[:4], b[4:], out[4:])
    multiply(a[4:], b[:4], out[:4])
    for i in range(4):
        out[4 + i] += out[i]
    multiply(a[:4], b[:4], out[:4])


@kernel
def dual_from_pose(r, q, out):
    """Dual quaternion Q (8,) of the position r^D (3,) [m] and the attitude q (4,), x, y, z, w."""
    for i in range(4):
        out[i] = q[i]
    cx, cy, cz = cross(r[0], r[1], r[2], q[0], q[1], q[2])
    out[4] = 0.5 * (q[3] * r[0] + cx)
    out[5] = 0.5 * (q[3] * r[1] + cy)
    out[6] = 0.5 * (q[3] * r[2] + cz)
    out[7] = -0.5 * (r[0] * q[0] + r[1] * q[1] + r[2] * q[2])


@kernel
def pose_from_dual(dual, r, q):
    """Position r^D (3,) [m] = 2 q' q* (vector part) and attitude q (4,), x, y, z, w, of a unit dual quaternion (8,)."""
    for i in range(4):
        q[i] = dual[i]
    cx, cy, cz = cross(dual[4], dual[5], dual[6], dual[0], dual[1], dual[2])
    r[0] = 2.0 * (dual[3] * dual[4] - dual[7] * dual[0] - cx)
    r[1] = 2.0 * (dual[3] * dual[5] - dual[7] * dual[1] - cy)
    r[2] = 2.0 * (dual[3] * dual[6] - dual[7] * dual[2] - cz)


@kernel
def twistor_from_dual(dual, out):
    """B = (Q - 1)(Q + 1)^-1 of a unit dual quaternion, to (8,): b = q_v/(1 + q_0), b' = (q'_v - q'_0 b)/(1 + q_0).

    Singular at q_0 = -1 (a full turn); |b| <= 1 where q_0 >= 0. Use `short_way` first to stay there.
    """
    scale = 1.0 / (1.0 + dual[3])
    for i in range(3):
        out[i] = dual[i] * scale
    for i in range(3):
        out[4 + i] = (dual[4 + i] - dual[7] * out[i]) * scale
    out[3] = 0.0
    out[7] = 0.0


@kernel
def dual_from_twistor(twistor, out):
    """Q = (1 + B)(1 - B)^-1 of a twistor (8,), to (8,): q = [2b, 1 - |b|^2]/(1 + |b|^2), q' its dual derivative."""
    n = twistor[0] * twistor[0] + twistor[1] * twistor[1] + twistor[2] * twistor[2]
    n_dual = 2.0 * (twistor[0] * twistor[4] + twistor[1] * twistor[5] + twistor[2] * twistor[6])
    s = 1.0 + n
    for i in range(3):
        out[i] = 2.0 * twistor[i] / s
        out[4 + i] = 2.0 * twistor[4 + i] / s - 2.0 * twistor[i] * n_dual / (s * s)
    out[3] = (1.0 - n) / s
    out[7] = -2.0 * n_dual / (s * s)


@kernel
def short_way(dual):
    """Change the sign of a dual quaternion (or of any array (8,) or (4,) with q_0 in [3]) in place where q_0 < 0."""
    if dual[3] < 0.0:
        for i in range(len(dual)):
            dual[i] = -dual[i]


@kernel
def twistor_from_pose(r, q, out):
    """Short-way twistor (8,), |b| <= 1, of the position r^D (3,) [m] and the unit quaternion q (4,), x, y, z, w."""
    sign = 1.0
    if q[3] < 0.0:
        sign = -1.0
    scale = sign / (1.0 + sign * q[3])
    for i in range(3):
        out[i] = q[i] * scale
    # b' = (1/4) N(b)^T r^D, N^T = (1 - |b|^2) I - 2 [b]x + 2 b b^T
    b_dot_r = out[0] * r[0] + out[1] * r[1] + out[2] * r[2]
    n = out[0] * out[0] + out[1] * out[1] + out[2] * out[2]
    cx, cy, cz = cross(out[0], out[1], out[2], r[0], r[1], r[2])
    out[4] = 0.25 * ((1.0 - n) * r[0] - 2.0 * cx + 2.0 * b_dot_r * out[0])
    out[5] = 0.25 * ((1.0 - n) * r[1] - 2.0 * cy + 2.0 * b_dot_r * out[1])
    out[6] = 0.25 * ((1.0 - n) * r[2] - 2.0 * cz + 2.0 * b_dot_r * out[2])
    out[3] = 0.0
    out[7] = 0.0


@kernel
def pose_from_twistor(twistor, r, q):
    """Position r^D = 4 N(b) b'/(1 + |b|^2)^2 (3,) [m] and attitude q (4,), x, y, z, w, of a twistor (8,)."""
    n = twistor[0] * twistor[0] + twistor[1] * twistor[1] + twistor[2] * twistor[2]
    s = 1.0 + n
    along = twistor[0] * twistor[4] + twistor[1] * twistor[5] + twistor[2] * twistor[6]
    cx, cy, cz = cross(twistor[0], twistor[1], twistor[2], twistor[4], twistor[5], twistor[6])
    scale = 4.0 / (s * s)
    r[0] = scale * ((1.0 - n) * twistor[4] + 2.0 * cx + 2.0 * along * twistor[0])
    r[1] = scale * ((1.0 - n) * twistor[5] + 2.0 * cy + 2.0 * along * twistor[1])
    r[2] = scale * ((1.0 - n) * twistor[6] + 2.0 * cz + 2.0 * along * twistor[2])
    for i in range(3):
        q[i] = 2.0 * twistor[i] / s
    q[3] = (1.0 - n) / s


@kernel
def inverse(twistor, out):
    """Twistor of the inverse pose: Q* has the twistor -B."""
    for i in range(8):
        out[i] = -twistor[i]


@kernel
def compose(first, second, work, out):
    """Short-way twistor of the pose product Q(first) Q(second), e.g. B_CD from B_BD and B_CB. ``work`` is (3, 8).

    The way over Q has no singularity; the rational rule for b alone is 0/0 at a full turn.
    """
    dual_from_twistor(first, work[0])
    dual_from_twistor(second, work[1])
    dual_multiply(work[0], work[1], work[2])
    short_way(work[2])
    twistor_from_dual(work[2], out)


@kernel
def shadow(twistor, out):
    """The other twistor of the same pose, B^s = B^-1 (Q -> -Q): b^s = -b/|b|^2, b'^s = [2 b (b.b') - |b|^2 b']/|b|^4.

    Not in the parts of the paper that are public; needed where |b| passes 1. ``out`` may be ``twistor`` itself.
    """
    n = twistor[0] * twistor[0] + twistor[1] * twistor[1] + twistor[2] * twistor[2]
    along = twistor[0] * twistor[4] + twistor[1] * twistor[5] + twistor[2] * twistor[6]
    for i in range(3):
        out[4 + i] = (2.0 * twistor[i] * along - n * twistor[4 + i]) / (n * n)
    for i in range(3):
        out[i] = -twistor[i] / n
    out[3] = 0.0
    out[7] = 0.0


@kernel
def switch_to_shadow(twistor, threshold):
    """Replace a twistor by its shadow, in place, where |b| > threshold (1, or 1 + hysteresis); tells whether it did."""
    n = twistor[0] * twistor[0] + twistor[1] * twistor[1] + twistor[2] * twistor[2]
    if n > threshold * threshold:
        shadow(twistor, twistor)
        return True
    return False


def unit_quaternion(orientation) -> np.ndarray:
    """A quaternion (4,), x, y, z, w, as float64 of norm 1; refused where it is not finite or not a unit quaternion."""
    q = np.array(orientation, dtype=float)
    if q.shape != (4,) or not np.all(np.isfinite(q)):
        raise FlightError(f"orientation must be four finite numbers x, y, z, w, got {orientation!r}")
    norm = math.sqrt(sum(float(x) * float(x) for x in q))
    if abs(norm - 1.0) > UNIT_TOLERANCE:
        raise FlightError(
            f"orientation has norm {norm:.9g}; a unit quaternion (x, y, z, w) within {UNIT_TOLERANCE:g} of 1 is needed"
        )
    return q / norm


def from_pose(position, orientation) -> np.ndarray:
    """Short-way twistor (8,) of a geometry_msgs/Pose: position r^D [m] and orientation x, y, z, w (B -> D)."""
    r = np.array(position, dtype=float)
    if r.shape != (3,) or not np.all(np.isfinite(r)):
        raise FlightError(f"position must be three finite numbers [m], got {position!r}")
    out = np.zeros(8)
    twistor_from_pose(r, unit_quaternion(orientation), out)
    return out


def to_pose(twistor) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) [m] and orientation (4,), x, y, z, w, with w >= 0, as geometry_msgs/Pose takes them."""
    r, q = np.zeros(3), np.zeros(4)
    pose_from_twistor(np.asarray(twistor, dtype=float), r, q)
    short_way(q)
    return r, q


def motor_from_twist(linear, angular) -> np.ndarray:
    """Velocity motor V = w + eps alpha as (8,) [w, 0 | alpha, 0] of a geometry_msgs/Twist in the body frame.

    linear is alpha = R_DB^T d(r^D)/dt [m/s], angular is w = w_BD^B [rad/s]: nav_msgs/Odometry with child frame B.
    """
    return np.array([*angular, 0.0, *linear, 0.0], dtype=float)


def twist_from_motor(motor) -> tuple[np.ndarray, np.ndarray]:
    """linear (3,) [m/s] and angular (3,) [rad/s] of a geometry_msgs/Twist in the body frame, of a motor (8,)."""
    motor = np.asarray(motor, dtype=float)
    return motor[4:7].copy(), motor[0:3].copy()


def body_twist(velocity, orientation, angular_velocity) -> np.ndarray:
    """Velocity motor (8,) of the velocity d(r^D)/dt [m/s], given in D, the attitude x, y, z, w, and w_BD^B [rad/s]."""
    return motor_from_twist(to_body(unit_quaternion(orientation), *(float(x) for x in velocity)), angular_velocity)


def site_velocity(motor, orientation) -> np.ndarray:
    """Velocity d(r^D)/dt (3,) [m/s] in D of a velocity motor (8,)."""
    return np.array(to_site(unit_quaternion(orientation), *(float(x) for x in np.asarray(motor)[4:7])))
