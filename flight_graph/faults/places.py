"""Places in a graph, as text: ``imu.imu.angular_velocity[2]``, ``plant <- command.effort[2]``, ``controller``.

A field is named as in the record: the message's own names, the names of its quantities, the entries of states and
parameters. Nodes are taken as they are in a graph: with ``component``, ``inputs``, ``period_ns`` and ``output_period_ns``.
"""

import re
from dataclasses import dataclass

import numpy as np

from flight_graph.components import names
from flight_graph.errors import FlightError, unknown
from flight_graph.faults import fault_types as types
from flight_graph.text_files import short

_STEP = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)((?:\[[0-9]+\])*)")
_ARROW = "<-"
_FORMS = ("component.output.field[i], reader <- input.field[i], component.state.entry[i], component.parameters.entry[i], "
          "component.output, reader <- input, or component")


@dataclass(frozen=True)
class Field:
    """Numbers in a record: offset [bytes] of the first, their dtype, how many follow each other."""

    offset: int
    dtype: np.dtype
    count: int


@dataclass(frozen=True)
class Place:
    """Where something happens. kind: one of `fault_types`; node: whose firing it belongs to; port: of the signal.

    field: the numbers, None for whole messages and components; path: the field as text.
    """

    kind: str
    node: str
    port: str = ""
    field: Field | None = None
    path: str = ""

    def meets(self, other: "Place") -> bool:
        """Whether both are of the same numbers, messages or component."""
        if (self.kind, self.node, self.port) != (other.kind, other.node, other.port):
            return False
        if self.field is None:
            return True
        mine, theirs = ((one.offset, one.offset + one.count * one.dtype.itemsize) for one in (self.field, other.field))
        return mine[0] < theirs[1] and theirs[0] < mine[1]


def place(text: str, nodes: dict, where: str) -> Place:
    """The place that a text names in a graph. nodes: name, as the text has it -> node.

    Raises FlightError with the nearest names.
    """
    if _ARROW in text:
        reader, _, rest = (part.strip() for part in text.partition(_ARROW))
        return _input(_node(reader, nodes, where), rest, where)
    name, rest = names.split(text.strip(), nodes)
    node = _node(name, nodes, where)
    if not rest:
        return Place(types.COMPONENT, node.name)
    first, _, path = rest.partition(".")
    if first in node.component.outputs and not _is_own(node.component, first, path):
        return _signal(types.OUTPUT, types.OUTPUT_MESSAGE, node, first, node.component.outputs[first], path, where)
    if first == "state" and path:
        found = entry(node.component.state.dtype, path, f"{where}: {name}.state", ("fault",))
        return Place(types.STATE, node.name, "", found, path)
    if first == "parameters" and path:
        found = entry(node.component.parameters.dtype, path, f"{where}: {name}.parameters", ("period",))
        return Place(types.PARAMETER, node.name, "", found, path)
    if first in node.component.inputs:
        raise FlightError(f"{where}: {first} is an input of {name}; write '{name} {_ARROW} {rest}'")
    if first in ("state", "parameters"):
        entries = [known for known in getattr(node.component, first).dtype.names or () if known not in ("fault", "period")]
        raise FlightError(f"{where}: {name}.{first} is no number; name one of it: {', '.join(entries) or 'it has none'}")
    raise unknown("output", first, [*node.component.outputs, "state", "parameters"], f"{where}: {name}")


def _is_own(component, first, path) -> bool:
    """Whether ``parameters.NAME`` or ``state.NAME`` means the component's own, where an output has that name too."""
    own = {"parameters": component.parameters, "state": component.state}.get(first)
    found = _STEP.match(path)
    return own is not None and found is not None and found[1] in own.entries and (
        found[1] not in component.outputs[first].dtype.names)


def signal_field(signal, path: str, where: str) -> Field:
    """A field of a message by its path, without those of its stamp. Raises FlightError."""
    found = entry(signal.dtype, path, where)
    if path.startswith(signal.stamp_path):
        raise FlightError(f"{where}: {path} is the stamp; 'stale' and 'delay' are the faults of stamps")
    return found


def entry(dtype: np.dtype, path: str, where: str, hidden: tuple = ()) -> Field:
    """A field of a record by its path, ``covariance[3]`` or ``pose.position[0]``. Raises FlightError."""
    offset, at = 0, where
    steps = path.split(".")
    for number, text in enumerate(steps):
        found = _STEP.fullmatch(text)
        if not found:
            raise FlightError(f"{where}: '{short(path)}' is no field; write its names with dots, and [i] for one number")
        name, indices = found[1], [int(index) for index in re.findall("[0-9]+", found[2])]
        known = [known for known in dtype.names or () if known not in hidden]
        if name not in known:
            raise unknown("field", name, known, at)
        dtype, more = dtype.fields[name][:2]
        offset, at = offset + more, f"{at}.{name}"
        shape = dtype.shape
        if len(indices) > len(shape) or any(i >= size for i, size in zip(indices, shape)):
            sizes = " x ".join(map(str, shape)) or "one number"
            raise FlightError(f"{where}: {text} is not there: {name} has {sizes}{' entries' if shape else ''}")
        inner = shape[len(indices):]
        size = int(np.prod(inner, dtype=np.int64)) * dtype.base.itemsize
        for index, length in zip(indices, _strides(shape)):
            offset += index * length * dtype.base.itemsize
        dtype = np.dtype((dtype.base, inner)) if inner else dtype.base
        if number + 1 < len(steps) and inner:
            raise FlightError(f"{where}: {name} is an array; name one of it: {name}[0]")
    if dtype.base.names:
        raise FlightError(f"{where}: {short(path)} is no number; name one of it: {', '.join(dtype.base.names)}")
    return Field(offset, dtype.base, size // dtype.base.itemsize)


def _strides(shape):
    """How many numbers lie between neighbours of each dimension."""
    return [int(np.prod(shape[number + 1:], dtype=np.int64)) for number in range(len(shape))]


def _node(name, nodes, where):
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*", name):
        raise FlightError(f"{where}: '{short(name)}' is no component; a place is {_FORMS}")
    if name not in nodes:
        raise unknown("component", name, nodes, where)
    return nodes[name]


def _input(node, rest, where):
    port, _, path = rest.partition(".")
    if port not in node.component.inputs:
        raise unknown("input", port, node.component.inputs, f"{where}: {node.name}")
    return _signal(types.INPUT, types.INPUT_MESSAGE, node, port, node.component.inputs[port], path, where)


def _signal(numbers, messages, node, port, signal, path, where):
    if not path:
        return Place(messages, node.name, port)
    return Place(numbers, node.name, port, signal_field(signal, path, f"{where}: {node.name}.{port}"), path)
