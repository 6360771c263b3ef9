"""Parsing MCAP records strictly: every byte must be accounted for. Anything odd is a `Damage`."""

import struct
import zlib
from io import BytesIO

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from flight_graph.bags.byte_kernels import read_field, walk

_CHUNK_HEAD = struct.Struct("<QQQI")
_ATTACHMENT_CRC = struct.Struct("<I")


class Damage(Exception):
    """What is wrong with a file, as the second half of a sentence."""


def list_records(data: np.ndarray, start: int, stop: int):
    """Return (opcodes, starts, stops, end) of the records in data[start:stop] (uint8).

    starts, stops: bounds of their contents. end: position behind the last whole record.
    """
    room = max(16, (stop - start) // 64)
    while True:
        opcodes, starts, stops = np.empty(room, np.uint8), np.empty(room, np.int64), np.empty(room, np.int64)
        count, end = walk(data, start, stop, opcodes, starts, stops)
        if count <= room:
            return opcodes[:count], starts[:count], stops[:count], end
        room = count


_FIELDS = {"channel": (0, 2, np.uint16), "sequence": (2, 4, np.uint32), "log_time": (6, 8, np.uint64),
           "publish_time": (14, 8, np.uint64)}  # of a message record: offset, size, type


def message_field(data: np.ndarray, starts: np.ndarray, name: str) -> np.ndarray:
    """Return (n,) the field of the message records whose content starts at ``starts``."""
    offset, size, dtype = _FIELDS[name]
    out = np.empty(len(starts), dtype)
    read_field(data, starts, offset, size, out)
    return out


def parse(kind, content: bytes):
    """Parse the content of one record with the library mcap's class ``kind``."""
    stream = ReadDataStream(BytesIO(content))
    try:
        record = kind.read(stream)
    except (EndOfFile, struct.error, UnicodeDecodeError, OverflowError, MemoryError):
        raise Damage(f"a {kind.__name__} record cannot be read") from None
    if stream.count != len(content):
        raise Damage(f"a {kind.__name__} record has the wrong length")
    return record


def attachment_checked(content: bytes) -> bool:
    """Whether an attachment record's own checksum holds; False also where there is none."""
    return len(content) > 4 and zlib.crc32(content[:-4]) == _ATTACHMENT_CRC.unpack(content[-4:])[0] != 0


class ChunkRecord:
    """A chunk as it stands in the file; `content` decompresses it and verifies its checksum."""

    def __init__(self, data: np.ndarray, start: int, stop: int):
        self.start, self.stop = start - 9, stop
        head = data[start:min(stop, start + 128)].tobytes()
        try:
            self.start_ns, self.end_ns, self.size, self.crc = _CHUNK_HEAD.unpack_from(head)
            name_length = struct.unpack_from("<I", head, _CHUNK_HEAD.size)[0]
            name_end = _CHUNK_HEAD.size + 4 + name_length
            self.compression = head[_CHUNK_HEAD.size + 4:name_end].decode()
            packed_size = struct.unpack_from("<Q", head, name_end)[0]
        except (struct.error, UnicodeDecodeError):
            raise Damage(f"the chunk at byte {self.start} cannot be read") from None
        self._data, self._packed_start = data, start + name_end + 8
        if self._packed_start + packed_size != stop:
            raise Damage(f"the chunk at byte {self.start} has the wrong length")

    def content(self, verify: bool = True) -> bytes:
        packed = self._data[self._packed_start:self.stop].tobytes()
        content = _decompress(self.compression, packed, self.size, f"the chunk at byte {self.start}")
        if verify and self.crc and zlib.crc32(content) != self.crc:
            raise Damage(f"the chunk at byte {self.start} fails its checksum")
        return content


def _decompress(compression, packed, size, where):
    try:
        if compression == "":
            content = packed
        elif compression == "zstd":
            known = zstandard.frame_content_size(packed)
            content = zstandard.ZstdDecompressor().decompress(packed) if known == size and size else \
                zstandard.ZstdDecompressor().stream_reader(packed).read(size + 1 if known < 0 else 0)
        elif compression == "lz4":
            content = lz4.frame.decompress(packed)
        else:
            raise Damage(f"{where} is compressed with '{compression[:16]}', which is unknown")
    except (zstandard.ZstdError, RuntimeError, MemoryError, OverflowError):
        raise Damage(f"{where} cannot be decompressed") from None
    if len(content) != size:
        raise Damage(f"{where} holds {len(content)} bytes where it declares {size}")
    return content


__all__ = ["ChunkRecord", "Damage", "Opcode", "attachment_checked", "list_records", "message_field", "parse"]
