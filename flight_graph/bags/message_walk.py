"""Walking over message records whose bytes no checksum covers: where the walk goes wrong, and where it can go on.

A record is believed when its type is one that may stand here, and its channel and time are possible (a channel whose own
declaration was hit counts as possible when its number is near the declared ones). Where one is not, the walk goes on at the
next place that begins a chain of believable records. The message in front of the break may be the one that is hit: it
is dropped when no other message of its channel has its size, or when it is older than all before it, or when its payload
begins otherwise than every other of its channel (the encapsulation of CDR).
"""

from dataclasses import dataclass

import numpy as np

from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD, RECORD_HEAD
from flight_graph.bags.mcap_records import Opcode, list_records, message_field

IN_CHUNK = (Opcode.SCHEMA, Opcode.CHANNEL, MESSAGE)
IN_FILE = (*IN_CHUNK, Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END)
_NEAR = 32  # channels beyond the highest declared one
_CHAIN = 3  # records that must follow each other
_PART = 1 << 20  # [bytes] searched in one go


@dataclass
class Stretch:
    """Believable records, all (n,): type, bounds of the content. broken: something is missing behind them."""

    opcodes: np.ndarray
    starts: np.ndarray
    stops: np.ndarray
    broken: bool


def stretches(data: np.ndarray, channels: set, cdr=frozenset(), earliest: int | None = None):
    """Yield the believable stretches of a chunk's content.

    channels: the ids that are declared; empty: not known yet. cdr: those whose messages are CDR. earliest: no message is
    older [ns].
    """
    position, end, sizes, heads = 0, len(data), {}, {}
    while position < end:
        opcodes, starts, stops, last = list_records(data, position, end)
        good = _believable(data, opcodes, starts, stops, channels)
        count = int(np.argmin(good)) if not good.all() else len(good)
        broken = count < len(good) or last < end
        resume = (int(starts[count]) - RECORD_HEAD if count < len(good) else last) + 1
        if broken and count and opcodes[count - 1] == MESSAGE:
            _note(sizes, data, opcodes[:count - 1], starts[:count - 1], stops[:count - 1])
            earliest = _earliest(earliest, data, opcodes[:count - 1], starts[:count - 1])
            _note_heads(heads, data, opcodes[:count - 1], starts[:count - 1], stops[:count - 1])
            last = int(starts[count - 1])
            if not is_usual(sizes, data, last, int(stops[count - 1])) or is_older(data, last, earliest) or \
                    is_odd(heads, cdr, data, last):
                count -= 1
                resume = int(starts[count]) + MESSAGE_HEAD
        _note(sizes, data, opcodes[:count], starts[:count], stops[:count])
        _note_heads(heads, data, opcodes[:count], starts[:count], stops[:count])
        earliest = _earliest(earliest, data, opcodes[:count], starts[:count])
        yield Stretch(opcodes[:count], starts[:count], stops[:count], broken)
        if not broken:
            return
        position = next_record(data, resume, end, channels, IN_CHUNK)


def _believable(data, opcodes, starts, stops, channels):
    good = np.isin(opcodes, IN_CHUNK)
    is_message = opcodes == MESSAGE
    good &= ~is_message | (stops - starts >= MESSAGE_HEAD)
    chosen = np.flatnonzero(good & is_message)
    if len(chosen):
        good[chosen] &= (message_field(data, starts[chosen], "log_time") >> np.uint64(63)) == 0
        if channels:
            good[chosen] &= message_field(data, starts[chosen], "channel") <= highest(channels)
    return good


def highest(channels: set) -> int:
    """The highest number of a channel that is believed."""
    return max(channels) + _NEAR if channels else 0xFFFF


def _note(sizes, data, opcodes, starts, stops):
    """Note the sizes that the messages of each channel have."""
    chosen = opcodes == MESSAGE
    if chosen.any():
        for channel, size in {*zip(message_field(data, starts[chosen], "channel").tolist(),
                                   (stops[chosen] - starts[chosen]).tolist())}:
            sizes.setdefault(channel, set()).add(size)


def is_usual(sizes: dict, data: np.ndarray, start: int, stop: int) -> bool:
    """Whether another message of this one's channel has its size, or none is known. sizes: channel -> set of sizes."""
    channel = int.from_bytes(data[start:start + 2].tobytes(), "little")
    return stop - start in sizes.get(channel, {stop - start})


def is_older(data: np.ndarray, start: int, earliest: int | None) -> bool:
    """Whether a message is older than the earliest of the others [ns]; not where there is none."""
    return earliest is not None and int.from_bytes(data[start + 6:start + 14].tobytes(), "little") < earliest


def is_odd(heads: dict, cdr, data: np.ndarray, start: int) -> bool:
    """Whether a CDR message begins otherwise than all others of its channel. heads: channel -> set of two bytes."""
    channel = int.from_bytes(data[start:start + 2].tobytes(), "little")
    head = data[start + MESSAGE_HEAD:start + MESSAGE_HEAD + 2].tobytes()
    return channel in cdr and head not in heads.get(channel, {head})


def _note_heads(heads, data, opcodes, starts, stops):
    chosen = starts[(opcodes == MESSAGE) & (stops - starts >= MESSAGE_HEAD + 2)]
    if len(chosen):
        first, second = (data[chosen + MESSAGE_HEAD + i].tolist() for i in (0, 1))
        for channel, *begin in {*zip(message_field(data, chosen, "channel").tolist(), first, second)}:
            heads.setdefault(channel, set()).add(bytes(begin))


def _earliest(known, data, opcodes, starts):
    chosen = opcodes == MESSAGE
    if not chosen.any():
        return known
    found = int(message_field(data, starts[chosen], "log_time").min())
    return found if known is None else min(known, found)


def next_record(data: np.ndarray, position: int, end: int, channels: set, allowed: tuple) -> int:
    """The next place from ``position`` on where a message or declaration begins that others follow, or ``end``."""
    for begin in range(max(position, 0), end - RECORD_HEAD, _PART):
        part = data[begin:min(begin + _PART + 8, end)]
        likely = np.isin(part[:-8], IN_CHUNK) & (part[8:] == 0) & (part[7:-1] == 0) & (part[6:-2] == 0) & (part[5:-3] == 0)
        for candidate in np.flatnonzero(likely).tolist():
            if _chain(data, begin + candidate, end, channels, allowed):
                return begin + candidate
    return end


def _chain(data, position, end, channels, allowed):
    for number in range(_CHAIN):
        if number and position == end:
            return True
        head = data[position:position + RECORD_HEAD + MESSAGE_HEAD].tobytes()
        length = int.from_bytes(head[1:RECORD_HEAD], "little")
        if len(head) < RECORD_HEAD or head[0] not in allowed or length > end - position - RECORD_HEAD:
            return False
        if head[0] == MESSAGE:
            channel, log_time = int.from_bytes(head[9:11], "little"), int.from_bytes(head[15:23], "little")
            if length < MESSAGE_HEAD or log_time >> 63 or channel > highest(channels):
                return False
        position += RECORD_HEAD + length
    return True
