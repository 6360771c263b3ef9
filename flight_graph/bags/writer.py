"""Writing a bag: a folder as rosbag2 writes it, that survives the death of its writer.

    with BagWriter("runs/hop") as writer:
        imu = writer.add_topic("/cubli/imu", "sensor_msgs/msg/Imu", Role.SENSOR.qos)
        writer.write(imu, stamp_ns, payload)

Identical inputs give an identical MCAP file: log time and publish time are the message's stamp, chunks end after the
message that fills 64 KiB, and nothing of the wall clock enters. While recording the folder holds the file RECORDING
(see `flight_graph.bags.journal`), which `close` removes last.
"""

import shutil
import struct
import threading
from pathlib import Path

from mcap import records

from flight_graph.bags.batch import Batch
from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD
from flight_graph.bags.description import FILE_NAME, TopicDescription, describe, qos_text, to_yaml, write_description
from flight_graph.bags.disk import sync_folder
from flight_graph.bags.errors import BagError
from flight_graph.bags.journal import FILE_NAME as MARK
from flight_graph.bags.journal import FLUSH_PERIOD_S, Journal
from flight_graph.bags.mcap_file import McapFile
from flight_graph.bags.message_types import standard_definition
from msg_schemas.definitions import Definition
from msg_schemas.qos import Qos

CHUNK_SIZE = 65536  # [bytes] a chunk ends with the message that reaches it
_HEAD = struct.Struct("<BQHIQQ")


class Topic:
    """A topic of an open bag; made by `BagWriter.add_topic`."""

    __slots__ = ("id", "name", "type_name", "type_hash", "qos_text", "encoding", "count", "marks")

    def __init__(self, number, name, type_name, type_hash, text, encoding="cdr"):
        self.id, self.name, self.type_name, self.type_hash, self.qos_text = number, name, type_name, type_hash, text
        self.encoding = encoding
        self.count = 0
        self.marks = []  # of the open chunk: log time, offset, log time, offset, ...


