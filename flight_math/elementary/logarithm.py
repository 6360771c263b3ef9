"""log, log1p."""

import math

from flight_math.elementary.arithmetic import (
    INF,
    LN2_HIGH,
    LN2_LOW,
    NAN,
    bits,
    from_bits,
    inlined,
    select,
    sum_of_two,
    two_to,
)

SMALLEST_NORMAL = 2.2250738585072014e-308
TWO_54 = 18014398509481984.0
ROOT_HALF = 4604544269498187776  # bits of sqrt(1/2), rounded down to 20 bits
EXPONENT = -4503599627370496  # mask of sign and exponent
# log((1 + s) / (1 - s)) = 2 s + s^3 (L1 + L2 s^2 + ...), |s| <= 0.1716, to 2^-59.5
L1, L2, L3, L4 = 0.6666666666666734, 0.3999999999941642, 0.2857142874211116, 0.22222198593865336
L5, L6, L7 = 0.18183563548947815, 0.15314064393663177, 0.14795861348845551


@inlined
def _split(x):
    """(k, m): x = 2^k m, sqrt(1/2) <= m < sqrt(2); x > 0 and finite."""
    small = x < SMALLEST_NORMAL
    i = bits(select(small, x * TWO_54, x))
    above = i - ROOT_HALF
    return (above >> 52) - select(small, 54, 0), from_bits(i - (above & EXPONENT))


@inlined
def _log_parts(k, f):
    """k ln 2 + log(1 + f) as a sum of two."""
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    r = z * (L1 + w * (L3 + w * (L5 + w * L7))) + w * (L2 + w * (L4 + w * L6))
    half = 0.5 * f * f
    turns = float(k)
    high = turns * LN2_HIGH
    value = high + f
    return value, (f - (value - high)) - (half - (s * (half + r) + turns * LN2_LOW))


@inlined
def log(x):
    """Natural logarithm."""
    x = float(x)
    k, m = _split(select((x > 0.0) & (x < INF), x, 1.0))
    value, rest = _log_parts(k, m - 1.0)
    return _at_the_ends(x, value + rest)


@inlined
def log1p(x):
    """log(1 + x), to the last bits near zero too."""
    x = float(x)
    u = 1.0 + x
    u = select((u > 0.0) & (u < INF), u, 1.0)
    c = sum_of_two(1.0, select((x > -1.0) & (x < INF), x, 0.0))[1]
    k, m = _split(u)
    near = m - 1.0
    c = c * two_to(-k if k < 64 else -1023)
    f = near + c
    f_low = c - (f - near)
    value, rest = _log_parts(k, f)
    return math.copysign(1.0, x) * abs(_at_the_ends(u if x > -1.0 else 1.0 + x, value + (rest + f_low * (1.0 - f))))


@inlined
def _at_the_ends(x, value):
    """value, or what the logarithm is at zero, infinity, NaN and below zero."""
    value = select(x < INF, value, INF)
    value = select(x == 0.0, -INF, value)
    return select(x >= 0.0, value, NAN)
