"""The cases of a scenario with a ``vary`` block, run one after the other in one thread."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from flight_graph.campaigns.rows import Row
from flight_graph.engines.compiled import LONGEST_CHUNK, CompiledRun, Flight
from flight_graph.errors import FlightError, RunStopped
from flight_graph.faults import fault_file
from flight_graph.faults.report import REPORT
from flight_graph.graphs import glossary, metrics
from flight_graph.graphs.scenario import Scenario, vary_case


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


class Cases:
    """Runs cases by their numbers; each row is a function of the scenario and the number alone."""

    def __init__(self, scenario: Scenario, batch: Batch = ONE_BY_ONE):
        self.scenario, self.vary, self.batch, self._logs = scenario, scenario.vary, batch, {}
        metrics.of(scenario)  # a name that is wrong is found before the flight

    @property
    def units(self) -> dict[str, str]:
        """Units of metrics and of what is varied, by name, where they are declared."""
        found = {entry.name: entry.unit for entry in glossary.of(self.scenario).metrics.values()}
        for key in self.vary.keys():
            name, _, parameter = key.partition(".")
            node = self.scenario.graph.nodes.get(name)
            if parameter == "rate_hz":
                found[key] = "Hz"
            elif node is not None and parameter in node.component.parameters.entries:
                found[key] = node.component.parameters.entries[parameter].unit
            elif key == "duration_s":
                found[key] = "s"
        return found

    def rows(self, numbers: Iterable[int], watch: Callable | None = None) -> list[Row]:
        """The rows of some cases, in their order."""
        return [self.row(number, watch=watch) for number in numbers]

    def row(self, number: int, values: dict | None = None, watch: Callable | None = None) -> Row:
        """Run a case and judge it. values: what it varies, by key, where it is not what the block says. watch(): is called
        now and then; what it raises ends the run.
        """
        row = Row(number, self.vary.name(number), {}, self.scenario.seed)
        try:
            row.varied = self.vary.overrides(number)
            scenario = vary_case(self.scenario, number)
            row.seed = scenario.seed
            row.varied = {key: _value(scenario, key) for key in self.vary.keys()}
        except FlightError as error:
            row.status, row.sentence = "refused", str(error)
            return row
        try:
            run = CompiledRun(scenario)
            row.metrics = metrics.compute(scenario, run.run((lambda _: watch()) if watch else None, self._logs), finite=False)
        except RunStopped as error:
            row.status, row.sentence = error.reason, str(error)
        except (ValueError, ArithmeticError, LookupError) as error:
            row.status, row.sentence = "error", f"{type(error).__name__}: {error}"
        return row


def _value(scenario, key):
    """The value that a key has in a scenario; a vector of equal numbers as one number."""
    name, _, parameter = key.partition(".")
    if not parameter:
        return getattr(scenario.file, key)
    if name == REPORT:
        return fault_file.value(scenario.file.faults, parameter)
    node = scenario.graph.nodes[name]
    value = {"rate_hz": node.rate_hz, "use": node.use}.get(parameter, node.values.get(parameter))
    if isinstance(value, list) and value and all(item == value[0] for item in value):
        return value[0]
    return value
