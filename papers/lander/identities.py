"""What the paper's appendices print, checked on the code that flies: one function a row of the claims table.

Each draws 200 random twistors, evaluates the printed matrix by its kernel in `lander_ros`, and compares it with a
complex- step derivative or with dual-quaternion algebra written out here. The same identities are proved symbolically
in tests/lander/test_appendix_a.py. Each returns (holds, what was found).
"""

from typing import NamedTuple

import numpy as np

from flight_math import DualVector, Vec3
from lander_ros import constraints, twistor_kinematics

EXACT = 1e-12  # [1] largest relative difference that rounding explains
STEP = 1e-40  # [1] of a complex-step derivative, which has no cancellation


class Funnel(NamedTuple):
    """The parameters of eq. (53)."""

    funnel_alpha: float
    funnel_beta: float
    funnel_gamma: float


def twistors(count=200) -> np.ndarray:
    """Random twistors (count, 8) with |b| up to 1 and b' up to some 100 m."""
    random = np.random.default_rng(2020)
    drawn = np.zeros((count, 8))
    drawn[:, 0:3] = random.uniform(-0.57, 0.57, (count, 3))
    drawn[:, 4:7] = random.uniform(-100.0, 100.0, (count, 3))
    return drawn


def position(b) -> np.ndarray:
    """r^D (3,) = 4 N(b) b'/(1 + |b|^2)^2, for complex numbers too."""
    v, d = b[0:3], b[4:7]
    n = v @ v
    return 4.0 / (1.0 + n) ** 2 * ((1.0 - n) * d + 2.0 * np.cross(v, d) + 2.0 * (v @ d) * v)


def body_position(b) -> np.ndarray:
    """r^B (3,) = 4 N(b)^T b'/(1 + |b|^2)^2."""
    v, d = b[0:3], b[4:7]
    n = v @ v
    return 4.0 / (1.0 + n) ** 2 * ((1.0 - n) * d - 2.0 * np.cross(v, d) + 2.0 * (v @ d) * v)


def derivatives(function, b) -> np.ndarray:
    """d function/d b_i as rows (8, ...); those of the scalar slots are left zero."""
    rows = []
    for i in range(8):
        moved = b.astype(complex)
        moved[i] += 1j * STEP
        rows.append(np.imag(function(moved)) / STEP if i not in (3, 7) else np.zeros(np.shape(function(b))))
    return np.array(rows)


def value(b) -> DualVector:
    """A twistor as the kernels take it."""
    return DualVector(Vec3(*b[0:3]), Vec3(*b[4:7]))


def matrix(block) -> np.ndarray:
    """A Mat3 as an array (3, 3)."""
    return np.reshape(block.parts(), (3, 3))


def worst(pairs):
    """(holds, text) of pairs (printed, true), by the largest difference relative to the largest entry."""
    error = max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in pairs)
    return error < EXACT, f"largest relative difference {error:.1e} at 200 random twistors"


def position_jacobian():
    """Appendix A (1)."""
    def printed(b):
        first, second = map(matrix, twistor_kinematics.position_jacobian(value(b)))
        return np.vstack([first, np.zeros((1, 3)), second, np.zeros((1, 3))])
    return worst((printed(b), derivatives(position, b)) for b in twistors())


def view_gradient():
    """Appendix A (2): the gradient of r^B_z/|r^B|."""
    def cosine(b):
        r = body_position(b)
        return r[2] / np.sqrt(r @ r)

    def printed(b):
        gradient = constraints.view_gradient_printed(value(b))
        return np.array([*gradient.real, 0.0, *gradient.dual, 0.0])
    return worst((printed(b), derivatives(cosine, b)) for b in twistors())


def pi_inverse_transpose():
    """Appendix A (3): r^B = Pi^-T b'."""
    return worst((matrix(twistor_kinematics.pi_inverse_transpose(value(b))) @ b[4:7], body_position(b))
                 for b in twistors())


