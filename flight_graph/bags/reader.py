"""Reading a bag in a few lines, ours or any other MCAP bag of ROS 2 messages.

    bag = read_bag("runs/hop")
    imu = bag["/cubli/imu"]                       # NumPy structured array, one row a message
    imu["angular_velocity"][:, 2]                 # rad/s
    bag.stamps_ns("/cubli/imu")                   # log times
    bag.constants("/cubli/imu")                   # {'header.frame_id': 'imu_link'}

A bag is verified as a whole before anything of it is handed out: checksums of chunks, data section, summary and
attachments, lengths of all records, index, counts, and metadata.yaml. `BagDamaged` says what does not hold.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from flight_graph.bags.decode import Decoder
from flight_graph.bags.description import FILE_NAME, from_yaml, read_description
from flight_graph.bags.errors import BagDamaged, BagError
from flight_graph.bags.journal import FILE_NAME as MARK
from flight_graph.bags.journal import is_live
from flight_graph.bags.layout import Layout, Misfit, Ragged, fixed_layout
from flight_graph.bags.mcap_file import LIBRARY
from flight_graph.bags.mcap_records import Damage
from flight_graph.bags.message_types import field_trees
from flight_graph.bags.payloads import Payloads
from flight_graph.bags.verify import read_mcap
from flight_graph.errors import unknown


@dataclass(frozen=True)
class TopicInfo:
    """One topic of a bag. qos_text: rosbag2's YAML text of the offered profiles."""

    name: str
    type_name: str
    count: int
    qos_text: str
    type_hash: str
    definition: str
    definition_encoding: str

    @property
    def qos(self) -> list:
        """The offered profiles, as dictionaries of rosbag2's keys."""
        return from_yaml(self.qos_text) or [] if self.qos_text else []


def read_bag(path) -> "Bag":
    """Read a bag: a folder with metadata.yaml, or an .mcap file. Raises BagError or BagDamaged."""
    path = Path(path)
    try:
        files, description = _files(path)
        contents = [read_mcap(file) for file in files]
        _check_description(description, contents)
        return Bag(path, contents)
    except FileNotFoundError as error:
        raise BagError(f"there is no bag at '{path}' ({Path(error.filename or path).name} is missing)") from None
    except OSError as error:
        raise BagError(f"bag '{path}' cannot be read: {(error.strerror or str(error)).lower()}") from error
    except Damage as damage:
        raise BagDamaged(path, str(damage)) from None


