"""Functions of matrices; each is written once, for plain Python and for the compiler. Numbers stand row by row."""

from flight_math.values.classes import Mat, Mat3, Vec, Vec3, is_matrix, is_vector
from flight_math.values.operation import operation
from flight_math.values.symbols import quotient


def _transposed(m):
    if not is_matrix(m):
        return None
    height, width = m.shape
    return Mat(width, height), lambda numbers: tuple(numbers[i * width + j] for j in range(width) for i in range(height))


@operation(_transposed, "needed is a matrix")
def transpose(m):
    """The transpose of a Mat3 or Mat(n, m)."""


@operation(lambda a, b: Mat(a.count, b.count) if is_vector(a) and is_vector(b) else None, "needed are two vectors")
def outer(a, b):
    """a b^T, a matrix of as many rows as a and columns as b have components."""
    return tuple(first * second for first in a for second in b)


@operation(lambda v: Mat3 if v is Vec3 else None, "needed is a Vec3")
def skew(v):
    """The matrix [v]x: skew(v) @ u is cross(v, u)."""
    return 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0


@operation(lambda: Mat3, "it takes nothing")
def identity3():
    """The Mat3 of ones on the diagonal."""
    return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0


def _square(v):
    return Mat(v.count, v.count) if is_vector(v) else None


@operation(_square, "needed is a vector")
def diagonal(v):
    """The matrix with the components of v on its diagonal."""
    return tuple(v[i] if i == j else 0.0 for i in range(len(v)) for j in range(len(v)))


def _stack(*vectors):
    if not vectors or not is_vector(vectors[0]) or any(vector is not vectors[0] for vector in vectors):
        return None
    return Mat(len(vectors), vectors[0].count)


def _side_by_side(*vectors):
    kind = _stack(*vectors)
    return kind and Mat(kind.shape[1], kind.shape[0])


@operation(_stack, "needed are vectors of one kind, three Vec3 for a Mat3")
def from_rows(*vectors):
    """The matrix of these rows."""
    return tuple(part for vector in vectors for part in vector)


@operation(_side_by_side, "needed are vectors of one kind, three Vec3 for a Mat3")
def from_columns(*vectors):
    """The matrix of these columns."""
    return tuple(vector[i] for i in range(len(vectors[0])) for vector in vectors)


@operation(lambda m: Vec(m.shape[0]) if is_matrix(m) and m.shape[0] == m.shape[1] else None, "needed is a square matrix")
def diagonal_of(m):
    """The vector of the elements on the diagonal."""
    size = round(len(m) ** 0.5)
    return tuple(m[i * (size + 1)] for i in range(size))


def _solvable(m, b):
    return b if is_matrix(m) and is_vector(b) and m.shape == (b.count, b.count) else None


@operation(_solvable, "needed are a square matrix and a vector of its size")
def solve(m, b):
    """x of m x = b for a symmetric positive definite m, of which the lower triangle is read: L D L^T; for small sizes."""
    size = len(b)
    lower = {}
    pivots = []
    for j in range(size):
        scaled = [lower[j, k] * pivots[k] for k in range(j)]
        pivots.append(_less(m[j * size + j], [(lower[j, k], scaled[k]) for k in range(j)]))
        for i in range(j + 1, size):
            lower[i, j] = quotient(_less(m[i * size + j], [(lower[i, k], scaled[k]) for k in range(j)]), pivots[j])
    x = []
    for i in range(size):
        x.append(_less(b[i], [(lower[i, k], x[k]) for k in range(i)]))
    x = [quotient(part, pivot) for part, pivot in zip(x, pivots)]
    for i in reversed(range(size)):
        x[i] = _less(x[i], [(lower[k, i], x[k]) for k in range(i + 1, size)])
    return x


def _less(number, products):
    """number minus products, one after the other."""
    for first, second in products:
        number = number - first * second
    return number
