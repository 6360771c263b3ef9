"""MCAP files as other recorders write them, made record by record with the library mcap's record classes."""

import struct
import zlib
from io import BytesIO

import lz4.frame
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from flight_graph.bags.reader import read_bag

MAGIC = b"\x89MCAP0\r\n"
START = 1_700_000_000_000_000_000  # [ns]
STEP = 100_000_000  # [ns]
INT32 = records.Schema(1, b"int32 data\n", "ros2msg", "std_msgs/msg/Int32")
COUNT = records.Channel(1, "/count", "cdr", {}, 1)


def record(made, pad: bytes = b"") -> bytes:
    """A record as bytes; ``pad``: fields that a later version of the format adds to its end."""
    builder = RecordBuilder()
    made.write(builder)
    raw = builder.end()
    return raw[:1] + struct.pack("<Q", len(raw) - 9 + len(pad)) + raw[9:] + pad


def raw_record(opcode: int, content: bytes) -> bytes:
    return bytes([opcode]) + struct.pack("<Q", len(content)) + content


def int32(value: int) -> bytes:
    return b"\0\1\0\0" + struct.pack("<i", value)


def message(channel: int, number: int, payload: bytes, time: int | None = None) -> bytes:
    time = START + number * STEP if time is None else time
    return record(records.Message(channel, time, payload, time, number))


def chunk(content: bytes, compression: str = "", crc: bool = True, pad: bytes = b"") -> bytes:
    packed = {"": bytes, "zstd": zstandard.ZstdCompressor().compress, "lz4": lz4.frame.compress}[compression](content)
    return record(records.Chunk(compression, packed, START + STEP * 100, START, zlib.crc32(content) if crc else 0,
                                len(content)), pad)


def file(data: bytes, summary: bytes = b"", pad: bytes = b"", library: str = "another recorder") -> bytes:
    """A whole file around a data section, without checksums."""
    head = MAGIC + record(records.Header("ros2", library), pad) + data + record(records.DataEnd(0), pad)
    start = len(head) if summary else 0
    return head + summary + record(records.Footer(start, 0, 0), pad) + MAGIC


def counting(count: int, **options) -> bytes:
    """A file with ``count`` messages of /count in one chunk."""
    content = b"".join([record(INT32), record(COUNT), *(message(1, i, int32(i)) for i in range(count))])
    return file(chunk(content, **options))


def by_mcap(content: bytes) -> list:
    """(topic, log time, payload) of every message, in write order, as the library mcap reads them."""
    from mcap.reader import NonSeekingReader
    return [(channel.topic, found.log_time, found.data) for _, channel, found in
            NonSeekingReader(BytesIO(content)).iter_messages(log_time_order=False)]


def bag_of(tmp_path, content, name="x.mcap"):
    path = tmp_path / name
    path.write_bytes(content)
    return read_bag(path)


__all__ = ["COUNT", "INT32", "MAGIC", "Opcode", "START", "STEP", "bag_of", "by_mcap", "chunk", "counting", "file", "int32", "message",
           "raw_record", "record"]
