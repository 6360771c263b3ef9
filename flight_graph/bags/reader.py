"""Reading a bag in a few lines, ours or any other MCAP bag of ROS 2 messages.

    bag = read_bag("runs/hop")
    imu = bag["/cubli/imu"]                       # NumPy structured array, one row a message
    imu["angular_velocity"][:, 2]                 # rad/s
    bag.stamps_ns("/cubli/imu")                   # log times
    bag.constants("/cubli/imu")                   # {'header.frame_id': 'imu_link'}

A bag is verified as a whole before anything of it is handed out: checksums of chunks, data section, summary and
attachments, lengths of all records, index, counts, and metadata.yaml. `BagDamaged` says what does not hold. A topic that
cannot be decoded (JSON, no definition) hides no other: its messages are there as bytes; asking for its numbers says why.
"""

from functools import cached_property
from pathlib import Path

import numpy as np

from flight_graph.bags.decode import Decoder
from flight_graph.bags.errors import BagDamaged, BagError
from flight_graph.bags.file_kinds import is_sqlite
from flight_graph.bags.files import check_description, find_files
from flight_graph.bags.layout import Layout, Misfit, Ragged, fixed_layout
from flight_graph.bags.mcap_records import Damage
from flight_graph.bags.message_types import field_trees
from flight_graph.bags.packed_messages import unpack_messages
from flight_graph.bags.payloads import Payloads
from flight_graph.bags.sqlite import read_sqlite
from flight_graph.bags.topics import TopicInfo, list_topics
from flight_graph.bags.verify import read_mcap
from flight_graph.errors import unknown


def read_bag(path) -> "Bag":
    """Read a bag: a folder (with or without metadata.yaml), an .mcap or a .db3 file. Raises BagError or BagDamaged."""
    path = Path(path)
    try:
        source = find_files(path)
        contents = [read_sqlite(file) if is_sqlite(file) else read_mcap(file) for file in source.files]
        if str((source.description or {}).get("compression_mode")).lower() == "message":
            for part in contents:
                unpack_messages(part)
        remarks = [remark for part in contents for remark in part.remarks]
        return Bag(path, contents, source.remarks + remarks + check_description(source, contents))
    except FileNotFoundError as error:
        raise BagError(f"there is no bag at '{path}' ({Path(error.filename or path).name} is missing)") from None
    except OSError as error:
        raise BagError(f"bag '{path}' cannot be read: {(error.strerror or str(error)).lower()}") from error
    except Damage as damage:
        raise BagDamaged(path, str(damage)) from None


