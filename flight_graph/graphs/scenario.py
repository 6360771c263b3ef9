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
    record: {max_rate_hz: 1000}
    metrics: papers.appc.metrics:compute
    vary: {grid: {controller.rate_hz: [20, 50, 100]}}   # what `flight sweep` varies, see `flight_graph.graphs.vary`

A parameter may follow from another component's: ``gravity: "= plant.gravity"`` (`flight_graph.graphs.expressions`).
It is validated as a whole before anything runs; an error names the file and the key.
"""

import os
import re
from importlib import resources
from pathlib import Path
from typing import Any

from flight_graph import yaml_text
from flight_graph.components import declared, functions, registry
from flight_graph.components.foreign import Consent, agree
from flight_graph.errors import FlightError, unknown
from flight_graph.faults import fault_file, report
from flight_graph.faults.fault_set import FaultSet
from flight_graph.graphs import events, expressions, foreign_nodes, measures
from flight_graph.graphs.graph import Edge, Graph, Node
from flight_graph.graphs.named_code import foreign_code
from flight_graph.graphs.scenario_file import FOREIGN, FOREIGN_KEYS, EdgeEntry, ScenarioFile
from flight_graph.graphs.vary import Vary
from flight_graph.monitors import monitor_file
from flight_graph.monitors.monitor_set import MonitorSet, component_of
from flight_graph.text_files import short
from flight_graph.timebase import SECOND, duration_ns, next_checkpoint_ns, period_ns
from flight_math.noise import stream_key

_NODE = re.compile("[A-Za-z][A-Za-z0-9_]{0,99}")
_PORT = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,99}\.[A-Za-z_][A-Za-z0-9_]{0,99}")
_TAKEN = ("recorder", "replayer", report.REPORT, report.MONITORS)


class Scenario:
    """A validated scenario: the file's data with overrides applied, and the graph it stands for.

    Raises FlightError on anything that is wrong, before anything runs.
    """

    def __init__(self, data: dict, origin: str, folder: Path | None = None):
        self.origin, self.folder = origin, folder
        self.tapes = {}  # (node, port) -> (ticks, records): what foreign nodes said, of a recorded run
        self.file = ScenarioFile.read(data, origin)
        self._check_names()
        self._check_functions()
        self.duration_ns = duration_ns(self.file.duration_s, f"{origin}: duration_s")
        self.epoch_ns = self.file.epoch_ns
        if self.epoch_ns <= 0 or (self.epoch_ns + self.duration_ns) >= 2**31 * 10**9:
            raise FlightError(f"{origin}: epoch_ns: {self.epoch_ns} is not allowed; allowed: a stamp after 1970 whose "
                              "seconds fit 31 bits at the end of the run (ROS reads zero as 'no clock')")
        self._without_effect = {}
        nodes = self._nodes()
        base = None
        if self.file.base_rate_hz is not None:
            base = period_ns(self.file.base_rate_hz, f"{origin}: base_rate_hz")
        entries = self._with_spares(fault_file.read(self.file.faults or [], f"{origin}: faults"))
        watching = monitor_file.read(self.file.monitors, f"{origin}: monitors") if self.file.monitors is not None else None
        nodes += self._added(nodes, entries, watching)
        try:
            self.graph = Graph(nodes, self._connections(), base)
            for node in nodes:
                for port in node.component.outputs:
                    node.output_period_ns(port)
        except FlightError as error:
            raise FlightError(f"{origin}: {error}") from None
        monitors = MonitorSet(watching, self.graph.nodes, f"{origin}: monitors") if watching else None
        changes = events.changes(self.file.events or [], {name: self.graph.nodes[name] for name in self.file.components},
                                 f"{origin}: events", folder)
        self.faults = FaultSet(entries, self.graph.nodes, self.seed, f"{origin}: faults", monitors, self.epoch_ns,
                               bool(self.live_ids), changes)
        self._check_recorded_topics()
        self.measures = measures.read(self.file.measures or {}, self.graph.nodes, f"{origin}: measures")
        self.vary = None
        if self.file.vary is not None:
            self.vary = Vary(self.file.vary, origin, folder)
            self.vary.check({node.name: node.component for node in nodes}, self.file.faults)

    @property
    def name(self) -> str:
        return self.file.name

    @property
    def seed(self) -> int:
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
        """What the components say of their parameters, each behind the component's name, and parameters without effect."""
        return [f"{name}: {sentence}" for name, node in self.graph.nodes.items()
                for sentence in [*self._without_effect.get(name, []),
                                 *declared.call(node.component, "warnings", node.values, node.period_ns / SECOND)]]

    def resolved(self) -> dict:
        """The scenario with every parameter and rate written out: what a bag carries and can be run from."""
        data = self.file.model_dump(by_alias=True, exclude_none=True, exclude={"vary"})
        for name in self.file.components:
            node = self.graph.nodes[name]
            if node.is_foreign:
                data["components"][name] = foreign_nodes.entry_of(node)
                continue
            data["components"][name] = {"use": node.use, "rate_hz": node.rate_hz, "parameters": dict(node.values)}
        data["connect"] = {
            f"{node.name}.{port}": {"from": f"{edge.node}.{edge.port}", "delay": edge.delay}
            for node in self.graph.nodes.values() for port, edge in node.inputs.items()}
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
                if self.file.record.max_rate_hz and name != report.REPORT:  # which speaks at changes alone
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

    def _nodes(self):
        """The nodes in the order of the file; one that reads another's parameters is made after it."""
        made = {}
        waiting = {name: entry for name, entry in self.file.components.items() if entry.use != FOREIGN}
        while waiting:
            known = {name: node.values for name, node in made.items()}
            ready = [name for name, entry in waiting.items() if not self._read_by(name, entry) & waiting.keys()]
            if not ready:
                raise FlightError(f"{self.origin}: components: {' and '.join(waiting)} take parameters from each other "
                                  "(or from themselves) in a circle")
            for name in ready:
                made[name] = self._node(name, waiting.pop(name), known)
        own = list(made.values())
        made |= {name: foreign_nodes.node(name, entry, own, f"{self.origin}: components.{name}")
                 for name, entry in self.file.components.items() if entry.use == FOREIGN}
        return [made[name] for name in self.file.components]

    @property
    def live_ids(self) -> list[str]:
        """The ids of faults that may be injected while the graph runs."""
        return [f"live_{number}" for number in range(1, (self.file.live_faults or 0) + 1)]

    def with_faults(self, injected: list[dict]) -> FaultSet:
        """The faults of the graph, those that were injected among them. Raises FlightError."""
        entries = [*(self.file.faults or []), *injected]
        read = self._with_spares(fault_file.read(entries, f"{self.origin}: faults"))
        return FaultSet(read, self.graph.nodes, self.seed, f"{self.origin}: faults", self.faults.monitors, self.epoch_ns,
                        True, self.faults.changes)

    def _with_spares(self, entries):
        """Entries in the order of the report: those of the file, then live ones by number, those that are free too."""
        live = {entry.id: entry for entry in entries if entry.id in self.live_ids}
        return [*(entry for entry in entries if entry.id not in live),
                *(live.get(name) or fault_file.spare(name) for name in self.live_ids)]

    def _added(self, nodes, entries, watching):
        """The components that follow from the blocks ``monitors`` and ``faults``."""
        added = []
        if watching:
            where = f"{self.origin}: monitors"
            name, component = component_of(watching, {node.name: node for node in nodes}, where)
            period_ns(watching.rate_hz, f"{where}.rate_hz")
            added.append(Node(report.MONITORS, name, component, {}, watching.rate_hz))
        if entries:
            identifiers = [entry.id for entry in entries]
            added.append(Node(report.REPORT, report.use(identifiers), report.fault_report(tuple(identifiers)), {},
                              report.report_rate_hz(nodes)))
        return added

    def _read_by(self, name, entry):
        """Names of the components whose parameters an entry reads."""
        read = set()
        for key, value in entry.parameters.items():
            if expressions.is_expression(value):
                where = f"{self.origin}: components.{name}.parameters.{key}"
                for other in expressions.references(value, where):
                    if other not in self.file.components:
                        raise unknown("component", other, self.file.components, where)
                    if self.file.components[other].use == FOREIGN:
                        raise FlightError(f"{where}: {other} is a foreign node, whose parameters are its own")
                    read.add(other)
        return read

    def _node(self, name, entry, known):
        where = f"{self.origin}: components.{name}"
        given = {key: expressions.evaluate(value, known, f"{where}.parameters.{key}")
                 if expressions.is_expression(value) else value for key, value in entry.parameters.items()}
        foreign_nodes.refuse_keys(entry, where)
        try:
            use = registry.absolute(entry.use, self.folder)
            component = registry.component(use)
        except FlightError as error:
            raise FlightError(f"{where}.use: {error}") from None
        values = component.parameters.defaults()
        if "seed" in component.parameters.entries:
            values["seed"] = stream_key(self.file.seed, name)
        given = component.parameters.validate(given, f"{where}.parameters")
        values.update(given)
        values = declared.resolved(component, values, f"{where}.parameters", self.folder)
        self._without_effect[name] = list(_without_effect(component.parameters, given, values))
        rate = component.rate_hz if entry.rate_hz is None else entry.rate_hz
        return Node(name, use, component, values, rate)

    def _connections(self):
        connections = {}
        for target, source in self.file.connect.items():
            delay = 0
            if isinstance(source, EdgeEntry):
                source, delay = source.source, source.delay
            for text in (target, source):
                if not _PORT.fullmatch(text):
                    raise FlightError(f"connect: '{short(text)}' is not of the form component.port")
            connections[tuple(target.split("."))] = Edge(*source.split("."), delay)
        return connections

    def _check_names(self):
        if not self.file.components:
            raise FlightError(f"{self.origin}: components: there is none; a graph has at least one")
        for name in self.file.components:
            if not _NODE.fullmatch(name):
                raise FlightError(f"{self.origin}: components.{short(name)}: this is no name of a node; allowed: a letter, "
                                  "then letters, digits and underscores, 100 in all")
            if name in _TAKEN:
                raise FlightError(
                    f"{self.origin}: components.{name}: this name is taken by a node of every run; take another")
            if self.file.components[name].use == FOREIGN and foreign_nodes.stand_in_of(name) in self.file.components:
                raise FlightError(f"{self.origin}: components.{foreign_nodes.stand_in_of(name)}: this name is taken by the "
                                  f"stand-in of the foreign node {name}; take another")

    def _check_functions(self):
        """The forms of the names; the functions themselves are loaded when they are called for."""
        for key in ("metrics", "figure"):
            if name := getattr(self.file, key):
                functions.check_name(name, f"{self.origin}: {key}")

    def _check_recorded_topics(self):
        topics = [signal.topic for _, _, signal in self.graph.outputs()]
        for topic in self.file.record.topics or []:
            if topic not in topics:
                raise unknown("topic", topic, topics, f"{self.origin}: record.topics")


