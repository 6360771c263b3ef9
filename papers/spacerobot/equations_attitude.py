"""Equations (3)-(6) as printed, against rotation matrices: one function a row of the claims table.

Source: Aerospace 2023, 10(8), 679, section 2.2.2. The arguments and answers are those of `papers.spacerobot.equations`.
"""

import numpy as np
from scipy.linalg import expm

from papers.spacerobot.equations import EXACT, STATES, agree, worst
from papers.spacerobot.inertial_frame import cross_matrix, vector_of
from papers.spacerobot.lagrangian import STEP, attitude, body_rates_matrix


def printed_rates_matrix(angles) -> np.ndarray:
    """N_phi of (3)."""
    (sa, sb, _), (ca, cb, _) = np.sin(angles), np.cos(angles)
    return np.array([[0.0, -sa, ca * cb], [0.0, ca, sa * cb], [1.0, 0.0, -sb]])


def euler_rates(corrected: bool = False):
    """(3): N gives the angular velocity of (5), (6) and (8), which is in body axes."""
    angles = np.random.default_rng(3).uniform(-1.5, 1.5, (STATES, 3))
    if corrected:
        def matrix(one):
            (_, sb, sg), (_, cb, cg) = np.sin(one), np.cos(one)
            return np.array([[-sb, 0.0, 1.0], [sg * cb, cg, 0.0], [cg * cb, -sg, 0.0]])
    else:
        matrix = printed_rates_matrix
    inertial = worst((printed_rates_matrix(one), attitude(one) @ body_rates_matrix(one)) for one in angles)
    return agree(((matrix(one), body_rates_matrix(one)) for one in angles),
                 f"; the printed N against the velocity in inertial axes {inertial:.1e}")


def euler_singularity(corrected: bool = False):
    """Below (3): N cannot be inverted where cos alpha is zero (corrected: cos beta)."""
    angles = np.random.default_rng(3).uniform(-1.4, 1.4, (STATES, 3))
    angles[:, 1 if corrected else 0] = np.pi / 2.0
    found = [abs(np.linalg.det(printed_rates_matrix(one))) for one in angles]
    return bool(max(found) < EXACT), f"|det N| there: {min(found):.2g} to {max(found):.2g}"


def rotation_of(q) -> np.ndarray:
    """R = E + 2 q0 q^x + 2 q^x q^x of a quaternion (4,), scalar first."""
    skew = cross_matrix(q[1:])
    return np.eye(3) + 2.0 * q[0] * skew + 2.0 * skew @ skew


def axis_angle(factor: float = 1.0):
    """(4): Q of axis and angle has norm one and is the rotation by that angle. factor: of the half angle."""
    draw, pairs = np.random.default_rng(4), []
    for psi in draw.uniform(-np.pi, np.pi, STATES):
        axis = draw.standard_normal(3)
        axis /= np.linalg.norm(axis)
        q = np.concatenate([[np.cos(factor * psi / 2.0)], np.sin(factor * psi / 2.0) * axis])
        pairs += [(rotation_of(q), expm(psi * cross_matrix(axis))), (q @ q, 1.0)]
    return agree(pairs)


def unique_quaternion(largest: float = 180.0):
    """Below (4): one Q with q0 > 0 for each attitude. largest: turn [deg] that is looked at besides one of 90 deg."""
    found = {}
    for psi in (90.0, largest):
        q0 = np.cos(np.radians(psi) / 2.0)
        count = sum(one > EXACT for one in (q0, -q0))  # of Q and -Q
        found[f"a turn of {psi:g} deg"] = count == 1, f"{count} with q0 > 0"
    return found


def quaternion_of(rotation):
    """Q with q0 > 0 of a rotation (3, 3), which may be complex."""
    q0 = 0.5 * np.sqrt(1.0 + np.trace(rotation))
    return np.concatenate([[q0], vector_of(rotation - rotation.T) / (4.0 * q0)])


def quaternion_rates(factor: float = 1.0):
    """(5) is the kinematics of a body with angular velocity in its own axes, (6) its inverse. factor: of the terms q^x."""
    draw, pairs = np.random.default_rng(5), []
    for _ in range(STATES):
        start, w = expm(cross_matrix(draw.uniform(-1.0, 1.0, 3))), draw.standard_normal(3)
        rate = np.imag(quaternion_of(start + 1j * STEP * start @ cross_matrix(w))) / STEP
        q0, q = quaternion_of(start)[0], quaternion_of(start)[1:]
        skew = factor * cross_matrix(q)
        pairs += [(0.5 * np.concatenate([[-q @ w], (q0 * np.eye(3) + skew) @ w]), rate),
                  (2.0 * (q0 * q0 * np.eye(3) - q0 * skew + np.outer(q, q)) / q0 @ rate[1:], w)]
    return agree(pairs)
