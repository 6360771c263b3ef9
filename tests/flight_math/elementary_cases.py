"""Exact values of the elementary functions by mpmath, errors in units of the last place, and the ranges that are tried."""

import numpy as np
from mpmath import libmp, mp, mpf

BITS = 120
TINY = 2.0**-70  # below it two terms of a series are exact enough
ONE = libmp.fone


def _expm1(x):
    return libmp.mpf_sub(libmp.mpf_exp(x, BITS + 80), ONE, BITS)


def _log1p(x):
    return libmp.mpf_log(libmp.mpf_add(ONE, x), BITS)


def _cbrt(x):
    root = libmp.mpf_cbrt(libmp.mpf_abs(x), BITS)
    return libmp.mpf_neg(root) if x[0] else root


def _by(function):
    return lambda *arguments: function(*arguments, BITS)


EXACT = {
    "sin": _by(libmp.mpf_sin), "cos": _by(libmp.mpf_cos), "tan": _by(libmp.mpf_tan), "asin": _by(libmp.mpf_asin),
    "acos": _by(libmp.mpf_acos), "atan": _by(libmp.mpf_atan), "exp": _by(libmp.mpf_exp), "expm1": _expm1,
    "log": _by(libmp.mpf_log), "log1p": _log1p, "tanh": _by(libmp.mpf_tanh), "cbrt": _cbrt,
    "atan2": _by(libmp.mpf_atan2), "hypot": _by(libmp.mpf_hypot), "power": _by(libmp.mpf_pow),
}
SERIES = {"sin": -0.0, "tan": 0.0, "asin": 0.0, "atan": 0.0, "expm1": 0.5, "log1p": -0.5, "tanh": 0.0}  # x + this x^2
LIMIT = {name: 1.0 for name in EXACT}  # ulp
NAMES = tuple(EXACT)
PAIRS = ("atan2", "hypot", "power")


def error(name, found, arguments):
    """|found - exact| in units of the last place of the exact value."""
    if name in SERIES and 0.0 < abs(arguments[0]) < TINY:
        x = mpf(arguments[0])
        with mp.workprec(300):
            exact = (x + SERIES[name] * x * x)._mpf_
    else:
        exact = EXACT[name](*map(libmp.from_float, arguments))
    high = libmp.to_float(exact)
    if not (np.isfinite(found) and np.isfinite(high)) or high == 0.0:
        return 0.0 if found == high else np.inf
    if abs(high) < 1e-290:
        with mp.workprec(300):
            return float(abs(mpf(found) - mp.make_mpf(exact)) / mpf(float(np.spacing(abs(high)))))
    low = libmp.to_float(libmp.mpf_sub(exact, libmp.from_float(high)))
    return abs((found - high) - low) / _unit(high)


def _unit(value):
    """The distance of neighbours about a value (at a power of two: that above it)."""
    return 2.0 ** (np.frexp(value)[1] - 53)


def _spread(random, low, high, count):
    """Either sign, logarithms evenly spread."""
    return 2.0 ** random.uniform(np.log2(low), np.log2(high), count) * random.choice([-1.0, 1.0], count)


def _angles(random, n):
    return {"|x| < 4": random.uniform(-4.0, 4.0, 2 * n), "|x| < 1e6": random.uniform(-1e6, 1e6, n),
            "1e6 to 1e308": _spread(random, 1e6, 1e308, n), "1e-300 to 1": _spread(random, 1e-300, 1.0, n)}


def _arcs(random, n):
    return {"|x| < 1": random.uniform(-1.0, 1.0, 3 * n), "next to 1": 1.0 - np.abs(_spread(random, 1e-16, 0.1, n)),
            "1e-300 to 1": _spread(random, 1e-300, 1.0, n)}


def _pairs(random, n):
    return {"unit square": (random.uniform(-1.0, 1.0, 3 * n), random.uniform(-1.0, 1.0, 3 * n)),
            "1e-307 to 1e307": (_spread(random, 1e-307, 1e307, n), _spread(random, 1e-307, 1e307, n)),
            "subnormal": (_spread(random, 1e-320, 1e-300, n), _spread(random, 1e-320, 1e-300, n))}


RANGES = {
    "sin": _angles, "cos": _angles, "tan": _angles, "asin": _arcs, "acos": _arcs,
    "atan": lambda random, n: {"|x| < 3": random.uniform(-3.0, 3.0, 3 * n), "1e-310 to 1e300": _spread(random, 1e-310, 1e300, 2 * n)},
    "exp": lambda random, n: {"|x| < 1": random.uniform(-1.0, 1.0, 2 * n), "-708 to 709.7": random.uniform(-708.0, 709.7, 2 * n),
                              "subnormal": random.uniform(-745.0, -708.0, n)},
    "expm1": lambda random, n: {"|x| < 2": random.uniform(-2.0, 2.0, 3 * n), "-40 to 709.7": random.uniform(-40.0, 709.7, n),
                                "1e-310 to 1": _spread(random, 1e-310, 1.0, n)},
    "log": lambda random, n: {"0.5 to 2": random.uniform(0.5, 2.0, 3 * n), "5e-324 to 1e308": np.abs(_spread(random, 5e-324, 1e308, 2 * n))},
    "log1p": lambda random, n: {"-0.9 to 1.5": random.uniform(-0.9, 1.5, 3 * n), "1e-310 to 0.5": _spread(random, 1e-310, 0.5, n),
                                "1 to 1e308": np.abs(_spread(random, 1.0, 1e308, n))},
    "tanh": lambda random, n: {"|x| < 1": random.uniform(-1.0, 1.0, 3 * n), "|x| < 22": random.uniform(-22.0, 22.0, n),
                               "1e-310 to 1": _spread(random, 1e-310, 1.0, n)},
    "cbrt": lambda random, n: {"1 to 8": random.uniform(1.0, 8.0, 3 * n), "5e-324 to 1e308": _spread(random, 5e-324, 1e308, 2 * n)},
    "atan2": _pairs, "hypot": _pairs,
    "power": lambda random, n: {"0 to 2, |y| < 3": (random.uniform(0.0, 2.0, 3 * n), random.uniform(-3.0, 3.0, 3 * n)),
                                "result 1e-307 to 1e307": _powers(random, n),
                                "next to 1": (1.0 + _spread(random, 1e-10, 1e-2, n), _spread(random, 1e2, 5e4, n))},
}


def _powers(random, n):
    x = np.abs(_spread(random, 1e-300, 1e300, n))
    return x, random.uniform(-707.0, 707.0, n) / np.log(x)


def ranges(name, count, seed=1):
    """(name of a range, columns of arguments), some `count` arguments together."""
    for label, columns in RANGES[name](np.random.default_rng(seed), count // 5).items():
        yield label, columns if isinstance(columns, tuple) else (columns,)
