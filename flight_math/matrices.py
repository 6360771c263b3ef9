"""Functions of Mat3 that are more than one expression."""

from flight_math.kernel import kernel
from flight_math.values import Vec, column, cross, dot, from_rows

Vec9 = Vec(9)


@kernel
def inverse(m):
    """Inverse of a Mat3 by cofactors; for well conditioned matrices (inertias, covariances)."""
    a, b, c = column(m, 0), column(m, 1), column(m, 2)
    first = cross(b, c)
    scale = 1.0 / dot(a, first)
    return scale * from_rows(first, cross(c, a), cross(a, b))


@kernel
def row_by_row(m):
    """A Mat3 as the nine numbers of a message's covariance."""
    return Vec9(m[0, 0], m[0, 1], m[0, 2], m[1, 0], m[1, 1], m[1, 2], m[2, 0], m[2, 1], m[2, 2])
