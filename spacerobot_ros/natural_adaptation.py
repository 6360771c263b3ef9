"""Natural adaptation: Lyapunov's law on the manifold of possible bodies, so that no estimate leaves it.

Each body's pseudo-inertia P moves by P+ = C exp(g T C^T L C) C^T, C = chol(P), where L is the symmetric matrix with
tr(L P(pi)) = (Y^T sigma) . pi (Lee, Kwon, Park 2018: natural adaptive control). P stays positive definite, hence every
estimated mass is positive and every inertia possible. It buys that guarantee, not better tracking.
"""

import math

from flight_math import Mat3, Vec3, clip, exp, identity3, kernel, stack_array
from flight_math.dense import cholesky, symmetric_eigen
from spacerobot_ros.dynamics import body_inertia


@kernel
def fill(matrix, block, column, corner):
    """The symmetric (4, 4) [[block, column], [column^T, corner]]."""
    for i in range(3):
        for j in range(3):
            matrix[i, j] = block[i, j]
        matrix[i, 3] = matrix[3, i] = column[i]
    matrix[3, 3] = corner


@kernel
def to_pseudo_inertia(pi, b, matrix):
    """Pseudo-inertia (4, 4) of body ``b`` of the parameter vector: [[tr(I)/2 E - I, h], [h^T, m]]."""
    tensor, h, m = body_inertia(pi, b)
    half_trace = 0.5 * (tensor[0, 0] + tensor[1, 1] + tensor[2, 2])
    fill(matrix, half_trace * identity3() - tensor, h, m)


@kernel
def from_pseudo_inertia(matrix, b, pi):
    """Write body ``b``'s ten parameters from its pseudo-inertia."""
    k = 10 * b
    pi[k], pi[k + 1], pi[k + 2] = matrix[1, 1] + matrix[2, 2], -matrix[0, 1], -matrix[0, 2]
    pi[k + 3], pi[k + 4], pi[k + 5] = matrix[0, 0] + matrix[2, 2], -matrix[1, 2], matrix[0, 0] + matrix[1, 1]
    for i in range(4):
        pi[k + 6 + i] = matrix[i, 3]


@kernel
def gradient(y, sigma, b, matrix):
    """L (4, 4) of body ``b``: tr(L P(pi)) = (Y^T sigma) . pi."""
    slope = stack_array(10)
    for c in range(10):
        for r in range(len(sigma)):
            slope[c] += y[r, 10 * b + c] * sigma[r]
    xx, xy, xz = slope[0], -0.5 * slope[1], -0.5 * slope[2]
    yy, yz, zz = slope[3], -0.5 * slope[4], slope[5]
    block = Mat3(yy + zz, xy, xz,
                 xy, xx + zz, yz,
                 xz, yz, xx + yy)
    fill(matrix, block, 0.5 * Vec3(slope[6], slope[7], slope[8]), slope[9])


@kernel
def spectral(values, vectors, result):
    """result (4, 4) = sum over k of values[k, k] v v^T, v = vectors[k]: the symmetric matrix of a decomposition."""
    for i in range(4):
        for j in range(i + 1):
            value = 0.0
            for k in range(4):
                value += values[k, k] * vectors[k, i] * vectors[k, j]
            result[i, j] = result[j, i] = value


@kernel
def congruence(lower, matrix, factor, result):
    """result = factor C^T L C, C the lower triangle of ``lower``, all (4, 4)."""
    product = stack_array(4, 4)
    for i in range(4):
        for j in range(4):
            for k in range(j, 4):
                product[i, j] += matrix[i, k] * lower[k, j]
    for i in range(4):
        for j in range(i + 1):
            value = 0.0
            for k in range(i, 4):
                value += lower[k, i] * product[k, j]
            result[i, j] = result[j, i] = factor * value


@kernel
def project(pi, floor):
    """Make every body possible: eigenvalues of its pseudo-inertia, scaled to a unit diagonal, to at least ``floor``.

    ``floor`` [-], 0.02 is usual. A body that satisfies it is not touched. Returns the number of bodies changed.
    """
    matrix, scaled, vectors, scale = stack_array(4, 4), stack_array(4, 4), stack_array(4, 4), stack_array(4)
    changed = 0
    for b in range(len(pi) // 10):
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
        spectral(scaled, vectors, matrix)
        for i in range(4):
            for j in range(4):
                matrix[i, j] *= scale[i] * scale[j]
        from_pseudo_inertia(matrix, b, pi)
    return changed


@kernel
def smallest_eigenvalues(pi, smallest):
    """Smallest eigenvalue of each body's pseudo-inertia, into ``smallest`` (bodies,); not positive: no such body."""
    matrix, vectors = stack_array(4, 4), stack_array(4, 4)
    for b in range(len(pi) // 10):
        to_pseudo_inertia(pi, b, matrix)
        symmetric_eigen(matrix, vectors, 4)
        smallest[b] = min(min(matrix[0, 0], matrix[1, 1]), min(matrix[2, 2], matrix[3, 3]))


@kernel
def natural_update(y, sigma, gain, period, limit, pi):
    """One step of natural adaptation for every body, ``pi`` in place. Returns the number of bodies left as they were.

    ``y``, ``sigma`` as in `lyapunov_update`; ``gain`` g (one number); ``period`` [s]; the exponent's eigenvalues are
    clipped to +-``limit`` (2 is usual). A body is left alone if its pseudo-inertia is not positive (call `project` on the
    prior) or Y or sigma is not finite.
    """
    root, slope, exponent = stack_array(4, 4), stack_array(4, 4), stack_array(4, 4)
    left = 0
    for b in range(len(pi) // 10):
        to_pseudo_inertia(pi, b, root)
        gradient(y, sigma, b, slope)
        total = 0.0
        for i in range(4):
            for j in range(4):
                total += abs(slope[i, j])
        if not math.isfinite(total) or not cholesky(root, 4) > 0.0:
            left += 1
            continue
        congruence(root, slope, gain * period, exponent)
        move(root, exponent, limit, slope)
        from_pseudo_inertia(slope, b, pi)
    return left


@kernel
def move(root, exponent, limit, moved):
    """moved (4, 4) = C exp(exponent) C^T, eigenvalues of the exponent clipped; C the lower triangle of ``root``."""
    vectors, columns = stack_array(4, 4), stack_array(4, 4)
    symmetric_eigen(exponent, vectors, 4)
    for k in range(4):
        exponent[k, k] = exp(clip(exponent[k, k], -limit, limit))
        for i in range(4):
            for j in range(i + 1):
                columns[k, i] += root[i, j] * vectors[k, j]
    spectral(exponent, columns, moved)
