"""The node ``replayer``: clock master of a replay. It publishes the recorded inputs and collects the answers."""

import heapq
import signal
import threading
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from flight_graph.errors import FlightError
from flight_graph.recordings.comparison import write_topics
from flight_graph.recordings.recorded_run import open_recorded
from flight_graph.recordings.recording import formatted_payload
from flight_graph.replays.replay import comparable_topics, recorded_inputs
from flight_graph.ros import parameter_changes, slots, texts
from flight_graph.ros.node import CLOCK, CLOCK_PERIOD_NS, clock_payload
from flight_graph.ros.ports import LoopOnly, RawPublisher, RawSubscription
from flight_graph.ros.progress import Watch
from flight_graph.ros.recorded_stream import Stream
from flight_graph.timebase import SECOND, stamp_parts

_PAUSE_S = 0.002  # [s] between two looks at the answers while the component works


class Replayer:
    """The other end of every topic of one component."""

    def __init__(self, node: Node):
        self._node = node
        self.stopping = threading.Event()
        self._run = open_recorded(Path(self._get("bag", "")), trust=True)  # whoever started this node has agreed
        self._component, self._end_ns = self._get("component", ""), self._get("end_ns", 0)
        self._timeout_s, self._window_ns = self._get("timeout_s", 30.0), self._get("window_ns", SECOND)
        self._epoch_ns = self._run.scenario.epoch_ns
        node.settings = SimpleNamespace(epoch_ns=self._epoch_ns)
        graph, replayed = self._run.scenario.graph, self._run.scenario.graph.nodes[self._component]
        self._period_ns = replayed.period_ns
        inputs = {port: entry for port, entry in recorded_inputs(self._run, replayed).items()
                  if entry.source[0] != self._component}  # conditions of its faults may read what it says itself
        self._publishers, self._readers = {}, {}
        self._slots = {}  # topic -> (publisher of its slots, their times)
        for entry in inputs.values():
            sent = graph.signal(*entry.source)
            self._readers[entry.topic] = self._readers.get(entry.topic, 0) + 1
            if entry.topic in self._publishers:
                continue
            self._publishers[entry.topic] = RawPublisher(node, entry.topic, sent.type_name, sent.role.qos)
            if self._run.scenario.is_irregular(*entry.source):
                self._slots[entry.topic] = (
                    RawPublisher(node, slots.slots_topic(entry.topic), slots.TYPE, slots.QOS_OF_SLOTS),
                    range(0, self._end_ns, entry.period_ns), Counter(entry.stamps_ns.tolist()))
        self._clock = None if inputs else RawPublisher(node, *CLOCK)
        group = LoopOnly()
        self._answers = comparable_topics(self._run, self._component)
        self._plain = [topic for topic in self._answers if topic.formatted is None]
        irregular = self._run.scenario.faults.is_irregular
        self._streams = [Stream(node, topic, self._epoch_ns, self._end_ns, group, irregular(topic.node, topic.port))
                         for topic in self._plain]
        self._watch = Watch(node, self._component, group)
        # A node waits for somebody who reads what is set in it.
        self._changes = RawSubscription(node, parameter_changes.TOPIC, texts.TYPE, parameter_changes.QOS, group)

    def _get(self, name, default):
        return self._node.declare_parameter(name, default).value

    def replay(self, folder: Path, announce) -> int:
        """Feed all inputs, collect all answers, write them as a bag; return the number of firings."""
        self._wait(self._is_matched, lambda: f"the node {self._component}: it has not appeared")
        self._wait(lambda: self._watch.read() >= 0, lambda: f"the node {self._component}: it is not ready")
        told_ns = 0
        for t_ns, publish, payload in self._messages():
            self._wait(lambda t_ns=t_ns: t_ns <= self._watch.read() + self._window_ns, self._where)
            publish(payload)
            if t_ns >= told_ns + SECOND:
                told_ns = t_ns
                announce({"progress": t_ns / SECOND})
        self._wait(self._is_complete, self._where)
        self._write(folder)
        return -(-self._end_ns // self._period_ns)

    def _messages(self):
        """Yield (t, publish, payload) of the recorded inputs in write order; clock ticks where there are none."""
        if self._clock is not None:
            for t_ns in range(0, self._end_ns, max(self._period_ns, CLOCK_PERIOD_NS)):
                yield t_ns, self._clock.publish, clock_payload(*stamp_parts(self._epoch_ns + t_ns))
            yield self._end_ns, self._clock.publish, clock_payload(*stamp_parts(self._epoch_ns + self._end_ns))
            return
        messages = ((stamp_ns - self._epoch_ns, 0, self._publishers[name.lstrip("/")].publish, payload) for
                    name, stamp_ns, payload in self._run.bag.messages([f"/{topic}" for topic in self._publishers]))
        said = [self._said(*one) for one in self._slots.values()]
        for t_ns, _, publish, payload in heapq.merge(messages, *said, key=lambda one: one[:2]):
            if t_ns < self._end_ns:
                yield t_ns, publish, payload

    def _said(self, publisher, times, counts):
        """The slots of one topic, as `_messages`."""
        return ((t_ns, 1, publisher.publish, slots.payload(self._epoch_ns + t_ns, counts[t_ns])) for t_ns in times)

    def _is_matched(self):
        return (all(self._publishers[topic].subscribers() >= count for topic, count in self._readers.items())
                and all(self._slots[topic][0].subscribers() >= self._readers[topic] for topic in self._slots)
                and all(stream.publishers() for stream in self._streams) and self._watch.is_matched())

    def _is_complete(self):
        return all(stream.done for stream in self._streams)

    def _where(self):
        return f"the answers of {self._component}; it has come to t = {max(self._watch.t_ns, 0) / SECOND:.9f} s"

    def _wait(self, condition, what):
        """Take answers until the condition holds. Raises FlightError when nothing comes for the timeout."""
        best, deadline = None, time.monotonic() + self._timeout_s
        self._drain()
        while not condition():
            if self.stopping.is_set():
                raise FlightError("the replay was interrupted")
            state = (self._drain(), self._watch.read())
            if state != best:
                best, deadline = state, time.monotonic() + self._timeout_s
            if time.monotonic() > deadline:
                raise FlightError(f"replayer: waited {self._timeout_s:g} s for {what()}")
            time.sleep(_PAUSE_S)

    def _drain(self) -> int:
        for stream in self._streams:
            stream.drain()
        return sum(stream.next_ns for stream in self._streams)

    def _write(self, folder):
        taken = {stream.topic.port: stream.queue for stream in self._streams}
        stamps, rows = [], []
        for topic in self._answers:
            found = [(t_ns, one) for t_ns, one, _ in taken[topic.port]
                     if t_ns == 0 or topic.formatted is None or not topic.formatted.once]
            times, messages = [t_ns for t_ns, _ in found], [one for _, one in found]
            stamps.append(np.array(times, np.int64) + self._epoch_ns)
            rows.append(messages if topic.formatted is None else [self._format(topic, message) for message in messages])
        write_topics(folder, self._answers, stamps, rows)

    @staticmethod
    def _format(topic, message):
        payload, record = topic.signal.new()
        topic.signal.receive(message, payload)
        return formatted_payload(topic.formatted, record)


def run_replayer(arguments: list[str], announce) -> int:
    """Run the node; return the exit status."""
    rclpy.init(args=["replayer", *arguments], signal_handler_options=SignalHandlerOptions.NO)
    node = Node("replayer", start_parameter_services=False)
    try:
        replayer = Replayer(node)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: replayer.stopping.set())
        out = Path(node.declare_parameter("out", "").value)
        firings = replayer.replay(out, announce)
        announce({"recorded": {"firings": firings}, "bag": str(out)})
        while not replayer.stopping.wait(0.05):
            pass
        return 0
    except FlightError as error:
        announce({"error": str(error)})
        return 1
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
