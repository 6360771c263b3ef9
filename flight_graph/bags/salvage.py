"""What can still be trusted in a damaged MCAP file: whole chunks whose checksum holds, and declarations that agree.

Chunks are found by walking over the records; where a record is broken the walk goes on at the next chunk, message
index, attachment, metadata record or end of data whose own lengths fit together, and in files that keep messages outside
of chunks at the next message that others follow. Records of unknown types are passed over, as the format asks.
"""

import zlib
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from mcap import records

from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD
from flight_graph.bags.mcap_file import LIBRARY, MAGIC
from flight_graph.bags.mcap_records import (
    ChunkRecord,
    Damage,
    Opcode,
    attachment_checksum,
    list_records,
    message_field,
    parse,
)
from flight_graph.bags.message_walk import IN_FILE, highest, is_odd, is_older, next_record, stretches

_DECLARATIONS = {Opcode.SCHEMA: records.Schema, Opcode.CHANNEL: records.Channel}
_RESUME = (Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END)
_SKIPPED = (Opcode.MESSAGE_INDEX, Opcode.DATA_END)


@dataclass
class Block:
    """Messages that stood together. content: their bytes; the rest (n,): payload bounds, channel, sequence, times."""

    content: bytes
    start: np.ndarray
    stop: np.ndarray
    channel: np.ndarray
    sequence: np.ndarray
    log_time: np.ndarray
    publish_time: np.ndarray


@dataclass
class Salvage:
    """What a file still holds, in order. ``blocks`` has None where messages may be missing."""

    library: str = ""
    blocks: list = field(default_factory=list)
    attachments: list = field(default_factory=list)
    metadata: list = field(default_factory=list)
    declared: dict = field(default_factory=dict)  # (record class, id) -> (trusted, record)
    statistics: records.Statistics | None = None
    chunks: int = 0  # whole chunk records seen, sound or not
    remarks: list = field(default_factory=list)
    sizes: dict = field(default_factory=dict)  # channel -> how often each size of record was met outside of chunks
    last_message: int | None = None  # where the content of the last of these begins
    last_time: int | None = None  # its time [ns]
    heads: dict = field(default_factory=dict)  # channel -> first two bytes of payloads of these before the last
    earliest: int | None = None  # that of the earliest of these before the last
    packed: bool = False  # each message is compressed on its own
    corrupted: bool = False  # bytes differ from what was written; False where the file only ends early

    @property
    def schemas(self) -> dict:
        return {key: record for (kind, key), (_, record) in self.declared.items() if kind is records.Schema}

    @property
    def channels(self) -> dict:
        return {key: record for (kind, key), (_, record) in self.declared.items() if kind is records.Channel}

    def declare(self, kind, content: bytes, trusted: bool) -> None:
        """Note a schema or channel; a copy under a checksum beats one without."""
        try:
            record = parse(kind, content)
        except Damage as damage:
            self.lose(str(damage))
            return
        before = self.declared.get((kind, record.id))
        if before is None or (trusted and not before[0]):
            self.declared[kind, record.id] = (trusted, record)

    def lose(self, remark: str, corrupted: bool = True) -> None:
        """Note that something is missing here."""
        self.remarks.append(remark)
        self.corrupted |= corrupted
        if not self.blocks or self.blocks[-1] is not None:
            self.blocks.append(None)

    def add_last(self, content: bytes) -> None:
        """Take the records of the chunk that was open; what came behind them is lost."""
        if self.blocks and self.blocks[-1] is None:
            self.blocks.pop()
        self.add_records(content, trusted=True)
        self.blocks.append(None)

    @property
    def cdr(self) -> set:
        """The channels whose messages are CDR."""
        return {key for key, channel in self.channels.items() if channel.message_encoding == "cdr"}

    def add_records(self, content: bytes, trusted: bool, earliest: int | None = None) -> None:
        """Take the messages and declarations of a chunk's content.

        trusted: a checksum stands over it; else only records that fit together are taken, and what lies between is lost.
        earliest: no message is older [ns].
        """
        data = np.frombuffer(content, np.uint8)
        if trusted:
            self._take(content, data, *list_records(data, 0, len(data))[:3], trusted)
            return
        for stretch in stretches(data, set(self.channels), self.cdr, earliest):
            self._take(content, data, stretch.opcodes, stretch.starts, stretch.stops, trusted)
            if stretch.broken:
                self.lose("a record of a chunk without checksum has a wrong length, type or channel")

    def _take(self, content, data, opcodes, starts, stops, trusted):
        for i in np.flatnonzero(np.isin(opcodes, list(_DECLARATIONS))):
            self.declare(_DECLARATIONS[opcodes[i]], content[starts[i]:stops[i]], trusted)
        chosen = (opcodes == MESSAGE) & (stops - starts >= MESSAGE_HEAD)
        possible = np.ones(len(starts), bool)
        possible[chosen] = (message_field(data, starts[chosen], "log_time") >> np.uint64(63)) == 0
        if not possible.all():
            self.lose(f"{np.count_nonzero(~possible)} messages of an impossible time are left out")
        chosen &= possible
        if chosen.any():
            heads = {name: message_field(data, starts[chosen], name)
                     for name in ("channel", "sequence", "log_time", "publish_time")}
            self.blocks.append(Block(content, starts[chosen] + MESSAGE_HEAD, stops[chosen], **heads))

    def add_message(self, data: np.ndarray, start: int, stop: int) -> bool:
        """Take a message that stands outside of chunks; whether it can be one."""
        head = data[start:start + MESSAGE_HEAD]
        channel = int.from_bytes(head[:2].tobytes(), "little")
        if stop - start < MESSAGE_HEAD or head[13] >= 0x80 or channel > highest(set(self.channels)):
            return False
        self.sizes.setdefault(channel, Counter())[stop - start] += 1
        if self.last_time is not None:
            self.earliest = self.last_time if self.earliest is None else min(self.earliest, self.last_time)
            before = data[self.last_message:self.last_message + MESSAGE_HEAD + 2].tobytes()
            self.heads.setdefault(int.from_bytes(before[:2], "little"), set()).add(before[MESSAGE_HEAD:])
        self.last_message, self.last_time = start, int.from_bytes(head[6:14].tobytes(), "little")
        place = np.array([start])
        heads = {name: message_field(data, place, name) for name in ("channel", "sequence", "log_time", "publish_time")}
        content = data[start + MESSAGE_HEAD:stop].tobytes()
        self.blocks.append(Block(content, np.array([0]), np.array([len(content)]), **heads))
        return True

    def drop_doubtful(self, data: np.ndarray, position: int) -> int | None:
        """Take back the message that ends at ``position``, where something is broken, if no other has its size, or if all
        others are younger, or begin in another way.

        Returns where its payload begins; None where it may stay.
        """
        start = self.last_message
        if start is None or not self.blocks or self.blocks[-1] is None:
            return None
        size = int.from_bytes(data[start - 8:start].tobytes(), "little")
        sizes = self.sizes[int.from_bytes(data[start:start + 2].tobytes(), "little")]
        odd = sizes[size] == 1 and len(sizes) > 1
        if start + size != position or not (odd or is_older(data, start, self.earliest) or
                                                 is_odd(self.heads, self.cdr, data, start)):
            return None
        self.blocks.pop()
        self.last_time = None
        sizes -= Counter({size: 1})
        return start + MESSAGE_HEAD


