"""Excitation in flight: singular values of all regressors seen so far, without keeping them.

The stacked regressor's triangular factor R (R^T R = sum of Y^T Y) is kept by Givens rotations, which, unlike the sum
itself, does not square the condition number. Columns are scaled by the parameters' size, so that numbers compare.
"""

import math

from flight_math import kernel, stack_array


@kernel
def accumulate(y, scale, triangle):
    """Rotate the rows of ``y`` (rows, p), columns times ``scale`` (p,), into ``triangle`` (p, p).

    ``triangle`` is upper triangular, zero at the start. A row that is not finite is left out. Returns the number of rows
    taken.
    """
    p = len(triangle)
    row = stack_array(p)
    taken = 0
    for r in range(len(y)):
        total = 0.0
        for j in range(p):
            row[j] = y[r, j] * scale[j]
            total += abs(row[j])
        if math.isfinite(total):
            rotate_in(row, triangle)
            taken += 1
    return taken


@kernel
def rotate_in(row, triangle):
    """One row (p,) into the triangular factor; the row is used up."""
    p = len(triangle)
    for k in range(p):
        length = math.sqrt(triangle[k, k] * triangle[k, k] + row[k] * row[k])
        if row[k] == 0.0 or length == 0.0:
            continue
        cosine = triangle[k, k] / length
        sine = row[k] / length
        for j in range(k, p):
            upper = triangle[k, j]
            lower = row[j]
            triangle[k, j] = cosine * upper + sine * lower
            row[j] = cosine * lower - sine * upper


@kernel
def singular_values(triangle, values):
    """Singular values of ``triangle`` (p, p), largest first, into ``values`` (p,), by one-sided Jacobi.

    Milliseconds for fifty parameters: for a monitor, not for a control loop.
    """
    p = len(triangle)
    rows = stack_array(p, p)
    for i in range(p):
        for j in range(p):
            rows[i, j] = triangle[j, i]
    for _ in range(40):  # [sweeps]; about ten are usual
        rotated = False
        for a in range(p - 1):
            for b in range(a + 1, p):
                rotated = orthogonalise(rows[a], rows[b]) or rotated
        if not rotated:
            break
    for i in range(p):
        total = 0.0
        for j in range(p):
            total += rows[i, j] * rows[i, j]
        size = math.sqrt(total)
        k = i
        while k > 0 and values[k - 1] < size:
            values[k] = values[k - 1]
            k -= 1
        values[k] = size


@kernel
def orthogonalise(a, b):
    """Rotate two rows to be orthogonal. Returns whether they were not."""
    aa, bb, ab = 0.0, 0.0, 0.0
    for j in range(len(a)):
        aa += a[j] * a[j]
        bb += b[j] * b[j]
        ab += a[j] * b[j]
    if abs(ab) <= 1e-15 * math.sqrt(aa * bb) or ab == 0.0:
        return False
    ratio = 0.5 * (bb - aa) / ab
    tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    for j in range(len(a)):
        upper = a[j]
        lower = b[j]
        a[j] = cosine * upper - sine * lower
        b[j] = sine * upper + cosine * lower
    return True