class Bag:
    """The content of a verified bag. Arrays are made when asked for, and kept."""

    def __init__(self, path: Path, contents: list):
        self.path = path
        self._contents = contents
        self._arrays, self._layouts = {}, {}
        self.checked = all(part.covered for part in contents)  # a checksum stands over every message
        self.attachments = {record.name: record for part in contents for record in part.attachments}
        self.metadata = {record.name: dict(record.metadata) for part in contents for record in part.metadata}
        self.topics = self._list_topics()

    def _list_topics(self):
        found = {}
        for part in self._contents:
            ids, counts = np.unique(part.messages.channel, return_counts=True)
            counted = dict(zip(ids.tolist(), counts.tolist()))
            for channel in part.channels.values():
                if channel.message_encoding != "cdr" or channel.schema_id not in part.schemas:
                    raise BagError(f"bag '{self.path}': topic '{channel.topic}' is encoded as "
                                   f"'{channel.message_encoding}'; cdr messages with a schema are read")
                schema = part.schemas[channel.schema_id]
                before = found.get(channel.topic)
                if before is not None and before.type_name != schema.name:
                    raise BagError(f"bag '{self.path}': topic '{channel.topic}' carries {before.type_name} and "
                                   f"{schema.name}; one type a topic is read")
                found[channel.topic] = TopicInfo(
                    channel.topic, schema.name, counted.get(channel.id, 0) + (before.count if before else 0),
                    channel.metadata.get("offered_qos_profiles", ""), channel.metadata.get("topic_type_hash", ""),
                    schema.data.decode(errors="replace"), schema.encoding)
        return found

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

    def field_trees(self, topic: str) -> dict:
        """The definition of a topic's type and of all that it contains (see `flight_graph.bags.message_types`)."""
        info = self.topic(topic)
        trees = field_trees(info.type_name, info.definition, info.definition_encoding)
        if info.type_name not in trees:
            raise BagError(f"bag '{self.path}': no definition of {info.type_name}")
        return trees

    def messages(self, topics=None):
        """Yield (topic, log time [ns], payload) in write order, of all topics or some."""
        wanted = {self.topic(name).name for name in topics} if topics is not None else set(self.topics)
        for part in self._contents:
            names = {channel.id: channel.topic for channel in part.channels.values() if channel.topic in wanted}
            for block, begin, end in part.runs(np.arange(len(part.messages.start))):
                content = block.tobytes()
                rows = zip(part.messages.channel[begin:end].tolist(), part.messages.log_time[begin:end].tolist(),
                           part.messages.start[begin:end].tolist(), part.messages.stop[begin:end].tolist())
                for channel, time, start, stop in rows:
                    if channel in names:
                        yield names[channel], time, content[start:stop]

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
        """The messages of a topic through the general decoder, strings and sequences included, whatever the layout."""
        try:
            decoder = Decoder(self.field_trees(topic), self.topic(topic).type_name)
            return decoder.decode(payload for _, _, payload in self.messages([topic]))
        except Misfit as error:
            raise self._misfit(topic, error) from None

    def _misfit(self, topic, error):
        return BagError(f"bag '{self.path}', topic '{topic}': a message is unreadable ({error})")

    def _fixed(self, topic):
        """(layout, array) where all messages of a topic share one, else None."""
        parts = self._uniform(topic)
        if parts is None:
            return None
        first = parts[0].first
        try:
            layout = fixed_layout(self.field_trees(topic), self.topic(topic).type_name, first.tobytes())
        except Ragged:
            return None
        if any((part.first[layout.columns] != first[layout.columns]).any() or not part.are_constant(layout.columns)
               for part in parts):
            return None
        return layout, _joined([part.records(layout.dtype) for part in parts])

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


def _files(path: Path):
    """Return (MCAP files of a bag, content of its metadata.yaml or None)."""
    if not path.is_dir():
        return [path], None
    if (path / MARK).exists():
        if is_live(path):
            raise BagError(f"bag '{path}' is still being recorded")
        raise Damage("its recorder was stopped before it could finish")
    if not (path / FILE_NAME).exists():
        if any(path.glob("*.mcap")):
            raise Damage(f"{FILE_NAME} is missing")
        raise BagError(f"'{path}' is no bag: it holds neither {FILE_NAME} nor an .mcap file")
    try:
        description = read_description(path)
    except ValueError as error:
        raise Damage(str(error)) from None
    storage, mode = description.get("storage_identifier"), str(description.get("compression_mode") or "none").lower()
    if storage == "sqlite3" or mode == "message":
        raise BagError(f"bag '{path}' is stored as {storage} with compression mode '{mode}'; mcap without message "
                       "compression is read")
    if storage != "mcap" or mode not in ("none", "file", "storage"):
        raise Damage(f"{FILE_NAME} names the unknown storage {storage!r} or compression mode {mode!r}")
    files = [path / Path(str(name)).name for name in description["relative_file_paths"]]
    missing = [file.name for file in files if not file.exists()]
    if missing or not files:
        raise Damage(f"its file {missing[0] if missing else ''} is missing")
    return files, description


def _check_description(description, contents):
    """metadata.yaml has no checksum: compare it with the files."""
    if description is None:
        return
    for record in contents[0].metadata:
        if record.name == "rosbag2" and contents[0].library == LIBRARY:
            if from_yaml(record.metadata["serialized_metadata"]) != description:
                raise Damage(f"{FILE_NAME} differs from the copy inside {description['relative_file_paths'][0]}")
    count = sum(len(part.messages.channel) for part in contents)
    if description.get("message_count") != count:
        raise Damage(f"{FILE_NAME} counts {description.get('message_count')} messages, the bag holds {count}")
