"""The numbers of a topic as lines to plot: those that belong together in one series, with unit and names."""

import re
from dataclasses import dataclass

import numpy as np

from flight_graph.bags.errors import BagError
from flight_graph.bags.export import UNITS_RECORD
from flight_graph.bags.fields import columns, definition_order
from flight_graph.bags.message_types import field_trees, vector_paths
from flight_graph.bags.reader import Bag
from flight_graph.bags.units import field_units
from flight_graph.viewers.quantities import TYPE, of_records, wire_layout

MOST_LINES = 12  # of a series; longer ones (matrices) are left to the person
_LEFT_OUT = re.compile(r"(^|\.)(header|stamp)\.|covariance")  # times, and what stands beside the numbers
_ENTRY = re.compile(r"(\.[xyzw]|\[\d+\])$")
_POSES = "tf2_msgs/msg/TFMessage"  # these are the picture
_ANGLES = {"position": "rad", "velocity": "rad/s", "effort": "N m"}  # of joints that turn


@dataclass(frozen=True)
class Line:
    """One number. path: in the message, as viewers write it; label: for a person; curve: as PlotJuggler names it."""

    path: str
    label: str
    curve: str


@dataclass(frozen=True, eq=False)
class Series:
    """Numbers of a topic that belong together. values: (n, k), a column a line."""

    topic: str
    name: str
    unit: str
    lines: tuple[Line, ...]
    values: np.ndarray

    @property
    def key(self) -> str:
        """What layouts call it."""
        return f"{self.topic}.{self.name}"

    @property
    def title(self) -> str:
        """What a plot of it is called."""
        return f"{self.topic}  {self.name}" + (f" [{self.unit}]" if self.unit else "")


def series_of_bag(bag: Bag, topic: str) -> list[Series]:
    """The series of a topic of a bag. Raises BagError where it cannot be decoded."""
    info = bag.topic(topic)
    trees = bag.field_trees(topic)
    return _series(topic, info.type_name, trees, bag[topic], bag.constants(topic).get("name"),
                   bag.metadata.get(UNITS_RECORD, {}))


def series_of_signal(topic: str, signal, units: dict[str, str]) -> list[Series]:
    """The series of a topic that carries a signal, without values."""
    layout = wire_layout(signal)
    trees = field_trees(signal.type_name, "", "")
    return _series(topic, signal.type_name, trees, np.zeros(0, layout.dtype), layout.constants.get("name"), units)


def _series(topic, type_name, trees, array, names, units):
    if type_name == TYPE and (found := of_records(topic, array.dtype, names, units)):
        return [_of_quantity(quantity, names, array) for quantity in found if len(quantity.indices) <= MOST_LINES]
    return list(_of_fields(topic, type_name, trees, array))


def _of_quantity(quantity, names, array):
    plain = quantity.labels or ([quantity.name] if len(quantity.indices) == 1 else
                                [f"{quantity.name}[{number}]" for number in range(len(quantity.indices))])
    lines = tuple(Line(f"{quantity.field}[{index}]", label, f"{quantity.topic}/{names[index]}/{quantity.field}")
                  for index, label in zip(quantity.indices, plain))
    unit = quantity.unit or (_ANGLES[quantity.field] if quantity.labels else "")
    return Series(quantity.topic, quantity.name, unit, lines, quantity.values(array).astype(float))


def _of_fields(topic, type_name, trees, array):
    known, vectors = field_units(trees, type_name), vector_paths(trees, type_name)
    order = definition_order(trees, type_name)
    groups = {}
    found = columns(array, lambda path, length: path in vectors)
    for name, path, values in sorted(found, key=lambda column: order.get(column[1], len(order))):
        if values.dtype.kind in "fiub" and not _LEFT_OUT.search(name):
            groups.setdefault(_ENTRY.sub("", name), []).append((name, known.get(path, ""), values))
    for group, members in groups.items():
        if len(members) <= MOST_LINES:
            lines = tuple(Line(name, name, f"{topic}/{name.replace('.', '/')}") for name, _, _ in members)
            numbers = np.stack([values.astype(float) for _, _, values in members], axis=1)
            yield Series(topic, group, members[0][1], lines, numbers)


def all_series(bag: Bag) -> tuple[list[Series], dict[str, str]]:
    """All that can be plotted of a bag, and topic -> sentence of what cannot be read."""
    found, problems = [], {}
    for topic, info in bag.topics.items():
        if info.count and info.type_name != _POSES:
            try:
                found += series_of_bag(bag, topic)
            except BagError as error:
                problems[topic] = str(error)
    return found, problems
