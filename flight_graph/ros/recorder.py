"""The recorder node: deep reader histories, drained on a period, written in the order of the schedule.

Messages that a component formats from a record (diagnostics, transforms) are made here by the same function.
"""

import json
import os
import time
from pathlib import Path

from flight_graph.components.names import ros
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.bag_scenario import INJECTED_FAULTS, SET_PARAMETERS
from flight_graph.recordings.recording import RunBag, formatted_payload
from flight_graph.ros import live_faults, parameter_changes, texts
from flight_graph.ros.checkpoints import Collector
from flight_graph.ros.installed import is_installed
from flight_graph.ros.ports import LoopOnly, RawSubscription
from flight_graph.ros.progress import Progress
from flight_graph.ros.recorded_stream import Stream
from flight_graph.ros.silence import TRANSITION, Silence
from flight_graph.ros.simulation_settings import RECORDED, add_entry
from flight_graph.ros.slots import TYPE as SLOT_TYPE
from flight_graph.ros.slots import slots_topic
from flight_graph.ros.standing import Reports
from flight_graph.timebase import SECOND
from msg_schemas.qos import Qos

DRAIN_S = 0.02  # [s] a wake-up for every message would halve the speed of the graph
HOLD_S = 0.05  # [s] realtime: a message waits for those of other topics with earlier stamps at most this long
_EAR = Qos(depth=1, reliable=False)  # of topics that are listened to and not recorded
QUIET_S = 0.3  # [s] after an interruption, messages on their way are waited for this long


