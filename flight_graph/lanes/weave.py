"""Records of eight runs woven into one: each number at eight times its offset, those of the runs side by side."""

from functools import cache

import numpy as np


@cache
def leaves(dtype: np.dtype) -> tuple[tuple[int, int, int], ...]:
    """(offset, count, bytes of one) of the numbers of a record, neighbours of one width together."""
    found = []
    for offset, count, size in sorted(_leaves(dtype)):
        if found and found[-1][2] == size and found[-1][0] + found[-1][1] * size == offset:
            found[-1] = (found[-1][0], found[-1][1] + count, size)
        else:
            found.append((offset, count, size))
    return tuple(found)


def _leaves(dtype):
    if dtype.names is None:
        base = dtype.base
        if base.names is None:
            count = dtype.itemsize // max(1, base.itemsize)
            if base.kind in "SVU":
                return ((0, dtype.itemsize, 1),)
            return ((0, count, base.itemsize),)
        return tuple((i * base.itemsize + offset, count, size) for i in range(dtype.itemsize // base.itemsize)
                     for offset, count, size in _leaves(base))
    return tuple((start + offset, count, size) for name in dtype.names for field, start in [dtype.fields[name][:2]]
                 for offset, count, size in _leaves(field))


@cache
def widths(dtype: np.dtype) -> dict[int, int]:
    """offset -> bytes of the number there."""
    return {offset + i * size: size for offset, count, size in leaves(dtype) for i in range(count)}


def block(size: int) -> np.ndarray:
    """Zeroed memory of so many bytes at a multiple of 64: vectors must not straddle cache lines."""
    room = np.zeros(size + 64, np.uint8)
    skip = -room.ctypes.data % 64
    return room[skip:skip + size]
