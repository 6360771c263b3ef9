"""Recursive least squares for the inertial parameters.

Source: Aerospace 2023, 10(10), 679, equations (39)-(41): pi += K (tau - Y pi), K = G Y^T (Y G Y^T + E)^-1,
G = (E - K Y) G. E = 1 (N m)^2, so G is relative to it: G0 = P0 / sigma_tau^2 for a prior covariance P0.
With S = Y G Y^T + E = L L^T and Z = L^-1 Y G this is pi += Z^T L^-1 (tau - Y pi), G -= Z^T Z, symmetric as it stands.

Row ``first_row`` of Y is the first used: 0 takes the force rows too (their measurement is the external force, zero in
free flight; ten rows for four joints), 3 only moments and torques (seven rows, as the paper).
"""

import math

import numpy as np

from flight_graph.errors import FlightError
from flight_graph.kernel import kernel
from spacerobot_ros.small_matrices import cholesky, symmetric_eigen

UPDATED = 0  # returned codes, bits
SKIPPED = 1  # a measurement or a regressor entry was not finite: nothing was touched
ASYMMETRIC = 2  # G had lost symmetry: averaged with its transpose
NOT_POSITIVE = 4  # G had lost positivity: negative eigenvalues of the scaled G raised to a small positive floor
RESET = 8  # G held a number that was not finite: set back to its initial diagonal


def work_rows(rows: int, parameters: int) -> int:
    """Rows of the work array (rows, parameters) that `update` needs."""
    return 2 * rows + 2 * parameters + 2


def initial_covariance(
    prior, choice: str = "prior_squared", scale: float | None = None, eta: float = 0.4, torque_noise: float = 1e-3
) -> np.ndarray:
    """Diagonal of G0 (parameters,). ``choice``: "prior_squared" scale * prior^2 (scale 1e6), so that every parameter is
    uncertain in its own measure; "uniform" scale (1e4) for all, the simplest; "covariance" (eta/3)^2 prior^2 /
    torque_noise^2 + 1e-6, equation (46) over the torque's noise [N m].
    In "prior_squared" a parameter that is (nearly) zero counts as 1e-4 of its body's measure: its largest inertia
    element I, its mass m, sqrt(m I) for first moments; else it could never be learnt.
    """
    prior = np.asarray(prior, float)
    if choice == "prior_squared":
        size = np.abs(prior).reshape(-1, 10)
        inertia, mass = size[:, :6].max(axis=1), size[:, 9]
        floor = np.empty_like(size)
        floor[:, :6] = inertia[:, None]
        floor[:, 6:9] = np.sqrt(mass * inertia)[:, None]
        floor[:, 9] = mass
        size = np.maximum(size, 1e-4 * floor).ravel()
        return (1e6 if scale is None else scale) * size * size
    if choice == "uniform":
        return np.full(prior.shape, 1e4 if scale is None else float(scale))
    if choice == "covariance":
        return (eta / 3.0) ** 2 * prior * prior / torque_noise**2 + 1e-6
    raise FlightError(f"initial covariance '{choice}' is unknown; allowed: prior_squared, uniform, covariance")


@kernel
def set_diagonal(diagonal, g):
    """g (p, p) = diag(diagonal)."""
    for i in range(diagonal.shape[0]):
        for j in range(diagonal.shape[0]):
            g[i, j] = 0.0
        g[i, i] = diagonal[i]


@kernel
def update(y, first_row, measurement, forgetting, pi, g, initial_diagonal, work):
    """One step of equations (39)-(41). Returns a sum of the codes above.

    ``y`` (rows, p) from `regressor` at the actual motion; ``measurement`` (rows,) external force [N], moment, torques
    [N m]; ``forgetting``: 1 for none; ``pi`` (p,), ``g`` (p, p) in place; ``initial_diagonal`` (p,) of G0;
    ``work`` (work_rows(rows, p), p).
    """
    rows = y.shape[0] - first_row
    p = pi.shape[0]
    if not _finite(y, first_row, measurement):
        return SKIPPED
    status = restore(g, initial_diagonal, work[2 * rows + 2 :])
    if not _gain(y, first_row, measurement, pi, g, work) > 0.0:
        set_diagonal(initial_diagonal, g)
        return status | RESET | SKIPPED
    correction = work[2 * rows]
    for r in range(rows):
        for j in range(p):
            pi[j] += work[r, j] * correction[r]
    for r in range(rows):
        for i in range(p):
            value = work[r, i]
            for j in range(p):
                g[i, j] -= value * work[r, j]
    if forgetting != 1.0:
        for i in range(p):
            for j in range(p):
                g[i, j] /= forgetting
    return status


