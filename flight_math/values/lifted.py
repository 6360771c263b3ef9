"""The elementary functions for vectors: sin(v) is the sine of each component, sincos(v) gives two vectors.

Of a number they give a number. `sincos` costs as much as one of the two.
"""

from flight_math.values.elementwise import elementwise

try:
    from flight_math import elementary as _numbers
except ImportError:
    from flight_math.values import library_functions as _numbers

acos = elementwise(_numbers.acos)
asin = elementwise(_numbers.asin)
atan = elementwise(_numbers.atan)
atan2 = elementwise(_numbers.atan2)
cbrt = elementwise(_numbers.cbrt)
cos = elementwise(_numbers.cos)
exp = elementwise(_numbers.exp)
expm1 = elementwise(_numbers.expm1)
hypot = elementwise(_numbers.hypot)
log = elementwise(_numbers.log)
log1p = elementwise(_numbers.log1p)
power = elementwise(_numbers.power)
sin = elementwise(_numbers.sin)
sincos = elementwise(_numbers.sincos)
tan = elementwise(_numbers.tan)
tanh = elementwise(_numbers.tanh)
