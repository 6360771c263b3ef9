"""What the elementary functions share: bits of a number, its upper half, a quotient to twice the precision."""

import math
import struct

import numba
from numba.core import types
from numba.extending import lower_builtin, type_callable

NAN, INF = math.nan, math.inf
LN2_HIGH, LN2_LOW = 0.6931471805598903, 5.497923018708371e-14  # 42 bits, so that k * LN2_HIGH is exact; the rest
LOWER_HALF = -134217728  # -2^27: the mask that clears 27 bits, so that the product of two upper halves is exact

_PACK_FLOAT, _PACK_INT = struct.Struct("<d"), struct.Struct("<q")


def inlined(function):
    """A kernel that is compiled into its caller: for small functions that are called in hot loops."""
    return numba.njit(error_model="numpy", nogil=True, _nrt=False, forceinline=True)(function)


def outlined(function):
    """A kernel that stays a function of its own, for rare arguments. (Left unsaid, it would inherit forceinline.)"""
    return numba.njit(error_model="numpy", nogil=True, _nrt=False, forceinline=False)(function)


def double(x):
    """The number as a float of 64 bits, whatever it is."""
    return float(x)


def bits(x):
    """The 64 bits of a float as a signed integer."""
    return _PACK_INT.unpack(_PACK_FLOAT.pack(x))[0]


def from_bits(i):
    """The float with these 64 bits."""
    return _PACK_FLOAT.unpack(_PACK_INT.pack(i))[0]


@type_callable(double)
def _type_double(context):
    return lambda x: types.float64 if isinstance(x, types.Number) else None


@type_callable(bits)
def _type_bits(context):
    return lambda x: types.int64 if x == types.float64 else None


@type_callable(from_bits)
def _type_from_bits(context):
    return lambda i: types.float64 if i == types.int64 else None


@lower_builtin(double, types.Number)
def _lower_double(context, builder, signature, arguments):
    return context.cast(builder, arguments[0], signature.args[0], types.float64)


@lower_builtin(bits, types.float64)
def _lower_bits(context, builder, signature, arguments):
    return builder.bitcast(arguments[0], context.get_value_type(types.int64))


@lower_builtin(from_bits, types.int64)
def _lower_from_bits(context, builder, signature, arguments):
    return builder.bitcast(arguments[0], context.get_value_type(types.float64))


@inlined
def select(condition, a, b):
    """a or b; both are computed already."""
    return a if condition else b


@inlined
def upper(x):
    """x without its lower 27 bits."""
    return from_bits(bits(x) & LOWER_HALF)


@inlined
def two_to(k):
    """2^k, -1022 <= k <= 1023; zero for k = -1023."""
    return from_bits((k + 1023) << 52)


@inlined
def sum_of_two(a, b):
    """a + b as its rounded value and the exact rest."""
    total = a + b
    from_b = total - a
    return total, (a - (total - from_b)) + (b - from_b)


@inlined
def product(a, b):
    """a b as its rounded value and the rest."""
    value = a * b
    a_top, b_top = upper(a), upper(b)
    a_low, b_low = a - a_top, b - b_top
    return value, ((a_top * b_top - value) + a_top * b_low + a_low * b_top) + a_low * b_low


@inlined
def quotient(n, n_low, d, d_low):
    """(n + n_low) / (d + d_low) as rounded value and rest, some 75 bits together."""
    value = n / d
    top, d_top = upper(value), upper(d)
    low, d_rest = value - top, d - d_top
    missing = ((n - top * d_top) - (top * d_rest + low * d_top)) + ((n_low - value * d_low) - low * d_rest)
    return value, missing * (1.0 / d)
