"""Every operator and function of values in a few kernels, and what the tests need to compare bits."""

import struct

from flight_math import (
    DualQuaternion,
    DualVector,
    Quaternion,
    Vec,
    Vec3,
    clip,
    column,
    conjugate,
    count,
    cross,
    diagonal,
    diagonal_of,
    dot,
    dual_quaternion,
    dual_vector_part,
    elementwise,
    from_columns,
    from_rows,
    identity3,
    kernel,
    largest,
    maximum,
    minimum,
    norm,
    normalised,
    outer,
    quaternion,
    rotate,
    rotate_back,
    rotation_matrix,
    row,
    same,
    short_way,
    sign,
    skew,
    smallest,
    sqrt,
    total,
    transpose,
    vector_part,
    where,
)
from flight_math.values import Value

Vec5 = Vec(5)


@kernel
def arithmetic(a, b, s):
    """Operators of vectors and numbers."""
    c = a + b
    c += s
    return (a + b, a - b, a * b, a / b, a + s, s + a, a - s, s - a, a * s, s * a, a / s, s / a, -a, abs(a), a @ b, c,
            a < b, a <= s, s > a, a >= b, a == b, a != b, ~(a < b), (a < b) & (a > s), (a < b) | (a > s))


@kernel
def vector_functions(a, b, s):
    """Functions of vectors."""
    mask = a < b
    return (where(mask, a, b), where(mask, s, b), where(mask, 1.0, s), where(s > 0.0, a, b), where(s > 0.0, 1.0, s),
            any(mask), all(mask), count(mask), clip(a, b, s), clip(a, s, b), clip(s, -1.0, 1.0), sign(a), sign(s),
            minimum(a, b), maximum(a, s), minimum(s, 1.0), largest(a), smallest(a), total(a), dot(a, b), norm(a),
            normalised(a), sqrt(a), sqrt(s), len(a), a[0], a[-1])


@kernel
def three_vectors(a, b, s, i):
    """What Vec3 alone has, and matrices of three."""
    m = from_rows(a, b, same(s))
    n = from_columns(a, b, cross(a, b))
    return (cross(a, b), same(s), m, n, transpose(n), outer(a, b), skew(a), diagonal(a), diagonal_of(m), m @ a, m @ n,
            m + n, m - n, -m, abs(m), m * s, s * m, m / s, m + s, identity3(), row(m, i), column(n, i), row(m, 1), m[i, 1],
            m[0, i], m[2, 2], a[i], a.x, a.y, a.z)


@kernel
def turns(q, r, a, s):
    """Quaternions, dual quaternions, dual vectors."""
    d, e = DualQuaternion(q, r), DualQuaternion(r, q * 2.0)
    t, u = DualVector(a, vector_part(q)), DualVector(vector_part(r), a)
    return (q * r, q + r, q - s, q * s, s * q, q / s, -q, abs(q), conjugate(q), rotate(q, a), rotate_back(q, a), norm(q),
            normalised(q), vector_part(q), quaternion(a, s), rotation_matrix(q), short_way(q), q.x, q.y, q.z, q.w, q[3],
            d * e, d + e, d * s, conjugate(d), short_way(d), d.real, e.dual, t + u, t * s, cross(t, u), t.real, u.dual,
            dual_quaternion(t), dual_vector_part(d), Vec(8)(d), Vec(4)(q), Quaternion(Vec(4)(r)))


@elementwise
def branches(x, low):
    """A number in, a number out, with an early return."""
    if x > low:
        return x * x
    return low


@elementwise
def is_small(x):
    """A truth."""
    return abs(x) < 1.0


@elementwise
def parted(x):
    """Two numbers."""
    return x - 1.0, x + 1.0


@kernel
def lifts(a, b, s):
    """Kernels of numbers with vectors."""
    return (branches(a, s), branches(a, b), branches(s, 1.0), branches(1.0, a), is_small(a), parted(a), parted(s),
            branches(outer(a, b), s))


def bits(result):
    """All numbers of a result as bytes; every NaN is the same."""
    if isinstance(result, Value):
        return type(result).__name__.encode() + b"".join(map(bits, result.parts()))
    if isinstance(result, tuple):
        return b"".join(map(bits, result))
    number = float(result)
    return struct.pack("<d", number) if number == number else b"NaN"


def vector(kind, numbers):
    """A value of the first numbers of a list."""
    return kind(*numbers[:kind.count])


CASES = {
    "arithmetic of Vec3": (arithmetic, (Vec3, Vec3, float)), "arithmetic of Vec(5)": (arithmetic, (Vec5, Vec5, float)),
    "functions of Vec3": (vector_functions, (Vec3, Vec3, float)), "functions of Vec(5)": (vector_functions, (Vec5, Vec5, float)),
    "three vectors": (three_vectors, (Vec3, Vec3, float, int)), "turns": (turns, (Quaternion, Quaternion, Vec3, float)),
    "lifts": (lifts, (Vec3, Vec3, float)),
}
