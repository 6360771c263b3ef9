"""What can be looked at in a stopped run, by name: outputs, inputs, states and parameters, whole or number by number.

``controller.funnel.attitude_xi[0]``, ``controller.funnel``, ``funnel.attitude_xi`` where one component alone has such an
output, ``controller.state.integral``, ``controller.parameters.lambda_a``, ``controller``.
"""

from dataclasses import dataclass

import numpy as np

from flight_graph.components import names
from flight_graph.engines.schedule import Schedule
from flight_graph.errors import FlightError, unknown
from flight_graph.faults import places


@dataclass(frozen=True)
class Found:
    """A record of a run, or a field of it. array: its name in the memory; path: of the field, empty for the record."""

    array: str
    path: str
    dtype: np.dtype

    def view(self, arrays: dict[str, np.ndarray]) -> np.ndarray:
        """The numbers of a field, where they lie in the memory."""
        field = places.entry(self.dtype, self.path, self.path)
        body = arrays[self.array].view("u1").reshape(-1)
        return body[field.offset:field.offset + field.count * field.dtype.itemsize].view(field.dtype)

    def read(self, arrays: dict[str, np.ndarray]):
        """The value: a number, an array, or of a record a dictionary."""
        if not self.path:
            return plain(arrays[self.array][0])
        values = self.view(arrays)
        return values[0].item() if len(values) == 1 else values.copy()


def plain(record) -> dict:
    """A record as a dictionary of numbers, arrays and dictionaries; what is not named (padding) is left out."""
    found = {}
    for name in record.dtype.names:
        value = record[name]
        found[name] = plain(value) if value.dtype.names and not value.dtype.shape else (
            value.copy() if np.ndim(value) else value.item())
    return found


def find(text: str, schedule: Schedule, where: str = "print") -> Found:
    """The record or field of a name. Raises FlightError with the nearest names."""
    nodes = schedule.graph.nodes
    name, rest = names.split(text.strip().replace(" ", ""), nodes)
    if name not in nodes:
        owners = [node for node in nodes if name.partition("[")[0] in nodes[node].component.outputs]
        if len(owners) != 1:
            ports = {port for node in nodes.values() for port in node.component.outputs}
            raise unknown("component", name, {*nodes, *ports}, where) if not owners else FlightError(
                f"{where}: {' and '.join(owners)} have an output {name}; write {owners[0]}.{text}")
        name, rest = owners[0], f"{name}.{rest}" if rest else name
    component = nodes[name].component
    port, _, path = rest.partition(".")
    if port in component.outputs:
        found = Found(schedule.shown(name, port), path, component.outputs[port].dtype)
    elif port in component.inputs:
        found = Found(schedule.read_by(nodes[name], port), path, component.inputs[port].dtype)
    elif port in ("state", "parameters"):
        found = Found(f"{'X' if port == 'state' else 'P'}_{name}", path, getattr(component, port).dtype)
    else:
        known = [*component.outputs, *component.inputs, "state", "parameters"]
        if not port:
            raise FlightError(f"{where}: what of {name}? It has {', '.join(known)}")
        raise unknown("record", port, known, f"{where}: {name}")
    if path:
        places.entry(found.dtype, path, f"{where}: {name}.{port}")
    return found


def every_name(schedule: Schedule) -> list[str]:
    """All that can be looked at."""
    found = []
    for name, node in schedule.graph.nodes.items():
        component = node.component
        for kind in ("state", "parameters"):
            found += [f"{name}.{kind}"] + [f"{name}.{kind}.{entry}" for entry in getattr(component, kind).dtype.names or ()]
        for port, signal in [*component.outputs.items(), *component.inputs.items()]:
            found += [f"{name}.{port}"] + [f"{name}.{port}.{path}" for path, _, _, _ in signal.leaves()]
    return found


def node_and_port(found: Found, schedule: Schedule) -> tuple[str, str]:
    """Whose record it is; of states and parameters the port is empty."""
    whole = found.array[2:]
    node, _, port = whole.rpartition(".")
    return (whole, "") if whole in schedule.graph.nodes else (node, port)


def unit(found: Found, schedule: Schedule) -> str:
    """The unit of a field, in brackets; empty where none is declared."""
    name = found.path.partition("[")[0]
    node, port = node_and_port(found, schedule)
    component = schedule.graph.nodes[node].component
    if not port:
        entries = (component.state if found.array.startswith("X_") else component.parameters).entries
        declared = entries[name].unit if name in entries else ""
    else:
        signal = (component.outputs | component.inputs)[port]
        quantities = {key: one for parts in signal.groups.values() for key, one in parts.items()}
        declared = quantities[name].unit if name in quantities else ""
    return f"[{declared}]" if declared else ""
