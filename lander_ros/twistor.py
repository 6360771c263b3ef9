"""Twistors: the pose of a spacecraft relative to its landing site, in eight numbers.

Source: Zhang and Cai, "Twistor-based pose control for asteroid landing with path constraints", Nonlinear Dynamics 100,
2427-2448 (2020), Appendix A. The definition B = (Q - 1)(Q + 1)^-1 is not printed in the parts of the paper that are
public; every matrix of Appendix A follows from it exactly (tests/lander/test_appendix_a.py).

Dual quaternion  Q = q + eps q',  q rotates B -> D,  q' = (1/2) r^D q = (1/2) q r^B,  r from the origin of D to B's.
Twistor          B = b + eps b',  b = q_v / (1 + q_0) = n tan(theta / 4), the modified Rodrigues parameters.
Motor            V = w + eps alpha,  w = w_BD^B [rad/s],  alpha = R_DB^T d(r^D)/dt [m/s].
A twistor and a motor are DualVectors: the scalars b4 and b8 of the paper's 8-vectors [vector, scalar | vector, scalar]
are 0. Positions in m; quaternions x, y, z, w.
"""

import math

import numpy as np

from flight_graph.errors import FlightError
from flight_math import (
    DualQuaternion,
    DualVector,
    Quaternion,
    Vec,
    Vec3,
    conjugate,
    cross,
    dot,
    kernel,
    quaternion,
    rotate,
    rotate_back,
    short_way,
    vector_part,
    where,
)

UNIT_TOLERANCE = 1e-6  # [-] how far the norm of a quaternion given by a user may be from 1
Vec8 = Vec(8)


@kernel
def dual_from_pose(r, q):
    """Dual quaternion Q = q + eps (1/2) r^D q of the position r^D and the attitude q."""
    return DualQuaternion(q, 0.5 * (quaternion(r, 0.0) * q))


@kernel
def pose_from_dual(dual):
    """Position r^D = 2 q' q* (vector part) and attitude q of a unit dual quaternion."""
    return 2.0 * vector_part(dual.dual * conjugate(dual.real)), dual.real


@kernel
def twistor_from_dual(dual):
    """B = (Q - 1)(Q + 1)^-1 of a unit dual quaternion: b = q_v/(1 + q_0), b' = (q'_v - q'_0 b)/(1 + q_0).

    Singular at q_0 = -1 (a full turn); |b| <= 1 where q_0 >= 0. Take the `short_way` first to stay there.
    """
    low = 1.0 + dual.real.w
    b = vector_part(dual.real) / low
    return DualVector(b, (vector_part(dual.dual) - dual.dual.w * b) / low)


@kernel
def dual_from_twistor(twistor):
    """Q = (1 + B)(1 - B)^-1 of a twistor: q = [2b, 1 - |b|^2]/(1 + |b|^2), and q' its dual derivative."""
    b, d = twistor.real, twistor.dual
    n, n_dual = dot(b, b), 2.0 * dot(b, d)
    s = 1.0 + n
    return DualQuaternion(quaternion(2.0 * b / s, (1.0 - n) / s),
                          quaternion(2.0 * d / s - 2.0 * n_dual / (s * s) * b, -2.0 * n_dual / (s * s)))


@kernel
def twistor_from_pose(r, q):
    """Short-way twistor, |b| <= 1, of the position r^D and the unit quaternion q.

    b' = (1/4) N(b)^T r^D, N^T = (1 - |b|^2) I - 2 [b]x + 2 b b^T.
    """
    short = short_way(q)
    b = vector_part(short) / (1.0 + short.w)
    return DualVector(b, 0.25 * ((1.0 - dot(b, b)) * r - 2.0 * cross(b, r) + 2.0 * dot(b, r) * b))


@kernel
def pose_from_twistor(twistor):
    """Position r^D = 4 N(b) b'/(1 + |b|^2)^2 and attitude q of a twistor."""
    b, d = twistor.real, twistor.dual
    n = dot(b, b)
    s = 1.0 + n
    r = 4.0 / (s * s) * ((1.0 - n) * d + 2.0 * cross(b, d) + 2.0 * dot(b, d) * b)
    return r, quaternion(2.0 * b / s, (1.0 - n) / s)


@kernel
def inverse(twistor):
    """Twistor of the inverse pose: Q* has the twistor -B."""
    return -twistor


@kernel
def compose(first, second):
    """Short-way twistor of the pose product Q(first) Q(second), e.g. B_CD from B_BD and B_CB.

    The way over Q has no singularity; the rational rule for b alone is 0/0 at a full turn.
    """
    return twistor_from_dual(short_way(dual_from_twistor(first) * dual_from_twistor(second)))


@kernel
def shadow(twistor):
    """The other twistor of the same pose, B^s = B^-1 (Q -> -Q): b^s = -b/|b|^2, b'^s = [2 b (b.b') - |b|^2 b']/|b|^4.

    Not in the parts of the paper that are public; needed where |b| passes 1.
    """
    b, d = twistor.real, twistor.dual
    n = dot(b, b)
    return DualVector(-b / n, (2.0 * dot(b, d) * b - n * d) / (n * n))


@kernel
def switch_to_shadow(twistor, threshold):
    """The shadow of a twistor where |b| > threshold (1, or 1 + hysteresis), else itself; and whether it is the shadow."""
    beyond = dot(twistor.real, twistor.real) > threshold * threshold
    return where(beyond, shadow(twistor), twistor), beyond


@kernel
def eight_numbers(value):
    """A twistor or a motor in the paper's order, [vector, 0 | vector, 0]."""
    a, b = value.real, value.dual
    return Vec8(a.x, a.y, a.z, 0.0, b.x, b.y, b.z, 0.0)


def unit_quaternion(orientation) -> Quaternion:
    """A quaternion x, y, z, w of norm 1; refused where it is not finite or not a unit quaternion."""
    q = np.array(orientation, dtype=float)
    if q.shape != (4,) or not np.all(np.isfinite(q)):
        raise FlightError(f"orientation must be four finite numbers x, y, z, w, got {orientation!r}")
    length = math.sqrt(sum(float(x) * float(x) for x in q))
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise FlightError(
            f"orientation has norm {length:.9g}; a unit quaternion (x, y, z, w) within {UNIT_TOLERANCE:g} of 1 is needed"
        )
    return Quaternion(*(q / length))


def from_pose(position, orientation) -> DualVector:
    """Short-way twistor of a geometry_msgs/Pose: position r^D [m] and orientation x, y, z, w (B -> D)."""
    r = np.array(position, dtype=float)
    if r.shape != (3,) or not np.all(np.isfinite(r)):
        raise FlightError(f"position must be three finite numbers [m], got {position!r}")
    return twistor_from_pose(Vec3(*r), unit_quaternion(orientation))


def to_pose(twistor) -> tuple[Vec3, Quaternion]:
    """Position [m] and orientation x, y, z, w, with w >= 0, as geometry_msgs/Pose takes them."""
    r, q = pose_from_twistor(twistor)
    return r, short_way(q)


def motor_of(velocity, orientation, angular_velocity) -> DualVector:
    """Motor of the velocity d(r^D)/dt [m/s], given in D, the attitude x, y, z, w, and w_BD^B [rad/s]."""
    return DualVector(Vec3(*angular_velocity), rotate_back(unit_quaternion(orientation), Vec3(*velocity)))


def site_velocity(motor, orientation) -> Vec3:
    """Velocity d(r^D)/dt [m/s] in D of a motor."""
    return rotate(unit_quaternion(orientation), motor.dual)
