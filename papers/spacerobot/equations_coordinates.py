"""Equations (22)-(29) as printed, in coordinates, against the dynamics in inertial axes: one function a row of the table.

Source: Aerospace 2023, 10(8), 679, section 2.2 and (29), (A11). Theta = [alpha, beta, gamma, theta_1 .. theta_n]: (23) and
(26) need coordinates whose rates are Theta_dot. The arguments and answers are those of `papers.spacerobot.equations`.
"""

import numpy as np

from papers.spacerobot.equations import EXACT, JOINTS, STATES, agree
from papers.spacerobot.inertial_frame import Arm, floating, random_arm, tensor, torques, total
from papers.spacerobot.lagrangian import (
    body_rates_matrix,
    coriolis_matrix,
    generalised,
    motion_of,
    reduced_mass_matrix,
)
from spacerobot_ros.robot_files import find_model

SIZE = 3 + JOINTS


def coordinates(count=STATES):
    """Random robots, coordinates q (6+n,) and rates of Theta (3+n,), away from beta = +-90 deg."""
    draw = np.random.default_rng(29)
    for _ in range(count):
        q = np.concatenate([np.zeros(3), draw.uniform(-1.2, 1.2, SIZE)])
        yield random_arm(draw, JOINTS), q, draw.standard_normal(SIZE)


def inverse(arm, q, rate, second) -> np.ndarray:
    """Forces of the coordinates Theta (3+n,) by the rates of momentum, the centre of mass at rest."""
    free = np.zeros(3)
    motion = floating(arm, motion_of(q, np.concatenate([free, rate]), np.concatenate([free, second])))
    return generalised(q, torques(arm.pi, arm, motion))[3:]


def dynamics(arm, q, rate):
    """M and D rate of Theta, by Lagrange's equations."""
    def matrix(point):
        return reduced_mass_matrix(arm, point)
    return matrix(q), coriolis_matrix(matrix, q, rate) @ rate


def angular_momentum_is_conserved(base_torque: float = 1.0):
    """(22): L = L_0 while the actuators of (26) work: joints alone, and the base's too. base_torque: its factor."""
    draw, found = np.random.default_rng(22), {"joint torques": 0.0, "base torque too, as (26) has it": 0.0}
    for arm, q, rate in coordinates():
        matrix, velocity = dynamics(arm, q, rate)
        for name, base in zip(found, (np.zeros(3), base_torque * draw.standard_normal(3))):
            force = np.concatenate([body_rates_matrix(q[3:6]).T @ base, draw.standard_normal(JOINTS)])
            second = np.linalg.solve(matrix, force - velocity)
            free = np.zeros(3)
            motion = floating(arm, motion_of(q, np.concatenate([free, rate]), np.concatenate([free, second])))
            found[name] = max(found[name], float(np.abs(total(arm, motion).moment).max() / np.abs(force).max()))
    return {name: (error < EXACT, f"dL/dt {error:.1e} of the largest torque") for name, error in found.items()}


def shipped_arm(base_scale: float = 1.0) -> Arm:
    """The robot of `models/mini_space_robot.yaml`. base_scale: on mass and inertia of its base."""
    pi = find_model("mini_space_robot").pi.reshape(-1, 10)
    mass, center, quarter = pi[:, 9], pi[:, 6:9] / pi[:, 9:], np.pi / 2.0
    inertia = np.array([tensor(ten[:6]) - ten[9] * (c @ c * np.eye(3) - np.outer(c, c)) for ten, c in zip(pi, center)])
    scale = np.array([base_scale, 1.0, 1.0, 1.0, 1.0])
    return Arm(np.array([0.0, quarter, 0.0, quarter]), np.array([0.1, 0.0, 0.4, 0.35]), np.array([0.26, 0.0, 0.0, 0.0]),
               scale * mass, center, scale[:, None, None] * inertia)


def coupling(base_scale: float = 1.0):
    """A joint that turns by 10 deg turns the free base by more than 1 deg, at the posture of section 4.1."""
    q = np.concatenate([np.zeros(6), np.radians([90.0, 45.0, 45.0, 0.0])])
    matrix = reduced_mass_matrix(shipped_arm(base_scale), q)
    turns = np.abs(np.linalg.solve(matrix[:3, :3], matrix[:3, 3:])).max(axis=0)
    found = ", ".join(f"{one:.3f}" for one in turns)
    return bool(turns.max() > 0.1), f"deg of the base for each deg of joints 1 to 4: {found}"


