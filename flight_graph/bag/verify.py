"""Reading one MCAP file with every check the format offers, or a `Damage` that says what does not hold."""

import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import zstandard
from mcap import records

from flight_graph.bag.byte_kernels import MESSAGE, MESSAGE_HEAD, message_heads
from flight_graph.bag.mcap_file import LIBRARY, MAGIC
from flight_graph.bag.mcap_records import ChunkRecord, Damage, Opcode, attachment_checked, list_records, parse

_FOOTER = struct.Struct("<BQQQI")
_TAIL = _FOOTER.size + len(MAGIC)  # [bytes] footer record and end magic
_KEEP = 1 << 30  # [bytes] decompressed chunks of a file are kept up to this total


@dataclass
class Messages:
    """Where the messages of a file are. All (n,), in write order: number of the block, first payload byte in it, byte
    behind the last, channel id, sequence, log time and publish time [ns]."""

    block: np.ndarray
    start: np.ndarray
    stop: np.ndarray
    channel: np.ndarray
    sequence: np.ndarray
    log_time: np.ndarray
    publish_time: np.ndarray


@dataclass
class McapContents:
    """What a sound file holds. blocks: functions that return the bytes of a chunk, or of a run of unchunked messages."""

    library: str = ""
    checked: bool = False  # a checksum covers every byte
    schemas: dict = field(default_factory=dict)
    channels: dict = field(default_factory=dict)
    attachments: list = field(default_factory=list)
    metadata: list = field(default_factory=list)
    blocks: list = field(default_factory=list)
    messages: Messages = None


def map_file(path: Path) -> np.ndarray:
    """Return the file's bytes as a uint8 array that is read on demand; ``.zstd`` files (rosbag2's file compression) are
    decompressed."""
    if path.stat().st_size == 0:
        return np.empty(0, np.uint8)
    if path.suffix == ".zstd":
        try:
            with open(path, "rb") as file:
                content = zstandard.ZstdDecompressor().stream_reader(file).read()
        except zstandard.ZstdError:
            raise Damage(f"{path.name} cannot be decompressed") from None
        return np.frombuffer(content, np.uint8)
    return np.memmap(path, np.uint8, mode="r").view(np.ndarray)


def read_mcap(path: Path) -> McapContents:
    """Read and verify a file. Raises Damage."""
    data = map_file(path)
    footer = _check_ends(data)
    opcodes, starts, stops, end = list_records(data, len(MAGIC), len(data) - len(MAGIC))
    if end != len(data) - len(MAGIC) or len(opcodes) < 3 or opcodes[0] != Opcode.HEADER:
        raise Damage("its records do not fill the file")
    data_ends = np.flatnonzero(opcodes == Opcode.DATA_END)
    if len(data_ends) != 1:
        raise Damage("the end of its data section is missing")
    split = int(data_ends[0])
    contents = McapContents(library=parse(records.Header, _bytes(data, starts[0], stops[0])).library)
    contents.checked = _check_sums(data, contents.library, int(starts[split]), int(stops[split]), footer)
    chunks = _read_data(contents, data, opcodes[1:split], starts[1:split], stops[1:split])
    _check_summary(contents, chunks, data, opcodes[split + 1:-1], starts[split + 1:-1], stops[split + 1:-1])
    return contents


def _bytes(data, start, stop):
    return data[int(start):int(stop)].tobytes()


def _check_ends(data):
    if len(data) < len(MAGIC) + _TAIL or _bytes(data, 0, 8) != MAGIC:
        raise Damage("it is no MCAP file" if len(data) >= 8 else "the file is cut off at its beginning")
    if _bytes(data, len(data) - 8, len(data)) != MAGIC:
        raise Damage("it ends without a footer (the recorder was stopped, or the file is cut off)")
    opcode, length, *footer = _FOOTER.unpack(_bytes(data, len(data) - _TAIL, len(data) - 8))
    if opcode != Opcode.FOOTER or length != 20:
        raise Damage("its footer cannot be read")
    return footer


def _check_sums(data, library, end_start, end_stop, footer):
    """Verify the checksums of the data section and the summary; return whether both are there."""
    summary_start, _, summary_crc = footer
    if end_stop - end_start != 4 or summary_start != (0 if end_stop == len(data) - _TAIL else end_stop):
        raise Damage("its footer does not point behind its data section")
    data_crc = int.from_bytes(_bytes(data, end_start, end_stop), "little")
    ours = library == LIBRARY
    if (data_crc or ours) and zlib.crc32(data[:end_start - 9]) != data_crc:
        raise Damage("its data section fails its checksum")
    if (summary_crc or ours) and zlib.crc32(data[end_stop:len(data) - 12]) != summary_crc:
        raise Damage("its summary fails its checksum")
    return bool(data_crc) and bool(summary_crc)


