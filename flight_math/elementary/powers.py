"""power(x, y) = x^y."""

import math

from flight_math.elementary.arithmetic import (
    INF,
    LN2_HIGH,
    LN2_LOW,
    NAN,
    double,
    inlined,
    outlined,
    product,
    quotient,
    sum_of_two,
)
from flight_math.elementary.exponential import reduced, scaled
from flight_math.elementary.logarithm import split

THIRD, THIRD_LOW = 0.3333333333333333, 1.850371707708594e-17
# atanh s = s + s^3 (1/3 + s^2 (Q0 + Q1 s^2 + ...)), |s| <= 0.1716, to 2^-66.2
Q0, Q1, Q2, Q3 = 0.1999999999999999, 0.14285714285722562, 0.11111111108766895, 0.09090909435322964
Q4, Q5, Q6, Q7 = 0.07692278424106724, 0.06668159150883732, 0.05837400238504323, 0.059945820812253144


@outlined
def power(x, y):
    """x^y; NaN for x < 0 unless y is a whole number."""
    x = double(x)
    y = double(y)
    if x == 1.0 or y == 0.0:
        return 1.0
    if not (x == x and y == y):
        return NAN
    a = abs(x)
    whole, odd = _whole(y)
    sign = math.copysign(1.0, x) if odd else 1.0
    if a == 0.0 or a == INF:
        return sign * (INF if (a == INF) == (y > 0.0) else 0.0)
    if abs(y) == INF:
        return 1.0 if a == 1.0 else INF if (a > 1.0) == (y > 0.0) else 0.0
    if x < 0.0 and not whole:
        return NAN
    return sign * _positive_power(a, y)


@inlined
def _whole(y):
    """Whether y is a whole number, and whether an odd one."""
    if abs(y) >= 9007199254740992.0:  # 2^53
        return True, False
    nearest = int(y)
    whole = float(nearest) == y
    return whole, whole and nearest & 1 == 1


@inlined
def _positive_power(a, y):
    """a^y for 0 < a < inf and finite y: exp(y log a) with some 64 bits of the logarithm."""
    log_a, log_a_low = _precise_log(a)
    if abs(log_a) * abs(y) > 1000.0:
        return INF if (log_a > 0.0) == (y > 0.0) else 0.0
    exponent, exponent_low = product(log_a, y)
    k, r, near, far = reduced(exponent)
    one = 1.0 + r
    rest = (exponent_low + log_a_low * y) * (one + (near + far))
    return scaled(one + (((r - (one - 1.0)) + (near + rest)) + far), k)


@inlined
def _precise_log(a):
    """log(a) as a sum of two."""
    k, m = split(a)
    d, d_low = sum_of_two(m, 1.0)
    s, s_low = quotient(m - 1.0, 0.0, d, d_low)
    z, z_low = product(s, s)
    z_low = z_low + 2.0 * s * s_low
    z2 = z * z
    u = z * (((Q0 + Q1 * z) + (Q2 + Q3 * z) * z2) + ((Q4 + Q5 * z) + (Q6 + Q7 * z) * z2) * (z2 * z2))
    c, c_low = sum_of_two(THIRD, u)
    v, v_low = product(z, c)
    v_low = v_low + (z * (c_low + THIRD_LOW) + z_low * c)
    w, w_low = product(s, v)
    w_low = w_low + (s * v_low + s_low * v)
    half, half_low = sum_of_two(s, w)
    half_low = half_low + (s_low + w_low)
    turns = float(k)
    value, rest = sum_of_two(turns * LN2_HIGH, 2.0 * half)
    return sum_of_two(value, rest + (2.0 * half_low + turns * LN2_LOW))
