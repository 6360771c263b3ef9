"""exp, expm1, tanh."""

import math

from flight_math.elementary.arithmetic import INF, LN2_HIGH, LN2_LOW, NAN, double, inlined, quotient, sum_of_two, two_to

LOG2_E = 1.4426950408889634
MAGIC = 6755399441055744.0  # 1.5 * 2^52: adding it rounds to an integer
# exp r = 1 + r + r^2 / 2 + r^3 (E3 + E4 r + ...), |r| <= ln 2 / 2, to 2^-61.4
E3, E4, E5, E6, E7 = (0.16666666666666674, 0.04166666666666667, 0.008333333333322207, 0.0013888888888880944,
                      0.00019841269886591)
E8, E9, E10, E11, E12 = (2.4801587333953088e-05, 2.7557242336680357e-06, 2.755726431433642e-07, 2.5110049895858716e-08,
                         2.091813816945801e-09)


@inlined
def reduced(x):
    """(k, r, near, far): exp(x) = 2^k (1 + r + near + far), |r| <= ln 2 / 2, |far| < 0.01; |x| < 1000."""
    k = (x * LOG2_E + MAGIC) - MAGIC
    high = x - k * LN2_HIGH
    low = k * LN2_LOW
    r = high - low
    c = (high - r) - low
    r2 = r * r
    r4 = r2 * r2
    q = (((E3 + E4 * r) + (E5 + E6 * r) * r2) + ((E7 + E8 * r) + (E9 + E10 * r) * r2) * r4) + (E11 + E12 * r) * (r4 * r4)
    return int(k), r, c + 0.5 * r2, (r2 * r) * q


@inlined
def scaled(value, k):
    """value 2^k in two steps, since 2^k alone may overflow or be subnormal."""
    half = k >> 1
    return value * two_to(half) * two_to(k - half)


@inlined
def exp(x):
    """e^x."""
    x = double(x)
    if not (x > -746.0 and x < 710.0):
        return 0.0 if x < 0.0 else INF if x > 0.0 else NAN
    k, r, near, far = reduced(x)
    one = 1.0 + r
    return scaled(one + (((r - (one - 1.0)) + near) + far), k)


@inlined
def expm1(x):
    """e^x - 1, to the last bits near zero too."""
    x = double(x)
    if not (x > -50.0 and x < 710.0):
        return -1.0 if x < 0.0 else INF if x > 0.0 else NAN
    k, r, near, far = reduced(x)
    whole, whole_low = _one_less(k)
    value = whole + r
    value = value + ((((r - (value - whole)) + whole_low) + near) + far)
    return math.copysign(scaled(value, k), x)


@inlined
def _one_less(k):
    """1 - 2^-k in two parts."""
    power = two_to(-k if k < 64 else -1023)
    whole = 1.0 - power
    return whole, (1.0 - whole) - power


@inlined
def tanh(x):
    """Hyperbolic tangent."""
    x = double(x)
    a = abs(x)
    if not a < 22.0:
        return math.copysign(1.0, x) if a == a else NAN
    k, r, near, far = reduced(2.0 * a)
    power = two_to(-k)
    whole = 1.0 - power  # exp(2 a) - 1 = 2^k (whole + r + near + far)
    head = whole + r
    tail = (((r - (head - whole)) + ((1.0 - whole) - power)) + near) + far
    n = head + tail
    n_low = tail - (n - head)
    d, d_low = sum_of_two(n, 2.0 * power)
    value, rest = quotient(n, n_low, d, d_low + n_low)
    return math.copysign(value + rest, x)
