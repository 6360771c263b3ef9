"""One recorded topic: its messages from their arrival until they are written, and what of them is lost, late or refused."""

import struct
import time
from collections import deque

from flight_graph.recordings.recording import RecordedTopic
from flight_graph.ros.answers import AnswerReader, Judge
from flight_graph.ros.ports import RawSubscription
from flight_graph.ros.slots import TYPE as SLOT_TYPE
from flight_graph.ros.slots import SlotReader, slots_topic
from flight_graph.timebase import SECOND
from msg_schemas.qos import RECORDER
from msg_schemas.signal import SignalMismatch

_OTHER_CLOCK_NS = 10 * SECOND  # [ns] stamps that are off by more are of another clock


class Stream:
    """One recorded signal: messages taken but not written yet, and the stamp that must come next."""

    def __init__(self, node, topic: RecordedTopic, epoch_ns: int, end_ns: int, group, slotted: bool = False,
                 lossy: bool = False, begin_ns: int = 0, is_foreign: bool = False):
        self.late = 0  # answers of a foreign node that did not come in time
        self._judge = Judge(topic.signal) if is_foreign else None
        self.is_free = is_foreign and lossy  # its stamps may be any
        self.topic, self.end_ns = topic, end_ns
        self.lost, self.refused, self.queue = 0, 0, deque()
        self.next_ns = -(-begin_ns // topic.source_period_ns) * topic.source_period_ns
        self.excused = False  # in realtime, of a node whose process may be stopped and killed: its silence is no loss
        self._epoch_ns, self._log = epoch_ns, node.get_logger()
        self.subscription = RawSubscription(node, topic.topic, topic.type_name, RECORDER, group)
        self._slots = None
        if slotted:
            told = RawSubscription(node, slots_topic(topic.topic), SLOT_TYPE, RECORDER, group)
            self._slots = AnswerReader(self.subscription, told, topic.signal) if is_foreign else (
                SlotReader(self.subscription, told, lossy))
        self._payload, self._record = topic.signal.new()
        self._offset = _stamp_offset(topic.signal)

    @property
    def done(self) -> bool:
        return self.next_ns >= self.end_ns

    def publishers(self) -> int:
        """How many sources there are, of its slots too where it has any."""
        return self.subscription.publishers() if self._slots is None else self._slots.publishers()

    def drain(self, now_ns: int = 0) -> int:
        """Take all that has arrived; return how many messages. One that is not of this signal is refused and counted.

        now_ns: how far the others have come, for stamps of another clock.
        """
        count, now = 0, time.monotonic()
        for stamp_ns, messages in self._arrived():
            count += 1
            messages = [message for message in map(self._accepted, messages) if message is not None]
            if stamp_ns is None and not messages:
                continue
            t_ns = (self._stamp_ns(messages[0]) if stamp_ns is None else stamp_ns) - self._epoch_ns
            if self.is_free:
                t_ns = min(t_ns if abs(t_ns - now_ns) < _OTHER_CLOCK_NS else now_ns, self.end_ns - 1)
                self.next_ns = max(self.next_ns, t_ns + self.topic.source_period_ns)
                self.queue.append((t_ns, messages[0], now))
                continue
            self.late += self._judge is not None and not messages
            if not self.excused:
                self.lost += max(0, t_ns - self.next_ns) // self.topic.source_period_ns
            self.next_ns = t_ns + self.topic.source_period_ns
            if t_ns % self.topic.period_ns == 0 and t_ns < self.end_ns:
                self.queue.extend((t_ns, message, now) for message in messages)
        return count

    def _arrived(self):
        """Yield (stamp of the slot, or None, messages) of all that is there."""
        if self._slots is None:
            while (message := self.subscription.take()) is not None:
                yield None, [message]
        else:
            while (slot := self._slots.next()) is not None:
                yield slot

    def _accepted(self, message) -> bytes | None:
        """A message in the signal's own form; None for one that is not of this signal, which is counted."""
        try:
            if self._judge:
                self._judge.stamp_ns(message)
            return self._canonical(message)
        except SignalMismatch as error:
            self.refused += 1
            if self.refused == 1:
                self._log.error(f"not recorded: {error}")
            return None

    def _stamp_ns(self, message) -> int:
        sec, nanosec = struct.unpack_from("<iI", message, self._offset)
        return sec * SECOND + nanosec

    def _canonical(self, message) -> bytes:
        """A message in the signal's own form, so that all of a topic have one layout. Raises SignalMismatch."""
        if len(message) == len(self._payload) and self.topic.signal.fits(message):
            return message
        self.topic.signal.receive(message, self._payload)
        return self._payload.tobytes()

    @property
    def missing(self) -> int:
        """Messages that are still to come until the end of the run."""
        return 0 if self.excused else max(0, -(-(self.end_ns - self.next_ns) // self.topic.source_period_ns))

    def record(self, message):
        """The message as a record, for a formatter."""
        self.topic.signal.receive(message, self._payload)
        return self._record


def _stamp_offset(signal) -> int:
    return 4 + next(offset for path, _, offset, _ in signal.leaves() if path.endswith("stamp.sec"))
