"""A graph of components: who runs when, which output feeds which input, with which delay; and its checks."""

from dataclasses import dataclass, field
from math import gcd

from flight_graph.components.component import Component
from flight_graph.components.namespaces import SHARED
from flight_graph.errors import FlightError, unknown
from flight_graph.timebase import period_ns
from msg_schemas.signal import Signal


@dataclass(frozen=True)
class Edge:
    """The source of an input. delay 0: the newest message stamped <= t; delay 1: the newest one stamped < t."""

    node: str
    port: str
    delay: int = 0


@dataclass
class Node:
    """One component of the graph. use: its name in the registry; values: all parameters in plain form."""

    name: str
    use: str
    component: type[Component]
    values: dict
    rate_hz: float
    inputs: dict[str, Edge] = field(default_factory=dict)

    @property
    def is_foreign(self) -> bool:
        """Whether it stands for a node that is not ours."""
        return self.component.is_foreign

    @property
    def period_ns(self) -> int:
        """Time between two firings [ns]. Raises FlightError where it is no whole number."""
        return period_ns(self.rate_hz, f"{self.name}.rate_hz")

    def output_period_ns(self, port: str) -> int:
        """Period of the messages of an output: the component's own, or the slower one that the port declares."""
        slower = self.component.output_rate_hz.get(port)
        if slower is None or slower >= self.rate_hz:
            return self.period_ns
        period = period_ns(slower, f"{self.name}.{port}")
        if period % self.period_ns:
            raise FlightError(f"{self.name}.{port}: its period of {period} ns is no multiple of the component's "
                              f"{self.period_ns} ns; set {self.name}.rate_hz to a multiple of {slower:g}")
        return period


@dataclass(frozen=True)
class Step:
    """One entry of the order within a tick. part: ``kernel``, ``output``, ``update``, or ``foreign``: what a foreign node
    says.
    """

    node: str
    part: str


