"""A fixed set of 10^5 arguments for each elementary function, made by integer arithmetic alone, so that it is the same everywhere.

A counter goes through a mixer of 64 bits (Steele, Lea and Flood 2014, splitmix64); its bits become the sign, exponent and
significand of an argument. The first arguments are the special values.
"""

import hashlib

import numpy as np

from flight_math import elementary

COUNT = 100_000
SPECIAL = (0.0, -0.0, np.inf, -np.inf, np.nan, 1.0, -1.0, 0.5, -0.5, 2.0, 5e-324, -5e-324, 2.2250738585072014e-308,
           1.7976931348623157e308, -1.7976931348623157e308, 1e22, 0.7853981633974483, 1.5707963267948966, 3.141592653589793,
           5.319372648326541e255, 1048576.0, 1048577.0, 709.782712893384, 709.7827128933841, -745.1332191019411,
           -745.1332191019412)
# exponents of 2 of the arguments, each range for an equal share of them; "+" for positive arguments only
ANGLES = ((-30, 1), (-3, 4), (4, 19), (20, 1023))
RANGES = {
    "sin": ANGLES, "cos": ANGLES, "sincos": ANGLES, "tan": ANGLES,
    "asin": ((-30, -1), (-3, -1)), "acos": ((-30, -1), (-3, -1)), "atan": ((-30, 30), (-3, 3)),
    "exp": ((-30, 9), (-2, 5)), "expm1": ((-60, 9), (-2, 5)), "tanh": ((-60, 4), (-3, 3)),
    "log": ("+", (-1023, 1023), (-2, 1)), "log1p": ((-60, 1023), (-4, 0)), "cbrt": ((-1023, 1023), (-2, 2)),
    "atan2": ((-1023, 1023), (-3, 2)), "hypot": ((-1023, 1023), (-3, 2)), "power": ("+", (-60, 60), (-2, 1)),
}
SECOND = {"atan2": ((-1023, 1023), (-3, 2)), "hypot": ((-1023, 1023), (-3, 2)), "power": ((-30, 3), (-2, 6))}


def _mixed(start):
    """COUNT words of 64 bits."""
    word = (np.arange(1, COUNT + 1, dtype=np.uint64) + np.uint64(start)) * np.uint64(0x9E3779B97F4A7C15)
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return word ^ (word >> np.uint64(31))


def _column(ranges, start):
    """Arguments whose exponents lie in these ranges."""
    positive = ranges[0] == "+"
    ranges = ranges[1:] if positive else ranges
    word, choice = _mixed(start), _mixed(start + COUNT)
    index = np.arange(COUNT) % len(ranges)
    low = np.array([first + 1023 for first, _ in ranges], dtype=np.uint64)[index]
    size = np.array([last - first + 1 for first, last in ranges], dtype=np.uint64)[index]
    exponent = low + choice % size
    sign = np.uint64(0) if positive else word & np.uint64(1 << 63)
    return (sign | exponent << np.uint64(52) | word & np.uint64((1 << 52) - 1)).view(np.float64)


def arguments(name):
    """The columns of arguments of a function: one, or two for atan2, hypot and power."""
    start = 10 * COUNT * sorted(RANGES).index(name)
    columns = [_column(RANGES[name], start)]
    columns[0][:len(SPECIAL)] = SPECIAL
    if name in SECOND:
        columns.append(_column(SECOND[name], start + 2 * COUNT))
        pairs = np.array([(a, b) for a in SPECIAL for b in SPECIAL])
        columns[0][:len(pairs)], columns[1][:len(pairs)] = pairs.T
    return columns


def results(name):
    """The function's results for them, in order (sincos: sines and cosines in turn)."""
    function = getattr(elementary, name)
    found = [function(*row) for row in zip(*(column.tolist() for column in arguments(name)))]
    return np.array(found, dtype="<f8").ravel()


def digest(name) -> str:
    """SHA-256 of the bytes of the results."""
    return hashlib.sha256(results(name).tobytes()).hexdigest()


def argument_digest(name) -> str:
    """SHA-256 of the bytes of the arguments."""
    return hashlib.sha256(np.array(arguments(name), dtype="<f8").tobytes()).hexdigest()
