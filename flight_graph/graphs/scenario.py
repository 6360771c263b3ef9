"""Scenarios: one YAML file says the graph, the parameters, the seed, the duration, what to record and what to judge.

    name: cubli_asteroid
    title: Cubli rover balancing on an asteroid
    duration_s: 60
    seed: 1
    components:
      plant: {use: sim_nodes/cubli_plant, rate_hz: 100, parameters: {gravity_sign: 1}}
      controller: {use: cubli_ros/appc_controller}
    connect:
      controller.attitude: plant.attitude               # or {from: plant.attitude, delay: 1}
    include: {rover_b: cubli_asteroid}                  # another scenario in this one: `flight_graph.graphs.include`
    record: {max_rate_hz: 1000}
    metrics: papers.appc.metrics:compute
    vary: {grid: {controller.rate_hz: [20, 50, 100]}}   # what `flight sweep` varies, see `flight_graph.graphs.vary`

A parameter may follow from another component's: ``gravity: "= plant.gravity"`` (`flight_graph.graphs.expressions`).
It is validated as a whole before anything runs; an error names the file and the key.
"""

from pathlib import Path
from typing import Any

from flight_graph.components import declared, names
from flight_graph.components.foreign import Consent, agree
from flight_graph.errors import FlightError, unknown
from flight_graph.faults import fault_file, report
from flight_graph.faults.fault_set import FaultSet
from flight_graph.graphs import events, foreign_nodes, include, inside, measures, placements, vehicles
from flight_graph.graphs.added_nodes import added_nodes
from flight_graph.graphs.graph import Edge, Graph, Node
from flight_graph.graphs.named_code import foreign_code
from flight_graph.graphs.node_making import NodeMaker
from flight_graph.graphs.scenario_file import MOST_COMPONENTS, EdgeEntry, EventEntry, ScenarioFile
from flight_graph.graphs.scenario_names import check_names
from flight_graph.graphs.setting import override
from flight_graph.graphs.source import read_file
from flight_graph.graphs.vary import Vary
from flight_graph.monitors import monitor_file
from flight_graph.monitors.monitor_set import MonitorSet
from flight_graph.text_files import short
from flight_graph.timebase import SECOND, duration_ns, next_checkpoint_ns, period_ns


