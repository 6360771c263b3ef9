"""Kernels that take raw records; kernels that take values are made with `flight_math.kernel`."""

import numba

from flight_math.kernel import fingerprint, plain

__all__ = ["fingerprint", "kernel", "plain"]


def kernel(function):
    """Compile ``function`` for the hot path; a component's part made with it gets records, not views."""
    return numba.njit(error_model="numpy", nogil=True)(function)
