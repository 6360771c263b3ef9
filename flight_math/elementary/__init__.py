"""Elementary functions that give the same bits on every machine, compiled and in plain Python.

Each is a fixed sequence of IEEE 754 operations (+ - * / sqrt, comparisons, integer arithmetic and bit casts): no C library,
no fused multiply-add, no tables. At most one unit in the last place from the true value (docs/portable.md); signed zeros,
infinities and NaN as C99 Annex F says; a NaN that comes out is always the same one (0x7ff8000000000000). The order of
evaluation is part of the definition: to rearrange it changes the bits, the digests in tests/portable and the golden bags.

The coefficients are minimax fits made for these modules: Remez exchange in mpmath (60 digits) for the relative error of
the whole function, each coefficient then rounded to double. The bound in the comment beside them is that of the rounded
ones.
"""

from flight_math.elementary.exponential import exp, expm1, tanh
from flight_math.elementary.inverse_trigonometry import acos, asin, atan, atan2
from flight_math.elementary.logarithm import log, log1p
from flight_math.elementary.powers import power
from flight_math.elementary.roots import cbrt, hypot
from flight_math.elementary.trigonometry import cos, sin, sincos, tan

__all__ = ["acos", "asin", "atan", "atan2", "cbrt", "cos", "exp", "expm1", "hypot", "log", "log1p", "power", "sin",
           "sincos", "tan", "tanh"]
