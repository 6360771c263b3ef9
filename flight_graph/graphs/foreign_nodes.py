"""Foreign nodes: components of a scenario that stand for nodes that are not ours, of any language and any author.

    controller: {use: foreign, rate_hz: 100, inputs: {attitude: cubli/attitude}, outputs: {command: cubli/wheel_command}}

What travels is what the graph knows: a topic carries the signal of those who publish or read it there, else that of
`msg_schemas`. Only nodes can fly such a scenario; from its bag it is run again with the messages that were recorded.
"""

import importlib
import pkgutil
from typing import ClassVar

import msg_schemas
from flight_graph.components.component import Component
from flight_graph.components.findings import ComponentMistake
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs.graph import Node
from flight_graph.graphs.scenario_file import FOREIGN, FOREIGN_KEYS, ComponentEntry
from msg_schemas.signal import Signal

ANSWER_WITHIN_S = 5.0  # [s of wall time]


class ForeignNode(Component):
    """A node that is not ours."""

    is_foreign = True
    answer_within_s: ClassVar[float] = ANSWER_WITHIN_S
    late: ClassVar[str] = "stop"


def node(name: str, entry: ComponentEntry, others: list[Node], where: str) -> Node:
    """The node of an entry with ``use: foreign``. others: the graph's own. Raises FlightError."""
    if entry.parameters:
        raise FlightError(f"{where}.parameters: a foreign node's parameters are its own; set them where it is started")
    if entry.rate_hz is None:
        raise FlightError(f"{where}.rate_hz is missing: how often does this foreign node answer?")
    if not (entry.inputs or entry.outputs):
        raise FlightError(f"{where}: a foreign node has inputs, outputs or both, as outputs: {{command: a/topic}}")
    both = sorted((entry.inputs or {}).keys() & (entry.outputs or {}))
    if both:
        raise FlightError(f"{where}: {', '.join(both)}: inputs and outputs at once; each port has a name of its own")
    said, heard = _signals(others, "outputs"), _signals(others, "inputs")
    ports = {"inputs": _ports(entry.inputs, said | heard, f"{where}.inputs"),
             "outputs": _ports(entry.outputs, heard | said, f"{where}.outputs")}
    declared = {"__doc__": ForeignNode.__doc__, "__module__": __name__, **ports, "rate_hz": float(entry.rate_hz),
                "late": entry.late or ForeignNode.late, "answer_within_s": float(entry.answer_within_s or ANSWER_WITHIN_S)}
    try:
        found = type("Foreign", (ForeignNode,), declared)
    except ComponentMistake as error:  # which names this file; the mistake stands in the scenario's
        raise FlightError(f"{where}.{str(error).partition(': Foreign.')[2]}") from None
    return Node(name, FOREIGN, found, {}, entry.rate_hz)


def stand_in_of(name: str) -> str:
    """The ROS node that stands in for a foreign node in lockstep, see `flight_graph.ros.stand_in`. It is one of the whole
    graph, also where the foreign node is in a vehicle.
    """
    return f"{name.replace('.', '_')}_stand_in"


def check_stand_ins(nodes: list[Node], vehicles, where: str) -> None:
    """Refuse a component, a vehicle or a second foreign node that takes the name of a stand-in. Raises FlightError."""
    taken = {one.name for one in nodes} | {*vehicles}
    for one in nodes:
        if one.is_foreign:
            if stand_in_of(one.name) in taken:
                raise FlightError(f"{where}: the name {stand_in_of(one.name)} is taken by the stand-in of the foreign node "
                                  f"{one.name}; take another")
            taken.add(stand_in_of(one.name))


def refuse_keys(entry: ComponentEntry, where: str) -> None:
    """Refuse what only foreign nodes have. Raises FlightError."""
    if given := [key for key in FOREIGN_KEYS if getattr(entry, key) is not None]:
        raise FlightError(f"{where}: {' and '.join(given)}: of a foreign node (use: foreign) alone; {entry.use} declares "
                          "its ports itself")


def entry_of(found: Node) -> dict:
    """A foreign node as a scenario file says it."""
    component = found.component
    return {"use": FOREIGN, "rate_hz": found.rate_hz, "answer_within_s": component.answer_within_s, "late": component.late,
            "inputs": {port: signal.topic for port, signal in component.inputs.items()},
            "outputs": {port: signal.topic for port, signal in component.outputs.items()}}


def _signals(nodes, side) -> dict[str, Signal]:
    return {signal.topic: signal for one in nodes for signal in getattr(one.component, side).values()}


def _ports(topics, known, where) -> dict[str, Signal]:
    found = {}
    for port, topic in (topics or {}).items():
        topic = topic.lstrip("/")
        signal = known.get(topic) or _declared().get(topic)
        if signal is None:
            raise unknown("topic", topic, {*known, *_declared()}, f"{where}.{port}")
        found[port] = signal
    return found


def _declared() -> dict[str, Signal]:
    """topic -> signal, of all that the packages declare."""
    found = {}
    for module in pkgutil.iter_modules(msg_schemas.__path__, "msg_schemas."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, Signal):
                found.setdefault(value.topic, value)
    return found
