"""Kernels: the compiled functions that carry all mathematics of a component.

A kernel is written for numba's nopython mode and follows five rules, so that it gives the same bits in every executor:
no allocation, no global state, no ``@``/``np.dot`` (BLAS), no reductions of NumPy (``np.sum``), no global random numbers.
Loops over small arrays and scalars are the style. ``kernel(f).py_func`` is the plain function, for a debugger.
"""

import hashlib
import inspect

import numba
import numpy as np


def kernel(function):
    """Compile ``function`` for the hot path (numba nopython, IEEE arithmetic, no contraction, releases the GIL).

    Division by zero and domain errors give inf or NaN, as in NumPy; the executors refuse non-finite outputs at the
    boundary. With ``NUMBA_DISABLE_JIT=1`` the function is returned as it is (the plain-Python mode).
    Nothing is cached here: numba would not notice a change in a function that is called from another file. The
    executors cache whole generated modules under a fingerprint of every kernel they reach (`fingerprint`).
    """
    return numba.njit(error_model="numpy", nogil=True)(function)


def plain(function):
    """The uncompiled form of a kernel: for a few calls, or for whole arrays in place of scalars."""
    return getattr(function, "py_func", function)


def fingerprint(*functions) -> str:
    """SHA-256 over the source of the kernels, of every kernel they call, and of the constants they read."""
    digest = hashlib.sha256()
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

    def consider(name, value, names):
        if hasattr(value, "py_func") or (inspect.isfunction(value) and numba.config.DISABLE_JIT):
            visit(value)
        elif inspect.ismodule(value):
            for attribute in sorted(names & set(vars(value))):
                if not inspect.ismodule(vars(value)[attribute]):
                    consider(f"{name}.{attribute}", vars(value)[attribute], names)
        elif isinstance(value, (bool, int, float, str, tuple, np.generic)):
            digest.update(f"{name}={value!r}".encode())
        elif isinstance(value, np.ndarray):
            digest.update(name.encode() + value.tobytes())

    for function in functions:
        visit(function)
    return digest.hexdigest()


def _global_names(code) -> set:
    names = set(code.co_names)
    for constant in code.co_consts:
        if inspect.iscode(constant):
            names |= _global_names(constant)
    return names
