"""Elementary functions give the same bits compiled, in vector code and in plain Python; their machine code calls no C library."""

import importlib
import math
import re
import sys
import warnings

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flight_math import elementary
from tests.flight_math import elementary_cases as cases
from tests.portable import elementary_set

NAMES = elementary.__all__
FLOATS = st.one_of(st.floats(width=64), st.floats(-30.0, 30.0), st.floats(-1e6, 1e6))
FUSED = re.compile(r"\bv?fn?m(?:add|sub|la|ls)\w*\b")
HARMLESS = re.compile(r"(?:llvm\.(?:fabs|copysign|umax|umin|smax|smin|is\.fpclass|memset|memcpy|lifetime|assume|select)\b.*"
                      r"|_?Py\w+|numba_\w+|NRT_\w+|sqrt|llvm\.sqrt.*|_ZN11flight_math10elementary\w*)$")


@pytest.fixture(scope="module")
def plain():
    """A second copy of the modules, made as NUMBA_DISABLE_JIT=1 makes them."""
    kept = {name: sys.modules.pop(name) for name in list(sys.modules) if name.startswith("flight_math.elementary")}
    numba.config.DISABLE_JIT = 1
    try:
        copy = importlib.import_module("flight_math.elementary")
    finally:
        numba.config.DISABLE_JIT = 0
        for name in [name for name in sys.modules if name.startswith("flight_math.elementary")]:
            del sys.modules[name]
        sys.modules.update(kept)
        sys.modules["flight_math"].elementary = kept["flight_math.elementary"]
    assert not hasattr(copy.sin, "py_func") and copy is not elementary
    return copy


def raw(value):
    return np.array(value, dtype=np.float64).tobytes()


@settings(max_examples=1000, deadline=None)
@given(x=FLOATS, y=FLOATS)
def test_plain_python_gives_the_same_bits(plain, x, y):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in NAMES:
            arguments = (x, y) if name in cases.PAIRS else (x,)
            expected = raw(getattr(elementary, name)(*arguments))
            assert raw(getattr(plain, name)(*arguments)) == expected, (name, arguments)
            assert raw(getattr(plain, name)(*map(np.float64, arguments))) == expected, (name, arguments)


@pytest.mark.parametrize("name", ["sin", "cos", "tan", "asin", "acos", "atan", "exp", "expm1", "tanh", "log", "log1p", "cbrt"])
def test_loops_that_become_vector_code_give_the_same_bits(name):
    function = getattr(elementary, name)

    @numba.njit(error_model="numpy")
    def table(arguments, found):
        for i in range(len(arguments)):
            found[i] = function(arguments[i])

    arguments = elementary_set.arguments(name)[0]
    found = np.empty(len(arguments))
    table(arguments, found)
    assert found.tobytes() == elementary_set.results(name).tobytes()
    assert not FUSED.search(table.inspect_asm(table.signatures[0]))


@pytest.mark.parametrize("name", NAMES)
def test_machine_code_calls_nothing_and_fuses_nothing(name):
    function = getattr(elementary, name)
    function(*(0.5,) * (2 if name in cases.PAIRS else 1))
    for signature in function.signatures:
        declared = re.findall(r"^declare .*?@\"?([\w.$]+)", function.inspect_llvm(signature), re.MULTILINE)
        assert not [symbol for symbol in declared if not HARMLESS.match(symbol)]
        code = function.inspect_asm(signature)
        assert not FUSED.search(code)
        assert not re.search(r"(?:call\w*|jmp|bl|\$)\s*sqrt\b", code)  # declared, yet an instruction


def code_for_arm(function):
    """Assembly for 64-bit Arm of a compiled function: made here, not run."""
    try:
        llvm.initialize_all_targets()
        llvm.initialize_all_asmprinters()
        machine = llvm.Target.from_triple("aarch64-unknown-linux-gnu").create_target_machine(opt=3)
    except RuntimeError:
        pytest.skip("this llvmlite makes code for its own processor only")
    text = function.inspect_llvm(function.signatures[0])
    text = re.sub(r"^target (triple|datalayout) = .*$", "", text, flags=re.MULTILINE)
    return machine.emit_assembly(llvm.parse_assembly('target triple = "aarch64-unknown-linux-gnu"\n' + text))


@pytest.mark.parametrize("name", NAMES)
def test_machine_code_for_arm_calls_nothing_and_fuses_nothing(name):
    function = getattr(elementary, name)
    function(*(0.5,) * (2 if name in cases.PAIRS else 1))
    code = code_for_arm(function)
    assert not FUSED.search(code)
    called = re.findall(r"\bbl?\s+([A-Za-z_][\w.$]*)", code)
    assert not [symbol for symbol in called if symbol == "sqrt" or not HARMLESS.match(symbol)]


def test_the_search_finds_what_it_is_for():
    contracted = numba.njit("float64(float64)", fastmath={"contract"})(lambda x: x * x + 1.0)
    assert FUSED.search(code_for_arm(contracted))
    sine = numba.njit("float64(float64)")(lambda x: math.sin(x))
    declared = re.findall(r"^declare .*?@\"?([\w.$]+)", sine.inspect_llvm(sine.signatures[0]), re.MULTILINE)
    assert [symbol for symbol in declared if not HARMLESS.match(symbol)]
