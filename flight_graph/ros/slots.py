"""Slots: what a node says of an output whose faults may keep messages back, so that lockstep need not guess.

``<topic>/slots`` carries a std_msgs/Header for each firing that would publish: its stamp, and in place of a frame the
number of messages that were sent on the topic for it (0: none, 2: one twice). A reader waits for the slot, then for so
many messages.
"""

import struct

from flight_graph.timebase import SECOND, stamp_parts
from msg_schemas.qos import QOS, Role
from msg_schemas.signal import ENCAPSULATION

TYPE = "std_msgs/msg/Header"
QOS_OF_SLOTS = QOS[Role.SENSOR]


def slots_topic(topic: str) -> str:
    """The topic of the slots of a topic."""
    return f"{topic}/slots"


def payload(stamp_ns: int, count: int) -> bytes:
    """A serialised slot."""
    sec, nanosec = stamp_parts(stamp_ns)
    text = str(count).encode() + b"\0"
    return ENCAPSULATION + struct.pack("<iII", sec, nanosec, len(text)) + text


def parse(message: bytes) -> tuple[int, int]:
    """(stamp [ns], number of messages) of a slot."""
    sec, nanosec, length = struct.unpack_from("<iII", message, 4)
    return sec * SECOND + nanosec, int(bytes(message[16:15 + length]).decode())


class SlotReader:
    """The messages of a topic, slot by slot. data, slots: the two subscriptions.

    With ``lossy`` (realtime: processes are stopped, killed and started again, so that either topic may lose what the other
    has) messages and slots find each other by when they were sent: a node sends the messages of a slot right before it.
    A message that was lost is not waited for when a later one is there, and one without a slot is left out.
    """

    def __init__(self, data, slots, lossy: bool):
        self.data, self._slots, self._lossy = data, slots, lossy
        self._slot, self._messages = None, []  # (stamp [ns], count, when it was sent [ns])
        self._ahead = None  # (message, when it was sent [ns]) that belongs to a later slot

    def next(self) -> tuple[int, list[bytes]] | None:
        """(stamp [ns], messages) of the next slot, None while it is not all there."""
        if self._slot is None:
            slot = self._slots.take_sent()
            if slot is None:
                return None
            self._slot = (*parse(slot[0]), slot[1])
        stamp_ns, count, _ = self._slot
        if not (self._gather_lossy() if self._lossy else self._gather()):
            return None
        found = stamp_ns, self._messages[max(0, len(self._messages) - count):]
        self._slot, self._messages = None, []
        return found

    def _gather(self) -> bool:
        """Take the messages of the slot in order; whether all are there."""
        while len(self._messages) < self._slot[1]:
            message = self.data.take()
            if message is None:
                return False
            self._messages.append(message)
        return True

    def _gather_lossy(self) -> bool:
        """Take what was sent before the slot; whether its messages are there or will never be."""
        _, count, sent_ns = self._slot
        while True:
            self._ahead = self._ahead or self.data.take_sent()
            if self._ahead is None:
                return len(self._messages) >= count
            if self._ahead[1] > sent_ns:
                return True
            self._messages.append(self._ahead[0])
            self._ahead = None

    def publishers(self) -> int:
        """How many sources there are of both topics."""
        return min(self.data.publishers(), self._slots.publishers())

    def wait(self, nanoseconds: int) -> None:
        """Wait until something of the next slot is there."""
        (self._slots if self._slot is None else self.data).wait(nanoseconds)
