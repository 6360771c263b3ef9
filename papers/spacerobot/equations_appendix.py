"""Appendix A as printed, against the dynamics in inertial axes: one function a row of the claims table.

Source: Aerospace 2023, 10(8), 679, appendix A. The arguments and answers are those of `papers.spacerobot.equations`.
"""

from typing import NamedTuple

import numpy as np

from papers.spacerobot.equations import JOINTS, agree, in_body, states
from papers.spacerobot.inertial_frame import angular_velocity, bodies, cross_matrix, joint_wrenches, momenta, turn


class Body(NamedTuple):
    """One body in its own axes: w, w_dot, acceleration of its origin and of its centre of mass, velocity of the origin;
    mass, centre of mass, inertia about it and about the origin, pi; ``moment`` on it about its origin, by its momentum."""

    w: np.ndarray
    al: np.ndarray
    a: np.ndarray
    center_a: np.ndarray
    v: np.ndarray
    mass: float
    c: np.ndarray
    inertia: np.ndarray
    about_origin: np.ndarray
    pi: np.ndarray
    moment: np.ndarray


def body(arm, motion, i) -> Body:
    """Body i of a robot in motion."""
    rotation, origin = bodies(arm, motion)[i]
    w, al = (in_body(rotation, one) for one in angular_velocity(rotation))
    part = momenta(arm.pi[i], rotation, origin)
    return Body(w, al, in_body(rotation, origin.second), in_body(rotation, origin.second + rotation.second @ arm.center[i]),
                in_body(rotation, origin.rate), arm.mass[i], arm.center[i], arm.inertia[i], arm.inertia_about_origin[i],
                arm.pi[i], in_body(rotation, part.moment - np.cross(origin.value, part.force)))


def every_body():
    """Every body of the random robots."""
    return (body(arm, motion, i) for arm, motion in states() for i in range(JOINTS + 1))


def spread(c) -> np.ndarray:
    """c^T c E - c c^T (3, 3)."""
    return c @ c * np.eye(3) - np.outer(c, c)


def moment_about_origin(corrected: bool = False):
    """(A1): N + P x F, its first and second line. Corrected: omega and v_dot where omega_dot is printed for them."""
    def lines(b):
        turning, center, origin = (b.w, b.center_a, b.a) if corrected else (b.al, b.al, b.al)
        spin = b.inertia @ b.al + np.cross(turning, b.inertia @ b.w)
        bracket = origin + np.cross(b.al, b.c) + np.cross(turning, np.cross(b.w, b.c))
        return spin + np.cross(b.c, b.mass * center), spin + b.mass * np.cross(b.c, bracket)
    return {name: agree((lines(b)[k], b.moment) for b in every_body()) for k, name in enumerate(("line 1", "line 2"))}


def nonlinear(about_origin: bool = False):
    """(19) is not linear in inertia, first moment and mass, for m P^2. about_origin: with the inertia of (A7) it is."""
    def moment(b, inertia, first, mass):
        found = inertia @ b.al + np.cross(b.w, inertia @ b.w) + np.cross(first, b.a)
        if about_origin:
            return found
        return found + np.cross(first, np.cross(b.al, first) + np.cross(b.w, np.cross(b.w, first))) / mass
    pairs, every = [], list(every_body())
    for b, other in zip(every, every[1:]):
        two = [(one.about_origin if about_origin else one.inertia, one.mass * one.c, one.mass) for one in (b, other)]
        apart = moment(b, *two[0]) + moment(b, *two[1])
        pairs.append((apart, moment(b, *(x + y for x, y in zip(*two)))))
        if np.abs(moment(b, *two[0]) - b.moment).max() > 1e-9 * np.abs(b.moment).max():
            raise ArithmeticError("this is not the moment of (19)")
    held, text = agree(pairs)
    return not held, text


def third_term(factor: float = 1.0):
    """(A2): P x m v_dot_C in three terms. factor: of P x (omega_dot x P)."""
    return agree((b.mass * np.cross(b.c, b.a) + factor * b.mass * np.cross(b.c, np.cross(b.al, b.c))
                  + b.mass * np.cross(b.c, np.cross(b.w, np.cross(b.w, b.c))), np.cross(b.c, b.mass * b.center_a))
                 for b in every_body())


def angular_acceleration_term(factor: float = 1.0):
    """(A3): P x (omega_dot x P) by the tensor. factor: of P P^T."""
    return agree((b.mass * (b.c @ b.c * np.eye(3) - factor * np.outer(b.c, b.c)) @ b.al,
                  b.mass * np.cross(b.c, np.cross(b.al, b.c))) for b in every_body())


def centripetal_term(corrected: bool = False):
    """(A4), last line: P x (omega x (omega x P)) by the tensor times omega_dot (corrected: omega)."""
    return agree((np.cross(b.w, b.mass * spread(b.c) @ (b.w if corrected else b.al)),
                  b.mass * np.cross(b.c, np.cross(b.w, np.cross(b.w, b.c)))) for b in every_body())


