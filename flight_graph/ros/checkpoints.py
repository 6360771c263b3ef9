"""Checkpoints of a graph of nodes in lockstep: every node tells its part of the memory, the recorder puts them together.

``<node>/_checkpoint`` carries std_msgs/UInt8MultiArray: the part of the node, as `flight_graph.engines.checkpoint` packs
it. A node that begins at a checkpoint reads the whole one from a file, and takes its part and what its inputs would have.
"""

import numpy as np

from flight_graph.components.names import ros
from flight_graph.engines.checkpoint import Checkpoint, is_kept, shape
from flight_graph.engines.schedule import Schedule
from flight_graph.graphs.scenario import Scenario
from flight_graph.ros.checkpoint_settings import CheckpointSettings, period_ns, read
from flight_graph.ros.ports import LoopOnly, RawPublisher, RawSubscription
from flight_graph.timebase import next_checkpoint_ns
from msg_schemas.qos import QOS, Role
from msg_schemas.signal import ENCAPSULATION

TYPE = "std_msgs/msg/UInt8MultiArray"
_QOS = QOS[Role.SENSOR]


class NodeMemory:
    """A node's part in the checkpoints. machine(): its `SingleComponent` as it is now."""

    def __init__(self, node, settings: CheckpointSettings, machine):
        self._node, self._settings, self._machine = node, settings, machine
        self._begin = read(settings.file)
        self.begin_ns = self._begin.checkpoint.t_ns if self._begin else 0
        self.is_restored = self._begin is not None
        self._shown = {}  # port -> what readers have got of an output of which they may not have got the newest
        self._publisher = self._due_ns = None
        if settings.period_ns:
            self._publisher = RawPublisher(node, f"{ros(node.graph_name)}/_checkpoint", TYPE, _QOS)
            self._due_ns = next_checkpoint_ns(self.begin_ns, settings.period_ns, settings.base_ns)

    def unmatched(self) -> str | None:
        """Who does not hear the checkpoints yet."""
        return "the recorder: it has not appeared" if self._publisher and self._publisher.subscribers() < 1 else None

    def watch(self, outputs: dict, slower) -> None:
        """Keep what readers get of some outputs. outputs: port -> its end; slower: ports that are slower than the node."""
        if self._publisher:
            self._shown = {name: np.zeros(port.record.nbytes, "u1") for name, port in outputs.items()
                           if name in slower or self._node.settings.slotted[name]}
            for name in self._shown:
                self._shown[name][:] = self._bytes(outputs[name].record)

    def published(self, name: str, record: np.ndarray, count: int) -> None:
        """An output was sent so many times."""
        if count and name in self._shown:
            self._shown[name][:] = self._bytes(record)

    def restore(self) -> None:
        """Take this node's part and what its inputs would have, where the run begins at a checkpoint."""
        if self._begin is None:
            return
        arrays = self._begin.checkpoint.arrays
        self._machine().restore(arrays)
        for port, shown in self._shown.items():
            shown[:] = np.frombuffer(arrays[f"V_{self._node.graph_name}.{port}"], "u1")
        self.restore_inputs()

    def restore_inputs(self) -> None:
        """Take what the inputs would have, where the run begins at a checkpoint."""
        for port, end in self._node.inputs.items() if self._begin else ():
            arrays, source = self._begin.checkpoint.arrays, self._node.settings.sources[port]
            newest = (self.begin_ns - 1) // source.period_ns * source.period_ns if source.period_ns else -1
            if newest >= 0:
                self._bytes(end.record)[:] = np.frombuffer(arrays[self._settings.inputs[port]], "u1")
                end.stamp_ns = newest

    def tell(self, t_ns: int) -> None:
        """Before the firing at t, the next one: tell the memory of the checkpoints until then."""
        while self._publisher and self._due_ns <= t_ns and self._due_ns < self._node.settings.duration_ns:
            self._publisher.publish(_message(self._part()))
            self._due_ns = next_checkpoint_ns(self._due_ns, self._settings.period_ns, self._settings.base_ns)

    def _part(self) -> bytes:
        name = self._node.graph_name
        arrays = self._machine().kept() | {f"V_{name}.{port}": shown.tobytes() for port, shown in self._shown.items()}
        arrays = {key: arrays[key] for key in sorted(arrays)}
        said = {"base_ns": self._settings.base_ns, "records": dict.fromkeys(arrays, {})}
        return Checkpoint(self._due_ns // self._settings.base_ns, said, arrays).encode()

    @staticmethod
    def _bytes(record):
        return record.view("u1").reshape(-1)


class Collector:
    """The recorder's part: checkpoints are whole when every node has told its own. keep(checkpoint): into the bag."""

    def __init__(self, node, scenario: Scenario, first: int, keep):
        self._scenario, self._keep, self._parts = scenario, keep, {}
        wanted = period_ns(scenario) > 0
        self._due = scenario.next_checkpoint(first) if wanted else scenario.ticks
        group = LoopOnly()
        self._subscriptions = {name: RawSubscription(node, f"{ros(name)}/_checkpoint", TYPE, _QOS, group)
                               for name in scenario.graph.nodes} if wanted else {}
        arrays = Schedule.of(scenario.graph, {}, scenario.faults).memory(0) if self._subscriptions else {}
        self._shape = shape(scenario.graph, arrays, scenario.epoch_ns)
        self._names = sorted(name for name in arrays if is_kept(name))

    @property
    def until_ns(self) -> int:
        """Time of the first checkpoint that has not been kept; the end of the run where all have."""
        return self._due * self._scenario.graph.base_ns

    @property
    def done(self) -> bool:
        """Whether all checkpoints have been kept."""
        return not self._subscriptions or self._due >= self._scenario.ticks

    def missing(self) -> list[str]:
        """The nodes whose checkpoints are not heard yet."""
        return [name for name, one in self._subscriptions.items() if one.publishers() < 1]

    def drain(self) -> None:
        """Take what has come; keep the checkpoints that are whole."""
        for name, subscription in self._subscriptions.items():
            while (message := subscription.take()) is not None:
                part = Checkpoint.decode(bytes(message[16:]), f"{name}/_checkpoint")
                self._parts.setdefault(part.tick, {})[name] = part.arrays
        while len(found := self._parts.get(self._due, {})) == len(self._subscriptions) and not self.done:
            arrays = {name: content for part in found.values() for name, content in part.items()}
            del self._parts[self._due]
            if sorted(arrays) != self._names:  # set while the graph runs, a node remembers what its scenario does not say
                self._due = self._scenario.ticks
                return
            self._keep(Checkpoint(self._due, self._shape, {name: arrays[name] for name in self._names}))
            self._due = self._scenario.next_checkpoint(self._due)


def _message(content: bytes) -> bytes:
    """A serialised std_msgs/UInt8MultiArray without dimensions."""
    return ENCAPSULATION + bytes(8) + len(content).to_bytes(4, "little") + content
