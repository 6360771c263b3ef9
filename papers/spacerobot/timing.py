"""How long an update takes (Table 2): compiled kernels on the shipped robot, best of several batches."""

import time

import numpy as np

from spacerobot_ros import recursive_least_squares as rls
from spacerobot_ros.lyapunov_law import lyapunov_update
from spacerobot_ros.model import find_model
from spacerobot_ros.regressor import regressor

REPEATS = 2000


def best(function, batches: int = 3, repeats: int = REPEATS) -> float:
    """Seconds a call, the best batch; the call from Python included."""
    function()
    found = []
    for _ in range(batches):
        began = time.perf_counter()
        for _ in range(repeats):
            function()
        found.append((time.perf_counter() - began) / repeats)
    return min(found)


def update_times() -> dict:
    """Seconds of the regressor, of least squares (seven and ten rows) and of Lyapunov's law, without the regressor."""
    robot = find_model("mini_space_robot")
    n, count = robot.joints, 10 * (robot.joints + 1)
    rng = np.random.default_rng(1)
    rotation = np.ascontiguousarray(robot.fixed_rotation)
    w, alpha, a = rng.standard_normal((3, 3))
    thd, thdd = rng.standard_normal((2, n))
    y, moving, block = np.zeros((6 + n, count)), np.zeros((n + 1, 12)), np.zeros((6, 10))
    pi, g, work = robot.pi.copy(), np.eye(count), np.zeros((rls.work_rows(6 + n, count), count))
    diagonal, measured, sigma = np.ones(count), np.zeros(6 + n), rng.standard_normal(3 + n)
    three, zero = np.int64(3), np.int64(0)

    def form():
        regressor(robot.parent, rotation, robot.offset, robot.axis, w, w, alpha, a, thd, thd, thdd, y, moving, block)

    form()
    return {
        "regressor": best(form),
        "least squares, 7 rows": best(lambda: rls.update(y, three, measured, 1.0, pi, g, diagonal, work)),
        "least squares, 10 rows": best(lambda: rls.update(y, zero, measured, 1.0, pi, g, diagonal, work)),
        "Lyapunov": best(lambda: lyapunov_update(y, three, sigma, 1e-9 * diagonal, 0.02, pi)),
    }


def updates_are_fast() -> tuple[bool, str]:
    """Whether regressor and update together stay below 3e-4 s for both methods, and the times."""
    found = update_times()
    total = {name: found["regressor"] + found[name] for name in ("least squares, 7 rows", "Lyapunov")}
    return max(total.values()) < 3e-4, ", ".join(f"{name} {1e6 * value:.1f} us" for name, value in total.items())
