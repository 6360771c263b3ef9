"""The cases of a scenario with a ``vary`` block, one after the other or several at a time, in one thread.

What cases share is made once: graph, machine codes, memory, tables. Measures are taken while a run flies. A run logs only
the topics that its metrics have asked for so far; where a case asks for another one, that case is run again with it. None
of this changes a bit of a row.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from flight_graph.campaigns.rows import Row
from flight_graph.components import names
from flight_graph.engines.compiled import LONGEST_CHUNK
from flight_graph.engines.flight import Flight
from flight_graph.engines.prepared import PreparedRun
from flight_graph.errors import FlightError
from flight_graph.faults import fault_file
from flight_graph.faults.report import REPORT
from flight_graph.graphs import glossary, metrics
from flight_graph.graphs.scenario import Scenario
from flight_graph.graphs.variation import Variation

_KEPT = 4  # prepared structures


def _one_by_one(flights: list[Flight], ticks: int, watch: Callable | None) -> None:
    for flight in flights:
        while not flight.stop and flight.tick < ticks:
            flight.advance(min(ticks, flight.tick + LONGEST_CHUNK))
            if watch:
                watch()


@dataclass(frozen=True)
class Batch:
    """How runs of one graph are advanced. width: how many flights it takes at a time, all of one schedule;
    advance(flights, ticks, watch): brings each to that tick, or to its ``stop``, with the bits of a flight that goes alone.
    """

    width: int = 1
    advance: Callable[[list[Flight], int, Callable | None], None] = _one_by_one


ONE_BY_ONE = Batch()


class _NotLogged(BaseException):
    """A metric asks for a topic that was left out; no handler of a metric's takes it for a missing one."""


class Logged:
    """The logs of a flight as a mapping topic -> records. topics: all that the scenario records; asked: takes the names of
    those that are asked for.
    """

    def __init__(self, flight: Flight, topics: set[str], asked: set[str]):
        self._logs, self._topics, self._asked = flight.logged(), topics, asked

    def __contains__(self, topic: str) -> bool:
        return topic.lstrip("/") in self._topics

    def __getitem__(self, topic: str):
        topic = topic.lstrip("/")
        if topic not in self._topics:
            raise KeyError(topic)
        self._asked.add(topic)
        if topic not in self._logs:
            raise _NotLogged
        return self._logs[topic]

    def get(self, topic: str, default=None):
        """The records of a topic, or the default where the scenario records none."""
        return self[topic] if topic in self else default


class Cases:
    """Runs cases by their numbers; each row is a function of the scenario and the number alone."""

    def __init__(self, scenario: Scenario, batch: Batch = ONE_BY_ONE):
        self.scenario, self.vary, self.batch = scenario, scenario.vary, batch
        self._variation, self._keys = Variation(scenario), scenario.vary.keys()
        self._prepared = {}  # structure -> PreparedRun
        self._asked = None if scenario.file.metrics else set()  # topics that metrics read; None: a run is to show it
        self._is_first = True
        metrics.check(scenario)  # a name that is wrong is found before the flight

    @property
    def units(self) -> dict[str, str]:
        """Units of metrics and of what is varied, by name, where they are declared."""
        found = {entry.name: entry.unit for entry in glossary.of(self.scenario).metrics.values()}
        for key in self._keys:
            name, parameter = names.split(key, self.scenario.graph.nodes)
            node = self.scenario.graph.nodes.get(name)
            if parameter == "rate_hz":
                found[key] = "Hz"
            elif node is not None and parameter in node.component.parameters.entries:
                found[key] = node.component.parameters.entries[parameter].unit
            elif key == "duration_s":
                found[key] = "s"
        return found

    def rows(self, numbers: Iterable[int], watch: Callable | None = None, values: list[dict] | None = None) -> list[Row]:
        """The rows of some cases, in their order. watch(): is called now and then; what it raises ends the work.

        values: what each of them varies, by key, where it is not what the block says.
        """
        wanted, found = list(zip(numbers, itertools.repeat(None) if values is None else values)), []
        width = 1 if self._is_first else self.batch.width
        while wanted:
            found += self._together(wanted[:width], watch)
            wanted, width, self._is_first = wanted[width:], self.batch.width, False
        return found

    def row(self, number: int, watch: Callable | None = None) -> Row:
        """Run a case and judge it."""
        return self.rows([number], watch)[0]

    def _together(self, wanted, watch):
        """The rows of so many cases as a batch takes, those of one structure at a time."""
        rows, groups = [], {}
        for number, values in wanted:
            row = Row(number, self.vary.name(number), {}, self.scenario.seed)
            rows.append(row)
            try:
                given = self.vary.overrides(number) if values is None else values
                row.varied = {key: value for key, value in given.items() if key != "seed"}
                scenario, structure = self._variation.of_values(given, number)
                row.seed = scenario.seed
                row.varied = {key: _value(scenario, key) for key in self._keys if key != "seed"}
                groups.setdefault(structure, []).append((row, scenario))
            except FlightError as error:
                row.status, row.sentence = "refused", str(error)
        for structure, group in groups.items():
            self._fly(structure, group, watch)
        return rows

    def _fly(self, structure, group, watch):
        try:
            prepared = self._ready(structure, group[0][1])
            flights = [prepared.flight(scenario, slot) for slot, (_, scenario) in enumerate(group)]
        except FlightError as error:
            for row, _ in group:
                row.status, row.sentence = "error", f"{type(error).__name__}: {error}"
            return
        self.batch.advance(flights, prepared.ticks, watch)
        missing = [(row, scenario) for (row, scenario), flight in zip(group, flights)
                   if not self._judge(row, scenario, flight)]
        if missing:
            self._prepared.clear()
            self._fly(structure, missing, watch)

    def _judge(self, row, scenario, flight) -> bool:
        """Fill in how a run ended; False where its metrics ask for what was not logged."""
        if flight.stop:
            row.status, row.sentence = flight.stop.reason, str(flight.stop)
            return True
        asked = set(self._asked or ())
        try:
            topics = {scenario.graph.signal(*output).topic for output in scenario.recorded()}
            found = metrics.compute(scenario, Logged(flight, topics, asked), False, flight.reduced())
            row.metrics = {name: math.nan if value != value else value for name, value in found.items()}
        except _NotLogged:
            return False
        except (ValueError, ArithmeticError, LookupError) as error:
            row.status, row.sentence = "error", f"{type(error).__name__}: {error}"
        finally:
            if asked != self._asked:
                self._asked = asked
                self._prepared.clear()
        return True

    def _ready(self, structure, scenario) -> PreparedRun:
        if structure not in self._prepared:
            if len(self._prepared) == _KEPT:
                self._prepared.pop(next(iter(self._prepared)))
            plan = scenario.recorded()
            if self._asked is not None:
                plan = {output: every for output, every in plan.items()
                        if scenario.graph.signal(*output).topic in self._asked}
            self._prepared[structure] = PreparedRun(scenario, plan)
        return self._prepared[structure]


def _value(scenario, key):
    """The value that a key has in a scenario; a vector of equal numbers as one number."""
    scenario, path = scenario.reach(key)
    name, _, parameter = path.partition(".")
    if not parameter:
        return getattr(scenario.file, path)
    if name == REPORT:
        return fault_file.value(scenario.file.faults, parameter)
    node = scenario.graph.nodes[name]
    value = {"rate_hz": node.rate_hz, "use": node.use}.get(parameter, node.values.get(parameter))
    if isinstance(value, list) and value and all(item == value[0] for item in value):
        return value[0]
    return value
