"""Excitation in flight: singular values of all regressors seen so far, without keeping them.

The stacked regressor's triangular factor R (R^T R = sum of Y^T Y) is kept by Givens rotations, which, unlike the sum
itself, does not square the condition number. Columns are scaled by the parameters' size, so that numbers compare.
"""

import math

from flight_graph.kernel import kernel


@kernel
def accumulate(y, first_row, scale, triangle, row):
    """Rotate the rows of ``y`` (rows, p) from ``first_row``, columns times ``scale`` (p,), into ``triangle`` (p, p).

    ``triangle`` is upper triangular, zero at the start; ``row`` (p,) is work. A row that is not finite is left out.
    Returns the number of rows taken.
    """
    p = triangle.shape[0]
    taken = 0
    for r in range(first_row, y.shape[0]):
        total = 0.0
        for j in range(p):
            row[j] = y[r, j] * scale[j]
            total += abs(row[j])
        if not math.isfinite(total):
            continue
        taken += 1
        for k in range(p):
            if row[k] == 0.0:
                continue
            length = math.sqrt(triangle[k, k] * triangle[k, k] + row[k] * row[k])
            if length == 0.0:
                continue
            cosine = triangle[k, k] / length
            sine = row[k] / length
            for j in range(k, p):
                upper = triangle[k, j]
                lower = row[j]
                triangle[k, j] = cosine * upper + sine * lower
                row[j] = cosine * lower - sine * upper
    return taken


@kernel
def singular_values(triangle, values, work):
    """Singular values, largest first, into ``values`` (p,): one-sided Jacobi on a copy in ``work`` (p, p).

    Milliseconds for fifty parameters: for a monitor, not for a control loop.
    """
    p = triangle.shape[0]
    for i in range(p):
        for j in range(p):
            work[i, j] = triangle[j, i]
    for _ in range(40):  # [sweeps]; about ten are usual
        rotated = False
        for a in range(p - 1):
            for b in range(a + 1, p):
                rotated = _orthogonalise(work, a, b) or rotated
        if not rotated:
            break
    for i in range(p):
        total = 0.0
        for j in range(p):
            total += work[i, j] * work[i, j]
        size = math.sqrt(total)
        k = i
        while k > 0 and values[k - 1] < size:
            values[k] = values[k - 1]
            k -= 1
        values[k] = size


@kernel
def _orthogonalise(work, a, b):
    """Rotate rows a and b of ``work`` to be orthogonal. Returns whether they were not."""
    aa, bb, ab = 0.0, 0.0, 0.0
    for j in range(work.shape[1]):
        aa += work[a, j] * work[a, j]
        bb += work[b, j] * work[b, j]
        ab += work[a, j] * work[b, j]
    if abs(ab) <= 1e-15 * math.sqrt(aa * bb) or ab == 0.0:
        return False
    ratio = 0.5 * (bb - aa) / ab
    tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    for j in range(work.shape[1]):
        upper = work[a, j]
        lower = work[b, j]
        work[a, j] = cosine * upper - sine * lower
        work[b, j] = sine * upper + cosine * lower
    return True
