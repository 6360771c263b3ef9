"""A bag as lines over time, found by the names that `flight export` gives them; no code of the bag runs."""

import difflib
from dataclasses import replace
from pathlib import Path

from flight_graph.bags.reader import Bag, read_bag
from flight_graph.bags.series import Series, series_of_bag
from flight_graph.errors import FlightError
from flight_graph.recordings.bag_scenario import LARGEST, SCENARIO
from flight_graph.text_files import parse_json, short

NEAREST = 5


class BagLines:
    """The series of a bag, read when they are asked for. name: of the run in legends.

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
        self._found, self.problems = {}, {}  # topic -> series; topic -> why it has none

    @property
    def topics(self) -> list[str]:
        """The topics of the bag."""
        return list(self.bag.topics)

    def series(self, topic: str) -> list[Series]:
        """All series of a topic; none where its messages cannot be decoded, which ``problems`` says then."""
        if topic not in self._found:
            try:
                self._found[topic] = series_of_bag(self.bag, topic, self.start_ns)
            except FlightError as error:
                self._found[topic], self.problems[topic] = [], str(error)
        return self._found[topic]

    def find(self, text: str) -> Series:
        """The series, or the single line of it, that ``TOPIC.FIELD`` names. Raises FlightError with the nearest names."""
        topic, field = self._split(text)
        for one in self.series(topic):
            if field == one.name:
                return one
            for line in one.lines:
                if field in (one.name + line.entry, line.column, line.path):
                    return replace(one, name=one.name + line.entry, lines=(replace(line, entry=""),))
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
        known = [one.key for name in (self.topics if topic is None else [topic]) for one in self.series(name)]
        nearest = difflib.get_close_matches(text if topic is None else f"{topic}.{field}", known, NEAREST, 0.4)
        if topic is None or not nearest:
            nearest = nearest or known[:NEAREST]
        what = f"did you mean {' or '.join(map(short, nearest))}?" if nearest else "it has no numbers"
        bag = "" if "." in text else ", and there is no bag of this name"
        return FlightError(f"{self.bag.path}: it has no field '{short(text)}'{bag}; {what} (flight plot {self.bag.path} "
                           "--fields lists all)")


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
