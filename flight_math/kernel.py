"""Kernels: the compiled functions that carry all mathematics of a component.

A kernel is written for numba's nopython mode and follows these rules, so that it gives the same bits in every executor: no
allocation (values live in registers, work arrays on the stack), no global state, no BLAS, no reductions of NumPy, no global
random numbers. ``plain(kernel)`` is the plain function, for a debugger.
"""

import functools
import hashlib
import inspect
from pathlib import Path

import numba
import numpy as np

from flight_math import exact  # noqa: F401 what the compiler has to know


def kernel(function):
    """Compile ``function`` for the hot path: IEEE arithmetic, no contraction, no allocation, releases the GIL.

    As a component's part it gets views of its records (`flight_math.values.view`). Division by zero and domain errors give
    inf or NaN; the executors refuse non-finite outputs at the boundary. With ``NUMBA_DISABLE_JIT=1`` the function is
    returned as it is (the plain-Python mode). Nothing is cached here: numba would not notice a change in a function that is
    called from another file; the executors cache under a fingerprint of every kernel they reach (`fingerprint`).
    """
    return numba.njit(error_model="numpy", nogil=True, _nrt=False)(function)


def plain(function):
    """The uncompiled form of a kernel: for a few calls, or for whole arrays in place of scalars."""
    return getattr(function, "py_func", function)


@functools.cache
def library() -> str:
    """SHA-256 over the files of this package: operators and functions of values leave no other trace in a kernel."""
    root, digest = Path(__file__).parent, hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def fingerprint(*functions) -> str:
    """SHA-256 over the source of the kernels, of every kernel they call, the constants they read, and this package."""
    digest = hashlib.sha256(library().encode())
    seen = set()

    def visit(function):
        function = plain(function)
        if function in seen:
            return
        seen.add(function)
        digest.update(inspect.getsource(function).encode())
        names = _global_names(function.__code__)
        for name in sorted(names):
            consider(name, function.__globals__.get(name), names)
        for name, cell in zip(function.__code__.co_freevars, function.__closure__ or ()):
            consider(name, cell.cell_contents, names)
        for name, parameter in inspect.signature(function).parameters.items():
            if parameter.default is not parameter.empty:
                consider(name, parameter.default, names)

    def consider(name, value, names):
        if type(value) is tuple:
            for number, item in enumerate(value):
                consider(f"{name}[{number}]", item, names)
        elif isinstance(value, (bool, int, float, str, tuple, np.generic)) or _is_class(value):
            digest.update(f"{name}={value!r}".encode())
        elif isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
            digest.update(f"{name}={value.__name__}{value._fields}{value._field_defaults}".encode())
        elif hasattr(value, "py_func") or (inspect.isfunction(value) and numba.config.DISABLE_JIT):
            visit(value)
        elif inspect.ismodule(value):
            for attribute in sorted(names & set(vars(value))):
                if not inspect.ismodule(vars(value)[attribute]):
                    consider(f"{name}.{attribute}", vars(value)[attribute], names)
        elif isinstance(value, np.ndarray):
            digest.update(name.encode() + value.tobytes())

    for function in functions:
        visit(function)
    return digest.hexdigest()


def _is_class(value) -> bool:
    return isinstance(value, type) and hasattr(value, "title")


def _global_names(code) -> set:
    names = set(code.co_names)
    for constant in code.co_consts:
        if inspect.iscode(constant):
            names |= _global_names(constant)
    return names
