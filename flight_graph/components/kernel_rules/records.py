"""The kinds of a part's arguments: parameters, state and messages, field by field."""

import numpy as np

from flight_graph.components.kernel_rules.kinds import Array, Number, Record, Value
from flight_graph.components.placement import Placement
from flight_math.values.views import NO_KINDS, Kinds, View, is_value_class, reads_as
from msg_schemas.signal import Signal

TIME = Number(int)


def parameters(component) -> Record:
    """The record p of a component."""
    return _declared(component.parameters, "parameters")


def state(component) -> Record:
    """The record x of a component."""
    return _declared(component.state, "state")


def placement() -> Record:
    """The record of the part ``place``."""
    return _declared(Placement, "input")


def message(signal: Signal, kinds: Kinds, role: str) -> Record:
    """The record of a port. kinds: its fields that are values; role: input or output."""
    return _message(signal.dtype, signal.type_name, role, kinds)


def _declared(cls, role):
    words = {name: entry.words for name, entry in cls.entries.items()}
    fields = {name: _field(cls.dtype, cls.kinds, name, role, cls.__name__, words.get(name, ()))
              for name in cls.dtype.names}
    texts = tuple(name for name, entry in cls.entries.items() if entry.kind == "text")
    return Record(cls.__name__, role, fields, texts)


def _message(dtype, title, role, kinds):
    return Record(title, role, {name: _field(dtype, kinds, name, role, title) for name in dtype.names})


def _field(dtype, kinds, name, role, title, words=()):
    """The kind of a field, as views read it."""
    read = reads_as(dtype, kinds, name)
    if read is View:
        inner = "header" if "header" in (name, role) else role
        return _message(dtype[name], f"{title}.{name}", inner, kinds.by_name.get(name) or NO_KINDS)
    if read is np.ndarray:
        return Array(dtype[name].shape, role)
    return Value(read) if is_value_class(read) else Number(read, words=words)
