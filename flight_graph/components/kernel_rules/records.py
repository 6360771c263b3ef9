"""The kinds of a part's arguments: parameters, state and messages, field by field."""

from flight_graph.components.kernel_rules.kinds import Array, Number, Record, Value
from flight_math.values.views import NO_KINDS, Kinds
from msg_schemas.signal import Signal

TIME = Number(int)


def parameters(component, views: bool) -> Record:
    """The record p of a component. views: the part reads its fields as values."""
    return _declared(component.parameters, "parameters", views)


def state(component, views: bool) -> Record:
    """The record x of a component."""
    return _declared(component.state, "state", views)


def message(signal: Signal, kinds: Kinds, role: str) -> Record:
    """The record of a port. kinds: its fields that are values; role: input or output."""
    return _message(signal.dtype, signal.type_name, role, kinds)


def _declared(cls, role, views):
    fields = {name: Number({"f": float, "i": int, "b": bool}[cls.dtype[name].kind]) for name, _ in cls.RESERVED}
    for name, entry in cls.entries.items():
        if entry.kind != "text":
            fields[name] = _entry(entry, role, views)
    texts = tuple(name for name, entry in cls.entries.items() if entry.kind == "text")
    return Record(cls.__name__, role, fields, texts)


def _entry(entry, role, views):
    if entry.value is not None and views:
        return Value(entry.value)
    if entry.shape:
        return Array(tuple(entry.shape), role)
    return Number({"float": float, "bool": bool}.get(entry.kind, int), words=entry.words)


def _message(dtype, title, role, kinds):
    fields = {}
    for name in dtype.names:
        part, kind = dtype[name], kinds.by_name.get(name)
        if part.names:
            inner = "header" if "header" in (name, role) else role
            fields[name] = _message(part, f"{title}.{name}", inner, kind or NO_KINDS)
        elif kind is not None:
            fields[name] = Value(kind)
        elif part.shape:
            fields[name] = Array(tuple(part.shape), role)
        else:
            fields[name] = Number({"f": float, "b": bool}.get(part.kind, int))
    return Record(title, role, fields)
