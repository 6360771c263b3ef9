"""Recursive least squares for the inertial parameters.

Source: Aerospace 2023, 10(8), 679, equations (39)-(41): pi += K (tau - Y pi), K = G Y^T (Y G Y^T + E)^-1,
G = (E - K Y) G. E = 1 (N m)^2, so G is relative to it: G0 = P0 / sigma_tau^2 for a prior covariance P0.
With S = Y G Y^T + E = L L^T and Z = L^-1 Y G this is pi += Z^T L^-1 (tau - Y pi), G -= Z^T Z, symmetric as it stands.

Y may have the force rows (their measurement is the external force, zero in free flight; ten rows for four joints), or
only those of moments and torques (seven rows, as the paper).
"""

import math

import numpy as np

from flight_graph.errors import FlightError
from flight_math import kernel, stack_array
from flight_math.dense import cholesky, symmetric_eigen

UPDATED = 0  # returned codes, bits
SKIPPED = 1  # a measurement or a regressor entry was not finite: nothing was touched
ASYMMETRIC = 2  # G had lost symmetry: averaged with its transpose
NOT_POSITIVE = 4  # G had lost positivity: negative eigenvalues of the scaled G raised to a small positive floor
RESET = 8  # G held a number that was not finite: set back to its initial diagonal


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
        return eta / 3.0 * (eta / 3.0) * prior * prior / (torque_noise * torque_noise) + 1e-6
    raise FlightError(f"initial covariance '{choice}' is unknown; allowed: prior_squared, uniform, covariance")


@kernel
def set_diagonal(diagonal, g):
    """g (p, p) = diag(diagonal)."""
    for i in range(len(diagonal)):
        for j in range(len(diagonal)):
            g[i, j] = 0.0
        g[i, i] = diagonal[i]


@kernel
def update(y, measurement, forgetting, pi, g, initial_diagonal):
    """One step of equations (39)-(41). Returns a sum of the codes above.

    ``y`` (rows, p) from `regressor` at the actual motion; ``measurement`` (rows,) external force [N], moment, torques
    [N m]; ``forgetting``: 1 for none; ``pi`` (p,), ``g`` (p, p) in place; ``initial_diagonal`` (p,) of G0.
    """
    rows, p = y.shape
    z, innovation = stack_array(rows, p), stack_array(rows)
    if not all_finite(y, measurement):
        return SKIPPED
    status = restore(g, initial_diagonal)
    if not gain(y, measurement, pi, g, z, innovation) > 0.0:
        set_diagonal(initial_diagonal, g)
        return status | RESET | SKIPPED
    for r in range(rows):
        for j in range(p):
            pi[j] += z[r, j] * innovation[r]
    for r in range(rows):
        for i in range(p):
            value = z[r, i]
            for j in range(p):
                g[i, j] -= value * z[r, j]
    if forgetting != 1.0:
        for i in range(p):
            for j in range(p):
                g[i, j] /= forgetting
    return status


@kernel
def all_finite(y, measurement):
    """Whether a measurement may be used."""
    total = 0.0
    for r in range(len(y)):
        total += abs(measurement[r])
        for j in range(y.shape[1]):
            total += abs(y[r, j])
    return math.isfinite(total)


@kernel
def gain(y, measurement, pi, g, z, innovation):
    """Fill ``z`` (rows, p) = L^-1 Y G and ``innovation`` (rows,) = L^-1 (tau - Y pi). Returns the smallest pivot of S (at
    least 1 while G is positive)."""
    rows, p = y.shape
    factor = stack_array(rows, rows)
    for r in range(rows):
        innovation[r] = measurement[r]
        for j in range(p):
            z[r, j] = 0.0
        for k in range(p):
            entry = y[r, k]
            innovation[r] -= entry * pi[k]
            if entry != 0.0:
                for j in range(p):
                    z[r, j] += entry * g[k, j]
        for c in range(r + 1):
            value = 1.0 if r == c else 0.0
            for k in range(p):
                value += z[r, k] * y[c, k]
            factor[r, c] = value
    smallest = cholesky(factor, rows)
    if not smallest > 0.0:
        return smallest
    for r in range(rows):
        for c in range(r):
            value = factor[r, c]
            innovation[r] -= value * innovation[c]
            for j in range(p):
                z[r, j] -= value * z[c, j]
        diagonal = factor[r, r]
        innovation[r] /= diagonal
        for j in range(p):
            z[r, j] /= diagonal
    return smallest


@kernel
def restore(g, initial_diagonal):
    """Put G (p, p) right if it is not finite, symmetric and positive definite. Returns codes."""
    p = len(g)
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
    if not is_positive(g):
        status |= repair(g, initial_diagonal)
    return status


@kernel
def is_positive(g):
    """True when every pivot of Gaussian elimination of the symmetric G (p, p) is positive."""
    p = len(g)
    left = stack_array(p, p)
    for i in range(p):
        for j in range(i, p):
            left[i, j] = g[i, j]
    for k in range(p):
        pivot = left[k, k]
        if not pivot > 0.0:
            return False
        for i in range(k + 1, p):
            factor = left[k, i] / pivot
            if factor != 0.0:
                for j in range(i, p):
                    left[i, j] -= factor * left[k, j]
    return True


@kernel
def repair(g, initial_diagonal):
    """Raise the eigenvalues of G, scaled to a unit diagonal, to at least 1e-12 of the largest. Returns NOT_POSITIVE.

    The scale is each parameter's own: sqrt(|G_ii|), or its initial value where that is zero.
    """
    p = len(g)
    scaled, vectors, scale = stack_array(p, p), stack_array(p, p), stack_array(p)
    for i in range(p):
        size = abs(g[i, i])
        scale[i] = math.sqrt(size) if size > 0.0 else math.sqrt(initial_diagonal[i])
    for i in range(p):
        for j in range(p):
            scaled[i, j] = g[i, j] / (scale[i] * scale[j])
    symmetric_eigen(scaled, vectors, p)
    largest = 0.0
    for k in range(p):
        largest = max(largest, scaled[k, k])
    if largest <= 0.0:
        set_diagonal(initial_diagonal, g)
        return NOT_POSITIVE
    for i in range(p):
        for j in range(i + 1):
            value = 0.0
            for k in range(p):
                value += max(scaled[k, k], 1e-12 * largest) * vectors[k, i] * vectors[k, j]
            g[i, j] = value * scale[i] * scale[j]
            g[j, i] = g[i, j]
    return NOT_POSITIVE
