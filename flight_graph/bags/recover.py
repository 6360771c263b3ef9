"""Making a valid bag of a truncated, corrupted or unfinished one.

What is saved: every message of a chunk whose checksum holds, the messages of the open chunk (file RECORDING), and the
attachments whose checksum holds; where a foreign bag carries no checksum, every record that fits together with its
neighbours. Each channel stays as it was: encoding, definition, metadata. Metadata records carry no checksum in MCAP and are
kept as they are found.
"""

from dataclasses import dataclass, field
from pathlib import Path

import yaml

from flight_graph.bags.description import FILE_NAME, from_yaml, read_description
from flight_graph.bags.errors import BagError, quoted
from flight_graph.bags.file_content import map_file
from flight_graph.bags.file_kinds import is_sqlite, refuse_other_kind
from flight_graph.bags.files import in_folder
from flight_graph.bags.journal import is_live, read_journal
from flight_graph.bags.mcap_file import LIBRARY, MAGIC
from flight_graph.bags.mcap_records import Damage
from flight_graph.bags.packed_messages import unpacked
from flight_graph.bags.salvage import Salvage, salvage_file
from flight_graph.bags.writer import BagWriter
from msg_schemas.definitions import TYPESTORE, definition


@dataclass(frozen=True)
class TopicRecovery:
    """Messages of a topic: saved, and lost as far as it can be known (None: unknown, or more may have followed)."""

    saved: int
    lost: int | None


@dataclass(frozen=True)
class Gap:
    """A stretch of stamps [ns] that lost messages, from the last message before it to the first behind it.

    None: there is no such message, and the length is unknown.
    """

    start_ns: int | None
    end_ns: int | None

    @property
    def seconds(self) -> float | None:
        return None if None in (self.start_ns, self.end_ns) else (self.end_ns - self.start_ns) / 1e9

    def __str__(self):
        place = "at the beginning" if self.start_ns is None else (
            f"after {self.start_ns // 10**9}.{self.start_ns % 10**9:09d} s")
        return f"lost {place}: " + ("how much cannot be known" if self.seconds is None else f"{self.seconds:.9f} s")


@dataclass
class RecoveryReport:
    """What `recover` did."""

    source: Path
    folder: Path
    topics: dict = field(default_factory=dict)
    gaps: list = field(default_factory=list)
    attachments: list = field(default_factory=list)
    metadata: list = field(default_factory=list)
    remarks: list = field(default_factory=list)

    @property
    def seconds_lost(self) -> float | None:
        """Stamps [s] between the last message before and the first after each gap; None where an end is unknown."""
        if any(gap.seconds is None for gap in self.gaps):
            return None
        return sum(gap.seconds for gap in self.gaps)

    def __str__(self):
        lines = [f"{name}: {topic.saved} messages saved" + (f", {topic.lost} lost" if topic.lost else "")
                 for name, topic in self.topics.items()]
        lines += [str(gap) for gap in self.gaps]
        lines += [f"{len(self.attachments)} attachments and {len(self.metadata)} metadata records kept"] + self.remarks
        return "\n".join(lines)


def recover(path, out) -> RecoveryReport:
    """Write what is intact in the bag ``path`` (folder or .mcap file) as a new bag folder ``out``. Raises BagError."""
    path = Path(path)
    report = RecoveryReport(path, Path(out))
    try:
        parts = _salvage_all(path)
    except OSError as error:
        raise BagError(f"bag '{path}' cannot be read: {(error.strerror or str(error)).lower()}") from error
    if not any(part.channels or part.attachments or part.metadata for part in parts):
        raise BagError(f"nothing can be saved of '{path}': no topic is left whose declaration is intact, and no attachment")
    for part in parts:
        report.remarks += part.remarks
    with BagWriter(out) as writer:
        channels = _add_channels(writer, parts, report)
        before = None, False
        for number, part in enumerate(parts):
            topics = {key[1]: topic for key, topic in channels.items() if key[0] == number}
            before = _write_messages(writer, part, topics, report, before)
            for record in part.attachments:
                writer.attach(record.name, record.media_type, record.data)
                report.attachments.append(record.name)
            for record in part.metadata:
                if record.name != "rosbag2":
                    writer.metadata(record.name, record.metadata)
                    report.metadata.append(record.name)
        if before[1]:
            report.gaps.append(Gap(before[0], None))
        _count(report, parts, channels)
        writer.metadata("recovered", {"source": path.name, "report": str(report)})
    return report


def _salvage_all(path):
    if not path.is_dir():
        return [_salvage(path)]
    if is_live(path):
        raise BagError(f"bag '{path}' is still being recorded; stop the recorder first")
    found = in_folder(path)
    files = [file for file in found if ".mcap" in file.suffixes]
    named, compressed = [], False
    if (path / FILE_NAME).exists():
        try:
            description = read_description(path)
            compressed = str(description.get("compression_mode")).lower() == "message"
            named = [path / Path(str(name)).name for name in description["relative_file_paths"]]
            packed = {file.with_suffix(""): file for file in files if file.suffix == ".zstd"}
            named = [packed.get(file, file) if file not in files else file for file in dict.fromkeys(named)]
        except ValueError:
            pass
    if not files:
        if found:
            _refuse_sqlite(found[0])
        raise BagError(f"'{path}' holds no .mcap file")
    files = named + [file for file in files if file not in named]
    parts = [_salvage(file) if len(files) == 1 else _salvage_one_of_many(file) for file in files]
    for part in parts:
        part.packed = compressed
    ordinal, content = read_journal(path)
    if ordinal >= parts[-1].chunks:
        parts[-1].add_last(content)
    return parts


