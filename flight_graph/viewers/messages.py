"""Messages on their way to a viewer: what a topic carries, and a moment's messages as a bag in memory."""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap import records

from flight_graph.bags.blocks import Block
from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD
from flight_graph.bags.errors import BagError
from flight_graph.bags.export import UNITS_RECORD
from flight_graph.bags.packed_messages import tables_of
from flight_graph.bags.reader import Bag
from flight_graph.bags.series import NAMED, Series, series_of_bag
from flight_graph.bags.verify import McapContents

_RECORD = struct.Struct("<BQHIQQ")
LATCHED = ("/tf_static", "/robot_description")  # also where a bag says nothing of quality of service


@dataclass(frozen=True)
class Stream:
    """A topic as viewers are told of it. definition, definition_encoding: of its type; latched: its last message is shown
    to those who come later."""

    topic: str
    type_name: str
    definition: str
    definition_encoding: str = "ros2msg"
    encoding: str = "cdr"
    latched: bool = False


@dataclass(frozen=True)
class Message:
    """One message. number: of its stream; stamp_ns: log time."""

    number: int
    stamp_ns: int
    payload: bytes


def streams_of(bag: Bag) -> list[Stream]:
    """The topics of a bag."""
    return [Stream(info.name, info.type_name, info.definition, info.definition_encoding or "ros2msg", info.encoding,
                   info.name in LATCHED or any(_is_latched(profile) for profile in info.qos))
            for info in bag.topics.values()]


def _is_latched(profile) -> bool:
    return str(profile.get("durability")).lower() in ("1", "transient_local")


def in_memory(streams: list[Stream], messages: list[Message], units: dict[str, str]) -> Bag:
    """The messages as a bag. units: as a bag's metadata record has them, ``topic:column`` -> unit."""
    contents = McapContents()
    for number, stream in enumerate(streams):
        contents.schemas[number + 1] = records.Schema(
            id=number + 1, name=stream.type_name, encoding=stream.definition_encoding, data=stream.definition.encode())
        contents.channels[number] = records.Channel(
            id=number, topic=stream.topic, message_encoding=stream.encoding, metadata={}, schema_id=number + 1)
    content = np.frombuffer(b"".join(
        _RECORD.pack(MESSAGE, MESSAGE_HEAD + len(message.payload), message.number, 0, message.stamp_ns, message.stamp_ns)
        + message.payload for message in messages), np.uint8)
    contents.blocks = [Block(lambda _: content)] if messages else []
    contents.messages, contents.room = tables_of(contents.blocks)
    contents.metadata = [records.Metadata(name=UNITS_RECORD, metadata=dict(units))]
    return Bag(Path("the messages"), [contents])


def named_series(bag: Bag) -> list[Series]:
    """The series of all topics of named numbers in a bag, t [s] since its first message."""
    found = []
    for topic, info in bag.topics.items():
        if info.type_name == NAMED and info.count and not info.problem:
            try:
                found += [one for one in series_of_bag(bag, topic, bag.start_ns) if one.lines[0].own]
            except BagError:  # a damaged message hides the names of its topic, no other
                continue
    return found
