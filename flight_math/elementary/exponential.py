"""exp, expm1, tanh."""

import math

from flight_math.elementary.arithmetic import LN2_HIGH, LN2_LOW, NAN, inlined, quotient, select, sum_of_two, two_to

LOG2_E = 1.4426950408889634
MAGIC = 6755399441055744.0  # 1.5 * 2^52: adding it rounds to an integer
# exp r = 1 + r + r^2 / 2 + r^3 (E3 + E4 r + ...), |r| <= ln 2 / 2, to 2^-61.4
E3, E4, E5, E6, E7 = (0.16666666666666674, 0.04166666666666667, 0.008333333333322207, 0.0013888888888880944,
                      0.00019841269886591)
E8, E9, E10, E11, E12 = (2.4801587333953088e-05, 2.7557242336680357e-06, 2.755726431433642e-07, 2.5110049895858716e-08,
                         2.091813816945801e-09)


@inlined
def _reduced(x):
    """(k, r, rest): exp(x) = 2^k (1 + r + rest), |r| <= ln 2 / 2, for |x| < 1000."""
    k = (x * LOG2_E + MAGIC) - MAGIC
    high = x - k * LN2_HIGH
    low = k * LN2_LOW
    r = high - low
    c = (high - r) - low
    r2 = r * r
    r4 = r2 * r2
    q = ((E3 + E4 * r) + (E5 + E6 * r) * r2) + ((E7 + E8 * r) + (E9 + E10 * r) * r2) * r4 + (E11 + E12 * r) * (r4 * r4)
    return int(k), r, c + r2 * (0.5 + r * q)


@inlined
def _scaled(value, k):
    """value 2^k in two steps, since 2^k alone may overflow or be subnormal."""
    half = k >> 1
    return value * two_to(half) * two_to(k - half)


@inlined
def exp(x):
    """e^x."""
    x = float(x)
    clipped = select(x < 710.0, x, 710.0)
    clipped = select(clipped > -746.0, clipped, -746.0)
    k, r, rest = _reduced(clipped)
    one = 1.0 + r
    return select(x == x, _scaled(one + ((r - (one - 1.0)) + rest), k), NAN)


@inlined
def expm1(x):
    """e^x - 1, to the last bits near zero too."""
    x = float(x)
    clipped = select(x < 710.0, x, 710.0)
    clipped = select(clipped > -50.0, clipped, -50.0)
    k, r, rest = _reduced(clipped)
    whole, whole_low = _one_less(k)
    value = whole + r
    value = value + (((r - (value - whole)) + whole_low) + rest)
    return select(x == x, math.copysign(_scaled(value, k), x), NAN)


@inlined
def _one_less(k):
    """1 - 2^-k in two parts."""
    power = two_to(-k if k < 64 else -1023)
    whole = 1.0 - power
    return whole, (1.0 - whole) - power


@inlined
def tanh(x):
    """Hyperbolic tangent."""
    x = float(x)
    a = abs(x)
    k, r, rest = _reduced(2.0 * select(a < 22.0, a, 22.0))
    power = two_to(-k)
    whole = 1.0 - power  # exp(2 a) - 1 = 2^k (whole + r + rest)
    head = whole + r
    tail = ((r - (head - whole)) + ((1.0 - whole) - power)) + rest
    n = head + tail
    n_low = tail - (n - head)
    d, d_low = sum_of_two(n, 2.0 * power)
    value = quotient(n, n_low, d, d_low + n_low)[0]
    return select(x == x, math.copysign(value, x), NAN)
