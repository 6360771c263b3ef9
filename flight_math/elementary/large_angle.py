"""Angles beyond 2^20 rad: x 2/pi modulo 4 from those bits of 2/pi that matter (Payne and Hanek)."""

import numpy as np

from flight_math.elementary.arithmetic import bits, outlined, product, sum_of_two

LIMB = 268435455  # 2^28 - 1
# 2/pi = sum of entry i times 2^(-28 (i - 2)), after three zeros; made by mpmath
TWO_OVER_PI = np.array((
    0, 0, 0,
    170891318, 240010261, 44024437, 131200308, 232525238, 43358524, 70845471, 240214955, 233552982, 28779630, 61088989,
    48236105, 49193117, 26352894, 31371723, 19507006, 243802975, 86948676, 139368903, 2536543, 132387737, 30816643,
    87269193, 210001803, 199201411, 186644631, 268296281, 135261999, 18396576, 174923629, 57142514, 130746807, 83125238,
    111042538, 47665787, 180874213, 253211600, 121239434, 86584998, 201023409, 33084880, 139854640, 74434486, 195817679,
    197265839, 70655401))
HALF_PI, HALF_PI_LOW = 1.5707963267948966, 6.123233995736766e-17
STEP = 3.725290298461914e-09  # 2^-28


@outlined
def reduce_large(x):
    """x - n pi/2 in two parts, and n modulo 4; 2^20 <= x < inf.

    x = m 2^e is written with e a multiple of 28 and m of three limbs. Then each limb of m 2/pi is a sum of three products
    of 28 by 28 bits and a carry; limbs above the point are multiples of 2^28 quarters, which need not be known.
    """
    exponent = (bits(x) >> 52) - 1075 + 56  # of the last bit, >= 0 with 56 added
    block = exponent // 28
    shift = exponent - 28 * block
    mantissa = (bits(x) & 4503599627370495) | 4503599627370496
    low = (mantissa & LIMB) << shift
    high = ((mantissa >> 28) << shift) + (low >> 28)
    m0, m1, m2 = low & LIMB, high & LIMB, high >> 28
    i = block  # of the entry whose product with m0 has the weight of whole quarters
    p6 = (m0 * TWO_OVER_PI[i + 6] + m1 * TWO_OVER_PI[i + 7] + m2 * TWO_OVER_PI[i + 8]) >> 28
    p5 = m0 * TWO_OVER_PI[i + 5] + m1 * TWO_OVER_PI[i + 6] + m2 * TWO_OVER_PI[i + 7] + p6
    p4 = m0 * TWO_OVER_PI[i + 4] + m1 * TWO_OVER_PI[i + 5] + m2 * TWO_OVER_PI[i + 6] + (p5 >> 28)
    p3 = m0 * TWO_OVER_PI[i + 3] + m1 * TWO_OVER_PI[i + 4] + m2 * TWO_OVER_PI[i + 5] + (p4 >> 28)
    p2 = m0 * TWO_OVER_PI[i + 2] + m1 * TWO_OVER_PI[i + 3] + m2 * TWO_OVER_PI[i + 4] + (p3 >> 28)
    p1 = m0 * TWO_OVER_PI[i + 1] + m1 * TWO_OVER_PI[i + 2] + m2 * TWO_OVER_PI[i + 3] + (p2 >> 28)
    n = m0 * TWO_OVER_PI[i] + m1 * TWO_OVER_PI[i + 1] + m2 * TWO_OVER_PI[i + 2] + (p1 >> 28)
    f1, f2, f3, f4, f5 = p1 & LIMB, p2 & LIMB, p3 & LIMB, p4 & LIMB, p5 & LIMB
    sign = 1.0
    if f1 >= 134217728:  # more than half a quarter: what is missing to the next
        n = n + 1
        sign = -1.0
        f1, f2, f3, f4, f5 = LIMB - f1, LIMB - f2, LIMB - f3, LIMB - f4, LIMB - f5
    tail = (float(f4) + float(f5) * STEP) * STEP
    first, rest = sum_of_two(float(f1), float(f2) * STEP)
    second, last = sum_of_two(rest, (float(f3) + tail) * (STEP * STEP))
    fraction, fraction_low = sum_of_two(first, second)
    fraction_low = fraction_low + last
    value, error = product(fraction, HALF_PI)
    head, low_part = sum_of_two(value, error + (fraction * HALF_PI_LOW + fraction_low * HALF_PI))
    return sign * head * STEP, sign * low_part * STEP, n & 3
