"""Products of three-vectors and 3x3 matrices as kernels use them: scalars in, tuples out, no allocation."""

from flight_graph.kernel import kernel


@kernel
def cross(ax, ay, az, bx, by, bz):
    """a x b"""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def matrix_vector(matrix, x, y, z):
    """matrix (3, 3) times (x, y, z)"""
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z,
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z,
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z,
    )


@kernel
def transpose_vector(matrix, x, y, z):
    """The transpose of matrix (3, 3) times (x, y, z)"""
    return (
        matrix[0, 0] * x + matrix[1, 0] * y + matrix[2, 0] * z,
        matrix[0, 1] * x + matrix[1, 1] * y + matrix[2, 1] * z,
        matrix[0, 2] * x + matrix[1, 2] * y + matrix[2, 2] * z,
    )
