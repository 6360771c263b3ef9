"""Which inertial parameters a motion makes visible: rank, singular values, and the combinations behind them.

The regressors of a motion are stacked and their columns scaled by the parameters' size. A parameter is identifiable on
its own when the null space of the stack has no component along it; the others appear only in combinations (base
parameters: Gautier and Khalil 1990), found by a QR decomposition with column pivoting.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr, solve_triangular

from flight_graph.errors import FlightError
from flight_math import Vec3
from spacerobot_ros.kinematics import actual_motion, posed
from spacerobot_ros.model import SpaceRobot
from spacerobot_ros.regressor import regressor


@dataclass(frozen=True)
class Identifiability:
    """names: (p,).  rank: number of identifiable combinations.  singular_values: (p,), largest first, of the scaled
    stack.  null_component: (p,) length of each (scaled) parameter's unit vector's part in the null space, 0 to 1.
    individual: (p,) bool, identifiable on its own.  combinations: (rank, p) matrix B, independent parameters first met
    by pivoting: the motion shows B pi and nothing else.  independent: (rank,) column of each combination's leader.
    """

    names: tuple[str, ...]
    rank: int
    singular_values: np.ndarray
    null_component: np.ndarray
    individual: np.ndarray
    combinations: np.ndarray
    independent: np.ndarray

    def sentences(self, smallest: float = 1e-9) -> list[str]:
        """One line a combination, as 'B0.hx + 0.4 B1.m'; coefficients below ``smallest`` are left out."""
        lines = []
        for leader, row in zip(self.independent, self.combinations, strict=True):
            line = self.names[leader]
            for k in np.flatnonzero(np.abs(row) > smallest):
                if k != leader:
                    line += f" {'+' if row[k] > 0 else '-'} {abs(row[k]):.6g} {self.names[k]}"
            lines.append(line)
        return lines


def identify(stack, names, scale, cut: float = 1e-10) -> Identifiability:
    """Analyse a stacked regressor (rows, p), or its triangular factor, with columns multiplied by ``scale`` (p,).

    ``scale``: size of each parameter (|pi|); an element that is zero counts as 1. ``cut``: singular values below
    cut * the largest are zero.
    """
    stack = np.asarray(stack, float)
    size = np.abs(np.asarray(scale, float))
    size = np.where(size > 0.0, size, 1.0)
    if stack.ndim != 2 or stack.shape[1] != size.shape[0]:
        raise FlightError(f"stacked regressor has shape {stack.shape}; {size.shape[0]} columns are needed")
    if not np.all(np.isfinite(stack)):
        raise FlightError("stacked regressor holds a number that is not finite")
    triangle = np.linalg.qr(stack * size, mode="r")
    _, values, right = np.linalg.svd(triangle, full_matrices=True)
    p = size.shape[0]
    singular_values = np.zeros(p)
    singular_values[: values.shape[0]] = values
    rank = int(np.sum(singular_values > cut * singular_values[0])) if singular_values[0] > 0.0 else 0
    null_component = np.sqrt(np.sum(right[rank:] ** 2, axis=0))
    combinations, independent = _combinations(right[:rank], size)
    return Identifiability(
        tuple(names), rank, singular_values, null_component, null_component < 1e-10, combinations, independent
    )


def _combinations(visible, size) -> tuple[np.ndarray, np.ndarray]:
    """Base parameters of the row space ``visible`` (rank, p): leader columns with unit coefficient, the rest solved."""
    rank = visible.shape[0]
    if rank == 0:
        return np.zeros((0, size.shape[0])), np.zeros(0, int)
    _, triangle, order = qr(visible, mode="economic", pivoting=True)
    scaled = np.zeros_like(visible)
    scaled[:, order] = solve_triangular(triangle[:, :rank], triangle)
    independent = order[:rank]
    combinations = scaled * size[independent][:, None] / size[None, :]
    combinations[np.abs(scaled) < 1e-9] = 0.0
    by_parameter = np.argsort(independent)
    return combinations[by_parameter], independent[by_parameter]


class Samples(NamedTuple):
    """A recorded or planned motion: theta, thd, thdd (samples, n) of the joints; w, alpha (samples, 3) angular velocity and
    acceleration of the base, base axes."""

    theta: np.ndarray
    w: np.ndarray
    thd: np.ndarray
    alpha: np.ndarray
    thdd: np.ndarray


def stack_regressors(robot: SpaceRobot, samples: Samples, a, rows=slice(None)) -> np.ndarray:
    """Regressors of a motion, stacked (samples * rows, 10(n+1)).

    ``a`` (samples, 3): acceleration of the base origin, base axes. ``rows``: which of the 6+n rows to keep: all,
    slice(3, None) for moments and torques, slice(6, None) for joint torques only.
    """
    n = robot.joints
    y, rotation = np.zeros((6 + n, 10 * (n + 1))), np.zeros((n, 3, 3))
    result = []
    for (theta, w, thd, alpha, thdd), acceleration in zip(zip(*samples), a, strict=True):
        motion = actual_motion(Vec3(*w), Vec3(*alpha), Vec3(*acceleration), thd, thdd)
        regressor(posed(robot.geometry, theta, rotation), motion, y)
        result.append(y[rows].copy())
    return np.concatenate(result)


def momentum_free_acceleration(robot: SpaceRobot, samples: Samples) -> np.ndarray:
    """Acceleration of the base origin (samples, 3), base axes [m/s^2], when no outer force acts: a = -f0 / M."""
    force = stack_regressors(robot, samples, np.zeros((len(samples.theta), 3)), slice(0, 3)) @ robot.pi
    return -force.reshape(-1, 3) / robot.pi[9::10].sum()