@kernel
def _finite(y, first_row, measurement):
    for r in range(first_row, y.shape[0]):
        total = measurement[r]
        for j in range(y.shape[1]):
            total += abs(y[r, j])
        if not math.isfinite(total):
            return False
    return True


@kernel
def _gain(y, first_row, measurement, pi, g, work):
    """Rows of ``work``: Z = L^-1 Y G, then the factor L, then L^-1 (tau - Y pi). Returns the smallest pivot of S
    (at least 1 while G is positive)."""
    rows = y.shape[0] - first_row
    p = pi.shape[0]
    factor = work[rows : 2 * rows]
    correction = work[2 * rows]
    for r in range(rows):
        for j in range(p):
            work[r, j] = 0.0
        value = measurement[first_row + r]
        for k in range(p):
            entry = y[first_row + r, k]
            value -= entry * pi[k]
            if entry != 0.0:
                for j in range(p):
                    work[r, j] += entry * g[k, j]
        correction[r] = value
    for r in range(rows):
        for c in range(r + 1):
            value = 1.0 if r == c else 0.0
            for k in range(p):
                value += work[r, k] * y[first_row + c, k]
            factor[r, c] = value
    smallest = cholesky(factor, rows)
    if not smallest > 0.0:
        return smallest
    for r in range(rows):
        for c in range(r):
            value = factor[r, c]
            correction[r] -= value * correction[c]
            for j in range(p):
                work[r, j] -= value * work[c, j]
        diagonal = factor[r, r]
        correction[r] /= diagonal
        for j in range(p):
            work[r, j] /= diagonal
    return smallest


@kernel
def restore(g, initial_diagonal, work):
    """Put G (p, p) right if it is not finite, symmetric and positive definite. Returns codes. Work: (2p, p)."""
    p = g.shape[0]
    status = UPDATED
    for i in range(p):
        for j in range(i):
            if g[i, j] != g[j, i]:
                g[i, j] = 0.5 * (g[i, j] + g[j, i])
                g[j, i] = g[i, j]
                status = ASYMMETRIC
    total = 0.0
    for i in range(p):
        for j in range(p):
            total += abs(g[i, j])
    if not math.isfinite(total):
        set_diagonal(initial_diagonal, g)
        return RESET
    if not is_positive(g, work):
        status |= repair(g, initial_diagonal, work)
    return status


@kernel
def is_positive(g, work):
    """True when every pivot of Gaussian elimination of the symmetric G (p, p) is positive. Work: (p, p)."""
    p = g.shape[0]
    for i in range(p):
        for j in range(i, p):
            work[i, j] = g[i, j]
    for k in range(p):
        pivot = work[k, k]
        if not pivot > 0.0:
            return False
        for i in range(k + 1, p):
            factor = work[k, i] / pivot
            if factor != 0.0:
                for j in range(i, p):
                    work[i, j] -= factor * work[k, j]
    return True


@kernel
def repair(g, initial_diagonal, work):
    """Raise the eigenvalues of G, scaled to a unit diagonal, to at least 1e-12 of the largest. Returns NOT_POSITIVE.

    The scale is each parameter's own: sqrt(|G_ii|), or its initial value where that is zero. Work: (2p, p).
    """
    p = g.shape[0]
    scaled = work[0:p]
    vectors = work[p : 2 * p]
    for i in range(p):
        for j in range(p):
            scaled[i, j] = g[i, j] / (_scale(g, initial_diagonal, i) * _scale(g, initial_diagonal, j))
    symmetric_eigen(scaled, vectors, p)
    largest = 0.0
    for k in range(p):
        largest = max(largest, scaled[k, k])
    if largest <= 0.0:
        set_diagonal(initial_diagonal, g)
        return NOT_POSITIVE
    floor = 1e-12 * largest  # [-]
    for i in range(p):
        scaled[0, i] = max(scaled[i, i], floor)
    for i in range(p):
        scaled[1, i] = _scale(g, initial_diagonal, i)
    for i in range(p):
        for j in range(i + 1):
            value = 0.0
            for k in range(p):
                value += scaled[0, k] * vectors[k, i] * vectors[k, j]
            g[i, j] = value * scaled[1, i] * scaled[1, j]
            g[j, i] = g[i, j]
    return NOT_POSITIVE


@kernel
def _scale(g, initial_diagonal, i):
    size = abs(g[i, i])
    return math.sqrt(size) if size > 0.0 else math.sqrt(initial_diagonal[i])
