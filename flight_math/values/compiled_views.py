"""Views of records in compiled kernels: a pointer to the record, loads and stores of the fields that are named."""

import hashlib
import math
import sys

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_constant
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import (
    lower_builtin,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import make_array, populate_array

from flight_math.values.compiled_types import ValueType, components, from_registers, kind_of_type, type_name
from flight_math.values.refusals import refuse_compiled
from flight_math.values.views import NO_KINDS, Kinds, View, assignable, no_entry, view, wrong_count, wrong_kind


class ViewType(types.Type):
    """A view of a numba Record; ``kinds`` names the fields that are values."""

    def __init__(self, record, kinds):
        self.record, self.kinds = record, kinds
        super().__init__(f"View({hashlib.sha256(f'{record}{kinds!r}'.encode()).hexdigest()[:12]})")

    @property
    def key(self):
        return self.record, self.kinds


class KindsType(types.Opaque):
    """`Kinds`, a constant of a kernel."""

    def __init__(self, kinds):
        self.kinds = kinds
        super().__init__(repr(kinds))


@register_model(ViewType)
class _ViewModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, dmm.lookup(fe_type.record).get_value_type())


register_model(KindsType)(models.OpaqueModel)


@typeof_impl.register(Kinds)
def _typeof_kinds(kinds, c):
    return KindsType(kinds)


@lower_constant(KindsType)
def _constant_kinds(context, builder, kind, value):
    return context.get_dummy_value()


@infer_global(view)
class _ViewCall(AbstractTemplate):
    key = view

    def generic(self, args, kws):
        if args and isinstance(args[0], ViewType):
            return signature(args[0], *args)
        if args and isinstance(args[0], types.Record):
            kinds = args[1].kinds if len(args) > 1 else NO_KINDS
            return signature(ViewType(args[0], kinds), *args)
        return refuse_compiled(f"view({', '.join(map(type_name, args))}): needed are a record and its Kinds")


@lower_builtin(view, types.VarArg(types.Any))
def _view(context, builder, signature, args):
    return args[0]


# -- fields ----------------------------------------------------------------------------------------------------------------
def field_type(viewed, name):
    """What a field of a view reads as."""
    record, kind = viewed.record, viewed.kinds.by_name.get(name)
    if name not in record.fields:
        refuse_compiled(no_entry(name, tuple(record.fields)))
    stored = record.typeof(name)
    if isinstance(kind, type):
        return ValueType(kind)
    if isinstance(stored, types.Record):
        return ViewType(stored, kind or NO_KINDS)
    if isinstance(stored, types.NestedArray):
        return types.Array(stored.dtype, stored.ndim, "C", aligned=record.aligned)
    return stored


@infer_getattr
class _ViewAttributes(AttributeTemplate):
    key = ViewType

    def resolve(self, value, attr):
        asked = sys._getframe(1)  # numba asks the same for reading and assigning, and keeps to itself what is assigned
        kind = field_type(value, attr)
        return stored_type(value, attr, asked.f_locals["value"]) if asked.f_code.co_name == "resolve_setattr" else kind


def member(context, builder, viewed, pointer, name, kind):
    """Pointer to a field, as a pointer to ``kind``."""
    return cgutils.get_record_member(builder, pointer, viewed.record.offset(name), kind)


def alignment(viewed) -> int:
    """How the numbers of a record lie: messages are packed as the wire has them."""
    return 8 if viewed.record.aligned else 1


@lower_getattr_generic(ViewType)
def _get(context, builder, viewed, pointer, name):
    kind = field_type(viewed, name)
    if isinstance(kind, ViewType):
        return member(context, builder, viewed, pointer, name, context.get_data_type(kind.record))
    if isinstance(kind, ValueType):
        place = member(context, builder, viewed, pointer, name, ir.ArrayType(ir.DoubleType(), kind.kind.count))
        return from_registers(context, builder, kind, [
            builder.load(cgutils.gep_inbounds(builder, place, 0, i), align=alignment(viewed))
            for i in range(kind.kind.count)])
    if isinstance(kind, types.Array):
        return _by_reference(context, builder, viewed, pointer, name, kind)
    return context.get_getattr(viewed.record, name)(context, builder, viewed.record, pointer, name)


