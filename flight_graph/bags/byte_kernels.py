"""The byte loops of the bags, compiled: walking over MCAP records, gathering and scattering rows.

These are no component kernels: they hold no arithmetic that could differ between engines, and are cached on disk.
"""

import numba
import numpy as np

MESSAGE = 0x05  # opcode
RECORD_HEAD = 9  # [bytes] opcode and length
MESSAGE_HEAD = 22  # [bytes] channel id, sequence, log time, publish time


def _compiled(function):
    try:
        return numba.njit(cache=True, nogil=True)(function)
    except RuntimeError:  # no folder for the cache can be written
        return numba.njit(nogil=True)(function)


@_compiled
def _little_endian(data, start, size):
    value = np.uint64(0)
    for i in range(size):
        value |= np.uint64(data[start + i]) << np.uint64(8 * i)
    return value


@_compiled
def walk(data, start, stop, opcodes, starts, stops):
    """List the records in data[start:stop]: opcode, first and last + 1 content byte.

    data: (n,) uint8. Returns (count, position behind the last whole record); count can exceed the arrays' length,
    then only the first ones are listed.
    """
    count = 0
    position = start
    while position + 9 <= stop:
        length = _little_endian(data, position + 1, 8)
        if length > np.uint64(stop - position - 9):
            break
        if count < len(opcodes):
            opcodes[count] = data[position]
            starts[count] = position + 9
            stops[count] = position + 9 + np.int64(length)
        count += 1
        position += 9 + np.int64(length)
    return count, position


@_compiled
def read_field(data, starts, offset, size, out):
    """Read the little-endian number of ``size`` bytes at ``offset`` behind every start. starts, out: (n,)."""
    for i in range(len(starts)):
        out[i] = _little_endian(data, starts[i] + offset, size)


@_compiled
def _copy(source, start, target, at, width):
    """Copy source[start:start + width] to target[at:] (both uint8), in words of eight bytes."""
    words = width // 8
    source_words = source[start:start + 8 * words].view(np.uint64)
    target_words = target[at:at + 8 * words].view(np.uint64)
    for j in range(words):
        target_words[j] = source_words[j]
    for j in range(8 * words, width):
        target[at + j] = source[start + j]


@_compiled
def gather(data, starts, width, out):
    """Copy data[start:start + width] of every start into the rows of out (n, >= width), all uint8."""
    for i in range(len(starts)):
        _copy(data, starts[i], out[i], 0, width)


@_compiled
def mark_varying(data, starts, first, varying):
    """Or into varying (size,) the bits in which data[start:start + size] differs from first (size,), for every start."""
    words = len(first) // 8
    first_words, varying_words = first[:8 * words].view(np.uint64), varying[:8 * words].view(np.uint64)
    for i in range(len(starts)):
        row = data[starts[i]:starts[i] + len(first)]
        row_words = row[:8 * words].view(np.uint64)
        for j in range(words):
            varying_words[j] |= row_words[j] ^ first_words[j]
        for j in range(8 * words, len(first)):
            varying[j] |= row[j] ^ first[j]


@_compiled
def scatter(rows, first, starts, out):
    """Copy rows[first + i] (uint8) to out[starts[i]:]."""
    for i in range(len(starts)):
        _copy(rows[first + i], 0, out, starts[i], rows.shape[1])
