"""Numbers under their names: what a topic of named numbers (a JointState's lists) holds, one quantity after the other.

Viewers of ROS messages count such numbers (``position[6]``). Here each quantity has a name of its own, and a typed message
of its own: ``/cubli/funnel/attitude_xi`` carries ``float64[3] value``, ``/cubli/wheel_command/effort`` a field a wheel.
"""

import re
from dataclasses import dataclass

import numpy as np

from flight_graph.bags.layout import Layout, fixed_layout
from flight_graph.bags.message_types import field_trees
from flight_graph.timebase import stamp_parts

FIELDS = ("position", "velocity", "effort")  # the lists of a JointState, in its order
TYPE = "sensor_msgs/msg/JointState"
PACKAGE = "flight_graph"
_ENTRY = re.compile(r"(.+)\[(\d+)\]")
_STAMP = "\n".join(("=" * 80, "MSG: builtin_interfaces/Time", "int32 sec", "uint32 nanosec", ""))


@dataclass(frozen=True)
class Quantity:
    """Numbers of a topic that belong together. field, indices: where they stand in the message; labels: one a number, empty
    where they are counted (x[0], x[1]) or there is one alone."""

    topic: str
    field: str
    name: str
    indices: tuple[int, ...]
    labels: tuple[str, ...] = ()
    unit: str = ""

    @property
    def own_topic(self) -> str:
        """The topic of its typed messages."""
        return f"{self.topic}/{_word(self.name)}"

    @property
    def type_name(self) -> str:
        """The name of its typed message: that of its topic, as one word."""
        words = re.split(r"[^A-Za-z0-9]+", self.own_topic.strip("/"))
        return f"{PACKAGE}/msg/" + "".join(word[:1].upper() + word[1:] for word in words)

    @property
    def fields(self) -> list[str]:
        """The fields of its typed message."""
        if not self.labels:
            return ["value"]
        words = [_word(label) for label in self.labels]
        return words if len(set(words)) == len(words) and "stamp" not in words else [
            f"number_{index}" for index in range(len(words))]

    @property
    def definition(self) -> str:
        """The text of its message type, as ROS 2 writes it, with what it needs."""
        kind = "float64" if self.labels or len(self.indices) == 1 else f"float64[{len(self.indices)}]"
        said = [f"# {self.name} of {self.topic}" + (f" [{self.unit}]" if self.unit else ""),
                "builtin_interfaces/Time stamp", *(f"{kind} {field}" for field in self.fields)]
        return "\n".join(said) + "\n" + _STAMP

    @property
    def paths(self) -> list[tuple[str, str]]:
        """(path in its typed message, label) of each number."""
        if self.labels:
            return list(zip(self.fields, self.labels))
        if len(self.indices) == 1:
            return [("value", self.name)]
        return [(f"value[{index}]", f"{self.name}[{index}]") for index in range(len(self.indices))]

    def values(self, records: np.ndarray) -> np.ndarray:
        """The numbers (n, k) of n messages as records."""
        return np.asarray(records[self.field])[:, list(self.indices)]

    def payloads(self, stamps_ns: np.ndarray, records: np.ndarray) -> np.ndarray:
        """The typed messages (n, size) uint8 of n records. stamps_ns: (n,) for their ``stamp``."""
        rows = np.zeros(len(records), np.dtype([("head", "u1", 4), ("sec", "<i4"), ("nanosec", "<u4"),
                                                ("values", "<f8", len(self.indices))]))
        rows["head"] = (0, 1, 0, 0)
        rows["sec"], rows["nanosec"] = stamp_parts(np.asarray(stamps_ns))
        rows["values"] = self.values(records)
        return rows.view("u1").reshape(len(rows), -1)


def quantities(topic: str, names: list[str], filled, units: dict | None = None) -> list[Quantity]:
    """The quantities of a topic. names: of its entries; filled: which of `FIELDS` hold numbers; units: see `Units`.

    Entries ``xi[0], xi[1]`` are one quantity. Names without a number stand for themselves where only ``position`` is filled
    (a list of numbers); otherwise they name joints, and each field is a quantity.
    """
    units, found = units or {}, []
    for field in filled:
        groups: dict[str, list[int]] = {}
        for index, name in enumerate(names):
            entry = _ENTRY.fullmatch(name)
            groups.setdefault(entry[1] if entry else name if tuple(filled) == ("position",) else field, []).append(index)
        for name, indices in groups.items():
            counted = all(_ENTRY.fullmatch(names[index]) for index in indices) or len(groups) > 1 and len(indices) == 1
            own = units.get(f"{topic}:{field}[{names[indices[0]]}]", "")
            title = name if name == field or len(tuple(filled)) == 1 else f"{name}_{field}"
            found.append(Quantity(topic, field, title, tuple(indices), () if counted else tuple(
                names[index] for index in indices), own))
    return found


def of_records(topic: str, dtype: np.dtype, names, units: dict | None = None) -> list[Quantity]:
    """The quantities of a topic whose messages have this layout and these names; none where it has none."""
    if not isinstance(names, list) or not names or len(set(names)) < len(names):
        return []
    filled = [field for field in FIELDS if field in (dtype.names or ()) and dtype[field].shape == (len(names),)]
    return quantities(topic, names, filled, units)


def of_signal(topic: str, signal, units: dict | None = None) -> list[Quantity]:
    """The quantities of a topic that carries a signal."""
    if signal.type_name != TYPE:
        return []
    layout = wire_layout(signal)
    return of_records(topic, layout.dtype, layout.constants.get("name"), units)


def wire_layout(signal) -> Layout:
    """The layout of a signal's messages, by the fields of its message type."""
    return fixed_layout(field_trees(signal.type_name, "", ""), signal.type_name, signal.template)


def _word(text: str) -> str:
    """A name as a field of a ROS message: lower case, digits, single underscores, a letter first."""
    word = re.sub(r"_+", "_", re.sub(r"[^a-z0-9]", "_", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text).lower())).strip("_")
    return word if word[:1].isalpha() else f"n_{word}".rstrip("_")
