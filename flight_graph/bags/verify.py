"""Reading one MCAP file with every check the format offers, or a `Damage` that says what does not hold."""

import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from mcap import records

from flight_graph.bags.blocks import Chunks, ahead, list_blocks
from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD, read_field
from flight_graph.bags.file_content import map_file
from flight_graph.bags.file_kinds import refuse_other_kind
from flight_graph.bags.mcap_file import LIBRARY, MAGIC
from flight_graph.bags.mcap_records import Damage, Opcode, attachment_checksum, list_records, message_field, parse
from flight_graph.bags.payloads import Payloads

_FOOTER = struct.Struct("<QQI")  # start of summary, of its offsets, checksum
_SHORTEST = 2 * len(MAGIC) + 9 + _FOOTER.size  # [bytes] of a file that has both ends
_KEPT = 1 << 29  # [bytes] the payloads of a file of this size are kept when it is read; of a larger one, when asked for


@dataclass
class Messages:
    """Where the messages of a file are, in write order.

    start, stop: (n,) first payload byte in its block, and the byte behind the last. channel: (n,) id. log_time: (n,)
    [ns]. first: (blocks + 1,) number of the first message of each block.
    """

    start: np.ndarray
    stop: np.ndarray
    channel: np.ndarray
    log_time: np.ndarray
    first: np.ndarray


@dataclass
class McapContents:
    """What a sound file holds. With a checksum over the data section the chunks' own checksums say nothing more, and
    are not computed again."""

    library: str = ""
    checked: bool = False  # a checksum stands over the whole data section
    covered: bool = False  # a checksum stands over every message
    schemas: dict = field(default_factory=dict)
    channels: dict = field(default_factory=dict)
    attachments: list = field(default_factory=list)
    metadata: list = field(default_factory=list)
    blocks: list = field(default_factory=list)
    messages: Messages = None
    room: int = 0  # [bytes] of all messages
    expected: dict = field(default_factory=dict)  # channel id -> messages, as the summary counts them
    kept: dict = field(default_factory=dict)  # topic -> Payloads
    remarks: list = field(default_factory=list)  # sentences for a person
    holder: object = None  # of a folder that must stay as long as this does

    def sequences(self, numbers: np.ndarray) -> np.ndarray:
        """Return (n,) uint32 sequence numbers of messages."""
        parts = [message_field(content, self.messages.start[numbers[begin:end]] - MESSAGE_HEAD, "sequence")
                 for content, begin, end in self.runs(numbers)]
        return np.concatenate([np.empty(0, np.uint32), *parts])

    def runs(self, numbers: np.ndarray):
        """Yield (content of a block, begin, end) for each run of messages numbers[begin:end] (rising) in one block."""
        bounds = np.searchsorted(numbers, self.messages.first)
        for i in np.flatnonzero(np.diff(bounds)):
            yield self.blocks[i].load(False), int(bounds[i]), int(bounds[i + 1])

    def payloads(self, topic: str) -> Payloads:
        """The payloads of a topic; kept from then on."""
        if topic not in self.kept:
            numbers, found = self.numbers(topic), self.empty(topic)
            for content, begin, end in self.runs(numbers):
                start, stop = (column[numbers[begin:end]] for column in (self.messages.start, self.messages.stop))
                found.add(content, start, stop - start)
            self.kept[topic] = found
        return self.kept[topic]

    def numbers(self, topic: str) -> np.ndarray:
        """(n,) the numbers of a topic's messages, in write order."""
        return np.flatnonzero(np.isin(self.messages.channel, self.channels_of(topic)))

    def channels_of(self, topic: str) -> list[int]:
        return [channel.id for channel in self.channels.values() if channel.topic == topic]

    def empty(self, topic: str) -> Payloads:
        """Room for the payloads of a topic."""
        return Payloads(sum(self.expected.get(number, 0) for number in self.channels_of(topic)), self.room)

    def keep(self, content: np.ndarray, table) -> None:
        """Keep the payloads of a block, while it is in the cache."""
        start, stop, channel, _ = table
        topics = {}
        for number in np.unique(channel).tolist():
            if number not in self.channels:
                raise Damage(f"it holds messages of a channel {number} that it does not declare")
            topics.setdefault(self.channels[number].topic, []).append(number)
        for topic, numbers in topics.items():
            chosen = slice(None) if len(topics) == 1 else np.flatnonzero(np.isin(channel, numbers))
            if topic not in self.kept:
                self.kept[topic] = self.empty(topic)
            self.kept[topic].add(content, start[chosen], stop[chosen] - start[chosen])