def _read_data(contents, data, opcodes, starts, stops):
    """Collect the records of the data section; return its chunks."""
    chunks, tables, kept = [], [], 0
    in_run = opcodes == MESSAGE
    first_of_run = in_run & ~np.concatenate(([False], in_run[:-1]))
    for i in np.flatnonzero((opcodes != Opcode.MESSAGE_INDEX) & (~in_run | first_of_run)):
        opcode, start, stop = opcodes[i], int(starts[i]), int(stops[i])
        if opcode == Opcode.CHUNK:
            chunk = ChunkRecord(data, start, stop)
            content = chunk.content()
            kept += len(content)
            contents.blocks.append((lambda held=content: held) if kept <= _KEEP else
                                   (lambda chunk=chunk: chunk.content(verify=False)))
            chunks.append(chunk)
            tables.append(_read_chunk(contents, np.frombuffer(content, np.uint8), len(contents.blocks) - 1, chunk))
        elif opcode == MESSAGE:
            behind = np.flatnonzero(~in_run[i:])
            last = i + int(behind[0]) if len(behind) else len(opcodes)
            begin, end = start, int(stops[last - 1])
            contents.blocks.append(lambda begin=begin, end=end: _bytes(data, begin, end))
            tables.append(_table(data, starts[i:last], stops[i:last], len(contents.blocks) - 1, begin))
        elif opcode == Opcode.ATTACHMENT:
            raw = _bytes(data, start, stop)
            if raw[-4:] != b"\0\0\0\0" and not attachment_checked(raw):
                raise Damage("an attachment fails its checksum")
            contents.attachments.append(parse(records.Attachment, raw))
        elif opcode == Opcode.METADATA:
            contents.metadata.append(parse(records.Metadata, _bytes(data, start, stop)))
        else:
            _declare(contents, opcode, data, start, stop)
    contents.messages = _joined(tables)
    unknown = set(np.unique(contents.messages.channel).tolist()) - set(contents.channels)
    if unknown:
        raise Damage(f"it holds messages of a channel {unknown.pop()} that it does not declare")
    return chunks


def _read_chunk(contents, content, number, chunk):
    opcodes, starts, stops, end = list_records(content, 0, len(content))
    if end != len(content):
        raise Damage(f"the records of the chunk at byte {chunk.start} do not fill it")
    is_message = opcodes == MESSAGE
    for i in np.flatnonzero(~is_message):
        _declare(contents, opcodes[i], content, int(starts[i]), int(stops[i]))
    return _table(content, starts[is_message], stops[is_message], number, 0)


def _declare(contents, opcode, data, start, stop):
    for code, kind, known in ((Opcode.SCHEMA, records.Schema, contents.schemas),
                              (Opcode.CHANNEL, records.Channel, contents.channels)):
        if opcode == code:
            record = parse(kind, _bytes(data, start, stop))
            if known.setdefault(record.id, record) != record:
                raise Damage(f"it declares {kind.__name__.lower()} {record.id} in two ways")


def _table(data, starts, stops, number, origin):
    count = len(starts)
    if (stops - starts < MESSAGE_HEAD).any():
        raise Damage("a message is too short")
    heads = [np.empty(count, dtype) for dtype in (np.uint16, np.uint32, np.uint64, np.uint64)]
    message_heads(data, starts, *heads)
    return (np.full(count, number, np.int64), starts + MESSAGE_HEAD - origin, stops - origin, *heads)


def _joined(tables):
    if not tables:
        tables = [_table(np.empty(0, np.uint8), *[np.empty(0, np.int64)] * 2, 0, 0)]
    joined = Messages(*[np.concatenate(column) for column in zip(*tables)])
    for name in ("log_time", "publish_time"):
        times = getattr(joined, name)
        if (times >> np.uint64(63)).any():
            raise Damage("a message has an impossible time")
        setattr(joined, name, times.view(np.int64))
    return joined


def _check_summary(contents, chunks, data, opcodes, starts, stops):
    """Compare the summary with what the data section holds."""
    indexed = []
    for opcode, start, stop in zip(opcodes, starts, stops):
        raw = _bytes(data, start, stop)
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            _declare(contents, opcode, np.frombuffer(raw, np.uint8), 0, len(raw))
        elif opcode == Opcode.CHUNK_INDEX:
            index = parse(records.ChunkIndex, raw)
            indexed.append((index.chunk_start_offset, index.chunk_start_offset + index.chunk_length))
        elif opcode == Opcode.STATISTICS:
            statistics = parse(records.Statistics, raw)
            ids, counts = np.unique(contents.messages.channel, return_counts=True)
            found = dict(zip(ids.tolist(), counts.tolist()))
            declared = {key: count for key, count in statistics.channel_message_counts.items() if count}
            if statistics.message_count != len(contents.messages.channel) or (declared and declared != found):
                raise Damage(f"it holds {len(contents.messages.channel)} messages where its summary counts "
                             f"{statistics.message_count}, or other ones")
    if indexed and sorted(indexed) != [(chunk.start, chunk.stop) for chunk in chunks]:
        raise Damage("its index does not fit its chunks")
