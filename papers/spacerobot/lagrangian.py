"""The same robot by Lagrange's equations, in coordinates: position of the base, Euler angles, joint angles.

The paper writes its control law for coordinates Theta with M(Theta) and D(Theta): here they are. q (6+n,) = [position,
alpha, beta, gamma, theta], attitude R = Z(alpha) Y(beta) X(gamma), section 2.2.2. Every coordinate but the position is a
turn about an axis through a point, which gives the Jacobians. All functions take complex q, so that derivatives along
any direction are complex steps without cancellation.
"""

import numpy as np

from papers.spacerobot.inertial_frame import Arm, Motion, cross_matrix, spinning, tensor, turn, vector_of

STEP = 1e-30  # [-] of complex steps


def attitude(angles) -> np.ndarray:
    """R (3, 3) of Euler angles [alpha, beta, gamma]: Z, then Y, then X."""
    return turn(2, angles[0]) @ turn(1, angles[1]) @ turn(0, angles[2])


def along(function, point, direction):
    """Derivative of ``function`` at ``point`` along ``direction``."""
    return np.imag(function(point + 1j * STEP * direction)) / STEP


def body_rates_matrix(angles) -> np.ndarray:
    """N (3, 3), w = N angles_dot in body axes, column by column from the rotation matrix."""
    rotation = attitude(angles)
    return np.stack([vector_of(rotation.T @ along(attitude, angles, direction)) for direction in np.eye(3)], axis=1)


def _axes(arm, q):
    """Axes and points of the turns, rotations and origins of the bodies; inertial axes."""
    origin, rotation = q[:3], attitude(q[3:6])
    axes = [np.array([0.0, 0.0, 1.0]), turn(2, q[3])[:, 1], (turn(2, q[3]) @ turn(1, q[4]))[:, 0]]
    points, placed = [origin] * 3, [(rotation, origin)]
    for i, offset in enumerate(arm.offset):
        origin = origin + rotation @ offset
        rotation = rotation @ turn(0, arm.alpha[i]) @ turn(2, q[6 + i])
        axes.append(rotation[:, 2])
        points.append(origin)
        placed.append((rotation, origin))
    return axes, points, placed


def mass_matrix(arm: Arm, q, pi=None) -> np.ndarray:
    """M (6+n, 6+n) of the kinetic energy 1/2 q_dot^T M q_dot, linear in ``pi`` (n+1, 10)."""
    axes, points, placed = _axes(arm, q)
    size = len(q)
    found = np.zeros((size, size), dtype=np.result_type(q, float))
    for b, ((rotation, origin), ten) in enumerate(zip(placed, arm.pi if pi is None else pi)):
        spin, move = np.zeros((3, size), found.dtype), np.zeros((3, size), found.dtype)
        move[:, :3] = np.eye(3)
        for k in range(3 + b):
            spin[:, 3 + k] = axes[k]
            move[:, 3 + k] = np.cross(axes[k], origin - points[k])
        coupling = move.T @ cross_matrix(rotation @ ten[6:9]).T @ spin
        found += ten[9] * move.T @ move + coupling + coupling.T + spin.T @ rotation @ tensor(ten[:6]) @ rotation.T @ spin
    return found


def reduced_mass_matrix(arm: Arm, q, pi=None) -> np.ndarray:
    """M (3+n, 3+n) of attitude and joints when the centre of mass rests: the position is eliminated."""
    full = mass_matrix(arm, q, pi)
    return full[3:, 3:] - full[3:, :3] @ np.linalg.solve(full[:3, :3], full[:3, 3:])


def coriolis_matrix(matrix, q, rate) -> np.ndarray:
    """D with D rate the velocity terms of Lagrange's equations, by Christoffel symbols of ``matrix``(q)."""
    slopes = np.array([along(matrix, q, direction) for direction in np.eye(len(q))])  # [k, i, j] dM_ij / dq_k
    slopes = slopes[-matrix(q).shape[0]:]
    return 0.5 * (np.einsum("kij,k->ij", slopes, rate) + np.einsum("jik,k->ij", slopes, rate)
                  - np.einsum("ijk,k->ij", slopes, rate))


def motion_of(q, rate, second) -> Motion:
    """The motion in inertial axes of coordinates (6+n,), their rates and second derivatives."""
    turns = [spinning(turn(axis, q[k]), rate[k] * np.eye(3)[axis], second[k] * np.eye(3)[axis])
             for axis, k in ((2, 3), (1, 4), (0, 5))]
    rotation = turns[0].times(turns[1]).times(turns[2])
    value, change = rotation.value, rotation.rate
    return Motion(value, vector_of(value.T @ change), vector_of(value.T @ rotation.second + change.T @ change), rate[:3],
                  second[:3], q[6:], rate[6:], second[6:])


def generalised(q, torque) -> np.ndarray:
    """Forces of the coordinates (6+n,) of base force and moment and joint torques (6+n,) in base axes."""
    return np.concatenate([attitude(q[3:6]) @ torque[:3], body_rates_matrix(q[3:6]).T @ torque[3:6], torque[6:]])
