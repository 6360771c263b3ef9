"""Arrays and values: rows read as values, values stored in rows, work arrays that live on the stack.

    v = vec3(a[i])              a (n, 3)
    a[i] = v                    likewise a (n, 3, 3) with a Mat3, a[:3] = v of a (n,)
    work = stack_array(6, n)    zeroed, until the function returns
"""

import operator

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin
from numba.np.arrayobj import make_array, populate_array

from flight_math.errors import refuse
from flight_math.values.access import at, inside
from flight_math.values.classes import Mat3, Quaternion, Value, Vec, Vec3, described, is_matrix, kind_of
from flight_math.values.compiled_types import ConstructorType, ValueType, components, from_registers, type_name
from flight_math.values.refusals import refuse_compiled

_DOUBLE = ir.DoubleType()
_WORD = ir.IntType(64)


# -- values of arrays ------------------------------------------------------------------------------------------------------
def _reader(kind, dimensions, allowed):
    def decorate(function):
        class Template(AbstractTemplate):
            key = function

            def generic(self, args, kws):
                if len(args) == 1 and isinstance(args[0], ValueType) and args[0].kind.count == kind.count:
                    return signature(ValueType(kind), *args)
                if len(args) == 1 and isinstance(args[0], types.Array) and args[0].ndim in dimensions:
                    return signature(ValueType(kind), *args)
                return refuse_compiled(f"{function.__name__}({', '.join(map(type_name, args))}): {allowed}")

        infer_global(function, types.Function(Template))

        @lower_builtin(function, types.Any)
        def lower(context, builder, signature, args):
            if isinstance(signature.args[0], ValueType):
                return args[0]
            return loaded(context, builder, ValueType(kind), signature.args[0], args[0])
        function.allowed = allowed
        return function
    return decorate


def _read(function, kind, shapes, array):
    if isinstance(array, Value) and array.count == kind.count:
        return kind.of(array.parts())
    if not isinstance(array, np.ndarray) or array.shape not in shapes:
        refuse(f"{function.__name__}{described((array,))}: {function.allowed}")
    return kind.of(array.ravel().tolist())


@_reader(Vec3, (1,), "needed is an array (3,)")
def vec3(array):
    """The Vec3 of an array (3,)."""
    return _read(vec3, Vec3, ((3,),), array)


@_reader(Mat3, (1, 2), "needed is an array (3, 3) or (9,)")
def mat3(array):
    """The Mat3 of an array (3, 3), or (9,) row by row."""
    return _read(mat3, Mat3, ((3, 3), (9,)), array)


@_reader(Quaternion, (1,), "needed is an array (4,)")
def quaternion4(array):
    """The Quaternion of an array (4,), x, y, z, w."""
    return _read(quaternion4, Quaternion, ((4,),), array)


def element_pointers(context, builder, kind, array_type, array):
    """Pointers to the elements of an array that hold a value's components, in their order."""
    made = make_array(array_type)(context, builder, array)
    lengths = cgutils.unpack_tuple(builder, made.shape, array_type.ndim)
    strides = cgutils.unpack_tuple(builder, made.strides, array_type.ndim)
    shape = kind.kind.shape if array_type.ndim == len(kind.kind.shape) else (kind.kind.count,)
    if context.enable_boundscheck:
        for length, needed in zip(lengths, shape):
            with builder.if_then(builder.icmp_signed("!=", length, ir.Constant(_WORD, needed)), likely=False):
                context.call_conv.return_user_exc(builder, IndexError, ("an array of another length than the value",))
    if array_type.layout == "C":
        return [builder.gep(made.data, [ir.Constant(_WORD, i)]) for i in range(kind.kind.count)]
    return [cgutils.pointer_add(builder, made.data, _offset(builder, strides, place)) for place in np.ndindex(*shape)]


def _offset(builder, strides, place):
    total = ir.Constant(_WORD, 0)
    for stride, index in zip(strides, place):
        total = builder.add(total, builder.mul(stride, ir.Constant(_WORD, index)))
    return total


def loaded(context, builder, kind, array_type, array):
    """The value of an array's elements."""
    numbers = [builder.load(pointer) for pointer in element_pointers(context, builder, kind, array_type, array)]
    return from_registers(context, builder, kind, [
        context.cast(builder, number, array_type.dtype, types.float64) for number in numbers])


@lower_builtin(ConstructorType, types.Array)
def _construct(context, builder, signature, args):
    return loaded(context, builder, signature.return_type, signature.args[0], args[0])


# -- values into arrays ----------------------------------------------------------------------------------------------------
@infer_global(operator.setitem)
class _StoreTemplate(AbstractTemplate):
    key = operator.setitem

    def generic(self, args, kws):
        array, index, value = args
        if not isinstance(array, types.Array) or not isinstance(value, ValueType):
            return None
        row = self.context.resolve_function_type(operator.getitem, (array, index), {}).return_type
        fits = isinstance(row, types.Array) and row.dtype == types.float64 and row.ndim == len(value.kind.shape)
        if not fits:
            refuse_compiled(_no_room(value.kind, array.ndim))
        return signature(types.none, array, types.unliteral(index), value)


