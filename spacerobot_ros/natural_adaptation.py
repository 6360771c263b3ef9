"""Natural adaptation: Lyapunov's law on the manifold of possible bodies, so that no estimate leaves it.

Each body's pseudo-inertia P moves by P+ = C exp(g T C^T L C) C^T, C = chol(P), where L is the symmetric matrix with
tr(L P(pi)) = (Y^T sigma) . pi (Lee, Kwon, Park 2018: natural adaptive control). P stays positive definite, hence every
estimated mass is positive and every inertia possible. It buys that guarantee, not better tracking.
"""

import math

from flight_graph.kernel import kernel
from spacerobot_ros.small_matrices import cholesky, symmetric_eigen

WORK = (20, 4)  # shape of the work array


@kernel
def to_pseudo_inertia(pi, b, matrix):
    """Pseudo-inertia (4, 4) of body ``b`` of the parameter vector."""
    first = 10 * b
    ixx, iyy, izz = pi[first], pi[first + 3], pi[first + 5]
    half = 0.5 * (ixx + iyy + izz)
    matrix[0, 0] = half - ixx
    matrix[1, 1] = half - iyy
    matrix[2, 2] = half - izz
    matrix[0, 1] = -pi[first + 1]
    matrix[0, 2] = -pi[first + 2]
    matrix[1, 2] = -pi[first + 4]
    for k in range(3):
        matrix[k, 3] = pi[first + 6 + k]
    matrix[3, 3] = pi[first + 9]
    for i in range(4):
        for j in range(i):
            matrix[i, j] = matrix[j, i]


@kernel
def from_pseudo_inertia(matrix, b, pi):
    """Write body ``b``'s ten parameters from its pseudo-inertia."""
    first = 10 * b
    pi[first] = matrix[1, 1] + matrix[2, 2]
    pi[first + 3] = matrix[0, 0] + matrix[2, 2]
    pi[first + 5] = matrix[0, 0] + matrix[1, 1]
    pi[first + 1] = -matrix[0, 1]
    pi[first + 2] = -matrix[0, 2]
    pi[first + 4] = -matrix[1, 2]
    for k in range(3):
        pi[first + 6 + k] = matrix[k, 3]
    pi[first + 9] = matrix[3, 3]


@kernel
def project(pi, floor, work):
    """Make every body possible: eigenvalues of its pseudo-inertia, scaled to a unit diagonal, to at least ``floor``.

    ``floor`` [-], 0.02 is usual. A body that satisfies it is not touched. Returns the number of bodies changed.
    """
    matrix = work[0:4]
    scaled = work[4:8]
    vectors = work[8:12]
    scale = work[12]
    changed = 0
    for b in range(pi.shape[0] // 10):
        to_pseudo_inertia(pi, b, matrix)
        largest = 0.0
        for i in range(4):
            largest = max(largest, abs(matrix[i, i]))
        for i in range(4):
            scale[i] = math.sqrt(max(abs(matrix[i, i]), 1e-6 * largest))
        for i in range(4):
            for j in range(4):
                scaled[i, j] = matrix[i, j] / (scale[i] * scale[j])
        symmetric_eigen(scaled, vectors, 4)
        low = False
        for k in range(4):
            if not scaled[k, k] >= floor:
                scaled[k, k] = floor
                low = True
        if not low:
            continue
        changed += 1
        for i in range(4):
            for j in range(i + 1):
                value = 0.0
                for k in range(4):
                    value += scaled[k, k] * vectors[k, i] * vectors[k, j]
                matrix[i, j] = value * scale[i] * scale[j]
                matrix[j, i] = matrix[i, j]
        from_pseudo_inertia(matrix, b, pi)
    return changed


@kernel
def smallest_eigenvalues(pi, smallest, work):
    """Smallest eigenvalue of each body's pseudo-inertia, into ``smallest`` (bodies,); not positive: no such body."""
    matrix = work[0:4]
    for b in range(pi.shape[0] // 10):
        to_pseudo_inertia(pi, b, matrix)
        symmetric_eigen(matrix, work[4:8], 4)
        smallest[b] = min(min(matrix[0, 0], matrix[1, 1]), min(matrix[2, 2], matrix[3, 3]))


@kernel
def natural_update(y, first_row, sigma, gain, period, limit, pi, work):
    """One step of natural adaptation for every body, ``pi`` in place. Returns the number of bodies left as they were.

    ``y``, ``first_row``, ``sigma`` as in `lyapunov_update`; ``gain`` g (one number); ``period`` [s]; the exponent's
    eigenvalues are clipped to +-``limit`` (2 is usual). A body is left alone if its pseudo-inertia is not positive
    (call `project` on the prior) or Y or sigma is not finite.
    """
    matrix = work[0:4]
    gradient = work[4:8]
    exponent = work[8:12]
    vectors = work[12:16]
    columns = work[16:20]
    left = 0
    for b in range(pi.shape[0] // 10):
        to_pseudo_inertia(pi, b, matrix)
        _gradient(y, first_row, sigma, b, columns, gradient)
        total = 0.0
        for i in range(4):
            for j in range(4):
                total += abs(gradient[i, j])
        if not math.isfinite(total) or not cholesky(matrix, 4) > 0.0:
            left += 1
            continue
        _congruence(matrix, gradient, gain * period, columns, exponent)
        symmetric_eigen(exponent, vectors, 4)
        for k in range(4):
            exponent[k, k] = math.exp(min(max(exponent[k, k], -limit), limit))
            for i in range(4):
                value = 0.0
                for j in range(i + 1):
                    value += matrix[i, j] * vectors[k, j]
                columns[k, i] = value
        for i in range(4):
            for j in range(i + 1):
                value = 0.0
                for k in range(4):
                    value += exponent[k, k] * columns[k, i] * columns[k, j]
                gradient[i, j] = value
                gradient[j, i] = value
        from_pseudo_inertia(gradient, b, pi)
    return left


@kernel
def _gradient(y, first_row, sigma, b, row, gradient):
    """L (4, 4) of body ``b``: tr(L P(pi)) = (Y^T sigma) . pi."""
    for c in range(10):
        value = 0.0
        for r in range(sigma.shape[0]):
            value += y[first_row + r, 10 * b + c] * sigma[r]
        row[c // 4, c % 4] = value
    xx, xy, xz, yy = row[0, 0], row[0, 1], row[0, 2], row[0, 3]
    yz, zz = row[1, 0], row[1, 1]
    gradient[0, 0] = yy + zz
    gradient[1, 1] = xx + zz
    gradient[2, 2] = xx + yy
    gradient[0, 1] = -0.5 * xy
    gradient[0, 2] = -0.5 * xz
    gradient[1, 2] = -0.5 * yz
    gradient[0, 3] = 0.5 * row[1, 2]
    gradient[1, 3] = 0.5 * row[1, 3]
    gradient[2, 3] = 0.5 * row[2, 0]
    gradient[3, 3] = row[2, 1]
    for i in range(4):
        for j in range(i):
            gradient[i, j] = gradient[j, i]


@kernel
def _congruence(lower, gradient, factor, product, result):
    """result = factor C^T L C with C the lower triangle of ``lower``; ``product`` (4, 4) is work."""
    for i in range(4):
        for j in range(4):
            value = 0.0
            for k in range(j, 4):
                value += gradient[i, k] * lower[k, j]
            product[i, j] = value
    for i in range(4):
        for j in range(i + 1):
            value = 0.0
            for k in range(i, 4):
                value += lower[k, i] * product[k, j]
            result[i, j] = factor * value
            result[j, i] = result[i, j]
