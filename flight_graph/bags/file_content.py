"""The bytes of a file of a bag, unpacked where the whole file is compressed (rosbag2's file compression)."""

import tempfile
from pathlib import Path

import numpy as np
import zstandard

from flight_graph.bags.mcap_records import Damage, largest_size

_STEP = 1 << 22  # [bytes]
_ALLOWED = 1 << 25  # [bytes] that a file may unpack to whatever the ratio


def map_file(path: Path) -> np.ndarray:
    """Return the file's bytes as a uint8 array that is read on demand. Raises Damage."""
    if path.suffix == ".zstd":
        with tempfile.TemporaryFile(prefix="flight_bag_") as target:
            size = unpack(path, target)
            return _mapped(target, size)
    return _mapped(path, path.stat().st_size)


def _mapped(file, size):
    return np.memmap(file, np.uint8, mode="r").view(np.ndarray) if size else np.empty(0, np.uint8)


def unpack(path: Path, target) -> int:
    """Write the content of a compressed file to an open one; return its size. Raises Damage."""
    size = 0
    try:
        with open(path, "rb") as file, zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True) as reader:
            while part := reader.read(_STEP):
                size += target.write(part)
                if size > max(largest_size(file.tell()), _ALLOWED):
                    raise Damage(f"{path.name} unpacks to an impossible size")
    except zstandard.ZstdError:
        raise Damage(f"{path.name} cannot be decompressed") from None
    target.flush()
    return size


def unpack_message(data: bytes) -> bytes:
    """The content of one message of rosbag2's message compression. Raises Damage."""
    try:
        limit = largest_size(len(data))
        content = zstandard.ZstdDecompressor().stream_reader(data).read(limit)
    except zstandard.ZstdError:
        raise Damage("a message cannot be decompressed") from None
    if len(content) == limit:
        raise Damage("a message unpacks to an impossible size")
    return content
