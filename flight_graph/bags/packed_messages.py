"""rosbag2's message compression: each message is a zstd frame of its own (no CDR begins like one)."""

import struct

import numpy as np

from flight_graph.bags.blocks import Block
from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD
from flight_graph.bags.file_content import unpack_message
from flight_graph.bags.mcap_records import list_records
from flight_graph.bags.verify import McapContents, joined_tables, message_table

ZSTD = b"\x28\xb5\x2f\xfd"  # its first bytes
_HEAD = struct.Struct("<BQ")


def unpack_messages(contents: McapContents) -> None:
    """Let each block of a file hold what its messages unpack to. Raises Damage."""
    first, kept = contents.messages.first, contents.messages
    contents.blocks = [_unpacked(block, kept.start[begin:end], kept.stop[begin:end])
                       for block, begin, end in zip(contents.blocks, first, first[1:])]
    contents.messages, contents.room = tables_of(contents.blocks)
    contents.kept = {}


def tables_of(blocks):
    """(table of the messages, bytes) of blocks that hold nothing but message records. Raises Damage."""
    tables, room = [], 0
    for block in blocks:
        content = block.load(False)
        _, starts, stops, _ = list_records(content, 0, len(content))
        tables.append(message_table(content, starts, stops))
        room += len(content)
    return joined_tables(tables), room


def unpacked(payload: bytes) -> bytes:
    """A payload as it was published. Raises Damage."""
    return unpack_message(payload) if payload.startswith(ZSTD) else payload


def _unpacked(block, starts, stops):
    def load(verify):
        content, records = block.load(verify).tobytes(), []
        for start, stop in zip(starts.tolist(), stops.tolist()):
            payload = unpacked(content[start:stop])
            records.append(_HEAD.pack(MESSAGE, MESSAGE_HEAD + len(payload)) + content[start - MESSAGE_HEAD:start] + payload)
        return np.frombuffer(b"".join(records), np.uint8)

    return Block(load)
