"""What Appendix A prints, checked on the code that flies: one function a row of the claims table.

Each draws 200 random twistors and evaluates the printed matrix by its kernel in `lander_ros`. The other side is dual-
quaternion algebra from the definition of the twistor and complex-step derivatives (`papers.lander.twistor_algebra`).
The same identities are proved symbolically in tests/lander/test_appendix_a.py. Each returns (holds, what was found), or
several of them by label. Arguments change an entry of what is printed; their defaults change nothing.
"""

from typing import NamedTuple

import numpy as np

from flight_math import DualVector, Vec3
from lander_ros import constraints, twistor_kinematics
from papers.lander import twistor_algebra as algebra
from papers.lander.twistor_algebra import derivatives, twistors

EXACT = 1e-12  # [1] largest relative difference that rounding explains
ALPHA, BETA, GAMMA = 27.0, 1.2, 1.0 / 3.0  # of the funnel (ours)


class Funnel(NamedTuple):
    """The parameters of eq. (53)."""

    funnel_alpha: float
    funnel_beta: float
    funnel_gamma: float


def value(b) -> DualVector:
    """A twistor as the kernels take it."""
    return DualVector(Vec3(*b[0:3]), Vec3(*b[4:7]))


def matrix(block) -> np.ndarray:
    """A Mat3 as an array (3, 3)."""
    return np.reshape(block.parts(), (3, 3))


def worst(pairs, limit=EXACT):
    """(holds, text) of pairs (printed, true), by the largest difference relative to the largest entry."""
    error = max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in pairs)
    return error < limit, f"largest relative difference {error:.1e} at 200 random twistors"


def printed_jacobian(b, a_33=1.0) -> np.ndarray:
    """Appendix A (1) as printed, (8, 3), its entry A33 times a factor."""
    first, second = map(matrix, twistor_kinematics.position_jacobian(value(b)))
    first[2, 2] *= a_33
    return np.vstack([first, np.zeros((1, 3)), second, np.zeros((1, 3))])


def printed_view_gradient(b, row_7=1.0) -> np.ndarray:
    """Appendix A (2) as printed, (8,), its seventh row times a factor."""
    gradient = constraints.view_gradient_printed(value(b))
    return np.array([*gradient.real, 0.0, *gradient.dual, 0.0]) * [1, 1, 1, 1, 1, 1, row_7, 1]


def printed_gamma(b, gamma_2=1.0) -> np.ndarray:
    """Appendix A (4) as printed, (8, 8), its block Gamma2 times a factor."""
    gamma = np.zeros((8, 8))
    first, second = map(matrix, twistor_kinematics.gamma_blocks(value(b)))
    corner, corner_dual = twistor_kinematics.gamma_scalars(value(b))
    for row, column, block, scalar in ((0, 0, first, corner), (4, 4, first, corner),
                                       (0, 4, gamma_2 * second, gamma_2 * corner_dual)):
        gamma[row:row + 3, column:column + 3], gamma[row + 3, column + 3] = block, scalar
    return gamma


def printed_terrain_gradient(r, row_2=1.0) -> np.ndarray:
    """Eq. (53) as printed (3,) with k_f1 = 1, its second row times a factor."""
    return np.array(constraints.terrain_gradient_printed(Funnel(ALPHA, BETA, GAMMA), 1.0, Vec3(*r))) * [1.0, row_2, 1.0]


def terrain_function(r):
    """f1 of eq. (53) up to a constant, k_f1 = 1."""
    return (ALPHA * (r[0] ** 2 + BETA * r[1] ** 2)) ** GAMMA - r[2]


def position_jacobian(a_33=1.0):
    """Appendix A (1): the rows of b and those of b'."""
    pairs = [(printed_jacobian(b, a_33), derivatives(algebra.position, b)) for b in twistors()]
    return {name: worst((printed[rows], true[rows]) for printed, true in pairs)
            for name, rows in (("the nine A_ij", slice(0, 4)), ("the lower block", slice(4, 8)))}