def parallel_axis(corrected: bool = False):
    """(A5): N + P x F in two lines; the first has (A4)'s last term (corrected: omega), the second I about the origin."""
    def first(b):
        return (b.inertia @ b.al + np.cross(b.w, b.inertia @ b.w) + b.mass * np.cross(b.c, b.a)
                + b.mass * spread(b.c) @ b.al + np.cross(b.w, b.mass * spread(b.c) @ (b.w if corrected else b.al)))

    def second(b):
        return b.about_origin @ b.al + np.cross(b.w, b.about_origin @ b.w) + b.mass * np.cross(b.c, b.a)
    return {"terms": agree((first(b), b.moment) for b in every_body()),
            "sum": agree((second(b), b.moment) for b in every_body())}


def joint_rotation(arm, motion, i) -> np.ndarray:
    """Axes of body i+1 in those of body i."""
    return turn(0, arm.alpha[i]) @ turn(2, motion.theta[i])


def moments_inward(factor: float = 1.0):
    """(A6): the moment on every body with all that hangs on it. factor: of m P_C x v_dot."""
    pairs = []
    for arm, motion in states():
        force, moment = joint_wrenches(arm.pi, arm, motion)
        for i in range(JOINTS + 1):
            b = body(arm, motion, i)
            found = b.about_origin @ b.al + np.cross(b.w, b.about_origin @ b.w) + factor * b.mass * np.cross(b.c, b.a)
            if i < JOINTS:
                joint = joint_rotation(arm, motion, i)
                found = found + joint @ moment[i + 1] + np.cross(arm.offset[i], joint @ force[i + 1])
            pairs.append((found, moment[i]))
    return agree(pairs)


def inertia_columns(v) -> np.ndarray:
    """K(v) (3, 6)."""
    x, y, z = v
    return np.array([[x, y, z, 0.0, 0.0, 0.0], [0.0, x, 0.0, y, z, 0.0], [0.0, 0.0, x, 0.0, y, z]])


def moment_columns(w, al, a, factor=1.0) -> np.ndarray:
    """[K(al) + S(w) K(w), -S(a), 0] (3, 10)."""
    return np.hstack([inertia_columns(al) + cross_matrix(w) @ inertia_columns(w), -factor * cross_matrix(a),
                      np.zeros((3, 1))])


def force_columns(w, al, a) -> np.ndarray:
    """[0, S(al) + S(w) S(w), a] (3, 10)."""
    return np.hstack([np.zeros((3, 6)), cross_matrix(al) + cross_matrix(w) @ cross_matrix(w), a[:, None]])


def last_body(factor: float = 1.0):
    """(A7), (A8): the moment on the last body, linear in its ten parameters. factor: of S(v_dot)."""
    last = (body(arm, motion, JOINTS) for arm, motion in states())
    return agree((moment_columns(b.w, b.al, b.a, factor) @ b.pi, b.moment) for b in last)


def own_block(corrected: bool = False):
    """(A10), i = j: as the text has it, K(omega) and S(v) (corrected: with the dots that (A8) has)."""
    return agree((moment_columns(b.w, *((b.al, b.a) if corrected else (b.w, b.v))) @ b.pi, b.moment) for b in every_body())


def _printed_block(b):
    """(A10), i < j, with all dots restored."""
    return moment_columns(b.w, b.al, b.a) + force_columns(b.w, b.al, b.a)


def outer_blocks(corrected: bool = False):
    """(A10), i < j: moments on the bodies, the lost dots restored. Corrected: R and P carry moment and force inward."""
    pairs = []
    for arm, motion in states():
        _, moment = joint_wrenches(arm.pi, arm, motion)
        every = [body(arm, motion, j) for j in range(JOINTS + 1)]
        for i in range(JOINTS):
            found = moment_columns(every[i].w, every[i].al, every[i].a) @ every[i].pi
            for j in range(i + 1, JOINTS + 1):
                block = _carried(arm, motion, every[j], i, j) if corrected else _printed_block(every[j])
                found = found + block @ every[j].pi
            pairs.append((found, moment[i]))
    return agree(pairs)


def _carried(arm, motion, b, i, j):
    """[R B_moment + S(P) R B_force] of body j on body i."""
    rotation, offset = np.eye(3), np.zeros(3)
    for k in range(i, j):
        offset = offset + rotation @ arm.offset[k]
        rotation = rotation @ joint_rotation(arm, motion, k)
    return (rotation @ moment_columns(b.w, b.al, b.a)
            + cross_matrix(offset) @ rotation @ force_columns(b.w, b.al, b.a))


def torque_is_moment(corrected: bool = False):
    """(A9), (A11): the column n_b ... n_n is tau, one a coordinate (corrected: n_b and the components along the axes).

    Judged by number, then by power: tau on the rates is the change of the kinetic energy.
    """
    rows = 3 + JOINTS if corrected else 3 * (1 + JOINTS)
    if rows != 3 + JOINTS:
        return False, f"{rows} rows for {3 + JOINTS} coordinates: moments, not torques"
    pairs = []
    for arm, motion in states():
        _, moment = joint_wrenches(arm.pi, arm, motion)
        pairs.append((moment[0] @ motion.w + moment[1:, 2] @ motion.thd, _power(arm, motion)))
    return agree(pairs)


def _power(arm, motion):
    """Rate of the kinetic energy [W]."""
    found = 0.0
    for pi, (rotation, origin) in zip(arm.pi, bodies(arm, motion)):
        part, w = momenta(pi, rotation, origin), angular_velocity(rotation)[0]
        found += part.force @ (origin.rate - np.cross(w, origin.value)) + part.moment @ w
    return found
