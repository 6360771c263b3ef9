"""How long an update takes (Table 2), to be shown, never judged: compiled kernels on the shipped robot, best of batches.

What is judged are operations, `papers.spacerobot.operations`.
"""

import time

import numpy as np

from flight_math import Vec3, kernel
from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.kinematics import actual_motion, posed
from spacerobot_ros.lyapunov_law import lyapunov_update
from spacerobot_ros.regressor import regressor
from spacerobot_ros.robot_files import find_model

REPEATS = 2000


def best(many, *arguments, batches: int = 5) -> float:
    """Seconds a call inside of a compiled loop: ``many(repeats, *arguments)``, the best batch."""
    many(1, *arguments)
    found = []
    for _ in range(batches):
        began = time.perf_counter()
        many(REPEATS, *arguments)
        found.append((time.perf_counter() - began) / REPEATS)
    return min(found)


@kernel
def _regressors(repeats, tree, motion, y):
    for _ in range(repeats):
        regressor(tree, motion, y)


@kernel
def _least_squares(repeats, y, measured, pi, g, diagonal):
    for _ in range(repeats):
        rls.update(y, measured, 1.0, pi, g, diagonal)


@kernel
def _lyapunov(repeats, y, sigma, gain, pi):
    for _ in range(repeats):
        lyapunov_update(y, sigma, gain, 0.02, pi)


def update_times() -> dict:
    """Seconds of the regressor, of least squares (seven and ten rows) and of Lyapunov's law, without the regressor."""
    robot = find_model("mini_space_robot")
    n, count = robot.joints, 10 * (robot.joints + 1)
    rng = np.random.default_rng(1)
    tree = posed(robot.geometry, np.zeros(n), np.zeros((n, 3, 3)))
    w, alpha, a = (Vec3(*row) for row in rng.standard_normal((3, 3)))
    motion = actual_motion(w, alpha, a, *rng.standard_normal((2, n)))
    y, pi, g = np.zeros((6 + n, count)), robot.pi.copy(), np.eye(count)
    diagonal, measured, sigma = np.ones(count), np.zeros(6 + n), rng.standard_normal(3 + n)
    return {
        "regressor": best(_regressors, tree, motion, y),
        "least squares, 7 rows": best(_least_squares, y[3:], measured[3:], pi, g, diagonal),
        "least squares, 10 rows": best(_least_squares, y, measured, pi, g, diagonal),
        "Lyapunov": best(_lyapunov, y[3:], sigma, 1e-9 * diagonal, pi),
    }
