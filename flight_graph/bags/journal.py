"""The file RECORDING: marks a bag that is being written, and keeps the records of its open chunk.

The MCAP file is append-only and grows by whole chunks, so that its bytes do not depend on when a timer fired. What has
not filled a chunk yet is copied here on the timer: a recorder that is killed loses what came after the last copy.
A running recorder holds a lock (flock) on the file, which ends with its process.

Layout: 256 bytes of text for whoever opens the file; ordinal of the open chunk, number of bytes, their CRC-32 (u64,
u64, u32, little endian); then the bytes, MCAP records (schema, channel, message).
"""

import fcntl
import os
import struct
import zlib
from pathlib import Path

FILE_NAME = "RECORDING"
FLUSH_PERIOD_S = 0.2  # [s] default: wall time of messages that a kill -9 may cost at most
_TEXT = (b"This bag is being recorded, or its recorder was stopped before it could finish.\n"
         b"In the second case `flight recover <this folder>` makes a valid bag of it.\n").ljust(256)
_HEAD = struct.Struct("<QQI")
_START = len(_TEXT) + _HEAD.size  # [bytes] position of the first record


class Journal:
    """Writes RECORDING. Used by one thread at a time."""

    def __init__(self, folder: Path):
        self.path = folder / FILE_NAME
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        fcntl.flock(self._file, fcntl.LOCK_EX)
        self.ordinal, self.size, self._crc = 0, 0, 0
        _write_all(self._file, _TEXT + _HEAD.pack(0, 0, 0), 0)

    def append(self, ordinal: int, data: bytes) -> None:
        """Add the next bytes of open chunk number ``ordinal``; the first bytes of a new number replace the old."""
        if ordinal != self.ordinal:
            self.ordinal, self.size, self._crc = ordinal, 0, 0
        _write_all(self._file, data, _START + self.size)
        self.size += len(data)
        self._crc = zlib.crc32(data, self._crc)
        _write_all(self._file, _HEAD.pack(ordinal, self.size, self._crc), len(_TEXT))
        os.fsync(self._file)

    def close(self) -> None:
        os.close(self._file)


def _write_all(file: int, data: bytes, position: int) -> None:
    view = memoryview(data)
    while view:
        written = os.pwrite(file, view, position)
        view, position = view[written:], position + written


def is_live(folder: Path) -> bool:
    """Whether a running process holds the RECORDING file of a folder."""
    try:
        file = os.open(folder / FILE_NAME, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(file)
    return False


def read_journal(folder: Path):
    """Return (ordinal, records) of a RECORDING file; (-1, b"") where there is none or its CRC does not hold."""
    try:
        content = (folder / FILE_NAME).read_bytes()
        ordinal, size, crc = _HEAD.unpack_from(content, len(_TEXT))
    except (OSError, struct.error):
        return -1, b""
    data = content[_START:_START + size]
    return (ordinal, data) if len(data) == size and zlib.crc32(data) == crc else (-1, b"")