def _without_effect(parameters, given, values):
    """Sentences about given parameters that change nothing: others decide them, or the chosen form does not use them."""
    defaults = parameters.defaults()
    for name, value in given.items():
        if values[name] != value:
            yield f"{name} is given and has no effect: it follows from other parameters"
            continue
        for choice, words in parameters.entries[name].used_if:
            if value != defaults[name] and values[choice] not in words:
                yield (f"{name} is given and has no effect with {choice} {values[choice]}; it is used with "
                       f"{' and '.join(words)}")


def available() -> dict[str, Path]:
    """Names of the scenarios that come with the packages, and their files."""
    folder = Path(str(resources.files("scenarios")))
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


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
    """The scenario of case number ``case``. overrides: what was set by hand, which must not be varied as well."""
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
    if found := foreign_code(data, path.parent, path.parent):
        consent(str(path), found)
    return override(data, overrides or {}, folder=path.parent), str(path.name), path.parent


def read_file(name_or_path: str) -> tuple[dict, Path]:
    """A scenario's data as its file has it, and the file. Nothing that it names is imported. Raises FlightError."""
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        known = available()
        if name_or_path not in known:
            raise unknown("scenario", name_or_path, known)
        path = known[name_or_path]
    elif not os.path.exists(path):
        raise FlightError(f"there is no scenario file '{short(str(path))}'")
    data = yaml_text.read(path)
    if not isinstance(data, dict):
        raise FlightError(f"{path}: a scenario is a mapping of keys (name, title, duration_s, components, ...)")
    return data, path


