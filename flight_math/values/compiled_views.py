"""Views of records in compiled kernels: a pointer to the record, loads and stores of the fields that are named."""

import hashlib
import sys

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_constant
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import lower_builtin, lower_getattr_generic, lower_setattr_generic, models, register_model, typeof_impl, unbox
from numba.np.arrayobj import make_array, populate_array

from flight_math.values.compiled_types import ValueType, components, from_registers, kind_of_type, type_name
from flight_math.values.refusals import refuse_compiled
from flight_math.values.views import NO_KINDS, Kinds, View, no_entry, not_assigned_whole, view, wrong_kind


class ViewType(types.Type):
    """A view of a numba Record; ``kinds`` names the fields that are values."""

    def __init__(self, record, kinds):
        self.record, self.kinds = record, kinds
        super().__init__(f"View({record}, {kinds!r})")

    @property
    def key(self):
        return self.record, self.kinds

    @property
    def mangling_args(self):
        return "View", (int(hashlib.sha256(self.name.encode()).hexdigest()[:12], 16),)


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
        if asked.f_code.co_name == "resolve_setattr":
            refuse_assignment(value, attr, asked.f_locals["value"])
        return field_type(value, attr)


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


@lower_setattr_generic(ViewType)
def _set(context, builder, signature, args, name):
    viewed, given = signature.args
    pointer, value = args
    kind = field_type(viewed, name)
    if isinstance(kind, ValueType):
        place = member(context, builder, viewed, pointer, name, ir.ArrayType(ir.DoubleType(), kind.kind.count))
        for i, part in enumerate(components(builder, value)):
            builder.store(part, cgutils.gep_inbounds(builder, place, 0, i), align=alignment(viewed))
        return
    setter = context.get_setattr(name, signature_of(viewed.record, given))
    setter(builder, (pointer, value))


def signature_of(record, given):
    """Signature of a store into a record."""
    return signature(types.none, record, given)


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


def refuse_assignment(viewed, name, given):
    """Refuse what may not be stored in a field; called when an assignment is typed."""
    kind = field_type(viewed, name)
    if isinstance(kind, ValueType):
        if given != kind:
            refuse_compiled(wrong_kind(name, kind.kind, type_name(given)))
    elif isinstance(kind, (types.Array, ViewType)):
        refuse_compiled(not_assigned_whole(name, isinstance(kind, ViewType)))
    elif kind_of_type(given) not in (float, bool):
        refuse_compiled(wrong_kind(name, float, type_name(given)))
