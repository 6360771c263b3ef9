"""What a graph does in a tick, as data: the memory of a run, and who copies, fires and publishes when.

Nothing here belongs to an engine: names stand for arrays. `flight_graph.engines.driver` binds them to addresses,
`flight_graph.engines.plain_driver` to records.

The memory of a run is a dictionary of arrays: P_ and X_ (parameters and state of each node), O_ (what a node wrote to an
output), V_ (what readers see of an output slower than its node), H_ (what an input that is delayed or unconnected
holds), L_ (the log of an output), M_ (what a measure remembers). The last dot stands between node and port: a port's name
has none.
"""

from dataclasses import dataclass, field

import numpy as np

from flight_graph.engines import effects, fault_schedule
from flight_graph.engines.fault_schedule import Channel, Own
from flight_graph.engines.reductions import MEMORY, Reduction
from flight_graph.engines.tape import Tape
from flight_graph.faults.fault_set import FaultSet
from flight_graph.graphs.graph import Graph
from flight_graph.graphs.measures import Measure
from flight_graph.timebase import SECOND
from msg_schemas.signal import Signal


@dataclass(frozen=True)
class Hold:
    """At every period-th tick, before anything fires: an input with a delay takes the newest message."""

    period: int
    target: str
    origin: str


@dataclass(frozen=True)
class Publication:
    """What follows the firing that wrote an output, at every period-th tick: check, show to readers, log, reduce.

    visible: the copy that readers see, where the output is slower than its node or its messages may be missing.
    log_period [ticks]: of the log and of reductions, 0 for neither. written: the record that the part writes, where faults
    stand between it and ``record``; channel: the way through them; times: ticks of the logged messages, where they are not
    regular.
    """

    port: str
    signal: Signal
    period: int
    record: str
    visible: str | None
    log: str | None
    log_period: int
    written: str = ""
    channel: Channel | None = None
    times: str | None = None
    reductions: tuple[Reduction, ...] = ()

    def log_rows(self, ticks: int) -> int:
        """Rows of the log of a run of so many ticks."""
        twice = any(effect.op == effects.DUPLICATE for effect in self.channel.effects) if self.channel else False
        return -(-ticks // self.log_period) * (1 + twice)


@dataclass(frozen=True)
class Firing:
    """One part of one node, at every period-th tick. records: names of its inputs, then of its outputs.

    own: what faults do before it.
    """

    node: str
    part: str
    period: int
    parameters: str
    state: str
    records: tuple[str, ...]
    publications: tuple[Publication, ...]
    own: Own | None = None


@dataclass
class Schedule:
    """The order of a tick. starts: (node, parameters, state) of the nodes with a start, run once before the first tick.

    tapes: of foreign nodes' outputs, played after the holds, before anything fires.
    """

    graph: Graph
    plan: dict
    faults: FaultSet | None = None
    measured: dict = field(default_factory=dict)
    starts: list[tuple[str, str, str]] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    firings: list[Firing] = field(default_factory=list)
    tapes: list[Tape] = field(default_factory=list)

    @classmethod
    def of(cls, graph: Graph, plan: dict, faults: FaultSet | None = None,
           measured: dict[tuple[str, str], tuple[int, list[Measure]]] | None = None,
           tapes: dict | None = None) -> "Schedule":
        """The schedule of a graph. plan: (node, port) -> every how manieth message goes into the log; measured: (node,
        port) -> every how manieth is reduced, and to what; tapes: (node, port) -> (ticks, records) of what foreign nodes
        said.
        """
        schedule = cls(graph, plan, faults, measured or {})
        for node in graph.nodes.values():
            if node.component.start is not None:
                schedule.starts.append((node.name, f"P_{node.name}", f"X_{node.name}"))
            schedule.holds += [Hold(graph.ticks(node), _held(node, port), schedule.shown(edge.node, edge.port))
                               for port, edge in node.inputs.items() if edge.delay]
            if faults:
                schedule.holds += [Hold(graph.ticks(node), fault_schedule.watched(node.name, *signal),
                                        schedule.shown(*signal))
                                   for signal in faults.watched(node.name)]
        schedule.firings = [schedule._firing(step) for step in graph.order if not graph.nodes[step.node].is_foreign]
        schedule.tapes = [Tape(*key, schedule.shown(*key), *found) for key, found in (tapes or {}).items()]
        return schedule

    def log_bytes(self, ticks: int) -> int:
        """Size of the logs of a run of so many ticks."""
        return sum(made.log_rows(ticks) * made.signal.dtype.itemsize for firing in self.firings
                   for made in firing.publications if made.log is not None)

    def memory(self, ticks: int, logs: dict | None = None) -> dict[str, np.ndarray]:
        """Fresh arrays for a run of so many ticks.

        logs: the arrays of an earlier run; those that fit are filled again (a run fills every row that it reports).
        """
        arrays = {}
        for node in self.graph.nodes.values():
            component = node.component
            parameters = component.parameters.record(node.values, node.name)
            parameters["period"] = node.period_ns / SECOND
            arrays[f"P_{node.name}"], arrays[f"X_{node.name}"] = parameters, component.initial_state(node.values)
            for port, signal in component.outputs.items():
                arrays[f"O_{node.name}.{port}"] = signal.new()[1]
                if self._is_copied(node, port):
                    arrays[f"V_{node.name}.{port}"] = signal.new()[1]
            for port, signal in component.inputs.items():
                if _is_held(node, port):
                    arrays[_held(node, port)] = signal.new()[1]
            for signal in self.faults.watched(node.name) if self.faults else ():
                arrays[fault_schedule.watched(node.name, *signal)] = self.graph.signal(*signal).new()[1]
        components = {name: node.component for name, node in self.graph.nodes.items()}
        arrays |= fault_schedule.memory(self.firings, components, arrays)
        for firing in self.firings:
            for made in firing.publications:
                arrays |= {one.memory: np.zeros(1, MEMORY) for one in made.reductions}
                if made.log is not None:
                    rows, old = made.log_rows(ticks), (logs or {}).get(made.log)
                    fits = old is not None and len(old) == rows and old.dtype == made.signal.dtype
                    arrays[made.log] = old if fits else made.signal.zeros(rows)
                    if made.times:
                        arrays[made.times] = np.zeros(rows, np.int64)
        return arrays

    def log_period_ns(self, node: str, port: str) -> int:
        """Time between the logged messages of an output."""
        return self.graph.nodes[node].output_period_ns(port) * self.plan[node, port]

    # -- names of arrays -----------------------------------------------------------------------------------------
    def _faults_of(self, node):
        return fault_schedule.of(self.faults, node)

    def _firing(self, step) -> Firing:
        node, faults = self.graph.nodes[step.node], self._faults_of(self.graph.nodes[step.node])
        inputs = [] if step.part == "output" else list(node.component.inputs)
        outputs = [] if step.part == "update" else list(node.component.outputs)
        origins = {port: self.read_by(node, port) for port in inputs}
        channels = {port: channel for port, origin in origins.items()
                    if faults and (channel := faults.input(port, origin)) is not None}
        seen = {port: channels[port].visible if port in channels else origin for port, origin in origins.items()}
        own = faults.own(step.part, f"P_{node.name}", f"X_{node.name}", tuple(channels.values())) if faults else None
        publications = [self._publication(node, port, faults) for port in outputs]
        return Firing(node.name, step.part, self.graph.ticks(node), f"P_{node.name}", f"X_{node.name}",
                      (*seen.values(), *(made.written for made in publications)), tuple(publications), own)

    def _publication(self, node, port, faults) -> Publication:
        logged, name = (node.name, port) in self.plan, f"{node.name}.{port}"
        every, measures = self.measured.get((node.name, port), (self.plan.get((node.name, port), 0), ()))
        period = node.output_period_ns(port) // self.graph.base_ns
        channel = faults.output(port, f"O_{name}", f"E_{name}") if faults else None
        return Publication(
            port, node.component.outputs[port], period, f"E_{name}" if channel else f"O_{name}",
            f"V_{name}" if self._is_copied(node, port) else None,
            f"L_{name}" if logged else None, period * every,
            f"O_{name}", channel, f"T_{name}" if logged and self._is_irregular(node, port) else None,
            tuple(Reduction(one, f"M_{one.name}") for one in measures))

    def _is_irregular(self, node, port) -> bool:
        return bool(self.faults) and self.faults.is_irregular(node.name, port)

    def _is_copied(self, node, port) -> bool:
        return not node.is_foreign and (is_slower(node, port) or self._is_irregular(node, port))

    def shown(self, name: str, port: str) -> str:
        """The array that readers of an output see."""
        node, faults = self.graph.nodes[name], self._faults_of(self.graph.nodes[name])
        if self._is_copied(node, port):
            return f"V_{name}.{port}"
        return f"{'E' if faults and faults.output(port, '', '') else 'O'}_{name}.{port}"

    def read_by(self, node, port: str) -> str:
        """The array that an input reads, before its faults."""
        return _held(node, port) if _is_held(node, port) else self.shown(node.inputs[port].node, node.inputs[port].port)


def is_slower(node, port) -> bool:
    """Whether an output has a rate of its own."""
    return port in node.component.output_rate_hz


def _held(node, port):
    return f"H_{node.name}.{port}"


def _is_held(node, port):
    return port not in node.inputs or bool(node.inputs[port].delay)


def stamp_offset(signal: Signal) -> int:
    """Where in a record the eight bytes of its stamp are (sec, nanosec)."""
    dtype, offset = signal.dtype, 0
    for name in signal.stamp_path.split("."):
        dtype, more = dtype.fields[name][:2]
        offset += more
    return offset


def finite_runs(signal: Signal) -> list[tuple[int, int, int]]:
    """(offset, count, size in bytes) of the floats of a record that must be finite; neighbours joined."""
    found = []
    for path, dtype, offset, length in signal.leaves():
        size = dtype.base.itemsize
        if dtype.base.kind != "f" or path in signal.may_be_nonfinite:
            continue
        if found and found[-1][2] == size and found[-1][0] + size * found[-1][1] == offset:
            found[-1] = (found[-1][0], found[-1][1] + length // size, size)
        else:
            found.append((offset, length // size, size))
    return found
