"""The payloads of one topic, if all are of one size: their bodies as the rows of a table, which is the topic's array.

A body is what stands behind the 4 bytes of encapsulation. It begins at a multiple of eight bytes, so that its numbers are
aligned.
"""

import numpy as np

from flight_graph.bags.byte_kernels import gather, mark_varying, read_field

HEAD = 4  # [bytes] of encapsulation


class Payloads:
    """Grows by the payloads of one block after another; holds nothing any more once sizes differ.

    expected: how many there will be, as far as that is known; room: bytes that all messages of the file have together.
    first: (size,) uint8, the first payload.
    """

    def __init__(self, expected: int, room: int):
        self._expected, self._room = expected, room
        self._uniform, self.first = True, None
        self._bodies, self._heads, self._count = _room(0, HEAD), [], 0
        self._varying = None  # (size,) uint8: the bits in which any payload differs from the first

    def add(self, content: np.ndarray, starts: np.ndarray, sizes: np.ndarray) -> None:
        """Append the payloads content[start:start + size]. starts, sizes: (n,), n > 0."""
        if self.first is None:
            self.first = content[starts[0]:starts[0] + sizes[0]].copy()
            self._varying, self._bodies = np.zeros_like(self.first), _room(0, len(self.first))
        self._uniform = self._uniform and len(self.first) >= HEAD and bool((sizes == len(self.first)).all())
        if not self._uniform:
            self._bodies, self._heads = _room(0, HEAD), []
            return
        begin, self._count = self._count, self._count + len(starts)
        if self._count > len(self._bodies):
            self._grow(begin)
        gather(content, starts + HEAD, len(self.first) - HEAD, self._bodies[begin:self._count])
        mark_varying(content, starts, self.first, self._varying)
        heads = np.empty(len(starts), np.uint32)
        read_field(content, starts, 0, HEAD, heads)
        self._heads.append(heads)

    def _grow(self, filled):
        """Make room: first for all that is expected (memory that is not touched costs nothing), then for twice as much."""
        wanted = 2 * len(self._bodies) or min(self._expected, self._room // len(self.first))
        bodies = _room(max(self._count, wanted), len(self.first))
        bodies[:filled] = self._bodies[:filled]
        self._bodies = bodies

    @property
    def size(self) -> int | None:
        """The size of all payloads [bytes]; None where they differ or there are none."""
        return len(self.first) if self._uniform and self.first is not None else None

    def are_constant(self, columns: np.ndarray) -> bool:
        """Whether all payloads agree in these bytes."""
        return not self._varying[columns].any()

    def rows(self) -> np.ndarray:
        """A copy of the payloads, (n, size) uint8."""
        rows = np.empty((self._count, len(self.first)), np.uint8)
        rows[:, :HEAD] = np.concatenate(self._heads).astype("<u4").view(np.uint8).reshape(-1, HEAD)
        rows[:, HEAD:] = self._bodies[:self._count, :len(self.first) - HEAD]
        return rows

    def records(self, dtype: np.dtype) -> np.ndarray:
        """The bodies as (n,) of a dtype that they hold; a view where nothing stands behind it in them."""
        return np.ascontiguousarray(self._bodies[:self._count, :dtype.itemsize]).reshape(-1).view(dtype)


def _room(count, size):
    """(count, bytes of the body of a payload of this size, rounded up to whole numbers of eight) uint8, zeros."""
    return np.zeros((count, max(0, size - HEAD + 7) // 8), np.uint64).view(np.uint8)
