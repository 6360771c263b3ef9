"""rosbag2's SQLite bags (.db3), read through the standard library into the form of an MCAP file's content.

Tables: topics (id, name, type, serialization_format, offered_qos_profiles, ...), messages (id, topic_id, timestamp, data)
and, since Iron, message_definitions. Rows are read in the order of their ids, which is that of their writing.
"""

import re
import sqlite3
import struct
import tempfile
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
from mcap import records

from flight_graph.bags.blocks import Block
from flight_graph.bags.byte_kernels import MESSAGE, MESSAGE_HEAD
from flight_graph.bags.errors import BagError
from flight_graph.bags.file_content import unpack
from flight_graph.bags.mcap_records import Damage
from flight_graph.bags.packed_messages import tables_of, unpacked
from flight_graph.bags.verify import McapContents

_ROWS = 2000  # a block
_HEAD = struct.Struct("<BQHIQQ")
_SOUND = ("typeof(topic_id) = 'integer' and typeof(timestamp) = 'integer' and timestamp >= 0 and typeof(data) = 'blob' "
          "and topic_id in (select id from topics)")


def read_sqlite(path: Path) -> McapContents:
    """Read and check a .db3 file. Raises BagError."""
    try:
        return _read(path)
    except Damage as damage:
        raise BagError(f"'{path}' is an SQLite file, but not a sound bag of rosbag2: {damage}") from None


def _read(path):
    contents = McapContents(library="rosbag2_storage_sqlite3")
    if path.suffix == ".zstd":
        contents.holder = tempfile.TemporaryDirectory(prefix="flight_db3_")
        packed, path = path, Path(contents.holder.name) / path.stem
        with open(path, "wb") as target:
            unpack(packed, target)
    with _opened(path) as database:
        topics = _rows(database, "topics", ("id", "name", "type", "serialization_format"), (
            "offered_qos_profiles", "type_description_hash"))
        definitions = {row[0]: row for row in _rows(
            database, "message_definitions", ("topic_type", "encoding", "encoded_message_definition"), (), optional=True)}
        for number, (key, name, type_name, encoding, qos, type_hash) in enumerate(topics, 1):
            _, kind, text = definitions.get(type_name, (type_name, "", ""))
            contents.schemas[number] = records.Schema(number, str(text).encode(), str(kind), str(type_name))
            contents.channels[key] = records.Channel(key, str(name), str(encoding), {
                "offered_qos_profiles": str(qos or ""), "topic_type_hash": str(type_hash or "")}, number)
        if any(not 0 <= key < 1 << 16 for key in contents.channels):
            raise Damage("a topic has an impossible number")
        _check_table(database, "messages", ("id", "topic_id", "timestamp", "data"))
        rows = database.execute(f"select id from messages where {_SOUND} order by id")
        ids = np.array([row[0] for row in rows], np.int64)
        count = database.execute("select count(*) from messages").fetchone()[0]
        if count and not len(ids):
            raise Damage("no message has a topic, a time and content")
        if count > len(ids):
            contents.remarks.append(f"{path.name}: {count - len(ids)} messages have no topic, no time or no content, and "
                                    "are left out")
    contents.blocks = [_block(path, ids[begin:begin + _ROWS]) for begin in range(0, len(ids), _ROWS)]
    contents.messages, contents.room = tables_of(contents.blocks)
    return contents


def _block(path, ids):
    first, last = int(ids[0]), int(ids[-1])

    def load(_):
        with _opened(path) as database:
            rows = database.execute("select topic_id, timestamp, data from messages where id between ? and ? "
                                    f"and {_SOUND} order by id", (first, last))
            return np.frombuffer(b"".join(_record(*row) for row in rows), np.uint8)

    return Block(load)


def _record(topic, stamp_ns, data):
    """A row as an MCAP message record; one of a bag with message compression is unpacked."""
    data = unpacked(data)
    return _HEAD.pack(MESSAGE, MESSAGE_HEAD + len(data), topic, 0, stamp_ns, stamp_ns) + data


@contextmanager
def _opened(path):
    """The database, read only; views and functions of a stranger's schema are not trusted."""
    try:
        mode = "ro" if path.with_name(path.name + "-wal").exists() else "ro&immutable=1"
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode={mode}", uri=True)) as database:
            database.execute("pragma trusted_schema = off")
            yield database
    except (sqlite3.Error, OverflowError, struct.error, TypeError, ValueError) as error:
        if isinstance(error, BagError):
            raise
        raise Damage(f"{path.name} cannot be read ({error})") from None


def _check_table(database, table, needed):
    """Refuse what is no plain table with these columns: a view or a virtual table works out what was asked for, without
    end if it wants."""
    found = database.execute("select sql from sqlite_master where name = ? and type = 'table'", (table,)).fetchone()
    if found is None or not re.match(r"\s*create\s+table\b", str(found[0]), re.I):
        raise Damage(f"its table '{table}' is missing")
    there = [row[1] for row in database.execute(f"pragma table_info({table})")]
    if not set(needed) <= set(there):
        raise Damage(f"its table '{table}' has other columns")
    return there


def _rows(database, table, needed, wished, optional=False):
    """Rows of a table with the columns that older versions lack as None."""
    try:
        there = _check_table(database, table, needed)
    except Damage:
        if optional:
            return []
        raise
    names = ", ".join(name if name in there else f"null as {name}" for name in (*needed, *wished))
    return database.execute(f"select {names} from {table}").fetchall()