class Bag:
    """The content of a verified bag. Arrays are made when asked for, and kept.

    attachments, metadata: by name, the last of equal names; all_attachments, all_metadata: each of them, in order.
    remarks: sentences on what a person should know of the bag.
    """

    def __init__(self, path: Path, contents: list, remarks=()):
        self.path, self.remarks = path, list(remarks)
        self._contents = contents
        self._arrays, self._layouts = {}, {}
        self.checked = all(part.covered for part in contents)  # a checksum stands over every message
        self.all_attachments = [record for part in contents for record in part.attachments]
        self.all_metadata = [record for part in contents for record in part.metadata]
        self.attachments = {record.name: record for record in self.all_attachments}
        self.metadata = {record.name: dict(record.metadata) for record in self.all_metadata}
        self.topics = list_topics(contents)

    @cached_property
    def start_ns(self) -> int:
        """First log time [ns]; 0 in an empty bag."""
        return min((int(part.messages.log_time.min()) for part in self._contents if len(part.messages.log_time)),
                   default=0)

    @cached_property
    def end_ns(self) -> int:
        """Last log time [ns]; 0 in an empty bag."""
        return max((int(part.messages.log_time.max()) for part in self._contents if len(part.messages.log_time)),
                   default=0)

    def topic(self, name: str) -> TopicInfo:
        """What is known of a topic. Raises an error that names the nearest ones."""
        if name not in self.topics:
            raise unknown("topic", name, self.topics, f"bag '{self.path}'")
        return self.topics[name]

    def spelled(self, name: str) -> str:
        """A topic's name in this bag, given with or without its first slash. Raises an error that names the nearest."""
        other = name[1:] if name.startswith("/") else f"/{name}"
        return self.topic(name if name in self.topics or other not in self.topics else other).name

    def field_trees(self, topic: str) -> dict:
        """The definition of a topic's type and of all that it contains (see `flight_graph.bags.message_types`).

        Raises BagError where the topic's messages cannot be decoded.
        """
        info = self.topic(topic)
        if info.problem:
            raise BagError(f"bag '{self.path}': topic '{topic}' {info.problem}")
        return self._trees(topic, info.type_name, info.definition, info.definition_encoding)

    def _trees(self, topic, type_name, definition, encoding):
        try:
            return field_trees(type_name, definition, encoding)
        except BagError as error:
            raise BagError(f"bag '{self.path}', topic '{topic}': {error}") from None

    def messages(self, topics=None):
        """Yield (topic, log time [ns], payload) in write order, of all topics or some."""
        for channel, _, log_time, _, payload in self.records(topics):
            yield channel.topic, log_time, payload

    def records(self, topics=None):
        """Yield (channel, its schema or None, log time [ns], number in the file, payload) in write order."""
        wanted = {self.topic(name).name for name in topics} if topics is not None else set(self.topics)
        for part in self._contents:
            known = {channel.id: (channel, part.schemas.get(channel.schema_id)) for channel in part.channels.values()
                     if channel.topic in wanted}
            for block, begin, end in part.runs(np.arange(len(part.messages.start))):
                content = block.tobytes()
                rows = zip(part.messages.channel[begin:end].tolist(), part.messages.log_time[begin:end].tolist(),
                           range(begin, end),
                           part.messages.start[begin:end].tolist(), part.messages.stop[begin:end].tolist())
                for number, time, index, start, stop in rows:
                    if number in known:
                        yield *known[number], time, index, content[start:stop]

    def write_order(self) -> tuple[list[str], np.ndarray, np.ndarray]:
        """Return (names, number of its topic in them (n,), log time [ns] (n,)) of all messages, in write order."""
        names, owners = list(self.topics), []
        for part in self._contents:
            table = np.zeros(max(part.channels, default=0) + 1, np.int64)
            for channel in part.channels.values():
                table[channel.id] = names.index(channel.topic)
            owners.append(table[part.messages.channel])
        return names, np.concatenate(owners), np.concatenate([part.messages.log_time for part in self._contents])

    def stamps_ns(self, topic: str) -> np.ndarray:
        """Return (n,) int64 log times [ns] of a topic, in write order."""
        return self._column(topic, "log_time")

    def sequences(self, topic: str) -> np.ndarray:
        """Return (n,) uint32 sequence numbers of a topic, in write order."""
        return np.concatenate([part.sequences(numbers) for part, numbers in self._select(topic)])

    def payloads(self, topic: str):
        """Return the payloads of a topic: (n, size) uint8 where all are of one size, else a list of bytes."""
        parts = self._uniform(topic)
        if parts is None:
            return [payload for _, _, payload in self.messages([topic])]
        return _joined([part.rows() for part in parts])

    def layout(self, topic: str) -> Layout | None:
        """The layout that all messages of a topic share, or None."""
        self[topic]
        return self._layouts[topic]

    def constants(self, topic: str) -> dict:
        """Strings, lists of strings and sequence lengths that are the same in all messages of a topic, by path."""
        layout = self.layout(topic)
        return layout.constants if layout is not None else {}

    def __contains__(self, topic: str) -> bool:
        return topic in self.topics

    def __getitem__(self, topic: str) -> np.ndarray:
        """The messages of a topic as a structured array (n,), in write order.

        With a fixed layout the rows are the bytes of the messages as they were read from the file, without a copy.
        """
        if topic not in self._arrays:
            try:
                fixed = self._fixed(topic)
            except Misfit as error:
                raise self._misfit(topic, error) from None
            self._layouts[topic], self._arrays[topic] = fixed or (None, self.decoded(topic))
        return self._arrays[topic]

    def decoded(self, topic: str) -> np.ndarray:
        """The messages of a topic through the general decoder, strings and sequences included, whatever the layout.

        Each message is read by the definition of its own channel; definitions that differ in more than the order of
        their fields are refused.
        """
        self.field_trees(topic)
        try:
            return self._decoded(topic)
        except Misfit as error:
            raise self._misfit(topic, error) from None

    def _decoded(self, topic):
        info = self.topic(topic)
        decoders, rows, owners = {}, {}, []
        for _, schema, _, _, payload in self.records([topic]):
            key = (schema.data.decode(errors="replace"), schema.encoding) if schema else (info.definition, "")
            if key not in decoders:
                decoders[key] = Decoder(self._trees(topic, info.type_name, *key), info.type_name)
                rows[key] = []
            rows[key].append(payload)
            owners.append(key)
        if not rows:
            return Decoder(self.field_trees(topic), info.type_name).decode([])
        tables = {key: decoders[key].decode(payloads) for key, payloads in rows.items()}
        if len(tables) == 1:
            return next(iter(tables.values()))
        return self._merged(topic, tables, owners)

    def _merged(self, topic, tables, owners):
        """Tables by definition, as one table in write order."""
        first, *others = tables
        dtype = tables[first].dtype
        for other in others:
            if sorted(tables[other].dtype.descr, key=str) != sorted(dtype.descr, key=str):
                raise BagError(f"bag '{self.path}': topic '{topic}' was recorded by two definitions that differ: "
                               f"{', '.join(dtype.names)} and {', '.join(tables[other].dtype.names)}")
        merged = np.empty(len(owners), dtype)
        for key, table in tables.items():
            places = np.flatnonzero([owner == key for owner in owners])
            for name in dtype.names:
                merged[name][places] = table[name]
        return merged

    def _misfit(self, topic, error):
        return BagError(f"bag '{self.path}', topic '{topic}': a message is unreadable ({error})")

    def _fixed(self, topic):
        """(layout, array) where all messages of a topic share one, else None."""
        parts = self._uniform(topic)
        trees = self.field_trees(topic)
        if parts is None or not self._has_one_definition(topic):
            return None
        first = parts[0].first
        try:
            layout = fixed_layout(trees, self.topic(topic).type_name, first.tobytes())
        except Ragged:
            return None
        if any((part.first[layout.columns] != first[layout.columns]).any() or not part.are_constant(layout.columns)
               for part in parts):
            return None
        return layout, _joined([part.records(layout.dtype) for part in parts])

    def _has_one_definition(self, topic):
        return len({(schema.data, schema.encoding) for part in self._contents for channel in part.channels.values()
                    if channel.topic == topic and (schema := part.schemas.get(channel.schema_id))}) <= 1

    def _uniform(self, topic) -> list[Payloads] | None:
        """The payloads of a topic, file by file, where all are of one size and there are any, else None."""
        self.topic(topic)
        parts = [part.payloads(topic) for part in self._contents if len(part.numbers(topic))]
        sizes = {part.size for part in parts}
        return parts if len(sizes) == 1 and None not in sizes else None

    def _select(self, topic):
        """Yield (part, numbers of the topic's messages in it)."""
        self.topic(topic)
        for part in self._contents:
            yield part, part.numbers(topic)

    def _column(self, topic, name):
        return np.concatenate([getattr(part.messages, name)[numbers] for part, numbers in self._select(topic)])


def _joined(arrays):
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
