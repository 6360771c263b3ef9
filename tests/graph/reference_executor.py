"""An independent executor of a graph: event by event, plain Python dictionaries and lists, from the rules in words.

Rules. Time is integer nanoseconds. A component fires when t is a multiple of its period; an output with a rate of its own
is published at multiples of that period alone. An input without delay holds the newest message stamped <= t, one with a
delay the newest stamped < t; before the first message it is zero. Outputs of a plant at t come before everything that
reads them at t; its update at t sees the inputs of t and moves its state to t + period.
Nothing here uses the graph's order, the generated source, or the compiled loop.
"""

import numpy as np

from flight_graph.components.component import kinds_of
from flight_math import plain
from flight_math.values import view


class ReferenceExecutor:
    """Runs a validated scenario; it returns (node, port) -> [(t_ns, payload)]."""

    def __init__(self, scenario):
        self.scenario, self.nodes = scenario, scenario.graph.nodes
        self.parameters, self.states, self.scratch = {}, {}, {}
        self.messages = {}  # (node, port) -> [(t_ns, payload)], in the order of publication
        for name, node in self.nodes.items():
            record = node.component.parameters.record(node.values)
            record["period"] = round(1e9 / node.rate_hz) / 1e9
            self.parameters[name] = view(record[0], node.component.parameters.kinds)
            self.states[name] = view(node.component.initial_state(node.values)[0], node.component.state.kinds)
            for port, signal in node.component.outputs.items():
                self.messages[name, port] = []
                self.scratch[name, port] = signal.new()

    def run(self) -> dict:
        with np.errstate(all="ignore"):
            for name, node in self.nodes.items():
                if node.component.start is not None:
                    plain(node.component.start)(self.parameters[name], self.states[name])
            times = sorted({t for node in self.nodes.values()
                            for t in range(0, self.scenario.duration_ns, int(round(1e9 / node.rate_hz)))})
            for t in times:
                self._instant(t)
        return self.messages

    def _instant(self, t):
        due = [name for name, node in self.nodes.items() if t % int(round(1e9 / node.rate_hz)) == 0]
        open_ = set(due)  # components whose outputs of this instant are still to come
        for name in due:
            if self.nodes[name].component.output is not None:
                self._fire(name, "output", t)
                open_.discard(name)
        while open_:  # any component whose sources of this instant have spoken may fire: the result is the same
            name = next(name for name in sorted(open_) if not any(
                edge.delay == 0 and edge.node in open_ for edge in self.nodes[name].inputs.values()))
            self._fire(name, "kernel", t)
            open_.discard(name)
        for name in due:
            if self.nodes[name].component.update is not None:
                plain(self.nodes[name].component.update)(
                    t, self.parameters[name], self.states[name], *self._inputs(name, t))

    def _fire(self, name, part, t):
        component = self.nodes[name].component
        records = []
        for port, signal in component.outputs.items():
            record = view(self.scratch[name, port][1][0], kinds_of(signal))
            stamp = self.scenario.epoch_ns + t
            record.header.stamp.sec, record.header.stamp.nanosec = stamp // 10**9, stamp % 10**9
            records.append(record)
        inputs = self._inputs(name, t) if part == "kernel" else []
        plain(getattr(component, part))(t, self.parameters[name], self.states[name], *inputs, *records)
        for port in component.outputs:
            rate = component.output_rate_hz.get(port)
            if rate is None or t % int(round(1e9 / rate)) == 0:
                self.messages[name, port].append((t, self.scratch[name, port][0].tobytes()))

    def _inputs(self, name, t):
        found = []
        for port, signal in self.nodes[name].component.inputs.items():
            edge = self.nodes[name].inputs[port]
            allowed = [message for stamp, message in self.messages[edge.node, edge.port][-3:]
                       if (stamp < t if edge.delay else stamp <= t)]
            payload, record = signal.new()
            if allowed:
                payload[:] = np.frombuffer(allowed[-1], "u1")
            found.append(view(record[0], kinds_of(signal)))
        return found