def view_gradient(row_7=1.0):
    """Appendix A (2): the gradient of r^B_z/|r^B|."""
    return worst((printed_view_gradient(b, row_7), derivatives(algebra.cosine, b)) for b in twistors())


def pi_inverse_transpose(entry_12=1.0):
    """Appendix A (3): r^B = Pi^-T b', and w = Pi^-T db/dt."""
    def printed(b):
        found = matrix(twistor_kinematics.pi_inverse_transpose(value(b)))
        found[0, 1] *= entry_12
        return found
    motors = twistors()[::-1] * [1, 1, 1, 0, 1, 1, 1, 0]
    return {"r^B = Pi^-T b'": worst((printed(b) @ b[4:7], algebra.body_position(b)) for b in twistors()),
            "w = Pi^-T db/dt": worst((printed(b) @ algebra.rate(b, motor)[:3], motor[:3])
                                     for b, motor in zip(twistors(), motors))}


def terrain_gradient(row_2=1.0):
    """Eq. (53), with x_D, y_D read as x_BD^D, y_BD^D."""
    places = (0, 1, 2)
    return worst((printed_terrain_gradient(r, row_2), derivatives(terrain_function, r, places))
                 for r in map(algebra.position, twistors()))


def chain_rule(transposed=False):
    """Eq. (52) with (53) and (1), in the column that the gradient of f2 is printed in.

    As it stands (52) is the row (df1/dr)^T dr/dB^T; transposed: the eight-by-three matrix of (1) times (53).
    """
    def pair(b):
        by_r, jacobian = printed_terrain_gradient(algebra.position(b))[:, None], printed_jacobian(b)
        found = jacobian @ by_r if transposed else by_r.T @ jacobian.T
        return found, derivatives(lambda moved: terrain_function(algebra.position(moved)), b)[:, None]
    found, wanted = pair(twistors(1)[0])
    if found.shape != wanted.shape:
        return False, f"(52) is {found.shape[0]} x {found.shape[1]}, (2) is {wanted.shape[0]} x {wanted.shape[1]}"
    return worst(map(pair, twistors()))


def functions_of_the_pose(row_7=1.0, a_33=1.0):
    """The printed gradients, integrated over a closed way of poses that ends at the other twistor, that of -Q.

    A round about the site's axis with a full turn: f1 by (52), (53) and (1), f2 by (2). The rates are periodic, so
    equal weights integrate them exactly.
    """
    random = np.random.default_rng(52)
    changes = {"f1": 0.0, "f2": 0.0}
    for _ in range(3):
        axis, tilt = (v / np.linalg.norm(v) for v in random.normal(size=(2, 3)))
        wide, high, angle = random.uniform(20.0, 80.0), random.uniform(10.0, 50.0), random.uniform(1.0, 1.6)

        def way(s, axis=axis, tilt=tilt, wide=wide, high=high, angle=angle):
            around, half = 2.0 * np.pi * s, np.pi * s
            r = np.array([wide * np.cos(around), wide * np.sin(around), high * (2.0 + np.sin(around))])
            turn = algebra.hamilton(np.array([*np.sin(0.5 * angle) * tilt, np.cos(0.5 * angle)]),
                                    np.array([*np.sin(half) * axis, np.cos(half)]))
            return algebra.twistor_of(algebra.dual_of_pose(r, turn))
        rates = []
        for s in np.arange(64) / 64.0:
            b, along = way(s), np.imag(way(s + 1j * algebra.STEP)) / algebra.STEP
            by_r = printed_terrain_gradient(algebra.position(b))
            rates.append([by_r @ (printed_jacobian(b, a_33).T @ along), printed_view_gradient(b, row_7) @ along])
        found = np.abs(np.sum(rates, axis=0)) / np.sum(np.abs(rates), axis=0)
        changes = {name: max(old, new) for (name, old), new in zip(changes.items(), found)}
    return {name: (bool(error < 1e-9), f"change {error:.1e} of the whole way's, the largest of 3 ways")
            for name, error in changes.items()}


