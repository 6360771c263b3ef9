"""Refusals while a kernel is compiled: KernelError with the line of the kernel that numba is at."""

import sys

from numba.core import ir

from flight_math.errors import KernelError


def refuse_compiled(sentence: str):
    """Raise KernelError for the statement that numba types or lowers now: the innermost place its frames hold."""
    frame = sys._getframe(1)
    while frame is not None:
        place = getattr(frame.f_locals.get("self"), "loc", None)
        if isinstance(place, ir.Loc):
            raise KernelError(place.filename, place.line, sentence)
        frame = frame.f_back
    raise KernelError("", 0, sentence)