def _by_reference(context, builder, viewed, pointer, name, kind):
    nested = viewed.record.typeof(name)
    place = member(context, builder, viewed, pointer, name, context.get_data_type(kind.dtype))
    words = [context.get_constant(types.intp, length) for length in nested.shape]
    strides = [context.get_constant(types.intp, stride) for stride in nested.strides]
    array = make_array(kind)(context, builder)
    populate_array(array, data=place, shape=words, strides=strides,
                   itemsize=context.get_constant(types.intp, nested.dtype.bitwidth // 8), meminfo=None)
    return array._getvalue()


def stored_type(viewed, name, given):
    """The type that a store into a field takes; it refuses what does not fit."""
    kind = field_type(viewed, name)
    if not assignable(reading(kind), reading(given)):
        refuse_compiled(wrong_kind(name, reading(kind), reading(given)))
    if isinstance(given, ValueType) and given.kind.count != math.prod(viewed.record.typeof(name).shape):
        refuse_compiled(wrong_count(name, viewed.record.typeof(name).shape, given.kind.count))
    if isinstance(given, types.Array) and given.ndim != 1 and given.layout != "C":
        refuse_compiled(f"an array with gaps is assigned to '{name}': copy it element by element")
    return given if isinstance(given, (types.Array, ValueType)) else kind


def reading(kind):
    """A type as `flight_math.values.views.reads_as` has it."""
    if isinstance(kind, types.Array):
        return np.ndarray
    return View if isinstance(kind, ViewType) else kind_of_type(kind) or type_name(kind)


@lower_setattr_generic(ViewType)
def _set(context, builder, sig, args, name):
    viewed, given = sig.args
    pointer, value = args
    if not isinstance(given, (ValueType, types.Array)):
        setter = context.get_setattr(name, signature(types.none, viewed.record, given))
        setter(builder, (pointer, value))
        return
    stored = viewed.record.typeof(name)
    count = math.prod(stored.shape)
    place = member(context, builder, viewed, pointer, name, ir.ArrayType(context.get_data_type(stored.dtype), count))

    def store(number, kind, index):
        number = context.cast(builder, number, kind, stored.dtype)
        builder.store(number, cgutils.gep_inbounds(builder, place, 0, index), align=alignment(viewed))

    if isinstance(given, ValueType):
        for i, number in enumerate(components(builder, value)):
            store(number, types.float64, i)
        return
    array = make_array(given)(context, builder, value)
    _check_size(context, builder, array, count)
    stride = builder.extract_value(array.strides, given.ndim - 1)
    with cgutils.for_range(builder, context.get_constant(types.intp, count)) as loop:
        pointer = cgutils.pointer_add(builder, array.data, builder.mul(stride, loop.index))
        store(builder.load(pointer), given.dtype, loop.index)


def _check_size(context, builder, array, count):
    """With bounds checks, an IndexError where an array is not as long as the field it is assigned to."""
    if context.enable_boundscheck:
        wrong = builder.icmp_signed("!=", array.nitems, context.get_constant(types.intp, count))
        with builder.if_then(wrong, likely=False):
            context.call_conv.return_user_exc(builder, IndexError, ("an array of another length than the field",))


# -- from plain Python -----------------------------------------------------------------------------------------------------
@typeof_impl.register(View)
def _typeof_view(viewed, c):
    from numba import typeof
    return ViewType(typeof(viewed._record), viewed._kinds)


@unbox(ViewType)
def _unbox_view(kind, viewed, c):
    record = c.pyapi.object_getattr_string(viewed, "_record")
    native = c.unbox(kind.record, record)
    c.pyapi.decref(record)
    return native
