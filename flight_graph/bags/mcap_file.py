"""The MCAP file as it is written: an append-only stream of records with running checksum, index and summary.

The format is the library mcap's (its record classes write themselves); the order of records, the chunks and what is
flushed when are decided here. Compression is zstd level -1: 0.3 us for an Imu message, a fourth of its size.
"""

import os
import struct
import zlib

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from flight_graph.bags.disk import new_file

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "flight_graph"
ZSTD_LEVEL = -1
_FOOTER = struct.Struct("<BQQQ")


def record_bytes(record) -> bytes:
    """One record of the library mcap as bytes."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


class McapFile:
    """An MCAP file open for appending. Not thread-safe."""

    def __init__(self, path):
        self._file = new_file(path)
        self.position = 0
        self._crc = 0
        self._compressor = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
        self.schemas, self.channels = [], []
        self.chunk_indexes, self.attachment_indexes, self.metadata_indexes = [], [], []
        self.counts = {}
        self.start_ns, self.end_ns = 2**64 - 1, 0
        self._append(MAGIC + record_bytes(records.Header("ros2", LIBRARY)))

    def _append(self, data: bytes) -> int:
        """Append and return where the data starts."""
        start = self.position
        self._crc = zlib.crc32(data, self._crc)
        view = memoryview(data)
        while view:
            written = os.write(self._file, view)
            view, self.position = view[written:], self.position + written
        return start

    def sync(self) -> None:
        os.fsync(self._file)

    def close(self) -> None:
        os.close(self._file)

    def add(self, record) -> bytes:
        """Append a schema or channel and return its bytes."""
        data = record_bytes(record)
        self._append(data)
        (self.schemas if isinstance(record, records.Schema) else self.channels).append(record)
        return data

    def add_attachment(self, name: str, media_type: str, content: bytes) -> None:
        data = record_bytes(records.Attachment(0, 0, name, media_type, content))
        start = self._append(data)
        self.attachment_indexes.append(
            records.AttachmentIndex(start, len(data), 0, 0, len(content), name, media_type))

    def add_metadata(self, name: str, content: dict) -> None:
        data = record_bytes(records.Metadata(name, content))
        self.metadata_indexes.append(records.MetadataIndex(self._append(data), len(data), name))

    def add_chunk(self, content: bytes, marks: dict) -> None:
        """Append a chunk and its message indexes. marks: channel id -> list of log time, offset, log time, ..."""
        indexes = {channel: np.array(values, "<u8") for channel, values in marks.items()}
        times = np.concatenate([values[::2] for values in indexes.values()])
        start_ns, end_ns = int(times.min()), int(times.max())
        packed = self._compressor.compress(content)
        data = record_bytes(records.Chunk(
            compression="zstd", data=packed, message_start_time=start_ns, message_end_time=end_ns,
            uncompressed_crc=zlib.crc32(content), uncompressed_size=len(content)))
        start = self.position
        parts, offsets, position = [data], {}, start + len(data)
        for channel, values in indexes.items():
            offsets[channel] = position
            parts.append(struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + values.nbytes, channel, values.nbytes))
            parts.append(values.tobytes())
            position += 15 + values.nbytes
            self.counts[channel] = self.counts.get(channel, 0) + len(values) // 2
        self._append(b"".join(parts))
        self.start_ns, self.end_ns = min(self.start_ns, start_ns), max(self.end_ns, end_ns)
        self.chunk_indexes.append(records.ChunkIndex(
            chunk_length=len(data), chunk_start_offset=start, compression="zstd", compressed_size=len(packed),
            message_end_time=end_ns, message_index_length=position - start - len(data),
            message_index_offsets=offsets, message_start_time=start_ns, uncompressed_size=len(content)))

    def statistics(self):
        count = sum(self.counts.values())
        return records.Statistics(
            attachment_count=len(self.attachment_indexes), channel_count=len(self.channels),
            channel_message_counts={channel.id: self.counts.get(channel.id, 0) for channel in self.channels},
            chunk_count=len(self.chunk_indexes), message_count=count, message_end_time=self.end_ns,
            message_start_time=self.start_ns if count else 0, metadata_count=len(self.metadata_indexes),
            schema_count=len(self.schemas))

    def finish(self) -> None:
        """Append the end of the data section with its checksum, the summary with its own, and the footer."""
        self._append(record_bytes(records.DataEnd(self._crc)))
        summary_start = self.position
        summary, offsets = RecordBuilder(), RecordBuilder()
        for opcode, group in (
            (Opcode.SCHEMA, self.schemas), (Opcode.CHANNEL, self.channels), (Opcode.STATISTICS, [self.statistics()]),
            (Opcode.CHUNK_INDEX, self.chunk_indexes), (Opcode.ATTACHMENT_INDEX, self.attachment_indexes),
            (Opcode.METADATA_INDEX, self.metadata_indexes),
        ):
            start = summary.count
            for record in group:
                record.write(summary)
            if group:
                records.SummaryOffset(opcode, summary_start + start, summary.count - start).write(offsets)
        offset_start = summary_start + summary.count
        data = summary.end() + offsets.end()
        crc = zlib.crc32(_FOOTER.pack(Opcode.FOOTER, 20, summary_start, offset_start), zlib.crc32(data))
        self._append(data + record_bytes(records.Footer(summary_start, offset_start, crc)) + MAGIC)
