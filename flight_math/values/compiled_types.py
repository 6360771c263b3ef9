"""Values as numba sees them: a type for each kind, an array of registers, and the way from and to plain Python."""

from llvmlite import ir
from numba import types
from numba.core import typing
from numba.core.imputils import lower_constant
from numba.extending import NativeValue, box, lower_builtin, models, register_model, typeof_impl, unbox

from flight_math.values.classes import Value, ValueClass, is_mask, kind_name
from flight_math.values.refusals import refuse_compiled
from flight_math.values.symbols import Symbol, TruthSymbol


class ValueType(types.Type):
    """A value; ``kind`` is its class in plain Python."""

    def __init__(self, kind):
        self.kind = kind
        super().__init__(kind.title)

    @property
    def key(self):
        return self.kind

    @property
    def mangling_args(self):
        return self.kind.__name__, ()

    @property
    def item(self):
        """Type of one component."""
        return types.boolean if is_mask(self.kind) else types.float64


class ConstructorType(types.Callable, types.Opaque):
    """The class itself, which a kernel calls with numbers."""

    def __init__(self, kind):
        self.kind = kind
        super().__init__(f"class({kind.title})")

    @property
    def key(self):
        return self.kind

    def get_call_type(self, context, args, kws):
        kind = self.kind
        arguments = constructor_arguments(kind, args) if not kws else None
        if arguments is None:
            refuse_compiled(kind.call_refused(list(map(type_name, args))))
        return typing.signature(ValueType(kind), *arguments)

    def get_call_signatures(self):
        return (), True

    def get_impl_key(self, sig):
        return ConstructorType


def constructor_arguments(kind, args):
    """Types that a class takes for arguments of types ``args``; None where it takes none."""
    if len(args) == 1 and isinstance(args[0], types.Array) and args[0].ndim in (1, len(kind.shape)):
        return args
    if len(args) == 1 and isinstance(args[0], ValueType) and args[0].kind.count == kind.count and not is_mask(args[0].kind):
        return args
    if kind.halves is not None:
        return args if args == (ValueType(kind.halves),) * 2 else None
    if len(args) != kind.count or not all(isinstance(a, (types.Number, types.Boolean)) for a in args):
        return None
    return (ValueType(kind).item,) * kind.count


@register_model(ValueType)
class _ValueModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, ir.ArrayType(dmm.lookup(fe_type.item).get_value_type(), fe_type.kind.count))


register_model(ConstructorType)(models.OpaqueModel)


def type_name(kind) -> str:
    """A numba type in words."""
    kind = types.unliteral(kind)
    if isinstance(kind, types.Array):
        return "array"
    return kind_name(kind_of_type(kind)) if kind_of_type(kind) is not None else str(kind)


def kind_of_type(kind):
    """A class of values, float (any number), bool (a truth), or None for what is none of them."""
    if isinstance(kind, ValueType):
        return kind.kind
    return float if isinstance(kind, types.Number) else bool if isinstance(kind, types.Boolean) else None


def type_of_kind(kind):
    """The numba type of a kind; of a tuple of kinds, of a tuple."""
    if isinstance(kind, tuple):
        return types.Tuple([type_of_kind(part) for part in kind])
    return {float: types.float64, bool: types.boolean, int: types.int64}.get(kind) or ValueType(kind)


def unpacked(builder, kind, register):
    """What a formula takes: a Symbol, or the list of the Symbols of a value."""
    if isinstance(kind, ValueType):
        symbol = TruthSymbol if is_mask(kind.kind) else Symbol
        return [symbol(builder, builder.extract_value(register, i)) for i in range(kind.kind.count)]
    return (TruthSymbol if isinstance(kind, types.Boolean) else Symbol)(builder, register)


def packed(context, builder, kind, result):
    """The register of what a formula returned."""
    if isinstance(kind, types.BaseTuple):
        return context.make_tuple(builder, kind, [packed(context, builder, *pair) for pair in zip(kind, result)])
    if isinstance(kind, ValueType):
        registers = [getattr(part, "value", part) for part in result]
        item = context.get_value_type(kind.item)
        return from_registers(context, builder, kind, [
            part if isinstance(part, ir.Value) else ir.Constant(item, item_constant(kind, part)) for part in registers])
    return getattr(result, "value", result)


def item_constant(kind, number):
    """A Python number as the constant of a component."""
    return int(number) if is_mask(kind.kind) else float(number)


def from_registers(context, builder, kind, registers):
    """A value of the registers of its components."""
    value = ir.Constant(context.get_value_type(kind), ir.Undefined)
    for i, part in enumerate(registers):
        value = builder.insert_value(value, part, i)
    return value


def components(builder, register):
    """The registers of a value's components."""
    return [builder.extract_value(register, i) for i in range(register.type.count)]


@lower_builtin(ConstructorType, types.VarArg(types.Any))
def _construct(context, builder, signature, args):
    kind = signature.return_type
    if len(args) == 1 and isinstance(signature.args[0], ValueType):
        return args[0]
    if kind.kind.halves is not None:
        args = [part for half in args for part in components(builder, half)]
    return from_registers(context, builder, kind, args)


# -- from and to plain Python ------------------------------------------------------------------------------------------
@typeof_impl.register(Value)
def _typeof_value(value, c):
    return ValueType(type(value))


@typeof_impl.register(ValueClass)
def _typeof_class(kind, c):
    return ConstructorType(kind)


@lower_constant(ConstructorType)
def _constant_class(context, builder, kind, value):
    return context.get_dummy_value()


@lower_constant(ValueType)
def _constant_value(context, builder, kind, value):
    item = context.get_value_type(kind.item)
    parts = [ir.Constant(item, item_constant(kind, part)) for part in value.parts()]
    return ir.Constant(context.get_value_type(kind), parts)


@unbox(ValueType)
def _unbox_value(kind, value, c):
    numbers = []
    for i in range(kind.kind.count):
        number = c.pyapi.number_float(c.pyapi.tuple_getitem(value, i))
        part = c.pyapi.float_as_double(number)
        numbers.append(c.builder.fcmp_ordered("!=", part, ir.Constant(part.type, 0.0)) if is_mask(kind.kind) else part)
        c.pyapi.decref(number)
    return NativeValue(from_registers(c.context, c.builder, kind, numbers))


@box(ValueType)
def _box_value(kind, register, c):
    items = [c.box(kind.item, part) for part in components(c.builder, register)]
    row = c.pyapi.tuple_pack(items)
    made = c.pyapi.call_function_objargs(c.pyapi.unserialize(c.pyapi.serialize_object(kind.kind.of)), [row])
    for item in (*items, row):
        c.pyapi.decref(item)
    return made
