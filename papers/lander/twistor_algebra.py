"""Twistors by the algebra of dual quaternions alone, from their definition: what the printed formulas are held against.

B = (Q - 1)(Q + 1)^-1 of the unit dual quaternion Q = q + eps (1/2) r^D q, its inverse Q = (1 + B)(1 - B)^-1. Arrays of
eight numbers in the paper's order [vector, scalar | vector, scalar]; complex ones too, for complex-step derivatives.
Nothing here is used in flight.
"""

import numpy as np

ONE = np.array([0.0, 0, 0, 1, 0, 0, 0, 0])
STEP = 1e-40  # [1] of a complex-step derivative, which has no cancellation
FREE = (0, 1, 2, 4, 5, 6)  # places of b1, b2, b3, b5, b6, b7


def twistors(count=200) -> np.ndarray:
    """Random twistors (count, 8) with |b| up to 1 and b' up to some 100 m."""
    random = np.random.default_rng(2020)
    drawn = np.zeros((count, 8))
    drawn[:, 0:3] = random.uniform(-0.57, 0.57, (count, 3))
    drawn[:, 4:7] = random.uniform(-100.0, 100.0, (count, 3))
    return drawn


def hamilton(a, b) -> np.ndarray:
    """Product of quaternions (4,), scalar last."""
    return np.array([*(a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])), a[3] * b[3] - a[:3] @ b[:3]])


def multiply(p, q) -> np.ndarray:
    """Product of dual quaternions (8,)."""
    return np.concatenate([hamilton(p[:4], q[:4]), hamilton(p[:4], q[4:]) + hamilton(p[4:], q[:4])])


def conjugate(q) -> np.ndarray:
    """q* of a quaternion (4,)."""
    return np.array([-q[0], -q[1], -q[2], q[3]])


def inverse(p) -> np.ndarray:
    """p^-1 of a dual quaternion (8,): (1 - eps a^-1 c) a^-1 for p = a + eps c."""
    real = conjugate(p[:4]) / (p[:4] @ p[:4])
    return np.concatenate([real, -hamilton(hamilton(real, p[4:]), real)])


def twistor_of(dual) -> np.ndarray:
    """B (8,) of a dual quaternion, unit or not."""
    return multiply(dual - ONE, inverse(dual + ONE))


def dual_of(b) -> np.ndarray:
    """Q (8,) of a twistor."""
    return multiply(ONE + b, inverse(ONE - b))


def dual_of_pose(r, q) -> np.ndarray:
    """Q (8,) of r^D (3,) [m] and of a quaternion (4,), B -> D."""
    return np.concatenate([q, 0.5 * hamilton(np.array([*r, 0.0]), q)])


def position(b) -> np.ndarray:
    """r^D (3,) = 2 q' q* [m]."""
    dual = dual_of(b)
    return 2.0 * hamilton(dual[4:], conjugate(dual[:4]))[:3]


def body_position(b) -> np.ndarray:
    """r^B (3,) = 2 q* q' [m]."""
    dual = dual_of(b)
    return 2.0 * hamilton(conjugate(dual[:4]), dual[4:])[:3]


def cosine(b):
    """r^B_z/|r|: the cosine between the camera's axis -z_B and the line of sight from B to the site."""
    r = body_position(b)
    return r[2] / np.sqrt(r @ r)


def rate(b, motor) -> np.ndarray:
    """dB/dt (8,) = (1/4)(1 + B) V (1 - B) of a motor V (8,), which follows from dQ/dt = (1/2) Q V."""
    return 0.25 * multiply(multiply(ONE + b, motor), ONE - b)


def derivatives(function, x, places=FREE) -> np.ndarray:
    """d function/d x_i as rows (len(x), ...); those of other places are left zero."""
    rows = []
    for i in range(len(x)):
        moved = x.astype(complex)
        moved[i] += 1j * STEP
        rows.append(np.imag(function(moved)) / STEP if i in places else np.zeros(np.shape(function(x))))
    return np.array(rows)
