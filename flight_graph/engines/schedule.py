"""What a graph does in a tick, as data: the memory of a run, and who copies, fires and publishes when.

Nothing here belongs to an engine: names stand for arrays. `flight_graph.engines.driver` binds them to addresses,
`flight_graph.engines.plain_driver` to records.

The memory of a run is a dictionary of arrays: P_ and X_ (parameters and state of each node), O_ (what a node wrote to an
output), V_ (what readers see of an output slower than its node), H_ (what an input that is delayed or unconnected
holds), L_ (the log of an output).
"""

from dataclasses import dataclass, field

import numpy as np

from flight_graph.graphs.graph import Graph
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
    """What follows the firing that wrote an output, at every period-th tick: check, show to readers, log.

    visible: the copy that readers see, where the output is slower than its node. log_period [ticks]: 0 for no log.
    """

    port: str
    signal: Signal
    period: int
    record: str
    visible: str | None
    log: str | None
    log_period: int


@dataclass(frozen=True)
class Firing:
    """One part of one node, at every period-th tick. records: names of its inputs, then of its outputs."""

    node: str
    part: str
    period: int
    parameters: str
    state: str
    records: tuple[str, ...]
    publications: tuple[Publication, ...]


@dataclass
class Schedule:
    """The order of a tick. starts: (node, parameters, state) of the nodes with a start, run once before the first tick."""

    graph: Graph
    plan: dict
    starts: list[tuple[str, str, str]] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    firings: list[Firing] = field(default_factory=list)

    @classmethod
    def of(cls, graph: Graph, plan: dict) -> "Schedule":
        """The schedule of a graph. plan: (node, port) -> every how manieth message goes into the log."""
        schedule = cls(graph, plan)
        for node in graph.nodes.values():
            if node.component.start is not None:
                schedule.starts.append((node.name, f"P_{node.name}", f"X_{node.name}"))
            schedule.holds += [Hold(graph.ticks(node), _held(node, port), _visible(graph, edge))
                               for port, edge in node.inputs.items() if edge.delay]
        schedule.firings = [_firing(graph, plan, step) for step in graph.order]
        return schedule

    def log_bytes(self, ticks: int) -> int:
        """Size of the logs of a run of so many ticks."""
        return sum(-(-ticks // made.log_period) * made.signal.dtype.itemsize for firing in self.firings
                   for made in firing.publications if made.log is not None)

    def memory(self, ticks: int, logs: dict | None = None) -> dict[str, np.ndarray]:
        """Fresh arrays for a run of so many ticks.

        logs: the arrays of an earlier run; those that fit are filled again (a run fills every row).
        """
        arrays = {}
        for node in self.graph.nodes.values():
            component = node.component
            parameters = component.parameters.record(node.values, node.name)
            parameters["period"] = node.period_ns / SECOND
            arrays[f"P_{node.name}"], arrays[f"X_{node.name}"] = parameters, component.initial_state(node.values)
            for port, signal in component.outputs.items():
                arrays[f"O_{node.name}_{port}"] = signal.new()[1]
                if is_slower(node, port):
                    arrays[f"V_{node.name}_{port}"] = signal.new()[1]
            for port, signal in component.inputs.items():
                if _is_held(node, port):
                    arrays[_held(node, port)] = signal.new()[1]
        for firing in self.firings:
            for made in firing.publications:
                if made.log is not None:
                    rows, old = -(-ticks // made.log_period), (logs or {}).get(made.log)
                    fits = old is not None and len(old) == rows and old.dtype == made.signal.dtype
                    arrays[made.log] = old if fits else made.signal.zeros(rows)
        return arrays

    def log_period_ns(self, node: str, port: str) -> int:
        """Time between the logged messages of an output."""
        return self.graph.nodes[node].output_period_ns(port) * self.plan[node, port]


def _firing(graph, plan, step):
    node = graph.nodes[step.node]
    inputs = [] if step.part == "output" else [_read(graph, node, port) for port in node.component.inputs]
    outputs = [] if step.part == "update" else list(node.component.outputs)
    return Firing(
        node.name, step.part, graph.ticks(node), f"P_{node.name}", f"X_{node.name}",
        (*inputs, *(f"O_{node.name}_{port}" for port in outputs)),
        tuple(_publication(graph, plan, node, port) for port in outputs))


def _publication(graph, plan, node, port):
    logged = (node.name, port) in plan
    period = node.output_period_ns(port) // graph.base_ns
    return Publication(
        port, node.component.outputs[port], period, f"O_{node.name}_{port}",
        f"V_{node.name}_{port}" if is_slower(node, port) else None,
        f"L_{node.name}_{port}" if logged else None, period * plan[node.name, port] if logged else 0)


def is_slower(node, port) -> bool:
    """Whether an output has a rate of its own."""
    return port in node.component.output_rate_hz


def _held(node, port):
    return f"H_{node.name}_{port}"


def _is_held(node, port):
    return port not in node.inputs or bool(node.inputs[port].delay)


def _read(graph, node, port):
    return _held(node, port) if _is_held(node, port) else _visible(graph, node.inputs[port])


def _visible(graph, edge):
    return f"{'V' if is_slower(graph.nodes[edge.node], edge.port) else 'O'}_{edge.node}_{edge.port}"


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
