"""The messages of a file in blocks: some dozens of chunks decompressed in one go, or a run of unchunked messages."""

import zlib
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import zstandard

from flight_graph.bags.byte_kernels import MESSAGE, read_field
from flight_graph.bags.mcap_records import ChunkRecord, Damage, Opcode, refuse_impossible_size

_GROUP = 1 << 21  # [bytes] chunks are decompressed together up to this size: what the cache holds
_AHEAD = 3  # blocks that are decompressed before they are asked for
_CHUNK_FIXED = 40  # [bytes] of a chunk record besides the name of its compression and its data


@dataclass
class Chunks:
    """The chunks of a file, all (n,): bounds of the record, size and CRC of its content, bounds of its packed data."""

    data: np.ndarray
    start: np.ndarray
    stop: np.ndarray
    size: np.ndarray
    crc: np.ndarray
    packed: np.ndarray
    packed_stop: np.ndarray
    compression: str | None  # None: not the same in all

    @classmethod
    def listed(cls, data, starts, stops):
        """Read the heads of all chunk records. Raises Damage."""
        if (stops - starts < _CHUNK_FIXED).any():
            raise Damage("a chunk is too short")
        size, crc, name = (np.empty(len(starts), np.int64) for _ in range(3))
        for offset, width, out in ((16, 8, size), (24, 4, crc), (28, 4, name)):
            read_field(data, starts, offset, width, out)
        packed = starts + _CHUNK_FIXED + name
        if (name < 0).any() or (name > 16).any() or (packed > stops).any() or (size < 0).any():
            raise Damage("the head of a chunk cannot be read")
        length = np.empty(len(starts), np.int64)
        read_field(data, packed - 8, 0, 8, length)
        if (length < 0).any() or (packed + length > stops).any():
            raise Damage("a chunk has the wrong length")
        names = {data[packed[i] - 8 - name[i]:packed[i] - 8].tobytes() for i in
                 (range(len(starts)) if len(set(name.tolist())) > 1 else [*range(min(1, len(starts)))])}
        common = names.pop().decode("latin-1") if len(names) == 1 else None
        return cls(data, starts, stops, size, crc, packed, packed + length, common)

    def content(self, first: int, last: int, verify: bool) -> np.ndarray:
        """Return the joined contents of chunks first to last - 1 as uint8."""
        total = int(self.size[first:last].sum())
        if self.compression == "zstd":
            out = self._unpack_zstd(first, last, total)
        else:
            chunks = [ChunkRecord(self.data, int(self.start[i]), int(self.stop[i])) for i in range(first, last)]
            out = np.frombuffer(b"".join(chunk.content(verify=False) for chunk in chunks), np.uint8)
        if verify:
            end = 0
            for i in range(first, last):
                begin, end = end, end + int(self.size[i])
                if self.crc[i] and zlib.crc32(out[begin:end]) != self.crc[i]:
                    raise Damage(f"the chunk at byte {self.start[i] - 9} fails its checksum")
        return out

    def _unpack_zstd(self, first, last, total):
        data = memoryview(self.data)
        frames = [data[begin:end] for begin, end in
                  zip(self.packed[first:last].tolist(), self.packed_stop[first:last].tolist())]
        try:
            for frame, size in zip(frames, self.size[first:last].tolist()):
                known = zstandard.frame_content_size(frame)
                if known not in (size, -1):
                    raise Damage(f"a chunk holds {known} bytes where it declares {size}")
            joined = b"".join(frames)
            refuse_impossible_size(total, len(joined), "a chunk")
            out = np.empty(total, np.uint8)
            reader = zstandard.ZstdDecompressor().stream_reader(
                joined, read_size=max(1, len(joined)), read_across_frames=True)
            view, filled = memoryview(out), 0
            while filled < total:
                count = reader.readinto(view[filled:])
                if not count:
                    raise Damage("a chunk holds less than it declares")
                filled += count
            if reader.read(1):
                raise Damage("a chunk holds more than it declares")
        except (zstandard.ZstdError, MemoryError):
            raise Damage("a chunk cannot be decompressed") from None
        return out


@dataclass(eq=False)
class Block:
    """Some messages' bytes.

    load(verify): decompress them, and verify the chunks' own checksums where asked to; returns uint8, not to be written
    to. chunk_sizes: of joined chunks; bounds: of a run of messages without chunks, (starts, stops) of their content.
    """

    load: Callable
    chunk_sizes: np.ndarray | None = None
    bounds: tuple | None = None


def list_blocks(data, opcodes, starts, stops, chunks: Chunks) -> list[Block]:
    """The blocks of a file, in its order."""
    blocks = []
    is_chunk, is_message = opcodes == Opcode.CHUNK, opcodes == MESSAGE
    places = np.flatnonzero(is_chunk | is_message)
    edges = np.flatnonzero(np.diff(is_message[places].astype(np.int8))) + 1
    number = 0
    for part in np.split(places, edges) if len(places) else []:
        if is_message[part[0]]:
            origin, end = int(starts[part[0]]), int(stops[part[-1]])
            blocks.append(Block(lambda verify, a=origin, b=end: data[a:b],
                                bounds=(starts[part] - origin, stops[part] - origin)))
            continue
        sizes = chunks.size[number:number + len(part)]
        groups = np.cumsum(np.minimum(sizes, _GROUP)) // _GROUP
        bounds = [0, *(np.flatnonzero(np.diff(groups)) + 1).tolist(), len(part)]
        for begin, end in zip(bounds, bounds[1:]):
            blocks.append(Block(lambda verify, a=number + begin, b=number + end: chunks.content(a, b, verify),
                                chunk_sizes=sizes[begin:end]))
        number += len(part)
    return blocks


def ahead(function: Callable, items: list):
    """Yield function(item), in order; a thread works them out ahead (decompression lets the interpreter go on)."""
    if len(items) <= _AHEAD:
        yield from map(function, items)
        return
    with ThreadPoolExecutor(1) as thread:
        waiting = deque()
        for item in items:
            waiting.append(thread.submit(function, item))
            if len(waiting) > _AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
