"""sin, cos, tan of an angle in radians; both at once with sincos, which costs no more than one."""

import math

from flight_math.elementary.arithmetic import INF, NAN, double, inlined, quotient, sum_of_two, upper
from flight_math.elementary.large_angle import reduce_large

QUARTER_PI = 0.7853981633974483
LARGEST = 1048576.0  # 2^20: beyond it the reduction by four constants would lose bits
TWO_OVER_PI = 0.6366197723675814
MAGIC = 6755399441055744.0  # 1.5 * 2^52: adding it rounds to an integer
# pi/2 in parts of 33, 33, 33 and 53 bits: n times a part is exact for n < 2^20
P1, P2, P3, P4 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32
# sin r = r + r^3 (S1 + S2 r^2 + ...), |r| <= pi/4, to 2^-57.8
S1, S2, S3, S4, S5, S6 = (-0.1666666666666663, 0.00833333333332184, -0.00019841269829358522, 2.7557313538511096e-06,
                          -2.5050734388632568e-08, 1.589543324605505e-10)
# cos r = 1 - r^2 / 2 + r^4 (C1 + C2 r^2 + ...), |r| <= pi/4, to 2^-63.9
C1, C2, C3, C4, C5, C6 = (0.041666666666666595, -0.0013888888888873342, 2.4801587289002086e-05, -2.75573142170427e-07,
                          2.0875705396769107e-09, -1.1358749287917544e-11)


@inlined
def _reduced(a):
    """a - n pi/2 in two parts, and n (its last two bits at least); 0 <= a < inf."""
    if a <= QUARTER_PI:
        return a, 0.0, 0
    if a > LARGEST:
        return reduce_large(a)
    n = (a * TWO_OVER_PI + MAGIC) - MAGIC
    first, rest = sum_of_two(a - n * P1, -(n * P2))
    head, low = sum_of_two(first, -(n * P3))
    return head, rest + (low - n * P4), int(n)


@inlined
def _sin_correction(r, tail, z):
    """sin(r + tail) - r; z = r^2"""
    w = z * z
    p = ((S1 + z * S2) + w * (S3 + z * S4)) + (w * w) * (S5 + z * S6)
    return tail * (1.0 - 0.5 * z) + (z * r) * p


@inlined
def _cos_parts(r, tail, z):
    """cos(r + tail) as a sum of two"""
    w = z * z
    p = ((C1 + z * C2) + w * (C3 + z * C4)) + (w * w) * (C5 + z * C6)
    half = 0.5 * z
    whole = 1.0 - half
    return whole, (((1.0 - whole) - half) - r * tail) + w * p


@inlined
def sincos(x):
    """(sin x, cos x)"""
    x = double(x)
    a = abs(x)
    if not a < INF:
        return NAN, NAN
    head, tail, n = _reduced(a)
    z = head * head
    s = head + _sin_correction(head, tail, z)
    whole, rest = _cos_parts(head, tail, z)
    c = whole + rest
    odd = n & 1
    sign = math.copysign(1.0, x) * (1.0 - (n & 2))
    return sign * (c if odd else s), (1.0 - ((n + 1) & 2)) * (s if odd else c)


@inlined
def sin(x):
    """Sine. Where the cosine is needed too, `sincos` costs half as much."""
    return sincos(x)[0]


@inlined
def cos(x):
    """Cosine. Where the sine is needed too, `sincos` costs half as much."""
    return sincos(x)[1]


@inlined
def tan(x):
    """Tangent."""
    x = double(x)
    a = abs(x)
    if not a < INF:
        return NAN
    head, tail, n = _reduced(a)
    z = head * head
    top = upper(head)
    correction = _sin_correction(head, tail, z)
    s = head + correction
    s_low = correction - (s - head)
    whole, rest = _cos_parts(head, tail, z)
    rest = rest - 0.5 * ((top * top - z) + (head - top) * (head + top))
    c = whole + rest
    c_low = rest - (c - whole)
    odd = n & 1
    value, rest = quotient(c if odd else s, c_low if odd else s_low, s if odd else c, s_low if odd else c_low)
    return math.copysign(1.0, x) * (1.0 - 2.0 * odd) * (value + rest)