class BagWriter:
    """Records messages into ``folder`` (<folder>/<name>_0.mcap and metadata.yaml). Thread-safe.

    flush_period_s: wall time [s] of messages that a kill -9 may cost at most; a thread copies what is open twice in it.
    overwrite: replace a bag that is already there (never a folder that holds anything else).
    """

    def __init__(self, folder, *, flush_period_s: float = FLUSH_PERIOD_S, overwrite: bool = False):
        self.folder = Path(folder)
        self.path = self.folder / f"{self.folder.resolve().name}_0.mcap"
        self._lock, self._flush_lock = threading.Lock(), threading.Lock()
        self._chunk, self._ordinal, self._journaled, self._synced = bytearray(), 0, 0, 0
        self._channels, self._schemas = [], {}
        self._failure, self._closed = None, False
        _make_folder(self.folder, overwrite)
        try:
            self._journal = Journal(self.folder)
            self._mcap = McapFile(self.path)
        except OSError as error:
            raise BagError(_sentence(self.folder, error)) from error
        self._stop = threading.Event()
        self._timer = threading.Thread(
            target=self._run_timer, args=(flush_period_s / 2,), name="bag flush", daemon=True)
        self._timer.start()

    # -- what goes in ----------------------------------------------------------------------------------------------
    def add_topic(self, name: str, type_name: str, qos: Qos | str, message: Definition | None = None,
                  encoding: str = "ros2msg") -> Topic:
        """Declare a topic.

        qos: a profile, or rosbag2's YAML text of it. message, encoding: definition of a type that is not standard.
        """
        message = message or standard_definition(type_name)
        text = qos if isinstance(qos, str) else qos_text(qos)
        with self._lock:
            self._check()
            if any(topic.name == name for topic in self._channels):
                raise BagError(f"bag '{self.folder}' already has the topic '{name}'")
        return self.add_channel(name, "cdr", {"offered_qos_profiles": text, "topic_type_hash": message.type_hash},
                                (type_name, encoding, message.text.encode()))

    def add_channel(self, name: str, encoding: str, metadata: dict, schema: tuple | None) -> Topic:
        """Declare a channel as another bag has it; a topic may have several.

        encoding: of its messages; schema: (name, encoding, data), or None where it has none.
        """
        with self._lock:
            self._check()
            number = 0
            if schema is not None:
                if schema not in self._schemas:
                    self._schemas[schema] = len(self._schemas) + 1
                    type_name, kind, data = schema
                    self._chunk += self._guard(self._mcap.add, records.Schema(self._schemas[schema], data, kind, type_name))
                number = self._schemas[schema]
            topic = Topic(len(self._channels) + 1, name, schema[0] if schema else "",
                          metadata.get("topic_type_hash", ""), metadata.get("offered_qos_profiles", ""), encoding)
            self._chunk += self._guard(self._mcap.add, records.Channel(topic.id, name, encoding, dict(metadata), number))
            self._channels.append(topic)
        return topic

    def write(self, topic: Topic, stamp_ns: int, payload) -> None:
        """Append one message: its CDR bytes with the 4-byte encapsulation header, stamped in simulation time [ns]."""
        if type(payload) is not bytes:
            payload = bytes(memoryview(payload))
        with self._lock:
            self._put(topic, topic.count, stamp_ns, stamp_ns, payload)

    def write_sequenced(self, topic: Topic, sequence: int, log_time_ns: int, publish_time_ns: int, payload) -> None:
        """Append a message of another bag with its own sequence number and times."""
        with self._lock:
            self._put(topic, sequence, log_time_ns, publish_time_ns, bytes(payload))

    def _put(self, topic, sequence, log_time_ns, publish_time_ns, payload):
        if self._failure is not None or self._closed:
            self._check()
        chunk = self._chunk
        try:
            head = _HEAD.pack(
                MESSAGE, MESSAGE_HEAD + len(payload), topic.id, sequence & 0xFFFFFFFF, log_time_ns, publish_time_ns)
        except struct.error:
            raise BagError(f"topic '{topic.name}': stamp {log_time_ns} is not a whole number of ns from 0 on") from None
        topic.marks += (log_time_ns, len(chunk))
        topic.count += 1
        chunk += head + payload
        if len(chunk) >= CHUNK_SIZE:
            self._end_chunk()

    def write_many(self, blocks) -> None:
        """Append arrays of messages, merged by stamp; equal stamps in the order of the blocks.

        blocks: of (topic, stamps_ns (n,) integer and not falling, payloads (n, size) uint8). The file is the same as
        after `write` for each message in that order.
        """
        with self._lock:
            self._check()
            batch = Batch(blocks)
            while not batch.done:
                self._chunk += batch.take(len(self._chunk), CHUNK_SIZE)
                if len(self._chunk) >= CHUNK_SIZE:
                    self._end_chunk()

    def attach(self, name: str, media_type: str, content: bytes) -> None:
        """Append an attachment."""
        with self._lock:
            self._check()
            self._guard(self._mcap.add_attachment, name, media_type, bytes(content))

    def metadata(self, name: str, content: dict) -> None:
        """Append a metadata record: str -> str."""
        with self._lock:
            self._check()
            self._guard(self._mcap.add_metadata, name, {str(key): str(value) for key, value in content.items()})

    # -- to the disk -----------------------------------------------------------------------------------------------
    def flush(self) -> None:
        """Bring every message written so far to the disk. The timer does this twice in ``flush_period_s``."""
        with self._flush_lock:
            with self._lock:
                if self._closed:
                    return
                ordinal = self._ordinal
                known = self._journaled if self._journal.ordinal == ordinal else 0
                new = bytes(self._chunk[known:])
                self._journaled = known + len(new)
                grown = self._mcap.position != self._synced
                self._synced = self._mcap.position
            try:
                if grown:
                    self._mcap.sync()
                if new:
                    self._journal.append(ordinal, new)
            except OSError as error:
                self._failure = BagError(_sentence(self.folder, error))
                raise self._failure from error

    def close(self) -> None:
        """Finish the bag: summary, metadata.yaml, and RECORDING goes. After a failure the mark stays, and it raises."""
        if self._closed:
            return
        self._halt()
        try:
            with self._lock:
                self._check()
                if any(topic.marks for topic in self._channels):
                    self._end_chunk()
                content = describe(
                    self.path.name,
                    _described(self._channels),
                    self._mcap.start_ns, self._mcap.end_ns)
                self._guard(self._mcap.add_metadata, "rosbag2", {"serialized_metadata": to_yaml(content)})
                self._guard(self._mcap.finish)
                self._guard(self._mcap.sync)
                self._guard(write_description, self.folder, content)
                self._guard(self._journal.remove)
                self._guard(sync_folder, self.folder)
        finally:
            self._release()

    def abandon(self) -> None:
        """Stop, leaving the bag marked as unfinished; `flight recover` saves every message written so far."""
        if self._closed:
            return
        self._halt()
        try:
            self.flush()
        except BagError:
            return
        finally:
            self._release()

    def __enter__(self):
        return self

    def __exit__(self, kind, value, traceback):
        if kind is None:
            self.close()
        else:
            self.abandon()

    def _run_timer(self, period):
        while not self._stop.wait(period):
            try:
                self.flush()
            except BagError:
                return

    def _halt(self):
        self._stop.set()
        self._timer.join()

    def _release(self):
        self._closed = True
        self._mcap.close()
        self._journal.close()

    def _end_chunk(self):
        marks = {topic.id: topic.marks for topic in self._channels if topic.marks}
        content = bytes(self._chunk)
        self._guard(self._mcap.add_chunk, content, marks)
        for topic in self._channels:
            topic.marks = []
        self._chunk = bytearray()
        self._ordinal += 1

    def _check(self):
        if self._failure is not None:
            raise BagError(str(self._failure))
        if self._closed:
            raise BagError(f"bag '{self.folder}' is closed")

    def _guard(self, action, *arguments):
        """Do something to the disk; a failure ends the recording for good."""
        try:
            return action(*arguments)
        except OSError as error:
            self._failure = BagError(_sentence(self.folder, error))
            raise self._failure from error


def _described(channels):
    """The channels as metadata.yaml lists them: one entry a topic."""
    found = {}
    for channel in channels:
        first, count = found.get(channel.name, (channel, 0))
        found[channel.name] = first, count + channel.count
    return [TopicDescription(first.name, first.type_name, first.qos_text, first.type_hash, count, first.encoding)
            for first, count in found.values()]


def _make_folder(folder: Path, overwrite: bool):
    try:
        if overwrite and folder.is_dir():
            foreign = [entry.name for entry in folder.iterdir()
                       if entry.suffix != ".mcap" and entry.name not in (MARK, FILE_NAME, FILE_NAME + ".partial")]
            if foreign:
                raise BagError(f"'{folder}' is not overwritten: it holds more than a bag ({', '.join(foreign[:3])})")
            shutil.rmtree(folder)
        folder.mkdir(parents=True)
    except FileExistsError:
        raise BagError(f"'{folder}' exists already; name a folder that is not there yet") from None
    except OSError as error:
        raise BagError(_sentence(folder, error)) from error


def _sentence(folder, error):
    return f"bag '{folder}' cannot be written: {(error.strerror or str(error)).lower()}"