def override(data: dict, overrides: dict[str, Any], origin: str = "--set", folder: Path | None = None) -> dict:
    """Return a copy of a scenario's data with ``component.parameter`` (or ``.rate_hz``), ``faults.ID.key`` and top-level
    keys replaced.

    ``component.use`` puts another component in the place: it keeps those of the file's parameters that it has itself
    (the file wrote them for the one that left), and everything else that is overridden.
    origin: where the overrides come from, for error texts. folder: where a relative component file starts.
    """
    components = data.get("components") or {}
    if not isinstance(components, dict) or not all(isinstance(entry or {}, dict) for entry in components.values()):
        return data  # the validation names the key
    data = {**data, "components": {name: dict(entry or {}) for name, entry in components.items()}}
    for key in sorted(overrides, key=lambda key: not key.endswith(".use")):
        value = overrides[key]
        component, _, parameter = key.partition(".")
        if component == report.REPORT and parameter:
            data["faults"] = fault_file.override(data.get("faults"), parameter, value, f"{origin} {key}")
            continue
        if not parameter:
            if key not in ScenarioFile.model_fields or key in ("components", "connect"):
                raise FlightError(f"{origin} {key}: write component.parameter=value")
            data[key] = value
            continue
        if component not in data["components"]:
            raise unknown("component", component, data["components"], f"{origin} {key}")
        entry = data["components"][component]
        if parameter == "use":
            for port in FOREIGN_KEYS:
                entry.pop(port, None)
            try:
                entries = registry.component(registry.absolute(str(value), folder)).parameters.entries
            except FlightError as error:
                raise FlightError(f"{origin} {key}: {error}") from None
            kept = {name: given for name, given in (entry.get("parameters") or {}).items() if name in entries}
            entry.update(use=value, parameters=kept)
        elif parameter == "rate_hz" or entry.get("use") == FOREIGN and parameter in FOREIGN_KEYS:
            entry[parameter] = value
        else:
            entry["parameters"] = {**(entry.get("parameters") or {}), parameter: value}
    return data
