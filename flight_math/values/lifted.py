"""The elementary functions for vectors: sin(v) is the sine of each component, sincos(v) gives two vectors.

Of a number they give a number. `sincos` costs as much as one of the two.
"""

from flight_math import elementary
from flight_math.values.elementwise import lift, looped


def _lifted(function):
    return lift(function, looped)


acos = _lifted(elementary.acos)
asin = _lifted(elementary.asin)
atan = _lifted(elementary.atan)
atan2 = _lifted(elementary.atan2)
cbrt = _lifted(elementary.cbrt)
cos = _lifted(elementary.cos)
exp = _lifted(elementary.exp)
expm1 = _lifted(elementary.expm1)
hypot = _lifted(elementary.hypot)
log = _lifted(elementary.log)
log1p = _lifted(elementary.log1p)
power = _lifted(elementary.power)
sin = _lifted(elementary.sin)
sincos = _lifted(elementary.sincos)
tan = _lifted(elementary.tan)
tanh = _lifted(elementary.tanh)