def kinematics(transposed=True, gamma_2=1.0):
    """Appendix A (4), read as dB/dt = (1/4) Gamma^T V, or = (1/4) Gamma V."""
    def pair(b, motor):
        gamma = printed_gamma(b, gamma_2)
        return 0.25 * (gamma.T if transposed else gamma) @ motor, algebra.rate(b, motor)
    return worst(pair(b, motor) for b, motor in zip(twistors(), twistors()[::-1]))


def kinematics_untransposed(transposed=False):
    """Appendix A (4), read as dB/dt = (1/4) Gamma V."""
    return kinematics(transposed)


def six_numbers(norm=1.0, scalar=0.0):
    """Poses have b4 = b8 = 0, and any b, b' is a pose. norm: of the quaternion; scalar: b4 of the twistors."""
    random = np.random.default_rng(8)
    largest = apart = 0.0
    for _ in range(200):
        q = random.normal(size=4)
        b = algebra.twistor_of(algebra.dual_of_pose(random.uniform(-1.0, 1.0, 3), norm * q / np.linalg.norm(q)))
        largest = max(largest, abs(b[3]) / (1.0 + np.linalg.norm(b[:3])), abs(b[7]) / (1.0 + np.linalg.norm(b[4:7])))
        dual = algebra.dual_of(np.array([*random.uniform(-3.0, 3.0, 3), scalar, *random.uniform(-9.0, 9.0, 3), 0.0]))
        apart = max(apart, abs(dual[:4] @ dual[:4] - 1.0), abs(dual[:4] @ dual[4:]) / np.linalg.norm(dual[4:]))
    return {"b4 = b8 = 0": (bool(largest < EXACT), f"largest scalar {largest:.1e} of the vector's size, 200 poses"),
            "any b, b' is a pose": (bool(apart < EXACT), f"{apart:.1e} off a unit dual quaternion, 200 twistors")}


def bounded_for_every_attitude(short_way=False):
    """|b| over turns of up to 359.9 deg; short_way: of the q that has q_0 >= 0."""
    largest = 0.0
    for angle in np.radians(np.append(np.arange(1.0, 360.0, 2.0), 359.9)):
        q = np.array([*np.sin(0.5 * angle) * np.array([0.6, 0.0, 0.8]), np.cos(0.5 * angle)])
        q = -q if short_way and q[3] < 0.0 else q
        largest = max(largest, np.linalg.norm(algebra.twistor_of(algebra.dual_of_pose(np.zeros(3), q))[:3]))
    return bool(largest <= 1.0), f"largest |b| {largest:.4g}"


def terrain_gradient_on_the_axis(rounding=0.0):
    """Eq. (53) towards the axis over the site, finite or not; rounding: rho_0 [m] beside x^2 + beta y^2 (ours)."""
    def slope(gamma, rho):
        base = ALPHA * (rho * rho + rounding * rounding)
        return 2.0 * ALPHA * gamma * rho * base ** (gamma - 1.0)
    found = {}
    for name, gamma in (("gamma 1/3", 1.0 / 3.0), ("gamma 1/2", 0.5), ("gamma 1", 1.0)):
        far, near = slope(gamma, 1e-3), slope(gamma, 1e-6)
        found[name] = near < 2.0 * far, f"df1/dx {far:.3g} at 1 mm, {near:.3g} at 1 um"
    return found


def view_gradient_at_the_goal(softening=0.0):
    """Appendix A (2) towards b' = 0, finite or not; softening: [m] in the distance sqrt(|b'|^2 + softening^2)."""
    def size(length):
        b = np.array([0.1, -0.2, 0.3, 0.0, *length * np.array([0.36, 0.48, 0.8]), 0.0])
        c, gradient = algebra.cosine(b), printed_view_gradient(b)
        ratio = length / np.hypot(length, softening)
        by_length = c * softening**2 / np.hypot(length, softening) ** 3
        return np.linalg.norm(ratio * gradient[4:7] + by_length * b[4:7] / length)
    far, near = size(1e-3), size(1e-6)
    return bool(near < 2.0 * far), f"|df2/db'| {far:.3g} /m at |b'| = 1 mm, {near:.3g} /m at 1 um"