def velocity_terms(factor: float = 1.0):
    """(23)-(25): velocity terms by the products of two rates and by the squares. factor: of the products."""
    pairs = []
    for arm, q, rate in coordinates(3):
        still, one = np.zeros(SIZE), np.eye(SIZE)
        squares = [inverse(arm, q, one[i], still) for i in range(SIZE)]
        found = np.sum([column * rate[i] ** 2 for i, column in enumerate(squares)], axis=0)
        for i in range(SIZE):
            for j in range(i + 1, SIZE):
                product = inverse(arm, q, one[i] + one[j], still) - squares[i] - squares[j]
                found = found + factor * product * rate[i] * rate[j]
        pairs.append((found, inverse(arm, q, rate, still)))
    return agree(pairs)


def matrix_of_theta(rates: bool = False):
    """(30): the velocity terms are D(Theta) times the rates, twice as large at twice the rates. rates: D has them, too."""
    pairs, still = [], np.zeros(SIZE)
    for arm, q, rate in coordinates():
        terms = inverse(arm, q, rate, still)
        if rates:
            matrix = coriolis_matrix(lambda point, arm=arm: reduced_mass_matrix(arm, point), q, 2.0 * rate)
            pairs.append((matrix @ (2.0 * rate), inverse(arm, q, 2.0 * rate, still)))
        else:
            pairs.append((2.0 * terms, inverse(arm, q, 2.0 * rate, still)))
    return agree(pairs)


def energy_is_positive(body_axes: bool = False):
    """(35): V > 0 for every sigma, so M(Theta) is positive definite. body_axes: sigma of the base in body axes."""
    found = {"beta from -80 to 80 deg": np.radians(np.linspace(-80.0, 80.0, 9)), "beta = 90 deg": [0.5 * np.pi]}
    least = dict.fromkeys(found, np.inf)
    for arm, q, _ in coordinates():
        for name, angles in found.items():
            for beta in angles:
                point = np.concatenate([q[:3], np.zeros(3) if body_axes else [q[3], beta, q[5]], q[6:]])
                rates = np.eye(SIZE)
                if body_axes:
                    rates[:3, :3] = np.linalg.inv(body_rates_matrix(point[3:6]))
                values = np.linalg.eigvalsh(rates.T @ reduced_mass_matrix(arm, point) @ rates)
                least[name] = min(least[name], values[0] / values[-1])
    return {name: (bool(ratio > EXACT), f"smallest eigenvalue of M {ratio:.1e} of the largest")
            for name, ratio in least.items()}


def forward_dynamics(factor: float = 1.0):
    """(27), (28): Theta_ddot = M^-1 (tau - tau'), back from the torques of a known motion. factor: of tau'."""
    draw, pairs = np.random.default_rng(28), []
    for arm, q, rate in coordinates():
        second = draw.standard_normal(SIZE)
        matrix, velocity = dynamics(arm, q, rate)
        pairs.append((np.linalg.solve(matrix, inverse(arm, q, rate, second) - factor * velocity), second))
    return agree(pairs)


def block_form(factor: float = 1.0):
    """(26): M_bm = M_mb^T, columns by the rates of momentum, and M_b the inertia of the whole. factor: of M_mb^T."""
    pairs = []
    for arm, q, _ in coordinates():
        still = np.zeros(SIZE)
        columns = np.stack([inverse(arm, q, still, direction) for direction in np.eye(SIZE)], axis=1)
        locked = np.zeros(JOINTS)
        whole = []
        for direction in np.eye(3):
            motion = motion_of(q, np.concatenate([np.zeros(3), direction, locked]), np.zeros(3 + SIZE))
            motion = floating(arm, motion)
            whole.append(body_rates_matrix(q[3:6]).T @ motion.rotation.T @ total(arm, motion).angular)
        pairs += [(columns[:3, 3:], factor * columns[3:, :3].T), (columns[:3, :3], np.array(whole).T)]
    return agree(pairs)


def linear_separation(base_acceleration: bool = False):
    """(29), (A11): u is linear in pi for given Theta, rates and accelerations. base_acceleration: it is given too."""
    draw, pairs = np.random.default_rng(30), []
    for arm, q, rate in coordinates():
        second, other = draw.standard_normal(SIZE), random_arm(draw, JOINTS).pi
        free = np.zeros(3)
        motion = motion_of(q, np.concatenate([free, rate]), np.concatenate([free, second]))
        if base_acceleration:
            given = motion._replace(a=draw.standard_normal(3))
            sums = [torques(pi, arm, given)[3:] for pi in (arm.pi, other, arm.pi + other)]
        else:
            sums = [_reduced(pi, arm, motion) for pi in (arm.pi, other, arm.pi + other)]
        pairs.append((sums[0] + sums[1], sums[2]))
    return agree(pairs)


def _reduced(pi, arm, motion):
    """Moment and joint torques when no force acts: the base's acceleration follows from pi."""
    force = torques(pi, arm, motion)[:3]
    moved = motion._replace(a=-motion.rotation @ force / pi[:, 9].sum())
    return torques(pi, arm, moved)[3:]
