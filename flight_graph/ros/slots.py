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
    """The messages of a topic, slot by slot. data, slots: the two subscriptions."""

    def __init__(self, data, slots):
        self.data, self._slots = data, slots
        self._stamp_ns, self._count, self._messages = None, 0, []

    def next(self) -> tuple[int, list[bytes]] | None:
        """(stamp [ns], messages) of the next slot, None while it is not all there."""
        if self._stamp_ns is None:
            slot = self._slots.take()
            if slot is None:
                return None
            self._stamp_ns, self._count = parse(slot)
        while len(self._messages) < self._count:
            message = self.data.take()
            if message is None:
                return None
            self._messages.append(message)
        found = self._stamp_ns, self._messages
        self._stamp_ns, self._messages = None, []
        return found

    def publishers(self) -> int:
        """How many sources there are of both topics."""
        return min(self.data.publishers(), self._slots.publishers())

    def wait(self, nanoseconds: int) -> None:
        """Wait until something of the next slot is there."""
        (self._slots if self._stamp_ns is None else self.data).wait(nanoseconds)
