"""The elementary functions of the C library, until the portable ones are there."""

import math

from flight_math.kernel import kernel


def _of(function):
    return kernel(lambda x: function(x))


acos, asin, atan, cbrt = _of(math.acos), _of(math.asin), _of(math.atan), kernel(lambda x: math.copysign(abs(x) ** (1.0 / 3.0), x))
cos, exp, expm1, log = _of(math.cos), _of(math.exp), _of(math.expm1), _of(math.log)
log1p, sin, tan, tanh = _of(math.log1p), _of(math.sin), _of(math.tan), _of(math.tanh)
atan2, hypot = kernel(lambda y, x: math.atan2(y, x)), kernel(lambda x, y: math.hypot(x, y))
power, sincos = kernel(lambda x, y: x ** y), kernel(lambda x: (math.sin(x), math.cos(x)))
