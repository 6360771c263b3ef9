"""Values: small immutable vectors, matrices and quaternions for kernels, and views of records that read as such.

Compiled they are registers; in plain Python (NUMBA_DISABLE_JIT=1, a debugger, a test) they are small tuples with the same
operators and the same bits. See docs/values.md.
"""

from flight_math.values import access, compiled_types, compiled_views, operators, refused  # noqa: F401 teach the compiler
from flight_math.values.arrays import column, mat3, quaternion4, row, stack_array, vec3
from flight_math.values.classes import DualQuaternion, DualVector, Mask, Mat, Mat3, Quaternion, Value, Vec, Vec3
from flight_math.values.elementwise import elementwise
from flight_math.values.functions import (
    clip,
    count,
    cross,
    dot,
    largest,
    maximum,
    minimum,
    norm,
    normalised,
    same,
    sign,
    smallest,
    sqrt,
    total,
    where,
)
from flight_math.values.lifted import (
    acos,
    asin,
    atan,
    atan2,
    cbrt,
    cos,
    exp,
    expm1,
    hypot,
    log,
    log1p,
    power,
    sin,
    sincos,
    tan,
    tanh,
)
from flight_math.values.matrices import (
    diagonal,
    diagonal_of,
    from_columns,
    from_rows,
    identity3,
    outer,
    skew,
    solve,
    transpose,
)
from flight_math.values.rotations import (
    conjugate,
    dual_quaternion,
    dual_vector_part,
    quaternion,
    rotate,
    rotate_back,
    rotation_matrix,
    short_way,
    vector_part,
)
from flight_math.values.views import NO_KINDS, Kinds, View, view

__all__ = [
    "DualQuaternion", "DualVector", "Kinds", "Mask", "Mat", "Mat3", "NO_KINDS", "Quaternion", "Value", "Vec", "Vec3",
    "View", "acos", "asin", "atan", "atan2", "cbrt", "clip", "column", "conjugate", "cos", "count", "cross", "diagonal",
    "diagonal_of", "dot", "dual_quaternion", "dual_vector_part", "elementwise", "exp", "expm1", "from_columns",
    "from_rows", "hypot", "identity3", "largest", "log", "log1p", "mat3", "maximum", "minimum", "norm", "normalised",
    "outer", "power", "quaternion", "quaternion4", "rotate", "rotate_back", "rotation_matrix", "row", "same", "short_way",
    "sign", "sin", "sincos", "skew", "smallest", "solve", "sqrt", "stack_array", "tan", "tanh", "total", "transpose",
    "vec3",
    "vector_part", "view", "where",
]
