"""What a kernel may call and read of Python, its mathematics and NumPy; and what to write in place of the rest."""

import importlib
import math
import types

import numpy as np

BUILTINS = frozenset("abs all any bool divmod enumerate float int isinstance len max min range reversed round tuple zip"
                     .split())
MATH = frozenset("sqrt fabs floor ceil trunc isfinite isnan isinf copysign".split())
NUMPY = frozenset("abs absolute fabs floor ceil trunc isfinite isnan isinf copysign signbit "
                  "float64 float32 int64 int32 int16 int8 uint64 uint32 uint16 uint8 bool_ bool".split())
TRUTHS = frozenset("isfinite isnan isinf signbit all any isinstance bool".split())
WHOLE = frozenset("int floor ceil len".split())

_BLAS = frozenset("dot matmul vdot inner outer cross einsum tensordot kron vecdot matvec vecmat".split())
_ALLOCATION = frozenset("zeros ones empty full array asarray zeros_like ones_like empty_like full_like eye identity arange "
                        "linspace diag copy concatenate stack vstack hstack tile repeat ascontiguousarray".split())
_REDUCTION = frozenset("sum prod mean std var cumsum cumprod average median trace nansum max min amax amin argmax argmin "
                       "ptp all any sort argsort diff clip interp".split())
_METHODS_OF_ARRAYS = frozenset("sum prod mean std var dot max min argmax argmin trace cumsum all any sort".split())
_OF_VALUES = {"sum": "total", "max": "largest", "min": "smallest", "matmul": "dot", "inner": "dot", "vdot": "dot",
              "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "identity": "identity3",
              "eye": "identity3", "diag": "diagonal", "amax": "largest", "amin": "smallest"}
NO_TEXT = "which no kernel may; messages stand in the class's faults, numbers go into outputs"
SCRATCH = "a value such as Vec3(...), or stack_array(n), both from flight_math"


def ours(name: str) -> str:
    """``from flight_math import NAME``, when it is there; else ''."""
    name = _OF_VALUES.get(name, name)
    for module in ("flight_math", "flight_math.elementary"):
        if name in importlib.import_module(module).__all__:
            return f"'from {module} import {name}'"
    return ""


def origin(value) -> tuple[str, str]:
    """Module and name of a function or class."""
    owner = getattr(value, "__self__", None)
    module = getattr(value, "__module__", None)
    if not isinstance(module, str):
        module = "numpy" if isinstance(value, np.ufunc) else type(owner).__module__
    if owner is not None and not isinstance(owner, types.ModuleType) and module == "builtins":
        module = type(owner).__module__
    return module, getattr(value, "__name__", type(value).__name__)


def refusal(value, written: str) -> str | None:
    """Why a kernel may not call ``value``, a function or class that is no kernel; None: it may. written: in the source."""
    module, name = origin(value)
    package = module.partition(".")[0]
    if package == "builtins":
        return _of_builtins(name, written)
    if package == "math":
        return None if name in MATH else _of_libm(name, written)
    if package == "numpy":
        return _of_numpy(module, name, written)
    if package in ("random", "secrets"):
        return _random(written)
    if package in ("time", "datetime"):
        return f"{written} reads a clock; in a kernel time is t_ns [ns], which counts from the start of the run"
    if package == "scipy":
        return (f"{written} is a function of SciPy, which cannot be compiled into a kernel; write what it does with the "
                "functions of flight_math, or work it out beforehand in resolve or tables")
    return None


def method_refusal(written: str, method: str) -> str | None:
    """Why a kernel may not call this method of an array."""
    if method in _METHODS_OF_ARRAYS:
        return _of_numpy("numpy", method, written)
    return None


def libm_operator(sign: str) -> str:
    return (f"{sign} calls the C library's pow, whose bits differ between machines; write x * x, or power(x, y) from "
            "flight_math")


def _of_builtins(name, written):
    if name in BUILTINS:
        return None
    if name == "print":
        return "a kernel prints nothing; for a look inside run with --engine python, where print and breakpoint work"
    if name == "pow":
        return libm_operator(written)
    if name == "sum":
        return f"{written} adds in an order of its own; write {ours('sum') or 'total(v)'}, which adds from first to last"
    if name in ("list", "dict", "set", "sorted", "bytearray", "map", "filter"):
        return f"{written}(...) allocates memory, which no kernel may; write {SCRATCH}"
    if name in ("str", "format", "repr", "ascii", "chr"):
        return f"{written}(...) makes a text, {NO_TEXT}"
    return f"{written}(...) is not for kernels; allowed of Python's own are {', '.join(sorted(BUILTINS))}"


def _of_libm(name, written):
    if not callable(getattr(math, name, None)):
        return None
    instead = ours(name)
    return (f"{written} is a function of the C library, whose bits differ between machines; "
            + (f"write {instead}" if instead else "allowed are " + ", ".join(sorted(f"math.{word}" for word in MATH))
               + " and the functions of flight_math"))


def _random(written):
    return (f"{written} draws from a global stream, which differs between runs and engines; write gaussian(p.seed, t_ns, "
            "index) or uniform(...) from flight_math.noise, with 'seed: int = field(0)' among the parameters")


def _of_numpy(module, name, written):
    instead = ours(name)
    instead = f"write {instead}" if instead else None
    if "random" in module:
        return _random(written)
    if "linalg" in module or name in _BLAS:
        return (f"{written} calls BLAS or LAPACK, whose order of sums differs between machines; "
                + (instead or "write it with the values of flight_math (v @ w, m @ v)"))
    if name in _ALLOCATION:
        return f"{written} allocates memory, which no kernel may; {instead or f'write {SCRATCH}'}"
    if name in _REDUCTION:
        return (f"{written} works through an array in an order of NumPy's own; "
                + (instead or "write a loop, or a function of flight_math"))
    if name in NUMPY:
        return None
    if instead:
        return f"{written} differs in its bits between machines and versions of NumPy; {instead}"
    return (f"{written} is no function for kernels; allowed of NumPy are {', '.join(sorted(NUMPY))}, "
            "everything else comes from flight_math")
