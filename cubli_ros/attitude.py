"""Attitude kinematics of the Cubli rover: Cardan angles 1-2-3, rotation matrix, quaternions, moment of gravity.

Source: Aerospace 2022, 9(11), 728, equations (1), (2) and (4).

Frames. *Body frame*: origin at the cube's centre, axes through the face centres (the wheel axes); the pivot corner is
at -l/2 [1, 1, 1]. *Balance frame*: the paper's inertial frame, the body frame at the balance point, so the cube stands
on its corner when both coincide. It is not a z-up frame: on level ground up is [1, 1, 1] / sqrt(3), gravity is
-g / sqrt(3) [1, 1, 1].

Angles (phi, theta, psi) [rad] are successive rotations about body axes 1, 2, 3; singular at theta = +-pi/2. What depends
on them takes ``turn = sincos(angles)``, their sines and cosines, which are computed once for each attitude.
Quaternions are x, y, z, w (ROS order) and turn body coordinates into balance-frame coordinates: rotate(q, v) is A^T v,
rotate_back(q, v) is A v.
"""

import math

from flight_math import Mat3, Quaternion, Vec3, asin, atan2, clip, cross, kernel, norm, same, sincos

FIX_TOLERANCE = 1e-3  # [-] of the length of a measured quaternion


@kernel
def rotation_matrix(turn):
    """Eq. (1), A: balance-frame coordinates to body coordinates."""
    sine, cosine = turn
    return Mat3(cosine.y * cosine.z,
                sine.x * sine.y * cosine.z + cosine.x * sine.z,
                -cosine.x * sine.y * cosine.z + sine.x * sine.z,
                -cosine.y * sine.z,
                -sine.x * sine.y * sine.z + cosine.x * cosine.z,
                cosine.x * sine.y * sine.z + sine.x * cosine.z,
                sine.y,
                -sine.x * cosine.y,
                cosine.x * cosine.y)


@kernel
def to_body(turn, v):
    """A v: balance-frame coordinates to body coordinates, by three plane rotations."""
    sine, cosine = turn
    y_1 = cosine.x * v.y + sine.x * v.z
    z_1 = cosine.x * v.z - sine.x * v.y
    x_2 = cosine.y * v.x - sine.y * z_1
    return Vec3(cosine.z * x_2 + sine.z * y_1, cosine.z * y_1 - sine.z * x_2, sine.y * v.x + cosine.y * z_1)


@kernel
def cardan_rates(turn, omega):
    """Eq. (2), G omega: body rates -> Cardan angle rates [rad/s]."""
    sine, cosine = turn
    along = cosine.z * omega.x - sine.z * omega.y
    return Vec3(along / cosine.y, sine.z * omega.x + cosine.z * omega.y, omega.z - sine.y / cosine.y * along)


@kernel
def body_rates(turn, rates):
    """Inverse of eq. (2), G^-1 rates: Cardan angle rates -> body rates [rad/s]."""
    sine, cosine = turn
    return Vec3(cosine.y * cosine.z * rates.x + sine.z * rates.y,
                -cosine.y * sine.z * rates.x + cosine.z * rates.y,
                sine.y * rates.x + rates.z)


@kernel
def level_gravity(p):
    """Gravity g_I of eq. (4) [m/s^2], balance frame, on level ground: -g / sqrt(3) [1, 1, 1]."""
    return same(-p.gravity / math.sqrt(3.0))


@kernel
def gravity_torque(p, gravity):
    """Eq. (4), M_g = r x m g [N m] with r = s l/2 [1, 1, 1]; gravity g [m/s^2] and torque in the body frame.

    The sign s = +1 is the inverted pendulum; -1 is the equation as printed, for which the balance point is a stable,
    hanging one.
    """
    return cross(same(p.gravity_sign * 0.5 * p.length), p.mass * gravity)


@kernel
def quaternion_from_cardan(angles):
    """Cardan angles [rad] -> unit quaternion: the product q_1(phi) q_2(theta) q_3(psi)."""
    s, c = sincos(0.5 * angles)
    return Quaternion(s.x * c.y * c.z + c.x * s.y * s.z,
                      c.x * s.y * c.z - s.x * c.y * s.z,
                      c.x * c.y * s.z + s.x * s.y * c.z,
                      c.x * c.y * c.z - s.x * s.y * s.z)


@kernel
def cardan_from_quaternion(q):
    """Unit quaternion -> Cardan angles [rad], theta in [-pi/2, pi/2], phi and psi in [-pi, pi]."""
    sin_theta = clip(2.0 * (q.x * q.z + q.w * q.y), -1.0, 1.0)
    return Vec3(atan2(2.0 * (q.w * q.x - q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y)),
                asin(sin_theta),
                atan2(2.0 * (q.w * q.z - q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z)))


@kernel
def is_known(attitude):
    """Whether an attitude (sensor_msgs/Imu) has arrived, with an orientation (covariance -1: none)."""
    return attitude.header.stamp.sec != 0 and attitude.orientation_covariance[0] >= 0.0


@kernel
def is_fix(q):
    """Whether a measured quaternion is an attitude: of length one. A star tracker without stars sends zeros."""
    return abs(norm(q) - 1.0) < FIX_TOLERANCE