def read_mcap(path: Path) -> McapContents:
    """Read and verify a file. Raises Damage, or BagError where it is something else than an MCAP file."""
    data = map_file(path)
    _check_ends(path, data)
    opcodes, starts, stops, end = list_records(data, len(MAGIC), len(data) - len(MAGIC))
    if end != len(data) - len(MAGIC) or len(opcodes) < 3 or opcodes[0] != Opcode.HEADER:
        raise Damage("its records do not fill the file")
    if opcodes[-1] != Opcode.FOOTER or stops[-1] - starts[-1] < _FOOTER.size:
        raise Damage("its footer cannot be read")
    data_ends = np.flatnonzero(opcodes == Opcode.DATA_END)
    if len(data_ends) != 1:
        raise Damage("the end of its data section is missing")
    split = int(data_ends[0])
    contents = McapContents(library=parse(records.Header, _bytes(data, starts[0], stops[0])).library)
    contents.checked = _check_sums(data, contents.library, (int(starts[split]), int(stops[split])), int(starts[-1]))
    contents.expected = _expected(data, opcodes[split + 1:-1], starts[split + 1:-1], stops[split + 1:-1])
    chunks = _read_data(contents, data, opcodes[1:split], starts[1:split], stops[1:split])
    _check_summary(contents, chunks, data, opcodes[split + 1:-1], starts[split + 1:-1], stops[split + 1:-1])
    return contents


def _bytes(data, start, stop):
    return data[int(start):int(stop)].tobytes()


def _check_ends(path, data):
    if not MAGIC.startswith(_bytes(data, 0, 8)):
        refuse_other_kind(path, _bytes(data, 0, 128))
        raise Damage("its beginning is no MCAP file's")
    if len(data) < 8:
        raise Damage("the file is cut off at its beginning" if len(data) else "the file is empty")
    if len(data) < _SHORTEST or _bytes(data, len(data) - 8, len(data)) != MAGIC:
        raise Damage("it ends without a footer (the recorder was stopped, or the file is cut off)")


def _check_sums(data, library, data_end, footer_start):
    """Verify the checksums of the data section and the summary; return whether the data section has one.

    data_end: bounds of the content of its last record; footer_start: of the footer's content.
    """
    end_start, end_stop = data_end
    summary_start, _, summary_crc = _FOOTER.unpack(_bytes(data, footer_start, footer_start + _FOOTER.size))
    if end_stop - end_start < 4 or summary_start and not end_stop <= summary_start <= footer_start - 9:
        raise Damage("its footer does not point behind its data section")
    data_crc = int.from_bytes(_bytes(data, end_start, end_start + 4), "little")
    ours = library == LIBRARY
    if (data_crc or ours) and zlib.crc32(data[:end_start - 9]) != data_crc:
        raise Damage("its data section fails its checksum")
    if (summary_crc or ours) and zlib.crc32(data[summary_start or end_stop:footer_start + 16]) != summary_crc:
        raise Damage("its summary fails its checksum")
    return bool(data_crc)


def _expected(data, opcodes, starts, stops):
    """channel id -> number of messages, as a summary counts them; nothing where it does not. Not checked here."""
    for i in np.flatnonzero(opcodes == Opcode.STATISTICS):
        return parse(records.Statistics, _bytes(data, starts[i], stops[i])).channel_message_counts
    return {}


def _read_data(contents, data, opcodes, starts, stops):
    """Collect the records of the data section; return its chunks."""
    where = opcodes == Opcode.CHUNK
    chunks = Chunks.listed(data, starts[where], stops[where])
    for i in np.flatnonzero(~np.isin(opcodes, (Opcode.CHUNK, Opcode.MESSAGE_INDEX, MESSAGE))):
        opcode, raw = opcodes[i], _bytes(data, starts[i], stops[i])
        if opcode == Opcode.ATTACHMENT:
            if attachment_checksum(raw) is False:
                raise Damage("an attachment fails its checksum")
            contents.attachments.append(parse(records.Attachment, raw))
        elif opcode == Opcode.METADATA:
            contents.metadata.append(parse(records.Metadata, raw))
        else:
            _declare(contents, opcode, raw)
    is_message = opcodes == MESSAGE
    contents.covered = contents.checked or bool((chunks.crc != 0).all() and not is_message.any())
    contents.room = int(chunks.size.sum() + (stops[is_message] - starts[is_message]).sum())
    contents.blocks = list_blocks(data, opcodes, starts, stops, chunks)
    tables = []
    for content, declared, table in ahead(lambda block: _read_block(block, not contents.checked), contents.blocks):
        for opcode, raw in declared:
            _declare(contents, opcode, raw)
        if contents.room <= _KEPT:
            contents.keep(content, table)
        tables.append(table)
    contents.messages = joined_tables(tables)
    unknown = set(np.unique(contents.messages.channel).tolist()) - set(contents.channels)
    if unknown:
        raise Damage(f"it holds messages of a channel {unknown.pop()} that it does not declare")
    return chunks


