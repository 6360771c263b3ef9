"""asin, acos, atan, atan2, in radians."""

import math

from flight_math.elementary.arithmetic import INF, NAN, bits, double, from_bits, inlined, outlined, quotient, select, upper

PI, PI_LOW = 3.141592653589793, 1.2246467991473532e-16
HALF_PI, HALF_PI_LOW = 1.5707963267948966, 6.123233995736766e-17
QUARTER_PI, QUARTER_PI_LOW = 0.7853981633974483, 3.061616997868383e-17
TAN_EIGHTH_PI = 0.4142135623730951
# atan q = q + q^3 (A0 + A1 q^2 + ...), |q| <= tan(pi/8), to 2^-57.5
A0, A1, A2, A3 = -0.333333333333332, 0.1999999999995321, -0.14285714280162434, 0.11111110781936845
A4, A5, A6, A7 = -0.0909089771868785, 0.07692059596098622, -0.06663097777699992, 0.05847848585296026
A8, A9, A10 = -0.0503914097301105, 0.03806085288970452, -0.01790359879573332
# asin x = x + x^3 (B0 + B1 x^2 + ...), |x| <= 1/2, to 2^-58.8
B0, B1, B2, B3 = 0.1666666666666676, 0.07499999999970802, 0.04464285717460893, 0.030381942707933415
B4, B5, B6, B7 = 0.02237221498321285, 0.01735161209601084, 0.013980819542437115, 0.011398920468624204
B8, B9, B10, B11, B12 = (0.01078020704329702, 0.003706578383675684, 0.02170704364278938, -0.020998505616295883,
                         0.03262828430223812)


@inlined
def atan2(y, x):
    """Angle of the vector (x, y), -pi to pi."""
    y = double(y)
    x = double(x)
    ay, ax = abs(y), abs(x)
    low, high = (ax, ay) if ay > ax else (ay, ax)
    if not (low >= 1e-150 and high <= 1e150):
        return _atan2_rare(y, x)
    return _angle(y, x, ay > ax, low, high)


@inlined
def _angle(y, x, steep, low, high):
    """atan2 from the smaller and the larger of |x| and |y|, or both times one power of two."""
    middle = low > TAN_EIGHTH_PI * high  # atan(low / high) = pi/4 - atan((high - low) / (high + low))
    difference = low - high
    total = low + high
    n = select(middle, difference, low)
    n_low = select(middle, low - (difference + high), 0.0)
    d = select(middle, total, high)
    d_low = select(middle, low - (total - high), 0.0)
    q, q_low = quotient(n, n_low, d, d_low)
    z = q * q
    z2 = z * z
    z4 = z2 * z2
    p = ((A0 + A1 * z) + (A2 + A3 * z) * z2) + ((A4 + A5 * z) + (A6 + A7 * z) * z2) * z4 \
        + ((A8 + A9 * z) + A10 * z2) * (z4 * z4)
    rest = q_low * (1.0 - z) + q * (z * p)
    base = select(middle, QUARTER_PI, 0.0)
    base_low = select(middle, QUARTER_PI_LOW, 0.0)
    base = select(steep, HALF_PI - base, base)
    base_low = select(steep, HALF_PI_LOW - base_low, base_low)
    behind = math.copysign(1.0, x) < 0.0
    base = select(behind, PI - base, base)
    base_low = select(behind, PI_LOW - base_low, base_low)
    backwards = steep != behind
    q = select(backwards, -q, q)
    rest = select(backwards, -rest, rest)
    value = base + q
    return math.copysign(value + ((q - (value - base)) + (base_low + rest)), y)


@outlined
def _atan2_rare(y, x):
    """atan2 where an argument is NaN, infinite, zero, or so large or small that a product could leave the range."""
    if not (x == x and y == y):
        return NAN
    ay, ax = abs(y), abs(x)
    steep = ay > ax
    low, high = (ax, ay) if steep else (ay, ax)
    if high == INF:
        low, high = (1.0 if low == INF else 0.0), 1.0
    elif high == 0.0:
        high = 1.0
    exponent = bits(high) >> 52
    scale = from_bits((2546 - (exponent if exponent > 500 else 500)) << 52)  # high near 2^500: low stays normal
    return _angle(y, x, steep, low * scale, high * scale)


@inlined
def atan(x):
    """Inverse tangent, -pi/2 to pi/2."""
    return atan2(x, 1.0)


@inlined
def _arc_term(t):
    """asin(x) / x - 1 for t = x^2 <= 1/4."""
    t2 = t * t
    t4 = t2 * t2
    p = ((B0 + B1 * t) + (B2 + B3 * t) * t2) + ((B4 + B5 * t) + (B6 + B7 * t) * t2) * t4 \
        + (((B8 + B9 * t) + (B10 + B11 * t) * t2) + B12 * t4) * (t4 * t4)
    return t * p


@inlined
def _twice_arc(t, p):
    """2 asin(sqrt(t)) = 2 sqrt(t) (1 + p) in two parts, the first with few enough bits to be subtracted."""
    root = math.sqrt(t)
    top = upper(root)
    rest = (t - top * top) / (root + top) if t > 0.0 else 0.0
    return 2.0 * top, 2.0 * (rest + root * p)


@inlined
def asin(x):
    """Inverse sine, -pi/2 to pi/2; NaN beyond -1 to 1."""
    x = double(x)
    a = abs(x)
    if not a <= 1.0:
        return NAN
    flat = a < 0.5
    t = select(flat, a * a, 0.5 * (1.0 - a))
    p = _arc_term(t)
    if flat:
        return x + x * p
    twice, rest = _twice_arc(t, p)
    value = HALF_PI - twice
    return math.copysign(value + (((HALF_PI - value) - twice) + (HALF_PI_LOW - rest)), x)


@inlined
def acos(x):
    """Inverse cosine, 0 to pi; NaN beyond -1 to 1."""
    x = double(x)
    a = abs(x)
    if not a <= 1.0:
        return NAN
    flat = a < 0.5
    t = select(flat, a * a, 0.5 * (1.0 - a))
    p = _arc_term(t)
    if flat:
        value = HALF_PI - x
        return value + (((HALF_PI - value) - x) + (HALF_PI_LOW - x * p))
    twice, rest = _twice_arc(t, p)
    if x > 0.0:
        return twice + rest
    value = PI - twice
    return value + (((PI - value) - twice) + (PI_LOW - rest))