class Graph:
    """Nodes by name, in the order of declaration, wired and checked.

    connections: (node, port) -> Edge for the inputs wired by hand; every other input is fed by the one output that
    carries its topic. base_ns: the tick; by default the greatest common divisor of all periods.
    """

    def __init__(self, nodes: list[Node], connections: dict | None = None, base_ns: int | None = None):
        self.nodes = {node.name: node for node in nodes}
        if len(self.nodes) < len(nodes):
            raise FlightError("two components share a name: " + ", ".join(node.name for node in nodes))
        periods = {node.name: node.period_ns for node in nodes}
        self.base_ns = base_ns or gcd(*periods.values())
        for name, period in periods.items():
            if period % self.base_ns:
                raise FlightError(
                    f"{name}.rate_hz: its period of {period} ns is no multiple of the base tick of {self.base_ns} ns")
        if all(node.is_foreign for node in nodes):
            raise FlightError("all components are foreign nodes; a graph has at least one of its own, which sets the time")
        self._check_topics()
        self._wire(connections or {})
        self.order = self._sorted_steps()

    # -- what there is -------------------------------------------------------------------------------------------
    def signal(self, node: str, port: str) -> Signal:
        """The signal of an output, by the names of its node and port."""
        return self.nodes[node].component.outputs[port]

    def outputs(self):
        """Yield (node, port, signal) of every output, in the order of declaration."""
        for node in self.nodes.values():
            for port, signal in node.component.outputs.items():
                yield node, port, signal

    @property
    def clock_master(self) -> str:
        """The node that sets the time over ROS: the first that moves with it, or the first of our own."""
        moving = (node.name for node in self.nodes.values() if node.component.update is not None)
        return next(moving, next(node.name for node in self.nodes.values() if not node.is_foreign))

    def ticks(self, node: Node) -> int:
        """Period of a node in ticks."""
        return node.period_ns // self.base_ns

    def consumers(self, name: str, port: str | None = None):
        """Yield (consumer, input port, edge) of every edge that leaves a node (a port of it)."""
        for node in self.nodes.values():
            for target, edge in node.inputs.items():
                if edge.node == name and port in (None, edge.port):
                    yield node, target, edge

    # -- checks --------------------------------------------------------------------------------------------------
    def _check_topics(self):
        seen = {}
        for node, port, signal in self.outputs():
            topics = [signal.topic] + [made.topic for made in node.component.formatted if made.port == port]
            for topic in topics:
                other = seen.setdefault(topic, f"{node.name}.{port}")
                if other != f"{node.name}.{port}" and topic not in SHARED:
                    raise FlightError(f"{node.name}.{port} and {other} both publish '{topic}'; one topic has one source")

    def _wire(self, connections):
        sources = {signal.topic: (node.name, port) for node, port, signal in self.outputs()}
        for name, port in connections:
            if name not in self.nodes:
                raise unknown("component", name, self.nodes, "connect")
            if port not in self.nodes[name].component.inputs:
                raise unknown("input", port, self.nodes[name].component.inputs, f"connect: {name}")
        for node in self.nodes.values():
            for port, signal in node.component.inputs.items():
                edge = connections.get((node.name, port))
                if edge is None and signal.topic in sources:
                    edge = Edge(*sources[signal.topic])
                if edge is None:
                    if port in node.component.optional_inputs:
                        continue
                    raise FlightError(
                        f"{node.name}.{port} is unconnected: no component publishes '{signal.topic}'; add one, or name "
                        f"another output under connect: {{{node.name}.{port}: component.output}}")
                self._check_edge(node, port, signal, edge)
                node.inputs[port] = edge

    def _check_edge(self, node, port, signal, edge):
        where = f"connect: {node.name}.{port}"
        if edge.node not in self.nodes:
            raise unknown("component", edge.node, self.nodes, where)
        if edge.port not in self.nodes[edge.node].component.outputs:
            raise unknown("output", edge.port, self.nodes[edge.node].component.outputs, f"{where}: {edge.node}")
        if edge.delay and node.is_foreign:
            raise FlightError(f"{where}: a foreign node takes what it takes; give the delay to who reads its answers")
        if edge.delay not in (0, 1):
            raise FlightError(f"{where}: a delay of {edge.delay} ticks is not allowed; allowed: 0 or 1")
        source = self.signal(edge.node, edge.port)
        if source.layout != signal.layout:
            what = "; ".join(f"{part} is {given} there, {taken} here" for part, given, taken in source.differences(signal))
            raise FlightError(
                f"{where}: {edge.node}.{edge.port} is the wrong signal: it carries {source.topic} ({source.type_name}), "
                f"the input takes {signal.topic} ({signal.type_name}): {what}")

    def _sorted_steps(self):
        steps, after = [], {}
        for node in self.nodes.values():
            component = node.component
            parts = ["foreign"] if node.is_foreign else [
                part for part in ("kernel", "output", "update") if getattr(component, part) is not None]
            steps += [Step(node.name, part) for part in parts]
        source_step = {step.node: step for step in steps if step.part != "update"}
        for step in steps:
            after[step] = set()
            if step.part != "output":
                for edge in self.nodes[step.node].inputs.values():
                    if edge.delay == 0 and edge.node in source_step:
                        after[step].add(source_step[edge.node])
            if step.part == "update" and step.node in source_step:
                after[step].add(source_step[step.node])
        order = []
        while len(order) < len(steps):
            ready = next((s for s in steps if s not in order and after[s] <= set(order)), None)
            if ready is None:
                raise FlightError(self._loop_sentence([s for s in steps if s not in order], after))
            order.append(ready)
        return order

    @staticmethod
    def _loop_sentence(left, after):
        path = [left[0]]
        while path[-1] not in path[:-1]:
            path.append(next(s for s in left if s in after[path[-1]]))
        names = [step.node for step in reversed(path[path.index(path[-1]):])]
        return (f"loop without delay: {' -> '.join(names)}; give one of these edges a delay of 1 tick "
                f"(connect: {{{names[1]}.<input>: {{from: {names[0]}.<output>, delay: 1}}}})")