def _read_block(block, verify):
    """Return (content, [(opcode, content) of a record that is no message], table of the messages) of a block."""
    content = block.load(verify)
    declared, bounds = ([], block.bounds) if block.bounds else _read_chunks(content, block.chunk_sizes)
    return content, declared, message_table(content, *bounds)


def _read_chunks(content, sizes):
    """Return ([(opcode, content) of a record that is no message], (starts, stops) of the messages) of joined chunks."""
    opcodes, starts, stops, end = list_records(content, 0, len(content))
    bounds = np.cumsum(sizes)
    begins = bounds[:-1][bounds[:-1] < len(content)] + 9
    if end != len(content) or not np.array_equal(starts[np.searchsorted(starts[:-1], begins)], begins):
        raise Damage("the records of a chunk do not fill it")
    is_message = opcodes == MESSAGE
    declared = [(opcodes[i], _bytes(content, starts[i], stops[i])) for i in np.flatnonzero(~is_message)]
    return declared, (starts[is_message], stops[is_message])


def _declare(contents, opcode, raw):
    for code, kind, known in ((Opcode.SCHEMA, records.Schema, contents.schemas),
                              (Opcode.CHANNEL, records.Channel, contents.channels)):
        if opcode == code:
            record = parse(kind, raw)
            if known.setdefault(record.id, record) != record:
                raise Damage(f"it declares {kind.__name__.lower()} {record.id} in two ways")


def message_table(content, starts, stops):
    if (stops - starts < MESSAGE_HEAD).any():
        raise Damage("a message is too short")
    return (starts + MESSAGE_HEAD, stops, message_field(content, starts, "channel"),
            message_field(content, starts, "log_time"))


def joined_tables(tables):
    nothing = np.empty(0, np.int64)
    tables = [(nothing, nothing, nothing.astype(np.uint16), nothing.astype(np.uint64)), *tables]
    start, stop, channel, log_time = (np.concatenate(column) for column in zip(*tables))
    if (log_time >> np.uint64(63)).any():
        raise Damage("a message has an impossible time")
    return Messages(start, stop, channel, log_time.view(np.int64), np.cumsum([len(table[0]) for table in tables]))


def _check_summary(contents, chunks, data, opcodes, starts, stops):
    """Compare the summary with what the data section holds."""
    is_index = opcodes == Opcode.CHUNK_INDEX
    if is_index.any():
        place = {name: np.empty(int(is_index.sum()), np.int64) for name in ("start", "length")}
        if (stops[is_index] - starts[is_index] < 32).any():
            raise Damage("a chunk index is too short")
        read_field(data, starts[is_index], 16, 8, place["start"])
        read_field(data, starts[is_index], 24, 8, place["length"])
        ours = contents.library == LIBRARY
        at = np.searchsorted(chunks.start, place["start"] + 9)  # chunks that no index names may be there as well
        fits = at < len(chunks.start)
        at[~fits] = 0
        if not fits.all() or (chunks.start[at] != place["start"] + 9).any() or (ours and len(at) != len(chunks.start)) or (
                chunks.stop[at] - place["start"] != place["length"]).any():
            raise Damage("its index does not fit its chunks")
    for i in np.flatnonzero(~is_index):
        raw = _bytes(data, starts[i], stops[i])
        if opcodes[i] in (Opcode.SCHEMA, Opcode.CHANNEL):
            _declare(contents, opcodes[i], raw)
        elif opcodes[i] == Opcode.STATISTICS:
            statistics = parse(records.Statistics, raw)
            ids, counts = np.unique(contents.messages.channel, return_counts=True)
            found = dict(zip(ids.tolist(), counts.tolist()))
            declared = {key: count for key, count in statistics.channel_message_counts.items() if count}
            if statistics.message_count != len(contents.messages.channel) or (declared and declared != found):
                raise Damage(f"it holds {len(contents.messages.channel)} messages where its summary counts "
                             f"{statistics.message_count}, or other ones")