class Recorder:
    """Writes the streams of a scenario into its bag, merged by stamp and schedule."""

    def __init__(self, node, scenario: Scenario, bag: RunBag, settings, group):
        self.node, self.bag, self.settings = node, bag, settings
        end_ns = settings.duration_ns or scenario.duration_ns
        first = node.beginning.checkpoint.tick if node.beginning else 0
        self.begin_ns = first * scenario.graph.base_ns
        self.streams, self.listeners, self._formatted = [], [], {}
        faulty = {fault.place.node for fault in scenario.faults.of_components()}
        for topic in bag.topics:
            if topic.formatted is None:
                is_foreign = scenario.graph.nodes[topic.node].is_foreign
                slotted = scenario.is_irregular(topic.node, topic.port) and (settings.lockstep or not is_foreign)
                self.streams.append(Stream(node, topic, scenario.epoch_ns, end_ns, group, slotted, not settings.lockstep,
                                           self.begin_ns, is_foreign))
                self.streams[-1].excused = not settings.lockstep and (is_foreign or topic.node in faulty or (
                    scenario.file.watchdog is not None and topic.node != scenario.graph.clock_master))
            else:
                self._formatted.setdefault((topic.node, topic.port), []).append(topic)
        self.end_ns = end_ns
        self.checkpoints = Collector(node, scenario, first, bag.keep) if settings.lockstep else None
        self._injections = RawSubscription(node, live_faults.TOPIC, texts.TYPE, live_faults.QOS, group) if (
            scenario.live_ids) else None
        self._changes = RawSubscription(node, parameter_changes.TOPIC, texts.TYPE, parameter_changes.QOS, group) if (
            settings.supervised) else None
        self.changes = []  # the parameters that were set, as JSON
        self._base_ns, origin = scenario.graph.base_ns, settings.control.origin if settings.control else ""
        self.reports = Reports(node, all_of_them=True) if settings.control else None
        self.done_to_it = [{"tick": first, "t_s": self.begin_ns / SECOND, "did": origin}] if origin else []

    def injected(self) -> list[str]:
        """The faults that were injected, as JSON, each as it was last."""
        found = {}
        while self._injections and (message := self._injections.take()) is not None:
            data = json.loads(texts.text_of(message))
            found[data["id"]] = json.dumps(data)
        return list(found.values())

    def drain(self) -> int:
        while self._changes and (message := self._changes.take()) is not None:
            self.changes.append(texts.text_of(message))
        for report in self.reports.new() if self.reports else ():
            add_entry(self.done_to_it, report, self._base_ns)
        if self.checkpoints:
            self.checkpoints.drain()
        now_ns = max((stream.next_ns - stream.topic.source_period_ns for stream in self.streams if not stream.is_free),
                     default=0)
        return sum(stream.drain(max(0, now_ns)) for stream in self.streams)

    def watermark(self) -> int:
        """Every message stamped before this has been taken. In realtime a late topic holds the others for `HOLD_S`: what
        is held here would be lost with this process."""
        low = min(stream.next_ns for stream in self.streams)
        if self.checkpoints:
            low = min(low, self.checkpoints.until_ns)
        if not self.settings.lockstep:
            long_ago = time.monotonic() - HOLD_S
            held = (t_ns + 1 for stream in self.streams for t_ns, _, taken in stream.queue if taken < long_ago)
            low = max(low, max(held, default=0))
        return min(low, self.end_ns)

    def write_before(self, t_ns: int) -> None:
        """Write all messages stamped before t, by stamp, then in the order of the schedule."""
        ready = []
        for order, stream in enumerate(self.streams):
            while stream.queue and stream.queue[0][0] < t_ns:
                stamp, message, _ = stream.queue.popleft()
                ready.append((stamp, order, message))
        ready.sort(key=lambda item: item[:2])
        for stamp, order, message in ready:
            stream = self.streams[order]
            self.bag.write(stream.topic, stamp, message)
            for topic in self._formatted.get((stream.topic.node, stream.topic.port), ()):
                if stamp and topic.formatted.once:
                    continue
                self.bag.write(topic, stamp, formatted_payload(topic.formatted, stream.record(message)))

    def lost(self) -> dict[str, int]:
        """Topic -> messages lost. Where any topic has come to the last tick of the run, the others should have."""
        last_ns = max(stream.next_ns - stream.topic.source_period_ns for stream in self.streams)
        ended = last_ns + min(stream.topic.source_period_ns for stream in self.streams) >= self.end_ns
        counts = {stream: stream.lost + (stream.missing if ended else 0) for stream in self.streams}
        return {"/" + stream.topic.topic: int(count) for stream, count in counts.items() if count}

    def late(self) -> dict[str, int]:
        """Topic of a foreign node -> answers that were late."""
        return {"/" + stream.topic.topic: stream.late for stream in self.streams if stream.late}

    def refused(self) -> dict[str, int]:
        return {"/" + stream.topic.topic: stream.refused for stream in self.streams if stream.refused}

    @property
    def done(self) -> bool:
        """Whether all has come; of streams that are excused, what has come by then."""
        return all(stream.done for stream in self.streams if not stream.excused) and (
            self.checkpoints is None or self.checkpoints.done)


