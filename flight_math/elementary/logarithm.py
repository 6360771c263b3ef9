"""log, log1p."""

import math

from flight_math.elementary.arithmetic import (
    INF,
    LN2_HIGH,
    LN2_LOW,
    NAN,
    bits,
    double,
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
def split(x):
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
    r = (((L1 + z * L2) + w * (L3 + z * L4)) + (w * w) * ((L5 + z * L6) + w * L7)) * (z * s)
    half = 0.5 * f * f
    turns = float(k)
    high = turns * LN2_HIGH
    value = high + f
    return value, ((f - (value - high)) - (half - (s * half + turns * LN2_LOW))) + r


@inlined
def log(x):
    """Natural logarithm."""
    x = double(x)
    if not (x > 0.0 and x < INF):
        return -INF if x == 0.0 else INF if x == INF else NAN
    k, m = split(x)
    value, rest = _log_parts(k, m - 1.0)
    return value + rest


@inlined
def log1p(x):
    """log(1 + x), to the last bits near zero too."""
    x = double(x)
    if not (x > -1.0 and x < INF):
        return -INF if x == -1.0 else INF if x == INF else NAN
    u, c = sum_of_two(1.0, x)
    k, m = split(u)
    near = m - 1.0
    c = c * two_to(-k if k < 64 else -1023)
    f = near + c
    f_low = c - (f - near)
    value, rest = _log_parts(k, f)
    return math.copysign(value + (rest + f_low * (1.0 - f)), x)
