"""The payloads of one topic: their bodies side by side in one piece of memory, which is what the topic's array is.

Every body (what stands behind the 4 bytes of encapsulation) begins at a multiple of eight bytes, so that its numbers are
aligned; bodies of one size are the rows of a table.
"""

import numpy as np

from flight_graph.bag.byte_kernels import gather, mark_varying, read_field

HEAD = 4  # [bytes] of encapsulation


class Payloads:
    """Grows by the payloads of one block after another.

    expected: how many there will be, as far as that is known; room: bytes that all messages of the file have together.
    """

    def __init__(self, expected: int, room: int):
        self._expected, self._room, self._used = expected, room, 0
        self._memory, self._heads = np.zeros(0, np.uint8), []
        self._uniform, self._varying = True, None  # the bits in which any payload differs from the first
        self.first = None  # (size,) uint8

    def add(self, content: np.ndarray, starts: np.ndarray, sizes: np.ndarray) -> None:
        """Append the payloads content[start:start + size]. starts, sizes: (n,), n > 0."""
        if (sizes < HEAD).any():
            self._uniform = False
            return
        slots = _slots(sizes)
        ends = np.cumsum(slots) + self._used
        if ends[-1] > len(self._memory):
            self._grow(int(ends[-1]), int(slots[0]))
        gather(content, starts + HEAD, sizes - HEAD, self._memory, ends - slots)
        heads = np.empty(len(starts), np.uint32)
        read_field(content, starts, 0, HEAD, heads)
        self._used = int(ends[-1])
        self._heads.append(heads)
        if self.first is None:
            self.first = content[starts[0]:starts[0] + sizes[0]].copy()
            self._varying = np.zeros_like(self.first)
        self._uniform = self._uniform and bool((sizes == len(self.first)).all())
        if self._uniform:
            mark_varying(content, starts, self.first, self._varying)

    def _grow(self, needed, slot):
        """Make room: at first for all that is expected (memory that is not touched costs nothing), then for twice as much."""
        wanted = 2 * len(self._memory) or min(slot * self._expected, self._room)
        memory = np.zeros(max(needed, wanted) // 8 + 1, np.uint64).view(np.uint8)  # aligned
        memory[:self._used] = self._memory[:self._used]
        self._memory = memory

    @property
    def size(self) -> int | None:
        """The size of all payloads [bytes]; None where they differ or there are none."""
        return len(self.first) if self._uniform and self.first is not None else None

    def are_constant(self, columns: np.ndarray) -> bool:
        """Whether payloads of one size agree in these bytes."""
        return not self._varying[columns].any()

    def rows(self) -> np.ndarray:
        """A copy of payloads of one size as (n, size) uint8."""
        bodies, heads = self._table(), np.concatenate(self._heads)
        rows = np.empty((len(bodies), len(self.first)), np.uint8)
        rows[:, :HEAD] = heads.astype("<u4").view(np.uint8).reshape(-1, HEAD)
        rows[:, HEAD:] = bodies[:, :len(self.first) - HEAD]
        return rows

    def records(self, dtype: np.dtype) -> np.ndarray:
        """The bodies of payloads of one size as (n,) of a dtype that they hold; a view where nothing stands behind it."""
        return np.ascontiguousarray(self._table()[:, :dtype.itemsize]).reshape(-1).view(dtype)

    def _table(self):
        count = sum(map(len, self._heads))
        return self._memory[:self._used].reshape(count, int(_slots(len(self.first))))


def _slots(sizes):
    return (sizes - HEAD + 7) // 8 * 8
