"""What was computed again against what a bag holds: byte for byte, or within a tolerance where versions differ."""

from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from flight_graph.bags.diff import TopicDifference, diff, floats, seconds_text
from flight_graph.bags.fields import columns, entry_names, named
from flight_graph.bags.message_types import vector_paths
from flight_graph.bags.reader import Bag, read_bag
from flight_graph.bags.writer import BagWriter
from flight_graph.recordings.recording import RecordedTopic, write_blocks

EQUAL, CLOSE, DIFFERENT, NOT_COMPARED = "equal", "close", "different", "not compared"
TOLERANCE = 1e-6  # [1] of the largest magnitude that a field reaches in the bag


@dataclass
class Comparison:
    """A verdict (`EQUAL`: every byte; `CLOSE`: within the tolerance; ...) and what it rests on.

    applied: ``bytes``, ``tolerance`` or ``nothing``. sentences: for a person, the first one says it all.
    """

    verdict: str
    applied: str
    messages: int = 0
    sentences: list[str] = field(default_factory=list)
    topics: list[TopicDifference] = field(default_factory=list)
    changed: dict[str, tuple[str, str]] = field(default_factory=dict)
    tolerance: float = TOLERANCE

    @property
    def holds(self) -> bool:
        """Whether the run came out as it was: equal, or close where versions differ."""
        return self.verdict in (EQUAL, CLOSE)

    def plain(self) -> dict:
        """The comparison as JSON knows it."""
        found = asdict(self)
        found["topics"] = [{key: value for key, value in topic.items() if value not in (None, {}, "")}
                           for topic in found["topics"] if not topic["equal"]]
        return found


def compare(recorded: Bag, again: Bag, topics: list[RecordedTopic], changed: dict,
            tolerance: float = TOLERANCE) -> Comparison:
    """Compare recorded topics of two bags, and the order of their messages.

    changed: versions that differ. Where nothing differs, every byte must be equal; else a field may differ by the
    tolerance times its largest magnitude, or by its floor (`msg_schemas.signal.Quantity.floor`) where that is more.
    """
    signals = {f"/{topic.topic}": topic.signal for topic in topics}
    topics = list(signals)
    found = diff(recorded, again, topics)
    result = Comparison(EQUAL, "bytes", sum(topic.count_a or 0 for topic in found), topics=found, changed=changed,
                        tolerance=tolerance)
    order = _order_difference(recorded, again, topics) if all(topic.equal for topic in found) else None
    if all(topic.equal for topic in found) and order is None:
        result.sentences.append(f"equal, byte for byte: {result.messages} messages on {len(found)} topics")
        return result
    result.verdict = DIFFERENT
    if order is not None:
        result.sentences.append(order)
        return result
    first = min((topic for topic in found if not topic.equal),
                key=lambda topic: (topic.first.stamp_ns if topic.first else -1))
    if changed:
        result.applied = "tolerance"
        beyond = [text for topic in found if not topic.equal
                  for text in _beyond(recorded, topic, signals[topic.topic], tolerance)]
        if not beyond:
            result.verdict = CLOSE
            result.sentences.append(
                f"not equal byte for byte, but within {tolerance:g} of each field's largest magnitude, or its floor: "
                f"{result.messages} messages on {len(found)} topics")
            return result
        result.sentences.append(f"different beyond the tolerance of {tolerance:g}: " + "; ".join(beyond[:3]))
    at = f" (t = {seconds_text(first.first.stamp_ns - recorded.start_ns)} s)" if first.first else ""
    result.sentences.append(f"{first}{at}")
    return result


def write_topics(folder: Path, topics: list[RecordedTopic], stamps: list, rows: list) -> Bag:
    """Write topics as a bag and open it. stamps: of (n,) log times [ns] each; rows: their payloads."""
    with BagWriter(folder) as writer:
        handles, blocks = {}, []
        for topic, times, payloads in zip(topics, stamps, rows):
            name = "/" + topic.topic
            if name not in handles:
                handles[name] = writer.add_topic(name, topic.type_name, topic.role.qos)
            blocks.append((handles[name], times, payloads))
        write_blocks(writer, blocks)
    return read_bag(folder)


def recorded_until(run, topics: list[RecordedTopic], again: Bag, end_ns: int, folder: Path) -> Bag:
    """The recorded messages of topics before a time since the start of the run, as a bag of their own, in their order.

    run: a `flight_graph.recordings.recorded_run.RecordedRun`; of one that did not come to its end, no later ones than
    those that were made again.
    """
    last_ns = run.scenario.epoch_ns + end_ns - 1
    if not run.complete:  # what was lost cannot be compared
        last_ns = min(last_ns, again.end_ns)
    with BagWriter(folder) as writer:
        handles = {}
        for topic in topics:
            name = "/" + topic.topic
            if name not in handles and name in run.bag:
                handles[name] = writer.add_topic(name, topic.type_name, topic.role.qos)
        for name, stamp_ns, payload in run.bag.messages(list(handles)):
            if stamp_ns <= last_ns:
                writer.write(handles[name], stamp_ns, payload)
    return read_bag(folder)


def _order_difference(recorded, again, topics):
    sides = []
    for bag in (recorded, again):
        names, owners, stamps = bag.write_order()
        number = np.array([topics.index(name) if name in topics else -1 for name in names], np.int64)[owners]
        sides.append((number[number >= 0], stamps[number >= 0]))
    wrong = np.flatnonzero(sides[0][0] != sides[1][0])
    if not len(wrong):
        return None
    at = int(wrong[0])
    return (f"the same messages in another order: at {sides[0][1][at] / 1e9:.9f} s the bag has "
            f"{topics[sides[0][0][at]]} where {topics[sides[1][0][at]]} comes now")


def _beyond(recorded, topic, signal, tolerance):
    """Yield what of a topic is beyond the tolerance: counts, stamps, strings and whole numbers must be equal."""
    if topic.remark or topic.count_a != topic.count_b or topic.first.field == "stamp":
        yield str(topic)
        return
    vectors = vector_paths(recorded.field_trees(topic.topic), recorded.topic(topic.topic).type_name)
    names = entry_names(recorded, topic.topic)
    known = {named(name, names): values for name, _, values in columns(
        recorded[topic.topic], lambda path, length: path in vectors)}
    for name, difference in topic.fields.items():
        values = known.get(name)
        parts = [] if values is None else [values] if values.dtype.kind == "f" else list(floats(values))
        finite = np.concatenate([np.empty(0), *(part[np.isfinite(part)] for part in parts)])
        scale = float(np.abs(finite).max(initial=0.0))
        floor = signal.floor(name) if parts else 0.0
        if not difference.absolute <= max(tolerance * scale, floor):
            yield f"{topic.topic} {name} by {difference.absolute:.3g}"
