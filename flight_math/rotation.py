"""Rotation vectors and quaternions: a rotation vector is the axis times the angle [rad].

A quaternion q (x, y, z, w) is the attitude of a body in a frame: rotate(q, v) turns body coordinates into the frame's.
"""

import math

from flight_math.kernel import kernel
from flight_math.values import Quaternion, atan2, norm, quaternion, short_way, sincos, vector_part

SMALL_ANGLE = 1e-4  # [rad] below, two terms of the series of sin(a / 2) / a are exact to 1e-18
SMALL_SINE = 1e-8  # [-] of half an angle; below, angle / sine is 2 to 16 digits


@kernel
def quaternion_from_rotation_vector(v):
    """Rotation vector [rad] -> unit quaternion."""
    square = v @ v
    angle = math.sqrt(square)
    sine, cosine = sincos(0.5 * angle)
    factor = 0.5 - square / 48.0 if angle < SMALL_ANGLE else sine / angle
    return quaternion(factor * v, cosine)


@kernel
def rotation_vector(q):
    """Unit quaternion -> rotation vector [rad], the shorter way round (at most pi long)."""
    near = short_way(q)
    axis = vector_part(near)
    sine = norm(axis)
    factor = 2.0 if sine < SMALL_SINE else 2.0 * atan2(sine, near.w) / sine
    return factor * axis


@kernel
def quaternion_from_matrix(m):
    """Rotation matrix -> unit quaternion of the same rotation, by its largest component (Shepperd 1978)."""
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    if trace >= max(m[0, 0], m[1, 1], m[2, 2]):
        w = 0.5 * math.sqrt(1.0 + trace)
        f = 0.25 / w
        return Quaternion(f * (m[2, 1] - m[1, 2]), f * (m[0, 2] - m[2, 0]), f * (m[1, 0] - m[0, 1]), w)
    if m[0, 0] >= max(m[1, 1], m[2, 2]):
        x = 0.5 * math.sqrt(1.0 + m[0, 0] - m[1, 1] - m[2, 2])
        f = 0.25 / x
        return Quaternion(x, f * (m[0, 1] + m[1, 0]), f * (m[0, 2] + m[2, 0]), f * (m[2, 1] - m[1, 2]))
    if m[1, 1] >= m[2, 2]:
        y = 0.5 * math.sqrt(1.0 + m[1, 1] - m[0, 0] - m[2, 2])
        f = 0.25 / y
        return Quaternion(f * (m[0, 1] + m[1, 0]), y, f * (m[1, 2] + m[2, 1]), f * (m[0, 2] - m[2, 0]))
    z = 0.5 * math.sqrt(1.0 + m[2, 2] - m[0, 0] - m[1, 1])
    f = 0.25 / z
    return Quaternion(f * (m[0, 2] + m[2, 0]), f * (m[1, 2] + m[2, 1]), z, f * (m[1, 0] - m[0, 1]))


@kernel
def quaternion_rates(q, omega):
    """q' = q omega / 2 of an attitude q and the body rates omega [rad/s]."""
    return 0.5 * Quaternion(q.w * omega.x + q.y * omega.z - q.z * omega.y,
                            q.w * omega.y + q.z * omega.x - q.x * omega.z,
                            q.w * omega.z + q.x * omega.y - q.y * omega.x,
                            -(q.x * omega.x + q.y * omega.y + q.z * omega.z))
