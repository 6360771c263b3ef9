"""Arrays of quaternions x, y, z, w (n, 4) for viewers; what flies has `flight_math`."""

import numpy as np


def multiply(first, second) -> np.ndarray:
    """Quaternions (n, 4) of the second rotation, then the first."""
    x, y, z, w = (first[:, i] for i in range(4))
    a, b, c, d = (second[:, i] for i in range(4))
    return np.stack([w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d,
                     w * d - x * a - y * b - z * c], axis=1)


def rotate(turn, vectors) -> np.ndarray:
    """Vectors (n, 3) turned by quaternions (n, 4)."""
    axis = turn[:, :3]
    half = np.cross(axis, vectors) + turn[:, 3:] * vectors
    return vectors + 2.0 * np.cross(axis, half)


def inverse(turn) -> np.ndarray:
    """The opposite rotations (n, 4)."""
    return turn * np.array([-1.0, -1.0, -1.0, 1.0])


def about(axis, angles) -> np.ndarray:
    """Quaternions (n, 4) of angles (n,) [rad] about an axis (3,)."""
    unit = np.asarray(axis, float) / np.linalg.norm(axis)
    half = 0.5 * np.asarray(angles, float)[:, None]
    return np.concatenate([np.sin(half) * unit, np.cos(half)], axis=1)


def slerp(begin, end, part) -> np.ndarray:
    """Quaternions (n, 4) on the short way from begin to end, at parts (n, 1) from 0 to 1."""
    cosine = np.sum(begin * end, axis=1, keepdims=True)
    end, cosine = np.where(cosine < 0.0, -end, end), np.minimum(np.abs(cosine), 1.0)
    angle = np.arccos(cosine)
    near = angle < 1e-6  # [rad]
    sine = np.where(near, 1.0, np.sin(angle))
    mixed = np.where(near, 1.0 - part, np.sin((1.0 - part) * angle) / sine) * begin + np.where(
        near, part, np.sin(part * angle) / sine) * end
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