def run(node, scenario: Scenario, folder: Path, settings) -> dict:
    """Record until every topic is complete, the node is asked to end, or nothing more will come; return the outcome.

    Raises FlightError, with the bag closed.
    """
    bag = RunBag(folder, scenario, "ros", node.pace, begin=node.beginning)
    bag.writer.metadata("flight_graph.ros", {"domain_id": os.environ.get("ROS_DOMAIN_ID") or "0"})
    recorder = Recorder(node, scenario, bag, settings, LoopOnly())
    progress = Progress(node, settings)
    recorder.listeners = _listeners(node, scenario, recorder.streams) if settings.supervised else []
    silence = Silence(node, scenario, settings, recorder.streams, recorder.reports)
    try:
        _wait_for_publishers(node, recorder, settings, progress)
        progress.tell(recorder.begin_ns)
        while not recorder.done and not node.should_end() and not silence.is_final(recorder.drain()):
            mark = recorder.watermark()
            recorder.write_before(mark)
            progress.tell(mark, now=True)
            time.sleep(DRAIN_S)
        complete = recorder.done
        if not complete:
            _drain_until_quiet(recorder)
        recorder.write_before(recorder.end_ns)
    finally:
        lost = recorder.lost()
        outcome = {"complete": str(recorder.done and not lost).lower(), "lost": str(sum(lost.values())),
                   **{f"lost {topic}": str(count) for topic, count in lost.items()},
                   **{f"late {topic}": str(count) for topic, count in recorder.late().items()},
                   **{f"refused {topic}": str(count) for topic, count in recorder.refused().items()}}
        if injected := recorder.injected():
            bag.writer.metadata(INJECTED_FAULTS, {str(number): text for number, text in enumerate(injected)})
        if recorder.changes:
            bag.writer.metadata(SET_PARAMETERS, {str(number): text for number, text in enumerate(recorder.changes)})
        if recorder.done_to_it:
            bag.writer.metadata(RECORDED, {str(number): json.dumps(one) for number, one in enumerate(recorder.done_to_it)})
        if done := _events(node):
            bag.writer.metadata("flight_graph.watchdog", {str(number): text for number, text in enumerate(done)})
        bag.close(outcome)
    if settings.lockstep and lost:
        raise FlightError(f"{node.get_name()}: messages were lost in lockstep: " + ", ".join(
            f"{count} on {topic}" for topic, count in lost.items()))
    if silence.sentence:
        raise FlightError(silence.sentence)
    progress.tell(recorder.end_ns, now=True)
    return outcome


def _events(node) -> list[str]:
    """What was done to processes of the graph in this run."""
    path = Path(node.events) if node.events else None
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path and path.exists() else []


def _listeners(node, scenario, streams) -> list[RawSubscription]:
    """Ears for what a graph publishes for others alone, so that `ros2 doctor` finds no topic without a subscriber."""
    graph, types = scenario.graph, {"/clock": "rosgraph_msgs/msg/Clock", f"{node.get_name()}/transition_event": TRANSITION}
    for name, found in graph.nodes.items():
        signals = [graph.signal(name, port) for port in found.component.outputs]
        types |= {made.topic: made.type_name for made in [*signals, *found.component.formatted]}
        types |= {slots_topic(signal.topic): SLOT_TYPE for port, signal in found.component.outputs.items()
                  if scenario.faults.is_irregular(name, port)}
    for stream in streams:
        types.pop(stream.topic.topic, None)
        types.pop(slots_topic(stream.topic.topic), None)
    group = LoopOnly()
    return [RawSubscription(node, topic, type_name, _EAR, group) for topic, type_name in types.items()
            if is_installed(type_name)]


def _wait_for_publishers(node, recorder, settings, progress):
    deadline = time.monotonic() + settings.timeout_s
    while True:
        missing = [f"{stream.subscription.topic} by the node {stream.topic.node}" for stream in recorder.streams
                   if stream.publishers() < 1]
        missing += [f"{ros(name)}/_checkpoint" for name in (recorder.checkpoints.missing() if recorder.checkpoints else ())]
        late = f"a publisher of {', '.join(missing)}" if missing else progress.unmatched()
        if late is None or node.should_end():
            return
        if time.monotonic() > deadline:
            raise FlightError(f"{node.get_name()}: waited {settings.timeout_s:g} s for {late}")
        time.sleep(0.01)


def _drain_until_quiet(recorder):
    quiet_since = time.monotonic()
    while time.monotonic() - quiet_since < QUIET_S:
        if recorder.drain():
            quiet_since = time.monotonic()
        time.sleep(DRAIN_S)


def read_scenario(text: str) -> Scenario:
    """A scenario by name or YAML file, or the resolved one of a run as a JSON file."""
    from flight_graph.graphs.scenario import load
    if text.endswith(".json"):
        return Scenario(json.loads(Path(text).read_text(encoding="utf-8")), Path(text).name, Path(text).parent)
    return load(text)
