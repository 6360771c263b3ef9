"""The elementary functions for vectors: sin(v) is the sine of each component, sincos(v) gives two vectors.

Of a number they give a number. `sincos` costs as much as one of the two.
"""

from flight_math import elementary
from flight_math.values.elementwise import elementwise

acos = elementwise(elementary.acos)
asin = elementwise(elementary.asin)
atan = elementwise(elementary.atan)
atan2 = elementwise(elementary.atan2)
cbrt = elementwise(elementary.cbrt)
cos = elementwise(elementary.cos)
exp = elementwise(elementary.exp)
expm1 = elementwise(elementary.expm1)
hypot = elementwise(elementary.hypot)
log = elementwise(elementary.log)
log1p = elementwise(elementary.log1p)
power = elementwise(elementary.power)
sin = elementwise(elementary.sin)
sincos = elementwise(elementary.sincos)
tan = elementwise(elementary.tan)
tanh = elementwise(elementary.tanh)
