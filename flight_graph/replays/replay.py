"""One component run again on its recorded inputs; its answers compared with the recorded ones.

The inputs of a firing are those the component had in the run: the newest recorded message that is due (see
`flight_graph.graphs.graph.Edge`). Nothing closes a loop here: with changed parameters the answers are open-loop ones.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flight_graph.engines.choice import ENGINES
from flight_graph.engines.memory import refuse_too_long
from flight_graph.engines.schedule import Schedule
from flight_graph.engines.single import SingleComponent
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs import setting
from flight_graph.graphs.graph import Edge, Node
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.comparison import TOLERANCE, Comparison, compare, recorded_until, write_topics
from flight_graph.recordings.recorded_run import RecordedRun, open_recorded, shortened
from flight_graph.recordings.recording import RecordedTopic, messages
from flight_graph.timebase import SECOND


@dataclass(frozen=True)
class RecordedInput:
    """An input and its recorded messages. stamps_ns: (n,) since the start of the run; records: (n,).

    end_ns: the first message that is missing would be due at a firing at this time.
    """

    port: str
    topic: str
    period_ns: int
    delay: int
    stamps_ns: np.ndarray
    records: np.ndarray
    end_ns: int
    source: tuple[str, str] = ("", "")  # node and port of the output

    def index(self, t_ns: int) -> int:
        """Number of the message that belongs to a firing at t; -1: none yet."""
        return int(np.searchsorted(self.stamps_ns, t_ns - self.delay, "right")) - 1


@dataclass
class Replay:
    """A replayed component. comparison: its answers against the recorded ones; open_loop: parameters were changed."""

    component: str
    engine: str
    firings: int
    comparison: Comparison
    open_loop: bool

    @property
    def holds(self) -> bool:
        return self.open_loop or self.comparison.holds

    def plain(self) -> dict:
        """The replay as JSON knows it."""
        return {"component": self.component, "engine": self.engine, "firings": self.firings,
                "open_loop": self.open_loop, **self.comparison.plain()}


def replay(path, component: str, engine: str = "compiled", settings: dict | None = None, trust: bool = False,
           tolerance: float = TOLERANCE, progress=None, check_bounds: bool = False, as_node=None) -> Replay:
    """Replay one component of a recorded run. Raises FlightError.

    settings: parameter -> value, in place of the recorded ones. engine: ``compiled``, ``python`` or ``ros`` (the real
    node, fed over ROS topics by ``as_node``, see `flight_graph.runs.replay`). progress(seconds simulated, in all) is
    called now and then. check_bounds: with checked indices.
    """
    if engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    if engine == "ros" and as_node is None:
        raise FlightError("a replay as a node is made by flight_graph.runs.replay")
    run = open_recorded(path, trust)
    if component not in run.scenario.graph.nodes:
        raise unknown("component", component, run.scenario.graph.nodes, f"bag '{path}'")
    if run.scenario.graph.nodes[component].is_foreign:
        raise FlightError(f"{component} is a foreign node: its answers are in the bag, its code is not; a replay is of a "
                          "component of this project")
    scenario = _with_settings(run, component, settings or {})
    node = scenario.graph.nodes[component]
    inputs = recorded_inputs(run, node)
    answers = comparable_topics(run, component)
    known_ns = run.scenario.duration_ns if run.complete else run.recorded_until_ns
    end_ns = min([entry.end_ns for entry in inputs.values()] + [known_ns])
    if end_ns <= run.begin_ns:
        raise FlightError(f"bag '{path}': nothing can be replayed; {_first_gap(inputs) or 'it holds no messages'}")
    if engine == "ros" and run.begin:
        raise FlightError(f"bag '{path}': this run {run.begin.sentence()}; a node is replayed from t = 0 only; replay it "
                          "with --engine compiled")
    told = progress and (lambda seconds: progress(seconds, end_ns / SECOND))
    with tempfile.TemporaryDirectory(prefix="flight_replay_") as folder:
        folder = Path(folder)
        if engine == "ros":
            again, firings, stopped = as_node(
                run.bag.path, shortened(scenario, end_ns), component, answers, folder, told, check_bounds)
        else:
            again, firings, stopped = _in_process(
                scenario, node, inputs, answers, end_ns, folder / "again", told, check_bounds, run.first)
        recorded = recorded_until(run, answers, again, end_ns, folder / "recorded")
        result = compare(recorded, again, answers, {} if settings else run.changed, tolerance)
    _explain(result, run, inputs, end_ns, stopped, bool(settings))
    return Replay(component, engine, firings, result, bool(settings))


def _with_settings(run: RecordedRun, component: str, settings: dict) -> Scenario:
    if not settings:
        return run.scenario
    for key in settings:
        if key in ("rate_hz", "use"):
            raise FlightError(f"--set {key}: only parameters can be changed in a replay; the recorded messages "
                              "fix the rest")
    data = run.scenario.file.model_dump(by_alias=True, exclude_none=True)
    changes = {f"{component}.{key}": value for key, value in settings.items()}
    return Scenario(setting.override(data, changes), run.scenario.origin)


def recorded_inputs(run: RecordedRun, node: Node) -> dict[str, RecordedInput]:
    """port -> its recorded messages. Raises FlightError where the bag does not hold all of them."""
    plan, graph = run.scenario.recorded(), run.scenario.graph
    edges = node.inputs | {watched_port(*signal): Edge(*signal, 1) for signal in run.scenario.faults.watched(node.name)}
    absent = [f"{port} (/{graph.signal(edge.node, edge.port).topic})" for port, edge in edges.items()
              if (edge.node, edge.port) not in plan]
    if absent:
        raise FlightError(f"{node.name} cannot be replayed: its inputs {', '.join(absent)} were not recorded "
                          "(record.topics of the scenario)")
    thinned = [f"/{graph.signal(edge.node, edge.port).topic}: every {plan[edge.node, edge.port]}th message"
               for edge in edges.values() if plan[edge.node, edge.port] > 1]
    if thinned:
        raise FlightError(f"{node.name} cannot be replayed: the bag was thinned (record.max_rate_hz "
                          f"{run.scenario.file.record.max_rate_hz:g}; {', '.join(thinned)}), and a replay needs every "
                          "input that the component had")
    signals, found = run.signals, {}
    for port, edge in edges.items():
        topic = graph.signal(edge.node, edge.port).topic
        period = graph.nodes[edge.node].output_period_ns(edge.port)
        stamps = run.bag.stamps_ns("/" + topic) - run.scenario.epoch_ns
        whole = len(stamps)
        if run.scenario.is_irregular(edge.node, edge.port):  # what is missing was kept back by a fault, or late
            end = run.scenario.duration_ns if run.complete else run.recorded_until_ns
        else:
            first = -(-run.begin_ns // period)
            wrong = np.flatnonzero(stamps != (first + np.arange(whole)) * period)
            whole = int(wrong[0]) if len(wrong) else whole
            end = (first + whole) * period
        found[port] = RecordedInput(port, topic, period, edge.delay, stamps[:whole], signals[topic][:whole],
                                    end + edge.delay, (edge.node, edge.port))
    return found


def comparable_topics(run: RecordedRun, component: str) -> list[RecordedTopic]:
    """The recorded topics that this component alone publishes. Raises FlightError when there are none."""
    owners = {}
    for topic in run.topics():
        owners.setdefault(topic.topic, set()).add(topic.node)
    found = [topic for topic in run.topics(component)
             if owners[topic.topic] == {component} and "/" + topic.topic in run.bag]
    if not found:
        raise FlightError(f"{component} cannot be replayed: none of its outputs is in the bag, so there is nothing to "
                          "compare with")
    return found


def _in_process(scenario, node, inputs, answers, end_ns, folder, progress, check_bounds, begin):
    """Fire the component by itself at every period; return (bag of answers, firings, sentence of a stop)."""
    machine, given, made = _machine(scenario, node, check_bounds)
    if begin:
        _begin(scenario, machine, inputs, given, begin)
    ports = {topic.port: topic for topic in reversed(answers)}
    rows = {port: 2 * -(-end_ns // topic.period_ns) if scenario.faults.is_irregular(node.name, port)
            else -(-end_ns // topic.period_ns) for port, topic in ports.items()}
    refuse_too_long(sum(rows[port] * topic.signal.dtype.itemsize for port, topic in ports.items()),
                    f"a replay of {end_ns / SECOND:g} s")
    logs = {port: topic.signal.zeros(rows[port]) for port, topic in ports.items()}
    times = {port: [] for port in ports}
    sources = [(entry, _bytes(entry.records), _bytes(given[port])[0]) for port, entry in inputs.items()]
    written = [(port, topic.period_ns, _bytes(logs[port]), _bytes(made[port])[0]) for port, topic in ports.items()]
    shown = max(1, end_ns // node.period_ns // 100)
    stopped, firings, t_ns = "", 0, -(-begin.t_ns // node.period_ns) * node.period_ns if begin else 0
    while t_ns < end_ns:
        for entry, rows, record in sources:
            at = entry.index(t_ns)
            if at >= 0:
                record[:] = rows[at]
        stopped = _fire(machine, t_ns, t_ns == 0 and begin is None)
        if stopped:
            break
        for port, period_ns, rows, record in written:
            if t_ns % period_ns == 0:
                for _ in range(machine.delivered(port)):
                    rows[len(times[port])] = record
                    times[port].append(t_ns)
        firings += 1
        t_ns += node.period_ns
        if progress and firings % shown == 0:
            progress(t_ns / SECOND)
    stamps = [np.array(times[topic.port], np.int64) for topic in answers]
    said = [messages(topic, one, logs[topic.port][:len(one)]) for topic, one in zip(answers, stamps)]
    stamps, written = [one + scenario.epoch_ns for one, _ in said], [rows for _, rows in said]
    return write_topics(folder, answers, stamps, written), firings, stopped


def _bytes(records: np.ndarray) -> np.ndarray:
    """The (n, size) bytes of records."""
    return np.ascontiguousarray(records).view("u1").reshape(len(records), records.dtype.itemsize)


def watched_port(node: str, port: str) -> str:
    """What stands for a signal that conditions of faults read, among the inputs of a component."""
    return f"when {node}.{port}"


def _machine(scenario: Scenario, node: Node, check_bounds: bool):
    """The component outside of any graph, and its input and output records by port."""
    component = node.component
    parameters = component.parameters.record(node.values, node.name)
    parameters["period"] = node.period_ns / SECOND
    inputs = {port: signal.new()[1] for port, signal in component.inputs.items()}
    outputs = {port: signal.new()[1] for port, signal in component.outputs.items()}
    watched = {signal: scenario.graph.signal(*signal).new()[1] for signal in scenario.faults.watched(node.name)}
    periods = {port: node.output_period_ns(port) for port in outputs}
    machine = SingleComponent(node.name, node.use, component, parameters, component.initial_state(node.values), inputs,
                              outputs, periods, scenario.epoch_ns, check_bounds, scenario.faults, watched)
    return machine, inputs | {watched_port(*signal): record for signal, record in watched.items()}, outputs


def _begin(scenario, machine, inputs, given, begin):
    """Let a component stand as it did at a checkpoint, its inputs as they were."""
    machine.restore(begin.arrays)
    schedule = Schedule.of(scenario.graph, {}, scenario.faults)
    for port, entry in inputs.items():
        if begin.t_ns > 0:
            _bytes(given[port])[0][:] = np.frombuffer(begin.arrays[schedule.shown(*entry.source)], "u1")


def _fire(machine, t_ns, is_first) -> str:
    """One firing; the sentence of a stop, or nothing."""
    for part in ("start", "kernel", "output", "update") if is_first else ("kernel", "output", "update"):
        if sentence := machine.call(part, t_ns):
            return sentence
    return ""


def _explain(result: Comparison, run, inputs, end_ns, stopped, open_loop):
    if open_loop:
        result.sentences.insert(0, "open loop: the changed component answered the recorded inputs; what its answers "
                                   "would have changed in the rest of the graph is not in here")
    elif run.changed:
        result.sentences.append(run.changes_sentence())
    if run.is_realtime:
        result.sentences.append("the run was in realtime: an input that came late then is in time here")
    if stopped:
        result.sentences.append(f"replayed, {stopped}")
    if end_ns < run.scenario.duration_ns:
        gap = _first_gap({port: entry for port, entry in inputs.items() if entry.end_ns == end_ns})
        result.sentences.append(f"replayed until t = {end_ns / SECOND:.9g} s of {run.scenario.duration_ns / SECOND:g} "
                                f"s; {gap or 'the bag ends there'}")


def _first_gap(inputs) -> str:
    entry = min(inputs.values(), key=lambda entry: entry.end_ns, default=None)
    if entry is None:
        return ""
    missing_s = (entry.end_ns - entry.delay) / SECOND
    return f"its input {entry.port} (/{entry.topic}) has no message of t = {missing_s:.9g} s"
