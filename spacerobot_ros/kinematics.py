"""Kinematics of a base that flies freely and n revolute joints in a tree.

Source: Aerospace 2023, 10(8), 679, equations (8), (13), (14), with separate actual and reference velocities (Slotine
and Li): w_r and theta_dot_r are the velocities that enter linearly, w and theta_dot the measured ones.

Body 0 is the base; joint i carries body i+1. Quaternions turn body axes into inertial axes; angular velocities are in
body axes [rad/s].
"""

from typing import NamedTuple

import numpy as np

from flight_math import Vec3, cross, identity3, kernel, mat3, outer, sincos, skew, transpose, vec3


class Geometry(NamedTuple):
    """Where the joints sit: the parameters of a robot's components have these entries too.

    parent: (n,) int64, body that carries joint i, always less than i+1.  fixed_rotation: (n, 9) turns vectors of body i+1
    into its parent's axes at angle zero, row by row.  offset: (n, 3) origin of body i+1 in its parent's axes [m].
    axis: (n, 3) unit vector of joint i in body i+1's axes.
    """

    parent: np.ndarray
    fixed_rotation: np.ndarray
    offset: np.ndarray
    axis: np.ndarray


class Tree(NamedTuple):
    """The robot at its present joint angles: as `Geometry`, with the rotation R of each body to its parent, (n, 3, 3)."""

    parent: np.ndarray
    rotation: np.ndarray
    offset: np.ndarray
    axis: np.ndarray


class Motion(NamedTuple):
    """What enters the equations of motion: w, w_r, al_r (angular) and a_r (base origin) of the base, in base axes
    [rad/s, rad/s, rad/s^2, m/s^2]; thd, thd_r, thdd_r (n,) of the joints. The actual motion has w_r = w, thd_r = thd."""

    w: Vec3
    w_r: Vec3
    al_r: Vec3
    a_r: Vec3
    thd: np.ndarray
    thd_r: np.ndarray
    thdd_r: np.ndarray


class Bodies(NamedTuple):
    """The same signals of every body in its own axes, (n+1, 3) each."""

    w: np.ndarray
    w_r: np.ndarray
    al_r: np.ndarray
    a_r: np.ndarray


@kernel
def axis_rotation(axis, angle):
    """Rodrigues: the rotation about a unit ``axis`` by ``angle`` [rad]."""
    sine, cosine = sincos(angle)
    return cosine * identity3() + sine * skew(axis) + (1.0 - cosine) * outer(axis, axis)


@kernel
def posed(p, theta, rotation):
    """The tree of the robot ``p`` at joint angles ``theta`` (n,); fills ``rotation`` (n, 3, 3), which the tree keeps."""
    for i in range(len(p.parent)):
        rotation[i] = mat3(p.fixed_rotation[i]) @ axis_rotation(vec3(p.axis[i]), theta[i])
    return Tree(p.parent, rotation, p.offset, p.axis)


@kernel
def actual_motion(w, al, a, thd, thdd):
    """The motion as it is, without references."""
    return Motion(w, w, al, a, thd, thd, thdd)


@kernel
def body_motion(tree, motion, bodies):
    """Outward recursion, equations (8), (13), (14), from the base's motion to that of all ``bodies``.

    w+ = R^T w + z thd;  w_r+ = R^T w_r + z thd_r;  al+ = R^T al + z thdd_r + (R^T w_r) x z thd;
    a+ = R^T (a + al x P + w x (w_r x P)); each in the body's own axes.
    """
    bodies.w[0], bodies.w_r[0], bodies.al_r[0], bodies.a_r[0] = motion.w, motion.w_r, motion.al_r, motion.a_r
    for i in range(len(tree.parent)):
        b = tree.parent[i]
        w, w_r, al_r, a_r = vec3(bodies.w[b]), vec3(bodies.w_r[b]), vec3(bodies.al_r[b]), vec3(bodies.a_r[b])
        inward, offset, axis = transpose(mat3(tree.rotation[i])), vec3(tree.offset[i]), vec3(tree.axis[i])
        spin, turned = motion.thd[i] * axis, inward @ w_r
        bodies.w[i + 1] = inward @ w + spin
        bodies.w_r[i + 1] = turned + motion.thd_r[i] * axis
        bodies.al_r[i + 1] = inward @ al_r + motion.thdd_r[i] * axis + cross(turned, spin)
        bodies.a_r[i + 1] = inward @ (a_r + cross(al_r, offset) + cross(w, cross(w_r, offset)))


@kernel
def to_parent(tree, i, force, moment):
    """Equations (18), (19): force and moment on body i+1 about its origin, as joint i hands them to the parent."""
    rotation = mat3(tree.rotation[i])
    turned = rotation @ force
    return turned, rotation @ moment + cross(vec3(tree.offset[i]), turned)