def _salvage_one_of_many(file):
    """A file of a bag of several: one that holds nothing hides no other."""
    try:
        if file.exists():
            return _salvage(file)
        reason = f"its file {file.name} is missing"
    except BagError as error:
        reason = str(error)
    part = Salvage()
    part.lose(reason)
    return part


def _refuse_sqlite(file):
    """Raise BagError: a damaged SQLite bag is a matter of its own tool."""
    raise BagError(f"'{file}' is an SQLite bag: sqlite3 itself saves what is intact (sqlite3 {quoted(file)} .recover)")


def _salvage(file):
    if is_sqlite(file):
        _refuse_sqlite(file)
    try:
        data = map_file(file)
    except Damage as damage:
        raise BagError(f"nothing can be saved: {damage}") from None
    if data[:len(MAGIC)].tobytes() != MAGIC:
        refuse_other_kind(file, data[:128].tobytes())
    return salvage_file(data, file.name)


def _add_channels(writer, parts, report):
    """Declare the channels as they were; return (number of the part, channel id) -> topic of the new bag.

    Equal channels of several files become one. A declaration without checksum is believed, and said to be so.
    """
    made, known = {}, {}
    for number, part in enumerate(parts):
        for key, channel in sorted(part.channels.items()):
            schema = part.schemas.get(channel.schema_id)
            if schema is None and channel.schema_id:
                report.remarks.append(f"topic '{channel.topic}': its definition is lost; its messages are kept as bytes")
            if schema is not None and part.corrupted and not _trusted(part, channel, schema) and not _is_standard(schema):
                report.remarks.append(f"topic '{channel.topic}': no checksum covers its declaration")
            given = (channel.topic, channel.message_encoding, tuple(_metadata(channel, report).items()),
                     (schema.name, schema.encoding, schema.data) if schema is not None else None)
            if given not in known:
                name, encoding, metadata, declared = given
                known[given] = writer.add_channel(name, encoding, dict(metadata), declared)
            made[number, key] = known[given]
    return made


def _is_standard(schema):
    return schema.name in TYPESTORE.fielddefs and definition(schema.name).text == schema.data.decode(errors="replace")


def _metadata(channel, report):
    """The metadata of a channel; a damaged text of its quality of service is left out."""
    metadata = dict(channel.metadata)
    try:
        if isinstance(from_yaml(metadata.get("offered_qos_profiles", "")) or [], list):
            return metadata
    except (yaml.YAMLError, ValueError, RecursionError):
        pass
    report.remarks.append(f"topic '{channel.topic}': its quality of service is lost")
    return {**metadata, "offered_qos_profiles": ""}


def _trusted(part: Salvage, channel, schema):
    return part.declared[type(channel), channel.id][0] and part.declared[type(schema), schema.id][0]


def _write_messages(writer, part, channels, report, before):
    """Write the messages of a file, and note its gaps. channels: id -> topic of the new bag.

    before: (last stamp [ns] or None, whether messages are missing behind it) of the files before; returns that of this one.
    """
    statistics, undeclared = part.statistics, set()
    last_ns, in_gap = before
    if last_ns is None and statistics is not None:
        last_ns = statistics.message_start_time
    for block in part.blocks:
        if block is None:
            in_gap = True
            continue
        if in_gap:
            first_ns = int(block.log_time.min())
            report.gaps.append(Gap(last_ns if last_ns is None else min(last_ns, first_ns), first_ns))
            in_gap = False
        rows = zip(*(getattr(block, name).tolist() for name in
                     ("channel", "sequence", "log_time", "publish_time", "start", "stop")))
        for channel, sequence, log_time, publish_time, start, stop in rows:
            if channel in channels:
                payload = block.content[start:stop]
                try:
                    payload = unpacked(payload) if part.packed else payload
                except Damage as damage:
                    report.remarks.append(f"topic '{channels[channel].name}', {log_time} ns: {damage}; it is left out")
                    continue
                writer.write_sequenced(channels[channel], sequence, log_time, publish_time, payload)
            else:
                undeclared.add(channel)
        last_ns = max(last_ns or 0, int(block.log_time.max()))
    if in_gap and statistics is not None:
        report.gaps.append(Gap(last_ns, max(last_ns, statistics.message_end_time)))
        in_gap = False
    for channel in sorted(undeclared):
        report.remarks.append(f"messages of channel {channel} are left out: its declaration is lost")
    return last_ns, in_gap


def _count(report, parts, channels):
    for name in dict.fromkeys(topic.name for topic in channels.values()):
        expected, known = 0, True
        saved = sum(topic.count for topic in set(channels.values()) if topic.name == name)
        for part in parts:
            numbers = [number for number, channel in part.channels.items() if channel.topic == name]
            if part.statistics is not None:
                expected += sum(part.statistics.channel_message_counts.get(number, 0) for number in numbers)
            elif part.library == LIBRARY:
                expected += 1 + max((int(block.sequence[block.channel == number].max()) for number in numbers
                                     for block in part.blocks
                                     if block is not None and (block.channel == number).any()), default=-1)
            else:
                known = False
        report.topics[name] = TopicRecovery(saved, max(0, expected - saved) if known else None)
