"""Numbers under their names in a stream: each series of a topic of named numbers as a topic with a message type of its own.

Viewers of ROS messages count such numbers (``position[6]``). Here ``/cubli/funnel/attitude_xi`` carries
``float64[3] value``, ``/cubli/wheel_command/effort`` a field a wheel.
"""

import re
from dataclasses import dataclass

import numpy as np

from flight_graph.bags.series import Series
from flight_graph.timebase import stamp_parts

PACKAGE = "flight_graph"
_STAMP = "\n".join(("=" * 80, "MSG: builtin_interfaces/Time", "int32 sec", "uint32 nanosec", ""))


@dataclass(frozen=True)
class TypedTopic:
    """A series as a topic. topic, name, unit: of the series; joints: the name of each of its numbers, empty where they are
    counted; count: how many there are."""

    topic: str
    name: str
    unit: str
    count: int
    joints: tuple[str, ...] = ()

    @classmethod
    def of(cls, series: Series) -> "TypedTopic":
        """The topic of a series."""
        return cls(series.topic, series.name, series.unit, len(series.lines),
                   tuple(series.labels) if series.are_joints else ())

    @property
    def own_topic(self) -> str:
        """What it is called."""
        return f"{self.topic}/{_word(self.name)}"

    @property
    def type_name(self) -> str:
        """Its message type: its name as one word."""
        words = re.split(r"[^A-Za-z0-9]+", self.own_topic.strip("/"))
        return f"{PACKAGE}/msg/" + "".join(word[:1].upper() + word[1:] for word in words)

    @property
    def fields(self) -> list[str]:
        """The fields of its messages."""
        if not self.joints:
            return ["value"]
        words = [_word(joint) for joint in self.joints]
        return words if len(set(words)) == len(words) and "stamp" not in words else [
            f"number_{index}" for index in range(len(words))]

    @property
    def definition(self) -> str:
        """The text of its message type, as ROS 2 writes it, with what it needs."""
        kind = "float64" if self.joints or self.count == 1 else f"float64[{self.count}]"
        said = [f"# {self.name} of {self.topic}" + (f" [{self.unit}]" if self.unit else ""),
                "builtin_interfaces/Time stamp", *(f"{kind} {field}" for field in self.fields)]
        return "\n".join(said) + "\n" + _STAMP

    def payloads(self, stamps_ns: np.ndarray, values: np.ndarray) -> np.ndarray:
        """The messages (n, size) uint8 of the numbers (n, count). stamps_ns: (n,) for their ``stamp``."""
        rows = np.zeros(len(values), np.dtype([("head", "u1", 4), ("sec", "<i4"), ("nanosec", "<u4"),
                                               ("values", "<f8", self.count)]))
        rows["head"] = (0, 1, 0, 0)
        rows["sec"], rows["nanosec"] = stamp_parts(np.asarray(stamps_ns))
        rows["values"] = values.reshape(rows["values"].shape)
        return rows.view("u1").reshape(len(rows), -1)


def _word(text: str) -> str:
    """A name as a field of a ROS message: lower case, digits, single underscores, a letter first."""
    word = re.sub(r"_+", "_", re.sub(r"[^a-z0-9]", "_", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text).lower())).strip("_")
    return word if word[:1].isalpha() else f"n_{word}".rstrip("_")
