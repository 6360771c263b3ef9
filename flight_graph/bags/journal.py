"""The file RECORDING: marks a bag that is being written, and keeps the records of its open chunk.

The MCAP file is append-only and grows by whole chunks, so that its bytes do not depend on when a timer fired. What has
not filled a chunk yet is copied here on the timer: a recorder that is killed loses what came after the last copy.
A running recorder holds a lock on the file, which ends with its process.

Layout: 256 bytes of text for whoever opens the file; ordinal of the open chunk, number of bytes, their CRC-32 (u64,
u64, u32, little endian); then the bytes, MCAP records (schema, channel, message).
"""

import os
import struct
import zlib
from pathlib import Path

from flight_graph.bags import disk

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
        self._file = disk.new_file(self.path)
        disk.lock(self._file)
        self.ordinal, self.size, self._crc = 0, 0, 0
        disk.write_at(self._file, _TEXT + _HEAD.pack(0, 0, 0), 0)

    def append(self, ordinal: int, data: bytes) -> None:
        """Add the next bytes of open chunk number ``ordinal``; the first bytes of a new number replace the old."""
        if ordinal != self.ordinal:
            self.ordinal, self.size, self._crc = ordinal, 0, 0
        disk.write_at(self._file, data, _START + self.size)
        self.size += len(data)
        self._crc = zlib.crc32(data, self._crc)
        disk.write_at(self._file, _HEAD.pack(ordinal, self.size, self._crc), len(_TEXT))
        os.fsync(self._file)

    def remove(self) -> None:
        """The bag is whole: remove the file. Windows removes no open file, so there it is closed before."""
        if disk.ON_WINDOWS:
            self.close()
        self.path.unlink()

    def close(self) -> None:
        """Let go of the file, once."""
        if self._file is not None:
            file, self._file = self._file, None
            os.close(file)


def is_live(folder: Path) -> bool:
    """Whether a running process holds the RECORDING file of a folder."""
    return disk.is_locked(folder / FILE_NAME)


def read_journal(folder: Path):
    """Return (ordinal, records) of a RECORDING file; (-1, b"") where there is none or its CRC does not hold."""
    try:
        content = (folder / FILE_NAME).read_bytes()
        ordinal, size, crc = _HEAD.unpack_from(content, len(_TEXT))
    except (OSError, struct.error):
        return -1, b""
    data = content[_START:_START + size]
    return (ordinal, data) if len(data) == size and zlib.crc32(data) == crc else (-1, b"")
