"""Parsing MCAP records. What does not fit together is a `Damage`; bytes behind a record's last field are none: the format
lets records grow by new fields at their end, which a reader passes over."""

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

LARGEST_RATIO = 1000  # [1] of unpacked to packed bytes
ALWAYS_ALLOWED = 1 << 21  # [bytes] that may be unpacked whatever the ratio
USUAL_RATIO, USUALLY_ALLOWED = 50, 1 << 26  # of more than so many bytes [bytes]
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
    return record


def attachment_checksum(content: bytes) -> bool | None:
    """Whether an attachment record's own checksum holds; None where it carries none. Raises Damage."""
    end = 16  # [bytes] two times
    for width in (4, 4, 8):  # name, media type, data: each behind its length
        if end + width > len(content):
            raise Damage("an attachment is too short")
        end += width + int.from_bytes(content[end:end + width], "little")
    if end + 4 > len(content):
        raise Damage("an attachment is too short")
    crc = _ATTACHMENT_CRC.unpack_from(content, end)[0]
    return zlib.crc32(content[:end]) == crc if crc else None


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
        self._packed_stop = self._packed_start + packed_size
        if self._packed_stop > stop:
            raise Damage(f"the chunk at byte {self.start} has the wrong length")

    def content(self, verify: bool = True) -> bytes:
        packed = self._data[self._packed_start:self._packed_stop].tobytes()
        content = _decompress(self.compression, packed, self.size, f"the chunk at byte {self.start}")
        if verify and self.crc and zlib.crc32(content) != self.crc:
            raise Damage(f"the chunk at byte {self.start} fails its checksum")
        return content


def largest_size(packed: int) -> int:
    """What so many packed bytes may unpack to [bytes]: small things by any ratio, large ones by that of real recordings."""
    return min(LARGEST_RATIO * packed + ALWAYS_ALLOWED, USUAL_RATIO * packed + USUALLY_ALLOWED)


def refuse_impossible_size(size: int, packed: int, where: str) -> None:
    """Raise Damage for a size that no compression reaches: a damaged or evil one must not fill the memory."""
    if size > largest_size(packed):
        raise Damage(f"{where} declares an impossible size of {size} bytes")


def _decompress(compression, packed, size, where):
    try:
        if compression == "":
            content = packed
        elif compression == "zstd":
            refuse_impossible_size(size, len(packed), where)
            content = zstandard.ZstdDecompressor().stream_reader(packed).read(size + 1)
        elif compression == "lz4":
            refuse_impossible_size(size, len(packed), where)
            content = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
        else:
            raise Damage(f"{where} is compressed with '{compression[:16]}', which is unknown")
    except (zstandard.ZstdError, RuntimeError, MemoryError, OverflowError, EOFError):
        raise Damage(f"{where} cannot be decompressed") from None
    if len(content) != size:
        raise Damage(f"{where} holds {'more' if len(content) > size else len(content)} bytes where it declares {size}")
    return content


__all__ = ["ChunkRecord", "Damage", "Opcode", "attachment_checksum", "list_records", "message_field", "parse"]
