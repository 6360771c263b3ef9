"""Functions of vectors and masks; each is written once, for plain Python and for the compiler.

A vector is a Vec3 or a Vec(n). Sums run from the first component to the last.
"""

import operator

from flight_math.values.classes import DualVector, Quaternion, Value, Vec, Vec3, is_mask, is_vector
from flight_math.values.operation import operation
from flight_math.values.operators import by_component, dot_product, rows
from flight_math.values.symbols import choose, how_many, quotient, root


# -- rules: kinds of the arguments -> kind of the result, or None --------------------------------------------------------
def _of_vector(result):
    return lambda v: result if is_vector(v) else None


def _alike(*kinds):
    """One vector kind among numbers; numbers alone give a number."""
    vectors = {kind for kind in kinds if is_vector(kind)}
    if not all(is_vector(kind) or kind is float for kind in kinds) or len(vectors) > 1:
        return None
    return vectors.pop() if vectors else float


def _where(condition, a, b):
    values = {kind for kind in (a, b) if kind is not float}
    if len(values) > 1 or not all(isinstance(kind, type) and issubclass(kind, Value) for kind in values):
        return None
    kind = values.pop() if values else float
    if condition is bool:
        return kind, _chosen_by_one
    if not is_mask(condition):
        return None
    kind = Vec(condition.count) if kind is float else kind
    return (kind, by_component(choose)) if is_vector(kind) and kind.count == condition.count else None


def _chosen_by_one(truth, a, b):
    if not isinstance(a, (tuple, list)) and not isinstance(b, (tuple, list)):
        return choose(truth, a, b)
    return tuple(choose(truth, first, second) for first, second in zip(*rows(a, b)))


def _lifted(function):
    """The formula of a function of numbers, for numbers and for vectors."""
    lifted = by_component(function)
    return lambda *args: lifted(*args) if any(isinstance(a, (tuple, list)) for a in args) else function(*args)


# -- by component ----------------------------------------------------------------------------------------------------------
def _smaller(a, b):
    return choose(b < a, b, a)


def _greater(a, b):
    return choose(b > a, b, a)


def _within(v, low, high):
    return choose(v > high, high, choose(v < low, low, v))


def _sign(v):
    return choose(v > 0.0, 1.0, choose(v < 0.0, -1.0, 0.0))


@operation(lambda v, low, high: _alike(v, low, high) if is_vector(v) or v is low is high is float else None,
           "needed are a vector and two bounds, each a vector of its kind or a number; or three numbers")
def clip(v, low, high):
    """v, at most ``high`` and at least ``low`` (each a vector or a number); NaN stays NaN."""
    return _lifted(_within)(v, low, high)


@operation(lambda v: _alike(v), "needed is a vector or a number")
def sign(v):
    """1, 0 or -1 for each component (0 for NaN)."""
    return _lifted(_sign)(v)


@operation(lambda a, b: _alike(a, b), "needed are vectors of one kind, or numbers")
def minimum(a, b):
    """The smaller of each two components."""
    return _lifted(_smaller)(a, b)


@operation(lambda a, b: _alike(a, b), "needed are vectors of one kind, or numbers")
def maximum(a, b):
    """The larger of each two components."""
    return _lifted(_greater)(a, b)


@operation(lambda v: _alike(v), "needed is a vector or a number")
def sqrt(v):
    """The square root of each component; NaN of a negative one."""
    return _lifted(root)(v)


@operation(_where, "needed are a Mask (a comparison of vectors) and two vectors or numbers, or a truth and two of one kind")
def where(condition, a, b):
    """a where the condition holds, b elsewhere; component by component with a Mask."""


@operation(lambda mask: int if is_mask(mask) else None, "needed is a Mask (a comparison of vectors)")
def count(mask):
    """How many truths of a Mask hold."""
    return how_many(mask)


# -- vectors ---------------------------------------------------------------------------------------------------------------
@operation(lambda a, b: float if is_vector(a) and a is b else None, "needed are two vectors of one kind")
def dot(a, b):
    """a . b, summed from the first component to the last."""
    return dot_product(a, b)


def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dual_cross(a, b):
    mixed = by_component(operator.add)(_cross(a[:3], b[3:]), _cross(a[3:], b[:3]))
    return *_cross(a[:3], b[:3]), *mixed


@operation(lambda a, b: {(Vec3, Vec3): (Vec3, _cross), (DualVector, DualVector): (DualVector, _dual_cross)}.get((a, b)),
           "needed are two Vec3, or two DualVector")
def cross(a, b):
    """a x b; of dual vectors a x b + eps (a x b' + a' x b)."""


@operation(lambda v: float if is_vector(v) or v is Quaternion else None, "needed is a vector or a Quaternion")
def norm(v):
    """The Euclidean norm."""
    return root(dot_product(v, v))


@operation(lambda v: v if is_vector(v) or v is Quaternion else None, "needed is a vector or a Quaternion")
def normalised(v):
    """v / |v|, by one division for each component; NaN for zero."""
    length = root(dot_product(v, v))
    return tuple(quotient(part, length) for part in v)


def _running(function):
    def formula(v):
        result = v[0]
        for part in v[1:]:
            result = function(result, part)
        return result
    return formula


@operation(_of_vector(float), "needed is a vector")
def largest(v):
    """The largest component."""
    return _running(_greater)(v)


@operation(_of_vector(float), "needed is a vector")
def smallest(v):
    """The smallest component."""
    return _running(_smaller)(v)


@operation(_of_vector(float), "needed is a vector")
def total(v):
    """The sum of the components, from the first to the last."""
    return _running(lambda a, b: a + b)(v)


@operation(lambda s: Vec3 if s is float else None, "needed is a number")
def same(s):
    """Vec3(s, s, s)"""
    return s, s, s