def salvage_file(data: np.ndarray, name: str) -> Salvage:
    """Read what is left of a file (uint8); remarks call it ``name``."""
    found = Salvage()
    _read_summary(found, data)
    position = len(MAGIC)
    if data[:len(MAGIC)].tobytes() != MAGIC:
        found.lose(f"{name}: its beginning is damaged")
    while position + 9 <= len(data):
        stop = _take_record(found, data, position)
        if stop is None:
            doubtful = found.drop_doubtful(data, position)
            resumed = _resume(found, data, position + 1 if doubtful is None else doubtful)
            if resumed == len(data):
                break
            found.lose(f"{name}: damage at byte {position}")
            position = resumed
        elif data[position] == Opcode.DATA_END:
            return found
        else:
            position = stop
    found.lose(f"{name} is cut off at byte {position}", corrupted=False)
    return found


def _take_record(found, data, position):
    """Take the record at ``position``; return where it ends, or None where there is no sound record."""
    opcode = int(data[position])
    start = position + 9
    stop = start + int.from_bytes(data[position + 1:start].tobytes(), "little")
    if stop > len(data):
        return _take_cut_chunk(found, data, start) if opcode == Opcode.CHUNK else None
    if opcode == Opcode.CHUNK:
        return _take_chunk(found, data, start, stop)
    content = data[start:stop].tobytes()
    try:
        if opcode in _DECLARATIONS:
            parse(_DECLARATIONS[opcode], content)
            found.declare(_DECLARATIONS[opcode], content, trusted=False)
        elif opcode == Opcode.HEADER:
            found.library = parse(records.Header, content).library
        elif opcode == MESSAGE and found.library != LIBRARY:  # ours are all in chunks
            return stop if found.add_message(data, start, stop) else None
        elif opcode == Opcode.ATTACHMENT:
            record = parse(records.Attachment, content)
            if attachment_checksum(content) is not False:
                found.attachments.append(record)
            else:
                found.corrupted = True
                found.remarks.append(f"attachment '{record.name}' fails its checksum and is dropped")
        elif opcode == Opcode.METADATA:
            found.metadata.append(parse(records.Metadata, content))
        elif not (opcode in _SKIPPED and _fits(data, position) or _is_unknown(data, opcode, stop)):
            return None
    except Damage:
        return None
    return stop


