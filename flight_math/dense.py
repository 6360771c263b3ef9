"""Small dense matrices in kernels: Cholesky factor and solution, eigenvalues of a symmetric matrix by Jacobi rotations.

Written out with loops because a kernel uses no BLAS or LAPACK, whose bits depend on the machine.
"""

import math

from flight_math.kernel import kernel


@kernel
def copy(source, target):
    """target[i] = source[i], both (n,)."""
    for i in range(len(source)):
        target[i] = source[i]


@kernel
def cholesky(matrix, size):
    """Overwrite the lower triangle of ``matrix[:size, :size]`` with L, matrix = L L^T. Returns the smallest pivot.

    A pivot (the square of a diagonal element of L) that is not positive is returned at once; L is then incomplete.
    """
    smallest = math.inf
    for column in range(size):
        pivot = matrix[column, column]
        for k in range(column):
            pivot -= matrix[column, k] * matrix[column, k]
        if not pivot > 0.0:
            return pivot
        smallest = min(smallest, pivot)
        diagonal = math.sqrt(pivot)
        matrix[column, column] = diagonal
        for row in range(column + 1, size):
            value = matrix[row, column]
            for k in range(column):
                value -= matrix[row, k] * matrix[column, k]
            matrix[row, column] = value / diagonal
    return smallest


@kernel
def cholesky_solve(factor, size, vector):
    """Overwrite ``vector[:size]`` with the solution x of L L^T x = vector."""
    for row in range(size):
        value = vector[row]
        for k in range(row):
            value -= factor[row, k] * vector[k]
        vector[row] = value / factor[row, row]
    for row in range(size - 1, -1, -1):
        value = vector[row]
        for k in range(row + 1, size):
            value -= factor[k, row] * vector[k]
        vector[row] = value / factor[row, row]


@kernel
def symmetric_eigen(matrix, vectors, size):
    """Jacobi rotations: the diagonal of ``matrix`` becomes the eigenvalues, row k of ``vectors`` the k-th eigenvector.

    Only ``[:size, :size]`` is used. Unordered. Stops when a sweep no longer changes a diagonal element.
    """
    for i in range(size):
        for j in range(size):
            vectors[i, j] = 0.0
        vectors[i, i] = 1.0
    for _ in range(60):  # [sweeps]; quadratic convergence, 6 to 10 are usual
        rotated = False
        for p in range(size - 1):
            for q in range(p + 1, size):
                off = matrix[p, q]
                gap = matrix[q, q] - matrix[p, p]
                floor = 1e-17 * math.sqrt(abs(matrix[p, p] * matrix[q, q]))
                if abs(off) <= floor or off == 0.0:
                    continue
                rotated = True
                ratio = 0.5 * gap / off
                tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
                cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
                sine = tangent * cosine
                for k in range(size):
                    upper = matrix[k, p]
                    lower = matrix[k, q]
                    matrix[k, p] = cosine * upper - sine * lower
                    matrix[k, q] = sine * upper + cosine * lower
                for k in range(size):
                    upper = matrix[p, k]
                    lower = matrix[q, k]
                    matrix[p, k] = cosine * upper - sine * lower
                    matrix[q, k] = sine * upper + cosine * lower
                    upper = vectors[p, k]
                    lower = vectors[q, k]
                    vectors[p, k] = cosine * upper - sine * lower
                    vectors[q, k] = sine * upper + cosine * lower
                matrix[p, q] = 0.0
                matrix[q, p] = 0.0
        if not rotated:
            return
