"""Bodies that are put elsewhere while a graph runs, by events: ``{at_s: 20, place: {plant: {velocity: [0.1, 0, 0]}}}``.

What moves is put before its first firing at the time or later, behind the parameters that are set and all that faults do
there. What is not given of its motion stays. Of two at the same time the later one in the list comes last. What the numbers
mean for its state its component declares (the part ``place``).
"""

from dataclasses import dataclass

import numpy as np

from flight_graph import yaml_text
from flight_graph.components import placement
from flight_graph.errors import FlightError, unknown
from flight_graph.text_files import short
from flight_graph.timebase import SECOND


@dataclass(frozen=True)
class Placed:
    """Where one body is put at ``begin_ns``. given: in plain form; record: (1,) for the part ``place``."""

    begin_ns: int
    given: dict
    record: np.ndarray

    @classmethod
    def of(cls, begin_ns: int, given: dict) -> "Placed":
        """A placement of what was checked (`require`)."""
        return cls(begin_ns, given, placement.record_of(given))


def found(entries, nodes: dict, where: str) -> dict[str, list[Placed]]:
    """node -> where it is put, in the order of time. entries: of a scenario's ``events``. Raises FlightError."""
    made = {}
    for number, entry in sorted(enumerate(entries), key=lambda item: item[1].at_s):
        for name, given in (entry.place or {}).items():
            given = require(nodes, name, given, f"{where}[{number}].place")
            made.setdefault(name, []).append(Placed.of(round(entry.at_s * SECOND), given))
    return made


def require(nodes: dict, name: str, given: dict, where: str) -> dict:
    """What is given of a body's motion, in plain form. Raises FlightError where there is no such body, or it is wrong."""
    movable = [one for one, node in nodes.items() if node.component.place is not None]
    if name not in nodes:
        raise unknown("component that moves", str(name), movable, where)
    if name not in movable:
        raise FlightError(f"{where}: {name} cannot be put elsewhere (it declares no part 'place'); allowed: "
                          f"{', '.join(movable) or 'none here'}")
    return placement.checked(given, f"{where}.{name}")


def parse(text: str, where: str) -> dict[str, dict]:
    """``plant.velocity=[0.1, 0, 0]; plant.orientation=[0, 0, 0, 1]`` as component -> quantities. Raises FlightError."""
    made = {}
    for part in filter(None, map(str.strip, text.split(";"))):
        key, equals, value = part.partition("=")
        name, _, quantity = key.strip().rpartition(".")
        if not equals or not name:
            raise FlightError(f"{where}: '{short(part)}': write COMPONENT.QUANTITY=[NUMBERS], as plant.velocity=[1, 0, 0]; "
                              "several with a semicolon between")
        made.setdefault(name, {})[quantity] = yaml_text.parse(value, f"{where}: {short(key)}")
    return made


def as_entry(node: str, begin_ns: int, given: dict) -> dict:
    """A placement as an entry of a scenario's ``events``."""
    return {"at_s": begin_ns / SECOND, "place": {node: given}}
