"""Records of eight runs woven into one: each number at eight times its offset, those of the runs side by side."""

from functools import cache

import numpy as np

from flight_graph.lanes.operations import LANES


@cache
def leaves(dtype: np.dtype) -> tuple[tuple[int, int, int], ...]:
    """(offset, count, bytes of one) of the numbers of a record."""
    if dtype.names is None:
        base = dtype.base
        if base.names is None:
            count = dtype.itemsize // max(1, base.itemsize)
            if base.kind in "SVU":
                return ((0, dtype.itemsize, 1),)
            return ((0, count, base.itemsize),)
        return tuple((i * base.itemsize + offset, count, size) for i in range(dtype.itemsize // base.itemsize)
                     for offset, count, size in leaves(base))
    return tuple((start + offset, count, size) for name in dtype.names for field, start in [dtype.fields[name][:2]]
                 for offset, count, size in leaves(field))


@cache
def widths(dtype: np.dtype) -> dict[int, int]:
    """offset -> bytes of the number there."""
    return {offset + i * size: size for offset, count, size in leaves(dtype) for i in range(count)}


def block(size: int) -> np.ndarray:
    """Zeroed memory of so many bytes at a multiple of 64: vectors must not straddle cache lines."""
    room = np.zeros(size + 64, np.uint8)
    skip = -room.ctypes.data % 64
    return room[skip:skip + size]


def weave(records: np.ndarray, woven: np.ndarray) -> None:
    """Weave records (LANES,) into memory of LANES times their size."""
    size = records.dtype.itemsize
    plain = np.ascontiguousarray(records).view(np.uint8).reshape(LANES, size)
    for offset, count, width in leaves(records.dtype):
        part = plain[:, offset:offset + count * width].reshape(LANES, count, width)
        woven[LANES * offset:LANES * (offset + count * width)].reshape(count, LANES, width)[:] = part.transpose(1, 0, 2)


def unweave(woven: np.ndarray, records: np.ndarray) -> None:
    """The records (LANES,) of woven memory; what lies between their numbers stays."""
    size = records.dtype.itemsize
    plain = records.view(np.uint8).reshape(LANES, size)
    for offset, count, width in leaves(records.dtype):
        part = woven[LANES * offset:LANES * (offset + count * width)].reshape(count, LANES, width)
        plain[:, offset:offset + count * width].reshape(LANES, count, width)[:] = part.transpose(1, 0, 2)
