"""Kernels of numbers that take vectors: one call for each component, numbers go to every component."""

import functools

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from flight_math.errors import refuse
from flight_math.kernel import kernel, plain
from flight_math.values.classes import Value, described, is_matrix, is_vector, kind_of, mask_of
from flight_math.values.compiled_types import ValueType, from_registers, type_name
from flight_math.values.refusals import refuse_compiled

_WORD = ir.IntType(64)
_NEEDED = "needed are numbers and vectors of one kind"


def elementwise(function):
    """Make a kernel of numbers (or the plain function for one) take Vec3, Vec(n), Mat3 and Mat(n, m) too.

    A number as result becomes a vector, a truth a Mask, a tuple of numbers a tuple of vectors.
    """
    return lift(function, _called)


def lift(function, emit):
    """`elementwise`; ``emit`` writes the calls of a compiled kernel."""
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
        _teach(lifted, compiled, emit)
    return lifted


def _is_row(kind) -> bool:
    return is_vector(kind) or is_matrix(kind)


def _teach(lifted, compiled, emit):
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
        kinds = tuple(types.float64 if isinstance(kind, ValueType) else kind for kind in sig.args)
        of_numbers = callee.get_call_type(context.typing_context, kinds, {})
        call = context.get_function(callee, of_numbers)
        kind = next((argument.kind for argument in sig.args if isinstance(argument, ValueType)), None)
        if kind is None:
            return call(builder, args)
        return emit(context, builder, sig, args, kind.count, lambda numbers: call(builder, numbers))


def _called(context, builder, sig, args, count, call):
    """One call for each component."""
    results = [call([builder.extract_value(register, i) if isinstance(kind, ValueType) else register
                     for kind, register in zip(sig.args, args)]) for i in range(count)]
    if not isinstance(sig.return_type, types.BaseTuple):
        return from_registers(context, builder, sig.return_type, results)
    columns = [[builder.extract_value(result, k) for result in results] for k in range(len(sig.return_type))]
    return context.make_tuple(builder, sig.return_type, [
        from_registers(context, builder, part, column) for part, column in zip(sig.return_type, columns)])


def looped(context, builder, sig, args, count, call):
    """One call in a loop over the components, so that its code, which is put in its place, stands there once.

    Components that are equal to the one before, bit for bit, share its result.
    """
    rows = {i: cgutils.alloca_once_value(builder, args[i])
            for i, kind in enumerate(sig.args) if isinstance(kind, ValueType)}
    parts = list(sig.return_type) if isinstance(sig.return_type, types.BaseTuple) else [sig.return_type]
    places = [cgutils.alloca_once(builder, context.get_value_type(part)) for part in parts]
    with cgutils.for_range(builder, ir.Constant(_WORD, count)) as loop:
        before = builder.select(builder.icmp_signed("==", loop.index, ir.Constant(_WORD, 0)), loop.index,
                                builder.sub(loop.index, ir.Constant(_WORD, 1)))
        differs = builder.icmp_signed("==", loop.index, ir.Constant(_WORD, 0))
        for place in rows.values():
            words = builder.bitcast(place, ir.ArrayType(_WORD, count).as_pointer())
            here, there = (builder.load(cgutils.gep_inbounds(builder, words, 0, at)) for at in (loop.index, before))
            differs = builder.or_(differs, builder.icmp_signed("!=", here, there))
        with builder.if_else(differs) as (new, old):
            with new:
                result = call([builder.load(cgutils.gep_inbounds(builder, rows[i], 0, loop.index)) if i in rows else args[i]
                               for i in range(len(args))])
                items = [result] if len(parts) == 1 else [builder.extract_value(result, k) for k in range(len(parts))]
                for item, place in zip(items, places):
                    builder.store(item, cgutils.gep_inbounds(builder, place, 0, loop.index))
            with old:
                for place in places:
                    builder.store(builder.load(cgutils.gep_inbounds(builder, place, 0, before)),
                                  cgutils.gep_inbounds(builder, place, 0, loop.index))
    results = [builder.load(place) for place in places]
    if isinstance(sig.return_type, types.BaseTuple):
        return context.make_tuple(builder, sig.return_type, results)
    return results[0]


def lifted_type(kind, result):
    """Type of the lifted result of numbers."""
    if isinstance(result, types.BaseTuple):
        return types.Tuple([lifted_type(kind, part) for part in result])
    return ValueType(mask_of(kind.count) if isinstance(result, types.Boolean) else kind)