def _is_unknown(data, opcode, stop):
    """Whether this is a record of a type to come, or a private one: another record must follow it."""
    return opcode > Opcode.DATA_END and stop + 9 <= len(data) and 0 < data[stop] <= Opcode.DATA_END


def _take_chunk(found, data, start, stop):
    try:
        chunk = ChunkRecord(data, start, stop)
    except Damage:
        return None
    found.chunks += 1
    try:
        found.add_records(chunk.content(), trusted=chunk.crc != 0, earliest=chunk.start_ns)
    except Damage as damage:
        found.lose(str(damage))
    return stop


def _take_cut_chunk(found, data, start):
    """An uncompressed chunk that the end of the file cuts: its whole records are still there. Return where they end."""
    head = data[start:start + 40].tobytes()
    if len(head) < 40 or head[28:32] != bytes(4) or int.from_bytes(head[32:], "little") <= len(data) - start - 40:
        return None
    end = _next_checked_record(data, start + 40)
    found.add_records(data[start + 40:end].tobytes(), trusted=False)
    if end < len(data):
        found.lose(f"the chunk at byte {start - 9} has a wrong length")
    return end


def _fits(data, position):
    """Whether the record at ``position`` is one after which the walk can go on: its own lengths must agree."""
    opcode, start = int(data[position]), position + 9
    length = int.from_bytes(data[position + 1:start].tobytes(), "little")
    stop = start + length
    if stop > len(data):
        return False
    if opcode == Opcode.MESSAGE_INDEX:
        return length >= 6 and int.from_bytes(data[start + 2:start + 6].tobytes(), "little") == length - 6
    if opcode == Opcode.DATA_END:
        return length == 4
    try:
        if opcode == Opcode.CHUNK:
            return ChunkRecord(data, start, stop).compression in ("", "lz4", "zstd")
        if opcode == Opcode.ATTACHMENT:
            return bool(attachment_checksum(data[start:stop].tobytes()))
        parse(records.Metadata, data[start:stop].tobytes())
    except Damage:
        return False
    return length > 8


def _resume(found, data, position):
    """Return the next place from ``position`` on where the walk can go on, or the end of the file."""
    place = _next_checked_record(data, position)
    if found.last_message is not None or not found.chunks and found.library != LIBRARY:
        place = min(place, next_record(data, position, place, set(found.channels), IN_FILE))
    return place


def _next_checked_record(data, position):
    for begin in range(position, len(data) - 9, 1 << 20):
        part = data[begin:begin + (1 << 20) + 8]
        likely = np.flatnonzero(np.isin(part[:-8], _RESUME) & (part[8:] == 0) & (part[7:-1] == 0) & (part[6:-2] == 0))
        for candidate in likely.tolist():
            if _fits(data, begin + candidate):
                return begin + candidate
    return len(data)


def _read_summary(found, data):
    """Take schemas, channels and counts from the summary, where its checksum holds; without one, the declarations."""
    tail = data[-37:].tobytes()
    if len(data) < 45 or tail[-8:] != MAGIC or tail[:9] != bytes([Opcode.FOOTER, 20]) + bytes(7):
        return
    footer = parse(records.Footer, tail[9:29])
    if not 0 < footer.summary_start <= len(data) - 37:
        return
    trusted = footer.summary_crc != 0
    if trusted and zlib.crc32(data[footer.summary_start:len(data) - 12]) != footer.summary_crc:
        return
    opcodes, starts, stops, end = list_records(data, footer.summary_start, len(data) - 37)
    if not trusted and (end != len(data) - 37 or (opcodes == 0).any()):
        return
    for opcode, start, stop in zip(opcodes, starts, stops):
        if opcode in _DECLARATIONS:
            found.declare(_DECLARATIONS[opcode], data[start:stop].tobytes(), trusted)
        elif opcode == Opcode.STATISTICS and trusted:
            found.statistics = parse(records.Statistics, data[start:stop].tobytes())
