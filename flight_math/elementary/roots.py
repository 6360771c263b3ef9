"""hypot, cbrt."""

import math

from flight_math.elementary.arithmetic import INF, NAN, bits, double, from_bits, inlined, select, upper

TWO_54, TWO_M18 = 18014398509481984.0, 3.814697265625e-06
THIRD_OF_BIAS = 3071306043645493248  # bits: a third of an exponent's bias, so that bits / 3 + it is a cube root to 3 %
# r^(-1/3), 0.87 <= r <= 1.13, to 2^-21.7
R0, R1, R2, R3, R4 = 1.8780520060237658, -1.892323272198004, 1.630825793108276, -0.7635677330240768, 0.1470132275582952


@inlined
def hypot(x, y):
    """sqrt(x^2 + y^2) without overflow on the way."""
    ax, ay = abs(double(x)), abs(double(y))
    low, high = (ax, ay) if ay > ax else (ay, ax)
    exponent = bits(select(high < INF, high, 1.0)) >> 52
    exponent = select(exponent > 54, exponent, 54)
    exponent = select(exponent < 2045, exponent, 2045)
    down, up = from_bits((2046 - exponent) << 52), from_bits(exponent << 52)
    a, b = high * down, low * down
    a_top, b_top = upper(a), upper(b)
    first, second = a_top * a_top, b_top * b_top
    total = first + second
    rest = (second - (total - first)) + ((a - a_top) * (a + a_top) + (b - b_top) * (b + b_top))
    squares = total + rest
    value = math.sqrt(select(squares < INF, squares, 0.0)) * up
    value = select((ax == ax) & (ay == ay), value, NAN)
    return select((ax == INF) | (ay == INF), INF, value)


@inlined
def cbrt(x):
    """Cube root."""
    x = double(x)
    a = abs(x)
    ordinary = (a > 0.0) & (a < INF)
    small = a < 1e-290
    v = select(ordinary, select(small, a * TWO_54, a), 1.0)
    t = from_bits(bits(v) // 3 + THIRD_OF_BIAS)
    r = t * t * (t / v)
    t = t * (((R0 + R1 * r) + (R2 + R3 * r) * (r * r)) + R4 * ((r * r) * (r * r)))
    t = from_bits((bits(t) + 536870912) & -1073741824)  # to 23 bits: its square is exact
    s = v / (t * t)
    t = t + t * ((s - t) / (t + t + s))
    value = select(small, t * TWO_M18, t)
    return select(x == x, math.copysign(select(ordinary, value, a), x), NAN)


