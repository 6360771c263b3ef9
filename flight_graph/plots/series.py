"""The numbers of a bag as lines over time, by the names that `flight export` gives them; no code of the bag runs.

A quantity is what belongs together: ``/cubli/imu.angular_velocity`` has the lines x, y and z, ``/cubli/truth.angles`` those
that the message names ``angles[0]`` to ``angles[2]``.
"""

import difflib
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flight_graph.bags.export import UNITS_RECORD, table
from flight_graph.bags.reader import Bag, read_bag
from flight_graph.errors import FlightError
from flight_graph.recordings.bag_scenario import LARGEST, SCENARIO
from flight_graph.text_files import parse_json, short

BOOKKEEPING = re.compile(r"(?:.*\.)?(?:header\.)?stamp\.(?:sec|nanosec)|(?:.*\.)?header\.seq")  # fields of every message
_ENTRY = re.compile(r"(position|velocity|effort)\[([^\d\]][^\]]*\]?)\]")  # of a message that names its entries
_LINE = re.compile(r"(.*?)((?:\.[xyzw])|(?:\[[^\[\]]*\]))")
NEAREST = 5


@dataclass(frozen=True)
class Quantity:
    """Lines that belong together. topic, name: what it is called; unit: "" where none is known.

    t: (n,) [s] since the start of the run; lines: name within the quantity ("" of a single one) -> (n,) values.
    """

    topic: str
    name: str
    unit: str
    t: np.ndarray
    lines: dict[str, np.ndarray]

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def is_constant(self) -> bool:
        """Whether nothing of it ever changes."""
        return all(not len(values) or bool((values == values[0]).all()) for values in self.lines.values())


class BagLines:
    """The quantities of a bag, read when they are asked for. name: of the run in legends.

    start_ns: log time [ns] of t = 0: the epoch of the scenario that the bag carries, else its first message. data: that
    scenario as plain data; odd_scenario: a sentence where the bag carries something else in its place.
    """

    def __init__(self, path, name: str = ""):
        self.bag: Bag = path if isinstance(path, Bag) else read_bag(path)
        self.name = name or Path(self.bag.path).name
        self.data, self.odd_scenario = scenario_data(self.bag)
        epoch = self.data.get("epoch_ns")
        known = isinstance(epoch, int) and abs(self.bag.start_ns - epoch) < 10**18
        self.start_ns = epoch if known and epoch <= self.bag.start_ns else self.bag.start_ns
        self._found, self.problems = {}, {}  # topic -> quantities; topic -> why it has none

    @property
    def topics(self) -> list[str]:
        """The topics of the bag."""
        return list(self.bag.topics)

    def quantities(self, topic: str) -> list[Quantity]:
        """All quantities of a topic; none where its messages cannot be decoded, which ``problems`` says then."""
        if topic not in self._found:
            try:
                self._found[topic] = list(self._read(topic))
            except FlightError as error:
                self._found[topic], self.problems[topic] = [], str(error)
        return self._found[topic]

    def find(self, text: str) -> Quantity:
        """The quantity, or the single line of it, that ``TOPIC.FIELD`` names. Raises FlightError with the nearest names."""
        topic, field = self._split(text)
        for quantity in self.quantities(topic):
            if field in (quantity.name, _short_name(quantity.name)):
                return quantity
            for line, values in quantity.lines.items():
                if field in (quantity.name + line, _short_name(quantity.name + line), _entry(quantity.name, line)):
                    return Quantity(topic, quantity.name + line, quantity.unit, quantity.t, {"": values})
        if topic in self.problems:
            raise FlightError(self.problems[topic])
        raise self._unknown(text, topic, field)

    def _split(self, text):
        """The topic and the field of ``TOPIC.FIELD``: topics have no dots, and may lack their first slash."""
        topic, dot, field = text.partition(".")
        for name in (topic, f"/{topic}", topic.lstrip("/")):
            if name in self.bag.topics:
                if not dot:
                    raise self._unknown(text, name, "")
                return name, field
        raise self._unknown(text, None, field)

    def _unknown(self, text, topic, field) -> FlightError:
        topics = self.topics if topic is None else [topic]
        known = [f"{name}.{_short_name(quantity.name)}" for name in topics for quantity in self.quantities(name)]
        nearest = difflib.get_close_matches(text if topic is None else f"{topic}.{field}", known, NEAREST, 0.4)
        if topic is None or not nearest:
            nearest = nearest or known[:NEAREST]
        what = f"did you mean {' or '.join(map(short, nearest))}?" if nearest else "it has no numbers"
        bag = "" if "." in text else ", and there is no bag of this name"
        return FlightError(f"{self.bag.path}: it has no field '{short(text)}'{bag}; {what} (flight plot {self.bag.path} "
                           "--fields lists all)")

    def _read(self, topic):
        columns = table(self.bag, topic)
        stamps = columns.pop("stamp [ns]")
        columns.pop("time [s]")
        t = (stamps - self.start_ns) / 1e9
        own = self.bag.metadata.get(UNITS_RECORD, {})
        are_joints = any(label.startswith(("velocity[", "effort[")) for label in columns)
        found = {}
        for label, values in columns.items():
            column, unit = _with_unit(label)
            if values.dtype.kind not in "fiub" or BOOKKEEPING.fullmatch(column):
                continue
            name, line = _parts(column, not are_joints and f"{topic}:{column}" in own)
            found.setdefault((name, unit), {})[line] = values.astype(float, copy=False)
        for (name, unit), lines in found.items():
            yield Quantity(topic, name, unit, t, lines)


def scenario_data(bag: Bag) -> tuple[dict, str]:
    """The scenario that a bag carries, as plain data of which nothing is run, {} without one; and why it cannot be read."""
    if SCENARIO not in bag.attachments:
        return {}, ""
    where = f"{bag.path}: its attachment {SCENARIO}"
    try:
        data = parse_json(bag.attachments[SCENARIO].data, where, LARGEST)
    except FlightError as error:
        return {}, str(error)
    is_scenario = isinstance(data, dict) and isinstance(data.get("components"), dict)
    return (data, "") if is_scenario else ({}, f"{where} is no scenario")


def _with_unit(label):
    column, bracket, unit = label.rpartition(" [")
    return (column, unit[:-1]) if bracket and unit.endswith("]") else (label, "")


def _parts(column, is_named):
    """(quantity, line) of a column: ``position[angles[0]]`` -> ``angles``, ``[0]``; ``orientation.x`` -> itself, ``.x``.

    is_named: its entries are quantities of their own, not the joints of one.
    """
    entry = _ENTRY.fullmatch(column) if is_named else None
    if entry:
        name, bracket, index = entry[2].partition("[")
        return name, f"[{index}" if bracket else ""
    found = _LINE.fullmatch(column)
    return (found[1], found[2]) if found else (column, "")


def _short_name(name):
    """What a person may write for a name."""
    entry = _ENTRY.fullmatch(name)
    return entry[2] if entry else name


def _entry(name, line):
    """The name of the field within the message."""
    return f"position[{name}{line}]"
