"""Elementary functions against mpmath, at their ends against C99 Annex F, and their symmetries."""

import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from flight_math import elementary
from flight_math.elementary import (
    acos,
    asin,
    atan,
    atan2,
    cbrt,
    cos,
    exp,
    expm1,
    hypot,
    log,
    log1p,
    power,
    sin,
    sincos,
    tan,
    tanh,
)
from tests.flight_math import elementary_cases as cases

INF, NAN = math.inf, math.nan
PI = math.pi
FLOATS = st.floats(width=64)
ENDS = (0.0, -0.0, INF, -INF, NAN, 1.0, -1.0, 0.5, -0.5, 2.0, -2.0, 3.0, -3.0, 5e-324, -5e-324, 1e-310, sys.float_info.min,
        sys.float_info.max, -sys.float_info.max, 1.5, 1e300, 9007199254740991.0, 9007199254740992.0, 4503599627370497.5)
NUMPY = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}
HARD = {  # arguments next to where a result is zero, or next to the middle of two floats
    "sin": (1e22, 1e300, 2.0**1023, 6381956970095103.0 * 2.0**797, 1048576.0, 1048576.0000000001, 355.0, 103993.0, PI, 2.0 * PI),
    "exp": (1e-17, -1e-17, 7.541527749555775e-10, 709.782712893384, -708.3964185322641, -745.1332191019411, -744.4400719213812),
    "log": (1.0 + 2.0**-52, 1.0 - 2.0**-53, 5e-324, sys.float_info.max, 0.7071067811865475, 0.7071067811865476, 1.4142135623730951),
    "asin": (0.5, 0.49999999999999994, 1.0 - 2.0**-53, 0.9999999999999998, 1e-8), "atan": (0.41421356237309503, 0.41421356237309515),
    "tanh": (21.999, 22.0, 22.5, 0.34657359027997264), "expm1": (0.34657359027997264, -0.34657359027997264, -36.9, -37.5, 1.0397),
    "log1p": (-0.29289321881345254, 0.4142135623730951, -1.0 + 2.0**-53, 2.0**-53, 1e16), "cbrt": (8.0, 27.0, 1e-300, 3.0),
}
HARD["cos"] = HARD["tan"] = HARD["sin"]
HARD["acos"] = HARD["asin"]


def same(a, b):
    """Equal bits."""
    return np.float64(a).tobytes() == np.float64(b).tobytes()


@pytest.mark.parametrize("name", cases.NAMES)
def test_within_one_unit_in_the_last_place(name):
    function = getattr(elementary, name)
    tried = list(cases.ranges(name, 20_000))
    tried.append(("hard", (np.array(HARD.get(name, ())),)) if name not in cases.PAIRS else ("none", ((), ())))
    for label, columns in tried:
        for arguments in zip(*(np.asarray(column).tolist() for column in columns)):
            error = cases.error(name, function(*arguments), arguments)
            assert error <= cases.LIMIT[name], f"{name}{arguments}: {error:.3f} units of the last place ({label})"


def test_next_to_multiples_of_a_quarter_turn():
    """The double nearest to n pi/2, for every n that the short reduction takes in part: the result is all cancellation."""
    numbers = [*range(1, 3000), *range(3001, 667544, 997), 168371, 186831, 551263, 667543]
    with mp.workprec(300):
        half_pi = mp.pi / 2
        for n in numbers:
            x = float(n * half_pi)
            distance = mpf(x) - n * half_pi
            exact = (1, 1, -1, -1)[n & 3] * (distance if n % 2 == 0 else -distance)  # sine, cosine: d^3/6 is below their bits
            found = sincos(x)[n % 2]
            assert abs(found - exact * (1 - distance**2 / 6)) <= 0.51 * math.ulp(found), n