class Scenario:
    """A validated scenario: the file's data with overrides applied, and the graph it stands for.

    vehicles: name -> the scenario that it includes, whole by itself; its components are in the graph of this one as well,
    under ``name.component``. like: another one of this file; vehicles that are the same in both are made once. Raises
    FlightError on anything that is wrong, before anything runs.
    """

    def __init__(self, data: dict, origin: str, folder: Path | None = None, like: "Scenario | None" = None):
        self.origin, self.folder, self.given = origin, folder, data
        self.tapes = {}  # (node, port) -> (ticks, records): what foreign nodes said, of a recorded run
        vehicles.refuse_too_deep(data, origin)
        self.file = ScenarioFile.read(data, origin)
        check_names(self.file, origin)
        self.duration_ns = duration_ns(self.file.duration_s, f"{origin}: duration_s")
        self.epoch_ns = self.file.epoch_ns
        if self.epoch_ns <= 0 or (self.epoch_ns + self.duration_ns) >= 2**31 * 10**9:
            raise FlightError(f"{origin}: epoch_ns: {self.epoch_ns} is not allowed; allowed: a stamp after 1970 whose "
                              "seconds fit 31 bits at the end of the run (ROS reads zero as 'no clock')")
        if (count := sum(1 for _ in vehicles.components(self.file.model_dump()))) > MOST_COMPONENTS:
            raise FlightError(f"{origin}: the graph has {count} components, those of vehicles among them; allowed: "
                              f"{MOST_COMPONENTS}")
        known, entries = like.vehicles if like else {}, self.file.include or {}
        self.vehicles = {name: self._vehicle(name, entry, known.get(name)) for name, entry in entries.items()}
        included = inside.nodes(self.vehicles)
        self.maker = NodeMaker(self.file.components, self.seed, origin, folder, {node.name: node for node in included})
        nodes = [*self.maker.nodes(), *included]
        foreign_nodes.check_stand_ins(nodes, self.vehicles, origin)
        base = None
        if self.file.base_rate_hz is not None:
            base = period_ns(self.file.base_rate_hz, f"{origin}: base_rate_hz")
        self._entries = self._with_spares(fault_file.read(self.file.faults or [], f"{origin}: faults"))
        self._watching = monitor_file.read(self.file.monitors, f"{origin}: monitors") if (
            self.file.monitors is not None) else None
        nodes += added_nodes(nodes, self._entries, self._watching, origin)
        try:
            self.graph = Graph(nodes, self._connections(), base)
            for node in nodes:
                for port in node.component.outputs:
                    node.output_period_ns(port)
        except FlightError as error:
            raise FlightError(f"{origin}: {error}") from None
        own = {name: node for name, node in self.graph.nodes.items() if not report.does_nothing(node.component)}
        self.faults = self._fault_set(self.graph.nodes, events.changes(self.events(), own, f"{origin}: events", folder),
                                      placements.found(self.events(), own, f"{origin}: events"))
        self._check_recorded_topics()
        self.measures = measures.read(self.file.measures or {}, self.graph.nodes, f"{origin}: measures")
        self.vary = None
        if self.file.vary is not None:
            self.vary = Vary(self.file.vary, origin, folder)
            self.vary.check(self)

    @property
    def name(self) -> str:
        """What bags and error texts call it."""
        return self.file.name

    @property
    def seed(self) -> int:
        """The seed that each component's own noise follows from."""
        return self.file.seed

    @property
    def foreign(self) -> list[str]:
        """The components that are foreign nodes."""
        return [name for name, node in self.graph.nodes.items() if node.is_foreign]

    def is_irregular(self, node: str, port: str) -> bool:
        """Whether messages of an output may be missing, by faults, or because a foreign node is late."""
        return self.graph.nodes[node].is_foreign or self.faults.is_irregular(node, port)

    @property
    def ticks(self) -> int:
        """The tick behind the last one."""
        return -(-self.duration_ns // self.graph.base_ns)

    @property
    def checkpoint_period_ns(self) -> int:
        """Time between checkpoints; 0: none are kept."""
        period = self.file.record.checkpoint_period_s
        return 0 if period is None else duration_ns(period, f"{self.origin}: record.checkpoint_period_s")

    def next_checkpoint(self, tick: int) -> int:
        """The first tick behind this one that a checkpoint is to be kept of; the end where there is none."""
        period, base = self.checkpoint_period_ns, self.graph.base_ns
        return min(self.ticks, next_checkpoint_ns(tick * base, period, base) // base) if period else self.ticks

    def warnings(self) -> list[str]:
        """What the components say of their parameters, each behind the component's name, and what has no effect:
        parameters, events that come too late.
        """
        said = self.without_effect()
        return [f"{name}: {sentence}" for name, node in self.graph.nodes.items()
                for sentence in [*said.get(name, []),
                                 *declared.call(node.component, "warnings", node.values, node.period_ns / SECOND)]] + [
            f"events: the one at {entry.at_s:g} s has no effect: the run ends at {self.duration_ns / SECOND:g} s"
            for entry in self.events() if round(entry.at_s * SECOND) >= self.duration_ns]

    def without_effect(self) -> dict[str, list[str]]:
        """name of a component -> sentences about its parameters that were given and change nothing."""
        return self.maker.without_effect | inside.without_effect(self.vehicles)

    def events(self) -> list[EventEntry]:
        """The events of the file, then those of the vehicles, by whole names."""
        return [*(self.file.events or []), *inside.events(self.vehicles)]

    @property
    def has_measures(self) -> bool:
        """Whether it or a vehicle of it has measures."""
        return bool(self.measures) or any(vehicle.has_measures for vehicle in self.vehicles.values())

    def reach(self, path: str) -> tuple["Scenario", str]:
        """The scenario that a path leads to, through the names of vehicles, and the rest of the path."""
        first, _, rest = path.partition(".")
        return self.vehicles[first].reach(rest) if rest and first in self.vehicles else (self, path)

    def resolved(self) -> dict:
        """The scenario with every parameter and rate written out: what a bag carries and can be run from."""
        data = self.file.model_dump(by_alias=True, exclude_none=True, exclude={"vary"})
        for name in self.file.components:
            node = self.graph.nodes[name]
            if node.is_foreign:
                data["components"][name] = foreign_nodes.entry_of(node)
                continue
            data["components"][name] = {"use": node.use, "rate_hz": node.rate_hz, "parameters": dict(node.values)}
        for name, vehicle in self.vehicles.items():
            found = vehicles.own(vehicle.resolved())
            if "seed" not in self.file.include[name].scenario:  # it follows from that of the whole
                del found["seed"]
            data["include"][name] = {"scenario": found}
        known = inside.edges(self.vehicles)
        data["connect"] = {
            f"{node.name}.{port}": {"from": f"{edge.node}.{edge.port}", "delay": edge.delay}
            for node in self.graph.nodes.values() for port, edge in node.inputs.items()
            if known.get((node.name, port)) != edge}
        return data

    def recorded(self) -> dict[tuple[str, str], int]:
        """(node, port) -> every how manieth message is recorded, in the order of the graph's steps."""
        wanted = self.file.record.topics
        names = [step.node for step in self.graph.order if step.part != "update"]
        plan = {}
        for name in names:
            node = self.graph.nodes[name]
            for port, signal in node.component.outputs.items():
                if wanted is not None and signal.topic not in wanted and not node.is_foreign:  # without it, no run again
                    continue
                every = 1
                if node.is_foreign:
                    plan[name, port] = every
                    continue
                if self.file.record.max_rate_hz and not self.faults.is_report(name):  # which speaks at changes alone
                    rate = 1e9 / node.output_period_ns(port)
                    every = max(1, -(-int(round(rate * 1e6)) // int(round(self.file.record.max_rate_hz * 1e6))))
                plan[name, port] = every
        return plan

    def measured(self) -> dict[tuple[str, str], tuple[int, list[measures.Measure]]]:
        """(node, port) -> every how manieth message is recorded, and the measures of it, of the outputs that have some."""
        found = {}
        for output, every in self.recorded().items():
            mine = [one for one in self.measures if (one.node, one.port) == output]
            found |= {output: (every, mine)} if mine else {}
        return found

    def _vehicle(self, name, entry, known) -> "Scenario":
        """The scenario under a name, whole by itself; what is one for all is taken from this one."""
        where = f"{self.origin}: include.{name}"
        if isinstance(entry.scenario, str) or entry.set:
            raise FlightError(f"{where}: scenarios are included where a file is read; here they have to stand in full")
        found = {"seed": vehicles.seed_of(self.seed, name), **vehicles.own(entry.scenario),
                 "duration_s": self.file.duration_s, "epoch_ns": self.file.epoch_ns}
        where = f"{where} ({short(str(found.get('name')), 60)})"
        if known is not None and known.given == found:
            return known
        return Scenario(found, where, Path(entry.folder) if entry.folder else None, known)

    def _fault_set(self, scope: dict[str, Node], changes: dict | None = None, placed: dict | None = None) -> FaultSet:
        """Faults, monitors, and those of the vehicles. scope: name, as this scenario has it -> node of the whole graph."""
        monitors = MonitorSet(self._watching, scope, f"{self.origin}: monitors") if self._watching else None
        found = {name: vehicle._fault_set({own: scope[names.joined(name, own)] for own in vehicle.graph.nodes})
                 for name, vehicle in self.vehicles.items()}
        return FaultSet(self._entries, scope, self.seed, f"{self.origin}: faults", monitors, self.epoch_ns,
                        bool(self.live_ids), changes, found, placed)

    @property
    def live_ids(self) -> list[str]:
        """The ids of faults that may be injected while the graph runs."""
        return [f"live_{number}" for number in range(1, (self.file.live_faults or 0) + 1)]

    def with_faults(self, injected: list[dict]) -> FaultSet:
        """The faults of the graph, those that were injected among them. Raises FlightError."""
        entries = [*(self.file.faults or []), *injected]
        read = self._with_spares(fault_file.read(entries, f"{self.origin}: faults"))
        return FaultSet(read, self.graph.nodes, self.seed, f"{self.origin}: faults", self.faults.monitors, self.epoch_ns,
                        True, self.faults.changes, self.faults.vehicles, self.faults.placements)

    def _with_spares(self, entries):
        """Entries in the order of the report: those of the file, then live ones by number, those that are free too."""
        live = {entry.id: entry for entry in entries if entry.id in self.live_ids}
        return [*(entry for entry in entries if entry.id not in live),
                *(live.get(name) or fault_file.spare(name) for name in self.live_ids)]

    def _connections(self):
        connections = inside.edges(self.vehicles)
        for target, source in self.file.connect.items():
            delay = 0
            if isinstance(source, EdgeEntry):
                source, delay = source.source, source.delay
            for text in (target, source):
                node, _, port = text.rpartition(".")
                words = node.split(".")
                if not all(map(names.is_word, words)) or not names.is_port(port) or words[0] not in (
                        self.vehicles if words[1:] else words):
                    raise FlightError(f"connect: '{short(text)}' is not of the form component.port")
            connections[tuple(target.rsplit(".", 1))] = Edge(*source.rsplit(".", 1), delay)
        return connections

    def _check_recorded_topics(self):
        topics = [signal.topic for _, _, signal in self.graph.outputs()]
        for topic in self.file.record.topics or []:
            if topic not in topics:
                raise unknown("topic", topic, topics, f"{self.origin}: record.topics")


def load(name_or_path: str, overrides: dict[str, Any] | None = None, case: int | None = None,
         consent: Consent = agree) -> Scenario:
    """Read, override and validate a scenario.

    name_or_path: the name of one that comes with the packages, or a YAML file.
    overrides: ``component.parameter`` -> value, ``component.rate_hz`` -> value, ``faults.ID.key`` -> value, or a top-level
    key -> value.
    case: number of a case of its ``vary`` block, whose values come on top.
    consent: is asked before code runs that the file names and that is neither of the packages nor in the file's folder.
    """
    scenario = Scenario(*read(name_or_path, overrides, consent))
    return scenario if case is None else vary_case(scenario, case, overrides)


def vary_case(scenario: Scenario, case: int, overrides: dict[str, Any] | None = None) -> Scenario:
    """The scenario of case number ``case``. overrides: what was set by hand, which must not be varied as well.

    Raises FlightError.
    """
    if scenario.vary is None:
        raise FlightError(f"{scenario.origin}: it has no 'vary' block, so it has no case {case}")
    values = scenario.vary.overrides(case)
    for key in values:
        if key in (overrides or {}):
            raise FlightError(f"{scenario.origin}: '{key}' is varied; it cannot be set to {overrides[key]!r} as well")
    data = scenario.file.model_dump(by_alias=True, exclude={"vary"})
    return Scenario(override(data, values, f"vary, case {case}", scenario.folder), scenario.origin, scenario.folder)


def read(name_or_path: str, overrides: dict[str, Any] | None = None, consent: Consent = agree) -> tuple[dict, str, Path]:
    """A scenario's data with overrides applied, the name of its file for error texts, and its folder.

    consent: as for `load`.
    """
    data, path = read_file(name_or_path)
    data = include.gathered(data, path)
    if found := foreign_code(data, path.parent, path.parent):
        consent(str(path), found)
    data = include.with_settings(data, str(path.name), path.parent)
    return override(data, overrides or {}, folder=path.parent), str(path.name), path.parent
