"""Components of values in compiled kernels: attributes, constant and run-time indices, and what may not be set."""

import operator
import sys

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer, infer_getattr, infer_global, signature
from numba.extending import lower_builtin, lower_getattr_generic

from flight_math.errors import KernelError
from flight_math.values.classes import Mat, Vec, immutable, is_matrix, no_attribute, no_truth
from flight_math.values.compiled_types import ConstructorType, ValueType, components, from_registers, type_name
from flight_math.values.refusals import refuse_compiled


# -- attributes ------------------------------------------------------------------------------------------------------------
@infer_getattr
class _ValueAttributes(AttributeTemplate):
    key = ValueType

    def resolve(self, value, attr):
        if sys._getframe(1).f_code.co_name == "resolve_setattr":  # numba asks the same for reading and setting
            refuse_compiled(immutable(value.kind))
        return self.component(value, attr)

    def component(self, value, name):
        """Type of an attribute."""
        kind = value.kind
        if kind.halves is not None and name in ("real", "dual"):
            return ValueType(kind.halves)
        if len(name) == 1 and name in kind.letters:
            return value.item
        return refuse_compiled(no_attribute(kind, name))


@lower_getattr_generic(ValueType)
def _attribute(context, builder, value, register, name):
    kind = value.kind
    if name in kind.letters:
        return builder.extract_value(register, kind.letters.index(name))
    first = 0 if name == "real" else kind.halves.count
    half = components(builder, register)[first:first + kind.halves.count]
    return from_registers(context, builder, ValueType(kind.halves), half)


# -- indices ---------------------------------------------------------------------------------------------------------------
@infer
class _ConstantItem(AbstractTemplate):
    key = "static_getitem"

    def generic(self, args, kws):
        value, index = args
        if not isinstance(value, ValueType):
            return None
        try:
            value.kind.place(index)
        except KernelError as error:
            refuse_compiled(error.sentence)
        return signature(value.item, *args)


@lower_builtin("static_getitem", ValueType, types.Any)
def _constant_item(context, builder, signature, args):
    return builder.extract_value(args[0], signature.args[0].kind.place(args[1]))


@infer_global(operator.getitem)
class _Item(AbstractTemplate):
    key = operator.getitem

    def generic(self, args, kws):
        value, index = args
        if not isinstance(value, ValueType):
            return None
        if is_matrix(value.kind):
            if isinstance(index, types.BaseTuple) and len(index) == 2 and all(isinstance(i, types.Integer) for i in index):
                return signature(value.item, value, types.UniTuple(types.intp, 2))
        elif isinstance(index, types.Integer):
            return signature(value.item, value, types.intp)
        form = "m[i, j]" if is_matrix(value.kind) else "v[i]"
        return refuse_compiled(f"a {value.kind.title} is read as {form} with whole numbers, not with {type_name(index)}")


@lower_builtin(operator.getitem, ValueType, types.intp)
def _item(context, builder, signature, args):
    return at(context, builder, args[0], args[1])


@lower_builtin(operator.getitem, ValueType, types.UniTuple)
def _matrix_item(context, builder, signature, args):
    width = ir.Constant(args[1].type.element, signature.args[0].kind.shape[1])
    i, j = (inside(context, builder, builder.extract_value(args[1], k), signature.args[0].kind.shape[k]) for k in range(2))
    return at(context, builder, args[0], builder.add(builder.mul(i, width), j))


def at(context, builder, register, index):
    """The component at a run-time index, from 0; negative ones count from the end."""
    index = inside(context, builder, index, register.type.count)
    place = cgutils.alloca_once_value(builder, register)
    return builder.load(cgutils.gep_inbounds(builder, place, 0, index))


def inside(context, builder, index, count):
    """An index counted from the front; with bounds checks, an IndexError where it is outside."""
    count = ir.Constant(index.type, count)
    index = builder.select(builder.icmp_signed("<", index, ir.Constant(index.type, 0)), builder.add(index, count), index)
    if context.enable_boundscheck:
        with builder.if_then(builder.icmp_unsigned(">=", index, count), likely=False):
            context.call_conv.return_user_exc(builder, IndexError, ("index outside of a value",))
    return index


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    key = operator.setitem

    def generic(self, args, kws):
        if isinstance(args[0], ValueType):
            refuse_compiled(immutable(args[0].kind))


@infer
class _SetConstantItem(_SetItem):
    key = "static_setitem"


# -- other questions -------------------------------------------------------------------------------------------------------
@infer_global(len)
class _Length(AbstractTemplate):
    key = len

    def generic(self, args, kws):
        if len(args) == 1 and isinstance(args[0], ValueType):
            return signature(types.intp, *args)
        return None


@lower_builtin(len, ValueType)
def _length(context, builder, signature, args):
    return ir.Constant(context.get_value_type(types.intp), args[0].type.count)


@infer_global(bool)
class _Truth(AbstractTemplate):
    key = bool

    def generic(self, args, kws):
        if len(args) == 1 and isinstance(args[0], ValueType):
            refuse_compiled(no_truth(args[0].kind))


@infer_global(operator.not_)
class _Not(_Truth):
    key = operator.not_


# -- classes of sizes ------------------------------------------------------------------------------------------------------
class _Sized(AbstractTemplate):
    """Vec(4) and Mat(2, 6) in a kernel, with constants."""

    prefer_literal = True

    def generic(self, args, kws):
        sizes = [argument.literal_value for argument in args if isinstance(argument, types.IntegerLiteral)]
        make = type(self).key
        if kws or len(sizes) != (1 if make is Vec else 2) or len(args) != len(sizes):
            refuse_compiled(f"{make.__name__}(...) in a kernel takes constants: name it outside, Vec7 = Vec(7)")
        return signature(ConstructorType(make(*sizes)), *args)


def _no_value(context, builder, signature, args):
    return context.get_dummy_value()


for _make in (Vec, Mat):
    infer_global(_make, types.Function(type("Template", (_Sized,), {"key": _make})))
    lower_builtin(_make, types.VarArg(types.Any))(_no_value)