def terrain_gradient():
    """Eq. (53), with x_D, y_D read as x_BD^D, y_BD^D."""
    def pair(b):
        r, (alpha, beta, gamma) = position(b), (27.0, 1.2, 1.0 / 3.0)
        p = Funnel(alpha, beta, gamma)
        out = np.array(constraints.terrain_gradient_printed(p, 1.0, Vec3(*r)))
        rows = []
        for i in range(3):
            moved = r.astype(complex)
            moved[i] += 1j * STEP
            rows.append(np.imag((alpha * (moved[0] ** 2 + beta * moved[1] ** 2)) ** gamma - moved[2]) / STEP)
        return out, np.array(rows)
    return worst(pair(b) for b in twistors())


def multiply(p, q) -> np.ndarray:
    """Product of dual quaternions (8,) in the order [vector, scalar | vector, scalar]."""
    def hamilton(a, b):
        return np.array([*(a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])), a[3] * b[3] - a[:3] @ b[:3]])
    return np.concatenate([hamilton(p[:4], q[:4]), hamilton(p[:4], q[4:]) + hamilton(p[4:], q[:4])])


def rate(b, motor) -> np.ndarray:
    """dB/dt = (1/4)(1 + B) V (1 - B) by dual-quaternion algebra."""
    one = np.array([0.0, 0, 0, 1, 0, 0, 0, 0])
    return 0.25 * multiply(multiply(one + b, motor), one - b)


def gamma_pairs(transposed):
    motors = twistors()[::-1]
    for b, motor in zip(twistors(), motors):
        gamma = np.zeros((8, 8))
        blocks, corners = twistor_kinematics.gamma_blocks(value(b)), twistor_kinematics.gamma_scalars(value(b))
        for (row, column), block, corner in zip(((0, 0), (0, 4), (4, 4)), (*blocks, blocks[0]), (*corners, corners[0])):
            gamma[row:row + 3, column:column + 3], gamma[row + 3, column + 3] = matrix(block), corner
        yield 0.25 * (gamma.T if transposed else gamma) @ motor, rate(b, motor)


def gamma_transposed():
    """Appendix A (4), read as dB/dt = (1/4) Gamma^T V."""
    return worst(gamma_pairs(True))


def gamma_as_kinematic_matrix():
    """Appendix A (4), read as dB/dt = (1/4) Gamma V."""
    return worst(gamma_pairs(False))


def appendix_b_terms(equal):
    """V1' and V2' at random states and weights; equal: p_eps q = p q_eps. Returns (V1', V2', scale) arrays (200,)."""
    random = np.random.default_rng(2427)
    found = []
    for _ in range(200):
        w, alpha, zeta, eta = random.normal(size=(4, 3))
        root = random.normal(size=(3, 3))
        j, m = root @ root.T, random.uniform(0.5, 2.0)
        k_a, k_w = random.uniform(0.5, 2.0, 2)
        k_w = k_a if equal else k_w
        beta, total = alpha + eta, w + zeta
        v1 = m * k_a * alpha @ np.cross(w, beta) + k_w * w @ (np.cross(w, j @ total) + m * np.cross(alpha, beta))
        v2 = (k_a * alpha @ (m * np.cross(zeta, alpha) - m * (np.cross(w, eta) + np.cross(alpha, zeta)))
              + k_w * w @ (np.cross(zeta, j @ w) + m * np.cross(eta, alpha) - j @ np.cross(w, zeta)))
        found.append((v1, v2, 1.0 + m * np.linalg.norm(j) * np.linalg.norm(total) * np.linalg.norm(w)))
    return np.array(found).T


def power_cancels():
    """Appendix B: V1' + V2' = 0 for any weights."""
    v1, v2, scale = appendix_b_terms(False)
    error = float(np.abs((v1 + v2) / scale).max())
    return error < EXACT, f"largest |V1' + V2'| {error:.1e} of the terms, at 200 random states and weights"


def power_vanishes_alone():
    """Appendix B, read as V1' = 0 and V2' = 0 for any weights."""
    v1, v2, scale = appendix_b_terms(False)
    v1_equal, v2_equal, scale_equal = appendix_b_terms(True)
    error = float(np.maximum(np.abs(v1), np.abs(v2)).max())
    equal = float((np.maximum(np.abs(v1_equal), np.abs(v2_equal)) / scale_equal).max())
    return error < EXACT, f"largest |V1'|, |V2'|: {error:.2g} W; with p_eps q = p q_eps: {equal:.1e}"
