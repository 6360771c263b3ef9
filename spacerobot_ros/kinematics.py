"""Kinematics of a base that flies freely and n revolute joints in a tree.

Source: Aerospace 2023, 10(10), 679, equations (8), (13), (14), with separate actual and reference velocities (Slotine
and Li): w_r and theta_dot_r are the velocities that enter linearly, w and theta_dot the measured ones.

Body 0 is the base; joint i carries body i+1. In every kernel the tree is four arrays:
``parent`` (n,) int64: body that carries joint i, always less than i+1; ``offset`` (n, 3): origin of body i+1 in its
parent's axes [m]; ``axis`` (n, 3): unit vector of joint i in body i+1's axes; ``rotation`` (n, 3, 3): turns vectors of
body i+1 into its parent's axes at the present joint angle (from `joint_rotations`).
Quaternions here are scalar first, body to inertial; angular velocities are in body axes [rad/s].
"""

import math

from flight_graph.kernel import kernel


@kernel
def joint_rotations(fixed_rotation, axis, theta, rotation):
    """rotation[i] = fixed_rotation[i] Rot(axis[i], theta[i]): body i+1's axes to its parent's, shape (n, 3, 3)."""
    for i in range(axis.shape[0]):
        c = math.cos(theta[i])
        s = math.sin(theta[i])
        v = 1.0 - c
        x = axis[i, 0]
        y = axis[i, 1]
        z = axis[i, 2]
        for r in range(3):
            fx = fixed_rotation[i, r, 0]
            fy = fixed_rotation[i, r, 1]
            fz = fixed_rotation[i, r, 2]
            rotation[i, r, 0] = fx * (c + v * x * x) + fy * (v * x * y + s * z) + fz * (v * x * z - s * y)
            rotation[i, r, 1] = fx * (v * x * y - s * z) + fy * (c + v * y * y) + fz * (v * y * z + s * x)
            rotation[i, r, 2] = fx * (v * x * z + s * y) + fy * (v * y * z - s * x) + fz * (c + v * z * z)


@kernel
def body_poses(parent, rotation, offset, position, orientation):
    """Pose of every body's frame in base axes: ``position`` (n+1, 3) [m], ``orientation`` (n+1, 3, 3) body to base."""
    for r in range(3):
        position[0, r] = 0.0
        for c in range(3):
            orientation[0, r, c] = 1.0 if r == c else 0.0
    for i in range(parent.shape[0]):
        b = parent[i]
        for r in range(3):
            value = position[b, r]
            for k in range(3):
                value += orientation[b, r, k] * offset[i, k]
            position[i + 1, r] = value
            for c in range(3):
                value = 0.0
                for k in range(3):
                    value += orientation[b, r, k] * rotation[i, k, c]
                orientation[i + 1, r, c] = value


@kernel
def body_motion(parent, rotation, offset, axis, w, w_r, al_r, a_r, thd, thd_r, thdd_r, motion):
    """Outward recursion, equations (8), (13), (14): row b of ``motion`` (n+1, 12) is [w, w_r, al_r, a_r] of body b.

    w+ = R^T w + z thd;  w_r+ = R^T w_r + z thd_r;  al+ = R^T al + (R^T w_r) x z thd + z thdd_r;
    a+ = R^T (a + al x P + w x (w_r x P)); each in the body's own axes. With w_r = w it is the actual motion.
    """
    for k in range(3):
        motion[0, k] = w[k]
        motion[0, 3 + k] = w_r[k]
        motion[0, 6 + k] = al_r[k]
        motion[0, 9 + k] = a_r[k]
    for i in range(parent.shape[0]):
        b = parent[i]
        wx, wy, wz = motion[b, 0], motion[b, 1], motion[b, 2]
        vx, vy, vz = motion[b, 3], motion[b, 4], motion[b, 5]
        ex, ey, ez = motion[b, 6], motion[b, 7], motion[b, 8]
        px, py, pz = offset[i, 0], offset[i, 1], offset[i, 2]
        cx = vy * pz - vz * py
        cy = vz * px - vx * pz
        cz = vx * py - vy * px
        ax = motion[b, 9] + (ey * pz - ez * py) + (wy * cz - wz * cy)
        ay = motion[b, 10] + (ez * px - ex * pz) + (wz * cx - wx * cz)
        az = motion[b, 11] + (ex * py - ey * px) + (wx * cy - wy * cx)
        for k in range(3):
            rx, ry, rz = rotation[i, 0, k], rotation[i, 1, k], rotation[i, 2, k]
            motion[i + 1, k] = rx * wx + ry * wy + rz * wz + axis[i, k] * thd[i]
            motion[i + 1, 3 + k] = rx * vx + ry * vy + rz * vz
            motion[i + 1, 6 + k] = rx * ex + ry * ey + rz * ez + axis[i, k] * thdd_r[i]
            motion[i + 1, 9 + k] = rx * ax + ry * ay + rz * az
        vx, vy, vz = motion[i + 1, 3], motion[i + 1, 4], motion[i + 1, 5]
        zx, zy, zz = axis[i, 0] * thd[i], axis[i, 1] * thd[i], axis[i, 2] * thd[i]
        motion[i + 1, 6] += vy * zz - vz * zy
        motion[i + 1, 7] += vz * zx - vx * zz
        motion[i + 1, 8] += vx * zy - vy * zx
        for k in range(3):
            motion[i + 1, 3 + k] += axis[i, k] * thd_r[i]


@kernel
def rotation_matrix(q, matrix):
    """Direction cosine matrix (3, 3), body to inertial, of the unit quaternion ``q`` = [q0, qx, qy, qz]."""
    s, x, y, z = q[0], q[1], q[2], q[3]
    matrix[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    matrix[0, 1] = 2.0 * (x * y - s * z)
    matrix[0, 2] = 2.0 * (x * z + s * y)
    matrix[1, 0] = 2.0 * (x * y + s * z)
    matrix[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    matrix[1, 2] = 2.0 * (y * z - s * x)
    matrix[2, 0] = 2.0 * (x * z - s * y)
    matrix[2, 1] = 2.0 * (y * z + s * x)
    matrix[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@kernel
def attitude_difference(q, q_d, difference):
    """difference = q^-1 * q_d: the desired attitude seen from the present body axes (scalar first)."""
    s, x, y, z = q[0], -q[1], -q[2], -q[3]
    t, u, v, w = q_d[0], q_d[1], q_d[2], q_d[3]
    difference[0] = s * t - x * u - y * v - z * w
    difference[1] = s * u + x * t + y * w - z * v
    difference[2] = s * v - x * w + y * t + z * u
    difference[3] = s * w + x * v - y * u + z * t


@kernel
def rotation_vector(q, vector):
    """Rotation vector (3,) [rad] of the unit quaternion ``q``, the shorter way round."""
    sign = 1.0 if q[0] >= 0.0 else -1.0
    sine = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    factor = 2.0 * sign if sine < 1e-12 else 2.0 * sign * math.atan2(sine, abs(q[0])) / sine
    for k in range(3):
        vector[k] = factor * q[1 + k]
