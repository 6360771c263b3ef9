"""Kernels of numbers that take vectors: one call for each component, numbers go to every component."""

import functools

import numpy as np
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from flight_math.errors import refuse
from flight_math.kernel import kernel, plain
from flight_math.values.classes import Value, described, is_matrix, is_vector, kind_of, mask_of
from flight_math.values.compiled_types import ValueType, from_registers, type_name
from flight_math.values.refusals import refuse_compiled

_NEEDED = "needed are numbers and vectors of one kind"


def elementwise(function):
    """Make a kernel of numbers (or the plain function for one) take Vec3, Vec(n), Mat3 and Mat(n, m) too.

    A number as result becomes a vector, a truth a Mask, a tuple of numbers a tuple of vectors.
    """
    compiled = function if hasattr(function, "py_func") else kernel(function)
    numbers = plain(function)

    @functools.wraps(numbers)
    def lifted(*args):
        kinds = {kind_of(argument) for argument in args if isinstance(argument, Value)}
        if not kinds:
            return numbers(*args)
        if len(kinds) > 1 or not _is_row(next(iter(kinds))):
            refuse(f"{numbers.__name__}{described(args)}: {_NEEDED}")
        kind = kinds.pop()
        results = [numbers(*(np.float64(tuple.__getitem__(argument, i)) if isinstance(argument, Value) else argument
                             for argument in args)) for i in range(kind.count)]
        if isinstance(results[0], tuple):
            return tuple(kind.of(column) for column in zip(*results))
        return (mask_of(kind.count) if isinstance(results[0], (bool, np.bool_)) else kind).of(results)

    lifted.py_func = numbers
    lifted.compiled = compiled
    if hasattr(compiled, "py_func"):
        _teach(lifted, compiled)
    return lifted


def _is_row(kind) -> bool:
    return is_vector(kind) or is_matrix(kind)


def _teach(lifted, compiled):
    callee = types.Dispatcher(compiled)

    class Template(AbstractTemplate):
        key = lifted

        def generic(self, args, kws):
            kinds = {argument.kind for argument in args if isinstance(argument, ValueType)}
            if kws or len(kinds) > 1 or not all(map(_is_row, kinds)):
                refuse_compiled(f"{compiled.__name__}({', '.join(map(type_name, args))}): {_NEEDED}")
            of_numbers = callee.get_call_type(
                self.context, tuple(types.float64 if isinstance(a, ValueType) else a for a in args), {})
            if not kinds:
                return of_numbers
            given = [a if isinstance(a, ValueType) else number for a, number in zip(args, of_numbers.args)]
            return signature(lifted_type(kinds.pop(), of_numbers.return_type), *given)

    infer_global(lifted, types.Function(Template))

    @lower_builtin(lifted, types.VarArg(types.Any))
    def lower(context, builder, sig, args):
        numbers = tuple(types.float64 if isinstance(kind, ValueType) else kind for kind in sig.args)
        of_numbers = callee.get_call_type(context.typing_context, numbers, {})
        call = context.get_function(callee, of_numbers)
        kind = next((argument.kind for argument in sig.args if isinstance(argument, ValueType)), None)
        if kind is None:
            return call(builder, args)
        results = [call(builder, [builder.extract_value(register, i) if isinstance(argument, ValueType) else register
                                  for argument, register in zip(sig.args, args)]) for i in range(kind.count)]
        if isinstance(sig.return_type, types.BaseTuple):
            columns = [[builder.extract_value(result, k) for result in results] for k in range(len(sig.return_type))]
            return context.make_tuple(builder, sig.return_type, [
                from_registers(context, builder, part, column) for part, column in zip(sig.return_type, columns)])
        return from_registers(context, builder, sig.return_type, results)


def lifted_type(kind, result):
    """Type of the lifted result of numbers."""
    if isinstance(result, types.BaseTuple):
        return types.Tuple([lifted_type(kind, part) for part in result])
    return ValueType(mask_of(kind.count) if isinstance(result, types.Boolean) else kind)