def _no_room(kind, dimensions) -> str:
    sentence = (f"a {kind.title} does not fit an array of {dimensions} dimensions at this index: "
                f"it fills {' x '.join(map(str, kind.shape))} float64 numbers")
    return f"{sentence}; for a row of {kind.count} write Vec({kind.count})(m)" if is_matrix(kind) else sentence


@lower_builtin(operator.setitem, types.Array, types.Any, ValueType)
def _store(context, builder, signature, args):
    array, index, value = signature.args
    read = context.typing_context.resolve_function_type(operator.getitem, (array, index), {})
    find = context.get_function(operator.getitem, read)
    row = find(builder, [args[0], context.cast(builder, args[1], index, read.args[1])])
    pointers = element_pointers(context, builder, value, read.return_type, row)
    for pointer, part in zip(pointers, components(builder, args[2])):
        builder.store(part, pointer)
    return context.get_dummy_value()


# -- rows and columns of matrices ------------------------------------------------------------------------------------------
def row(matrix, i):
    """Row i of a matrix."""
    return Vec(_width(matrix, i, "row")).of(matrix[i, j] for j in range(kind_of(matrix).shape[1]))


def column(matrix, j):
    """Column j of a matrix."""
    _width(matrix, j, "column")
    return Vec(kind_of(matrix).shape[0]).of(matrix[i, j] for i in range(kind_of(matrix).shape[0]))


def _width(matrix, index, name):
    if not is_matrix(kind_of(matrix)) or not isinstance(index, (int, np.integer)):
        refuse(f"{name}{described((matrix, index))}: needed are a matrix and a whole number")
    return kind_of(matrix).shape[1]


def _line(function, along):
    """Compiled row (along 1) and column (along 0)."""
    class Template(AbstractTemplate):
        key = function

        def generic(self, args, kws):
            fits = len(args) == 2 and isinstance(args[0], ValueType) and isinstance(args[1], types.Integer)
            if not fits or not is_matrix(args[0].kind):
                refuse_compiled(f"{function.__name__}({', '.join(map(type_name, args))}): "
                                "needed are a matrix and a whole number")
            return signature(ValueType(Vec(args[0].kind.shape[along])), args[0], types.intp)

    infer_global(function, types.Function(Template))

    @lower_builtin(function, ValueType, types.intp)
    def lower(context, builder, signature, args):
        height, width = signature.args[0].kind.shape
        index = inside(context, builder, args[1], (height, width)[1 - along])
        step, stride = (1, width) if along else (width, 1)
        first = builder.mul(index, ir.Constant(_WORD, stride))
        return from_registers(context, builder, signature.return_type, [
            at(context, builder, args[0], builder.add(first, ir.Constant(_WORD, k * step)))
            for k in range((height, width)[along])])


_line(row, 1)
_line(column, 0)


# -- work arrays -----------------------------------------------------------------------------------------------------------
def stack_array(*shape):
    """A zeroed float64 array of this shape that lives until the function returns. Not in a loop, and never returned."""
    if not 1 <= len(shape) <= 4 or not all(isinstance(length, (int, np.integer)) for length in shape):
        refuse(f"stack_array{described(shape)}: needed are one to four whole numbers")
    return np.zeros(shape)


class _StackTemplate(AbstractTemplate):
    key = stack_array
    prefer_literal = True

    def generic(self, args, kws):
        if kws or not 1 <= len(args) <= 4 or not all(isinstance(length, types.Integer) for length in args):
            refuse_compiled(f"stack_array({', '.join(map(type_name, args))}): needed are one to four whole numbers")
        return signature(types.Array(types.float64, len(args), "C"), *args)

infer_global(stack_array, types.Function(_StackTemplate))


@lower_builtin(stack_array, types.VarArg(types.Any))
def _stack(context, builder, sig, args):
    words = [context.cast(builder, length, kind, types.intp) for length, kind in zip(args, sig.args)]
    fixed = [kind.literal_value for kind in sig.args if isinstance(kind, types.IntegerLiteral)]
    if len(fixed) == len(args):
        words = [ir.Constant(_WORD, length) for length in fixed]
        count = ir.Constant(_WORD, int(np.prod(fixed)))
        with builder.goto_entry_block():
            data = builder.alloca(_DOUBLE, count)
    else:
        count = words[0]
        for word in words[1:]:
            count = builder.mul(count, word)
        data = builder.alloca(_DOUBLE, count)
    data.align = 16
    cgutils.memset(builder, data, builder.mul(count, ir.Constant(_WORD, 8)), 0)
    strides = [ir.Constant(_WORD, 8)]
    for word in reversed(words[1:]):
        strides.insert(0, builder.mul(strides[0], word))
    array = make_array(sig.return_type)(context, builder)
    populate_array(array, data=data, shape=words, strides=strides, itemsize=ir.Constant(_WORD, 8), meminfo=None)
    return array._getvalue()
