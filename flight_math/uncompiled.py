"""Kernels in plain Python all the way down: the same bits as compiled, without compiling anything. For a few calls, as
those that work out parameters before a run."""

import inspect
import types

from flight_math.kernel import plain

_MADE = {}


def uncompiled(kernel):
    """A kernel whose kernels are plain Python too, and theirs. Elementary functions in it take numbers, not vectors."""
    function = plain(kernel)
    if function in _MADE or not inspect.isfunction(function):
        return _MADE.get(function, function)
    world = dict(function.__globals__)
    cells = tuple(types.CellType(_replaced(cell.cell_contents)) for cell in function.__closure__ or ())
    made = types.FunctionType(function.__code__, world, function.__name__, function.__defaults__, cells or None)
    _MADE[function] = made
    world.update({name: _replaced(world[name]) for name in function.__code__.co_names if name in world})
    return made


def _replaced(value):
    return uncompiled(value) if not isinstance(value, tuple) and callable(getattr(value, "py_func", None)) else value
