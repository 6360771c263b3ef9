"""How fast the control law must run: gains against the control period."""

import numpy as np

from spacerobot_ros.dynamics import mass_matrix, reduced_mass_matrix
from spacerobot_ros.kinematics import posed
from spacerobot_ros.model import SpaceRobot

LIMIT = 2.1  # [-] found by bisection on the mini space robot's step; design to 1


def sampling_number(robot: SpaceRobot, theta, damping, gain: float, period: float) -> float:
    """T (lambda_max(M_r^-1 K_D) + Lambda) at the joint angles ``theta`` (n,) [rad]; unstable above about `LIMIT`.

    ``damping``: diagonal of K_D (3+n,) [N m s/rad]; ``gain``: Lambda [1/s]; ``period``: T [s], torque held in between.
    """
    rates = damping_rates(robot, theta, damping)
    return float(period * (rates[-1] + gain))


def damping_rates(robot: SpaceRobot, theta, damping) -> np.ndarray:
    """Eigenvalues of M_r^-1 K_D (3+n,), smallest first [1/s]: the poles by which sigma decays."""
    n = robot.joints
    h, reduced = np.zeros((6 + n, 6 + n)), np.zeros((3 + n, 3 + n))
    mass_matrix(posed(robot.geometry, np.asarray(theta, float), np.zeros((n, 3, 3))), robot.pi, h)
    reduced_mass_matrix(h, reduced)
    root = np.sqrt(np.asarray(damping, float))
    return 1.0 / np.linalg.eigvalsh(reduced / np.outer(root, root))[::-1]
