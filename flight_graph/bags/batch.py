"""Arrays of messages of several topics, merged by stamp and laid out as MCAP message records."""

import numpy as np

from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD, RECORD_HEAD, scatter
from flight_graph.bags.errors import BagError

_HEAD = np.dtype([("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"),
                  ("log_time", "<u8"), ("publish_time", "<u8")])


class Batch:
    """The merged messages of blocks (topic, stamps_ns (n,), payloads (n, size) uint8), handed out chunk by chunk."""

    def __init__(self, blocks):
        blocks = [(topic, *_checked(topic, stamps, payloads)) for topic, stamps, payloads in blocks if len(stamps)]
        lengths = [len(stamps) for _, stamps, _ in blocks]
        self._topics = [topic for topic, _, _ in blocks]
        self._stamps = [stamps for _, stamps, _ in blocks]
        self._rows = [_records(*block) for block in blocks]
        self._taken = [0] * len(blocks)
        order = np.argsort(np.concatenate(self._stamps or [np.empty(0)]), kind="stable")
        self._owner = np.repeat(np.arange(len(blocks)), lengths)[order]
        self._sizes = np.array([rows.shape[1] for rows in self._rows], np.int64)[self._owner]
        self._ends = np.cumsum(self._sizes)
        self._next = 0

    @property
    def done(self) -> bool:
        return self._next == len(self._owner)

    def take(self, filled: int, full: int) -> bytes:
        """Return the next records, until a chunk of ``filled`` bytes reaches ``full``; note them at their topics."""
        first = self._next
        before = int(self._ends[first] - self._sizes[first])
        last = min(int(np.searchsorted(self._ends, full - filled + before)) + 1, len(self._owner))
        starts = self._ends[first:last] - self._sizes[first:last] - before
        owner = self._owner[first:last]
        part = np.empty(int(self._ends[last - 1]) - before, np.uint8)
        for number, topic in enumerate(self._topics):
            at = starts[owner == number]
            begin, end = self._taken[number], self._taken[number] + len(at)
            scatter(self._rows[number], begin, at, part)
            marks = np.column_stack((self._stamps[number][begin:end], (at + filled).astype(np.uint64)))
            topic.marks += marks.ravel().tolist()
            topic.count += len(at)
            self._taken[number] = end
        self._next = last
        return part.tobytes()


def _checked(topic, stamps, payloads):
    stamps = np.asarray(stamps)
    if stamps.dtype.kind not in "iu" or stamps.ndim != 1 or stamps[0] < 0 or (stamps[1:] < stamps[:-1]).any():
        raise BagError(f"topic '{topic.name}': stamps must be whole numbers of ns from 0 on that do not fall")
    if payloads.dtype != np.uint8 or payloads.ndim != 2 or len(payloads) != len(stamps):
        raise BagError(f"topic '{topic.name}': payloads must be a ({len(stamps)}, size) uint8 array, "
                       f"not {payloads.shape} {payloads.dtype}")
    return stamps.astype(np.uint64), payloads


def _records(topic, stamps, payloads):
    """Return (n, 31 + size) uint8: the message records of a block."""
    rows = np.empty((len(stamps), RECORD_HEAD + MESSAGE_HEAD + payloads.shape[1]), np.uint8)
    heads = np.empty(len(stamps), _HEAD)
    heads["opcode"], heads["length"], heads["channel"] = MESSAGE, MESSAGE_HEAD + payloads.shape[1], topic.id
    heads["sequence"] = (topic.count + np.arange(len(stamps))) & 0xFFFFFFFF
    heads["log_time"] = heads["publish_time"] = stamps
    rows[:, :_HEAD.itemsize] = heads.view(np.uint8).reshape(len(stamps), -1)
    rows[:, _HEAD.itemsize:] = payloads
    return rows
