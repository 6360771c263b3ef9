"""The numbers of a topic as lines over time: those that belong together in one series, with name and unit.

``/cubli/imu.angular_velocity`` has the lines x, y and z, ``/cubli/truth.angles`` those that the message names ``angles[0]``
to ``angles[2]``, ``/cubli/wheel_command.effort`` one a wheel. Plots, reports and viewers take numbers and names from here.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flight_graph.bags.export import UNITS_RECORD
from flight_graph.bags.fields import columns, definition_order, entry_names, named
from flight_graph.bags.layout import Layout, fixed_layout
from flight_graph.bags.message_types import field_trees, vector_paths
from flight_graph.bags.reader import Bag
from flight_graph.bags.units import JOINT_UNITS, field_units

NAMED = "sensor_msgs/msg/JointState"  # the message that names its numbers
JOINTS = "joint_states"  # what ROS calls a topic of joints
_BOOKKEEPING = re.compile(r"(?:.*\.)?(?:header\.)?stamp\.(?:sec|nanosec)|(?:.*\.)?header\.seq")  # fields of every message
_PARTS = re.compile(r"(.*?)(\.[xyzw]|\[[^\[\]]*\])")
_COUNTED = re.compile(r"(.+)(\[\d+\])")


@dataclass(frozen=True, eq=False)
class Line:
    """One number over time. path: in the message, as viewers count (``position[6]``); own: the message's own name of the
    entry, "" where it has none; entry: within the series (``[0]``, ``.x``, ``[wheel_x]``, "" of a single one)."""

    path: str
    entry: str
    values: np.ndarray  # (n,)
    own: str = ""

    @property
    def column(self) -> str:
        """As `flight_graph.bags.export` names it: ``position[angles[0]]``."""
        return f"{self.path.partition('[')[0]}[{self.own}]" if self.own else self.path


@dataclass(frozen=True, eq=False)
class Series:
    """Numbers of a topic that belong together. unit: "" where none is known; t: (n,) [s]; are_joints: a line a joint."""

    topic: str
    name: str
    unit: str
    t: np.ndarray
    lines: tuple[Line, ...]
    are_joints: bool = False

    @property
    def key(self) -> str:
        """What a person and layouts call it: ``TOPIC.NAME``."""
        return f"{self.topic}.{self.name}"

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def labels(self) -> list[str]:
        """What each line is called by itself: ``angles[0]``, ``angular_velocity.x``, ``wheel_x``."""
        return [line.own if self.are_joints else f"{self.name}{line.entry}" for line in self.lines]

    @property
    def values(self) -> np.ndarray:
        """All numbers (n, k)."""
        return np.stack([line.values for line in self.lines], axis=1)

    @property
    def is_constant(self) -> bool:
        """Whether nothing of it ever changes."""
        return all(not len(line.values) or bool((line.values == line.values[0]).all()) for line in self.lines)


def series_of_bag(bag: Bag, topic: str, start_ns: int) -> list[Series]:
    """The series of a topic. start_ns: log time of t = 0. Raises BagError where it cannot be decoded."""
    info = bag.topic(topic)
    t = (bag.stamps_ns(topic) - start_ns) / 1e9
    units = bag.metadata.get(UNITS_RECORD, {})
    return list(_series(info.name, info.type_name, bag.field_trees(topic), bag[topic], entry_names(bag, topic), units, t))


def series_of_signal(topic: str, signal, units: dict[str, str]) -> list[Series]:
    """The series of a topic that carries a signal, without numbers. units: as a bag's record, ``topic:column`` -> unit."""
    layout = wire_layout(signal)
    trees, names = field_trees(signal.type_name, "", ""), layout.constants.get("name")
    return list(_series(topic, signal.type_name, trees, np.zeros(0, layout.dtype), names, units, np.zeros(0)))


def wire_layout(signal) -> Layout:
    """The layout of a signal's messages, by the fields of its message type."""
    return fixed_layout(field_trees(signal.type_name, "", ""), signal.type_name, signal.template)


def _series(topic, type_name, trees, array, names, units, t) -> Iterator[Series]:
    if type_name == NAMED and (fields := named_fields(array.dtype, names)):
        yield from of_names(topic, array, names, fields, units, t)
        return
    known, vectors = field_units(trees, type_name), vector_paths(trees, type_name)
    order = definition_order(trees, type_name)
    groups: dict[tuple, list] = {}
    found = columns(array, lambda path, length: path in vectors)
    for path, place, values in sorted(found, key=lambda column: order.get(column[1], len(order))):
        if values.dtype.kind in "fiub" and not _BOOKKEEPING.fullmatch(path):
            column = named(path, names or [])
            parts = _PARTS.fullmatch(path)
            name, entry = (parts[1], parts[2]) if parts else (path, "")
            unit = units.get(f"{topic}:{column}") or known.get(place, "")
            groups.setdefault((name, unit), []).append(Line(path, entry, values.astype(float, copy=False)))
    for (name, unit), lines in groups.items():
        yield Series(topic, name, unit, t, tuple(lines))


def named_fields(dtype: np.dtype, names) -> list[str]:
    """The lists of a JointState that hold a number for each of its names; none where the names tell nothing."""
    if not isinstance(names, list) or not names or len(set(names)) < len(names):
        return []
    return [field for field in JOINT_UNITS if field in (dtype.names or ()) and dtype[field].shape == (len(names),)]


def of_names(topic, array, names, fields, units, t):
    """The series of an array of JointStates. fields: those of `named_fields`.

    Entries ``xi[0]``, ``xi[1]`` are one series. Other names stand for themselves in a list of numbers; they are joints, and
    each list is a series, where there are velocities or efforts beside the positions, or the topic says so.
    """
    are_numbers = fields == ["position"] and topic.rpartition("/")[2] != JOINTS
    for field in fields:
        groups: dict[str, list] = {}
        for index, own in enumerate(names):
            counted = _COUNTED.fullmatch(own)
            name = counted[1] if counted else own if are_numbers else field
            entry = counted[2] if counted else "" if are_numbers else f"[{own}]"
            path = f"{field}[{index}]"
            groups.setdefault(name, []).append(Line(path, entry, array[field][:, index].astype(float, copy=False), own))
        for name, lines in groups.items():
            are_joints = name == field and not are_numbers and all(line.entry == f"[{line.own}]" for line in lines)
            title = name if are_joints or len(fields) == 1 else f"{name}_{field}"
            unit = units.get(f"{topic}:{lines[0].column}") or (JOINT_UNITS[field] if are_joints else "")
            yield Series(topic, title, unit, t, tuple(lines), are_joints)