@pytest.mark.parametrize("name", cases.NAMES)
def test_ends_are_those_of_annex_f(name):
    """Where NumPy's function gives 0, an infinity or NaN, so does ours, with that sign; NaN is one NaN."""
    ours, theirs = getattr(elementary, name), getattr(np, NUMPY.get(name, name))
    pairs = name in cases.PAIRS
    for x in ENDS:
        for arguments in [(x, y) for y in ENDS] if pairs else [(x,)]:
            if name == "power" and arguments[1] == 0.5:
                continue  # NumPy takes the root, whose zero and infinity differ
            with np.errstate(all="ignore"):
                expected = float(theirs(*arguments))
            found = ours(*arguments)
            if expected == 0.0 or not math.isfinite(expected):
                assert same(found, NAN if expected != expected else expected), (arguments, found, expected)
            else:
                assert abs(found - expected) <= 2.0 * math.ulp(expected), (arguments, found, expected)


def test_exact_values():
    for x in (0.0, -0.0, 5e-324, -5e-324, 1e-310, 1e-200):  # the identity to the last bit, sign of zero kept
        for function in (sin, tan, asin, atan, expm1, log1p, tanh):
            assert same(function(x), x), (function, x)
    assert all(same(value, 1.0) for value in (cos(-0.0), exp(-0.0), cos(1e-200), power(NAN, 0.0), power(1.0, NAN), tanh(30.0)))
    assert same(log(1.0), 0.0) and same(acos(1.0), 0.0) and same(expm1(-INF), -1.0) and same(hypot(NAN, -INF), INF)
    assert [cbrt(n * n * n) for n in range(-9, 10)] == list(range(-9, 10))
    assert [hypot(3.0 * n, -4.0 * n) for n in (1.0, 2.0**-1070, 2.0**1020)] == [5.0, 5.0 * 2.0**-1070, 5.0 * 2.0**1020]
    assert [power(n, k) for n in (2, -3, 10) for k in (2, 3, 5)] == [n**k for n in (2, -3, 10) for k in (2, 3, 5)]
    assert same(power(-0.0, 0.5), 0.0) and same(power(-0.0, -3.0), -INF) and same(power(-INF, 0.5), INF)
    assert asin(1.0) == PI / 2 and acos(-1.0) == PI and atan(INF) == PI / 2 and atan(1.0) == PI / 4
    assert [atan2(0.0, -1.0), atan2(-0.0, -0.0), atan2(-INF, -INF), atan2(INF, 1.0)] == [PI, -PI, -0.75 * PI, PI / 2]


@settings(max_examples=500, deadline=None)
@given(FLOATS)
def test_odd_and_even(x):
    for function in (sin, tan, asin, atan, tanh, cbrt):
        value = function(x)
        assert same(function(-x), -value if value == value else NAN)
    assert same(cos(-x), cos(x))
    assert sincos(x) == (sin(x), cos(x)) or x in (INF, -INF) or x != x


@settings(max_examples=500, deadline=None)
@given(FLOATS, FLOATS)
def test_mirrored_pairs(x, y):
    angle = atan2(y, x)
    assert same(atan2(-y, x), -angle if angle == angle else NAN)
    assert same(hypot(x, y), hypot(-y, x))


@settings(max_examples=500, deadline=None)
@given(st.floats(-1e300, 1e300))
def test_identities(x):
    s, c = sincos(x)
    assert abs(s * s + c * c - 1.0) < 4e-16
    assert -1.0 <= s <= 1.0 and -1.0 <= c <= 1.0 and -1.0 <= tanh(x) <= 1.0
    assert abs(atan(x)) <= PI / 2
    if abs(x) < 700.0:
        assert abs(log(exp(x)) - x) <= 3e-16 * (1.0 + abs(x))


def test_integers_and_single_precision_are_widened():
    third = np.float32(1.0) / np.float32(3.0)
    for function in (sin, asin, exp, log):
        assert same(function(third), function(float(third)))
        assert same(function(1), function(1.0))
    assert same(atan2(third, 1), atan2(float(third), 1.0)) and same(hypot(3, third), hypot(3.0, float(third)))
