"""Parameters that change while a graph runs: ``events: [{at_s: 20, set: {controller.lambda_a: 0.03}}]``.

A change holds from a component's first firing at its time or later. What follows from other parameters of the component
follows anew; what another component takes from it (``"= plant.gravity"``) was decided at the start and stays.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flight_graph.components import declared, names
from flight_graph.errors import FlightError, unknown
from flight_graph.timebase import SECOND


@dataclass(frozen=True)
class Change:
    """All parameters of one component from ``begin_ns`` on. given: those that were set; record: (1,) for its parts."""

    begin_ns: int
    given: dict
    values: dict
    record: np.ndarray


def sequence(node, given: list[tuple[int, dict, str]], folder: Path | None) -> list[Change]:
    """The changes of a node one upon the other. Raises FlightError.

    node: with ``name``, ``component``, ``values`` and ``period_ns``; given: (when [ns], parameter -> value, what error
    texts call it), in the order of time; folder: where a relative file name starts.
    """
    component, values, made = node.component, node.values, []
    for begin_ns, wanted, where in given:
        wanted = component.parameters.validate(wanted, where)
        values = declared.resolved(component, {**values, **wanted}, where, folder)
        for key, value in wanted.items():
            if values[key] != value:
                raise FlightError(f"{where}.{key}: it follows from other parameters and cannot be set")
        record = component.parameters.record(values, where)
        record["period"] = node.period_ns / SECOND
        made.append(Change(begin_ns, wanted, values, record))
    return made


def changes(entries, nodes: dict, where: str, folder: Path | None) -> dict[str, list[Change]]:
    """node -> its changes. entries: of a scenario's ``events``. Raises FlightError."""
    found, seen = {}, {}
    for number, entry in sorted(enumerate(entries), key=lambda item: item[1].at_s):
        here, begin_ns, by_node = f"{where}[{number}].set", round(entry.at_s * SECOND), {}
        for key, value in (entry.set or {}).items():
            name, parameter = names.split(key, nodes)
            _refuse(name, parameter, nodes, here)
            if seen.setdefault((key, begin_ns), number) != number:
                raise FlightError(f"{here}: {key} is set at {entry.at_s:g} s by {where}[{seen[key, begin_ns]}] as well")
            by_node.setdefault(name, {})[parameter] = value
        for name, given in by_node.items():
            found.setdefault(name, []).append((begin_ns, given, f"{here}: {name}"))
    return {name: sequence(nodes[name], given, folder) for name, given in found.items()}


def with_change(known: list[Change], node, begin_ns: int, given: dict) -> list[Change]:
    """The changes of a node with one that was made while it ran. Raises FlightError."""
    all_given = [*((one.begin_ns, one.given, node.name) for one in known), (begin_ns, given, node.name)]
    return sequence(node, sorted(all_given, key=lambda one: one[0]), None)


def as_entry(node: str, begin_ns: int, given: dict) -> dict:
    """A change as an entry of a scenario's ``events``."""
    return {"at_s": begin_ns / SECOND, "set": {f"{node}.{name}": value for name, value in given.items()}}


def _refuse(name, parameter, nodes, where):
    if name not in nodes:
        raise unknown("component", name, nodes, where)
    if parameter == "rate_hz":
        raise FlightError(f"{where}: {name}.rate_hz: the rates of a graph stay as they are; allowed: parameters")
    if parameter not in nodes[name].component.parameters.entries:
        raise unknown("parameter", parameter, nodes[name].component.parameters.entries, f"{where}: {name}")
