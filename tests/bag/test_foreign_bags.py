"""Bags of any recorder: what the MCAP specification lets a file be, and what rosbag2 leaves, read as the library mcap
or rosbags reads it; one topic that cannot be decoded hides no other."""

import itertools
import json
import shutil
import sqlite3
import struct

import numpy as np
import pytest
import zstandard
from mcap import records
from pyarrow import parquet
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from flight_graph.bags.errors import BagDamaged, BagError
from flight_graph.bags.export import export, table
from flight_graph.bags.reader import read_bag
from msg_schemas.definitions import TYPESTORE
from tests.bag import foreign_files as made
from tests.bag.foreign_files import COUNT, INT32, START, STEP, by_mcap, chunk, counting, file, int32, message, record


def bag_of(tmp_path, content, name="x.mcap"):
    path = tmp_path / name
    path.write_bytes(content)
    return read_bag(path)


def everything(bag):
    return [(topic, stamp, bytes(payload)) for topic, stamp, payload in bag.messages()]


# -- what the specification lets a file be -----------------------------------------------------------------------------
@pytest.mark.parametrize(("compression", "crc", "pad"), [
    *itertools.product(("", "lz4", "zstd"), (True, False), (b"", b"\1\2\3"))])
def test_chunks(tmp_path, compression, crc, pad):
    content = counting(10, compression=compression, crc=crc, pad=pad)
    bag = bag_of(tmp_path, content)
    assert everything(bag) == by_mcap(content) and len(by_mcap(content)) == 10
    np.testing.assert_array_equal(bag["/count"]["data"], np.arange(10))
    assert bag.checked == crc


def test_records_that_grew(tmp_path):
    """Every record carries three bytes more than today's readers know."""
    pad = b"\7\7\7"
    data = b"".join([
        record(INT32, pad), record(COUNT, pad), *(message(1, i, int32(i)) for i in range(3)),
        record(records.Metadata("notes", {"a": "1"}), pad),
        record(records.Attachment(0, 0, "log.txt", "text/plain", b"all is well"), pad)])
    content = file(data, record(records.Statistics(1, 1, {1: 3}, 0, 3, START + 2 * STEP, START, 1, 1), pad), pad)
    bag = bag_of(tmp_path, content)
    assert everything(bag) == by_mcap(content)
    assert bag.attachments["log.txt"].data == b"all is well" and bag.metadata == {"notes": {"a": "1"}}


def test_unknown_records_are_passed_over(tmp_path):
    for opcode in (0x10, 0x7F, 0x80, 0xFF):
        inside = record(INT32) + made.raw_record(opcode, b"new") + record(COUNT) + message(1, 0, int32(5))
        bag = bag_of(tmp_path, file(made.raw_record(opcode, b"private") + chunk(inside)))
        assert bag["/count"]["data"].tolist() == [5]


def test_unchunked_without_summary_or_index(tmp_path):
    content = file(record(INT32) + record(COUNT) + b"".join(message(1, i, int32(i)) for i in range(20)))
    bag = bag_of(tmp_path, content)
    assert everything(bag) == by_mcap(content) and not bag.checked


def test_chunks_out_of_order_and_overlapping_in_time(tmp_path):
    head = record(INT32) + record(COUNT)
    parts = [[9, 3, 4], [0, 8], [5]]
    content = file(head + b"".join(chunk(b"".join(message(1, i, int32(i)) for i in part)) for part in parts))
    bag = bag_of(tmp_path, content)
    assert bag["/count"]["data"].tolist() == [9, 3, 4, 0, 8, 5]  # as they were written
    assert (bag.start_ns, bag.end_ns) == (START, START + 9 * STEP)


def test_equal_names_of_attachments_and_metadata(tmp_path):
    data = b"".join(record(records.Attachment(i, i, "note", "text/plain", bytes([i]))) for i in range(3)) + b"".join(
        record(records.Metadata("run", {"n": str(i)})) for i in range(2))
    bag = bag_of(tmp_path, file(data))
    assert [a.data for a in bag.all_attachments] == [b"\0", b"\1", b"\2"]
    assert [dict(m.metadata) for m in bag.all_metadata] == [{"n": "0"}, {"n": "1"}]


def test_channels_without_schema_or_of_another_encoding(tmp_path):
    """They are listed, and there as bytes; only asking for their numbers is refused, by a sentence."""
    note = records.Schema(2, b'{"type": "object"}', "jsonschema", "Note")
    data = b"".join([
        record(INT32), record(note), record(COUNT), record(records.Channel(2, "/notes", "json", {}, 2)),
        record(records.Channel(3, "/raw", "text", {}, 0)), record(records.Channel(4, "/bare", "cdr", {}, 0)),
        message(1, 0, int32(7)), message(2, 1, b'{"a": 1}'), message(3, 2, b"free"), message(4, 3, int32(1))])
    bag = bag_of(tmp_path, file(data))
    assert bag["/count"]["data"].tolist() == [7]
    assert [payload for _, _, payload in bag.messages(["/notes"])] == [b'{"a": 1}']
    assert bag.payloads("/raw").tobytes() == b"free"
    for topic, reason in (("/notes", "is encoded as 'json'"), ("/raw", "is encoded as 'text'"),
                          ("/bare", "has no message definition")):
        with pytest.raises(BagError, match=reason):
            bag[topic]
    done = export(bag, tmp_path / "t")
    assert list(done.files) == ["/count"] and set(done.problems) == {"/notes", "/raw", "/bare"}


def test_each_channel_is_read_by_its_own_definition(tmp_path):
    one, other = (records.Schema(i, text, "ros2msg", "my_msgs/msg/Gain") for i, text in
                  ((1, b"float64 kp\nfloat64 kd\n"), (2, b"float64 kd\nfloat64 kp\n")))
    data = record(one) + record(other) + b"".join(record(records.Channel(i, "/x", "cdr", {}, i)) for i in (1, 2))
    values = {1: (1.0, 2.0), 2: (2.0, 1.0)}
    data += b"".join(message(i, n, b"\0\1\0\0" + struct.pack("<dd", *values[i])) for n, i in enumerate((1, 2, 1, 2)))
    bag = bag_of(tmp_path, file(data))
    assert bag["/x"]["kp"].tolist() == [1.0] * 4 and bag["/x"]["kd"].tolist() == [2.0] * 4
    third = records.Schema(2, b"float64 kp\nfloat32 ki\n", "ros2msg", "my_msgs/msg/Gain")
    bag = bag_of(tmp_path, file(data.replace(record(other), record(third))), "y.mcap")
    with pytest.raises(BagError, match="two definitions that differ: kp, kd and kp, ki"):
        bag["/x"]


def test_two_types_on_one_topic(tmp_path):
    text = records.Schema(2, b"float64 data\n", "ros2msg", "std_msgs/msg/Float64")
    data = record(INT32) + record(text) + record(COUNT) + record(records.Channel(2, "/count", "cdr", {}, 2)) + record(
        records.Channel(3, "/other", "cdr", {}, 1)) + message(1, 0, int32(1)) + message(3, 1, int32(4))
    bag = bag_of(tmp_path, file(data))
    assert bag["/other"]["data"].tolist() == [4]
    with pytest.raises(BagError, match="carries std_msgs/msg/Int32 and std_msgs/msg/Float64"):
        bag["/count"]


def test_compressed_and_bombs(tmp_path):
    (tmp_path / "x.mcap.zstd").write_bytes(zstandard.ZstdCompressor().compress(counting(10)))
    assert len(read_bag(tmp_path / "x.mcap.zstd")["/count"]) == 10
    bomb = zstandard.ZstdCompressor(level=19).compressobj()
    packed = b"".join(bomb.compress(bytes(1 << 24)) for _ in range(24)) + bomb.flush()
    (tmp_path / "bomb.mcap.zstd").write_bytes(packed)
    with pytest.raises(BagDamaged, match="unpacks to an impossible size"):
        read_bag(tmp_path / "bomb.mcap.zstd")
    for compression, pack in (("zstd", zstandard.ZstdCompressor().compress), ("lz4", None)):
        import lz4.frame
        inside = (pack or lz4.frame.compress)(bytes(1 << 20))
        for size in (1 << 20, 1 << 40):
            lying = record(records.Chunk(compression, inside, 0, 0, 0, size))
            with pytest.raises(BagDamaged, match="impossible size|do not fill it|where it declares"):
                bag_of(tmp_path, file(lying), f"{compression}{size}.mcap")


# -- what a file is when it is no bag ----------------------------------------------------------------------------------
@pytest.mark.parametrize(("content", "sentence"), [
    (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "is a Git LFS pointer"),
    (b"#ROSBAG V2.0\n", "is a bag of ROS 1"), (b"hello\n", "is a text file"), (b"PAR1" + bytes(20), "is a Parquet table"),
    (b"rosbag2_bagfile_information:\n", "is the description of a bag"), (b"\x1f\x8b" + bytes(20), "is compressed by gzip")])
def test_other_files(tmp_path, content, sentence):
    from flight_graph.bags.recover import recover
    (tmp_path / "x.mcap").write_bytes(content)
    for action in (read_bag, lambda path: recover(path, tmp_path / "saved")):
        with pytest.raises(BagError, match=sentence) as caught:
            action(tmp_path / "x.mcap")
        assert "flight recover" not in str(caught.value)


# -- folders -----------------------------------------------------------------------------------------------------------
def write(folder, count=40, version=9, plugin=StoragePlugin.MCAP, mode=None):
    kind = "std_msgs/msg/Int32"
    writer = Writer(folder, version=version, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/count", kind, typestore=TYPESTORE)
        for i in range(count):
            writer.write(topic, START + i * STEP, TYPESTORE.serialize_cdr(TYPESTORE.types[kind](i), kind))
    return folder


@pytest.mark.parametrize("mode", [None, CompressionMode.FILE, CompressionMode.MESSAGE])
def test_sqlite_bags(tmp_path, mode):
    folder = write(tmp_path / "bag", 5000, plugin=StoragePlugin.SQLITE3, mode=mode)
    bag = read_bag(folder)
    np.testing.assert_array_equal(bag["/count"]["data"], np.arange(5000))
    np.testing.assert_array_equal(bag.stamps_ns("/count"), START + STEP * np.arange(5000))
    if mode is None:
        assert len(read_bag(next(folder.glob("*.db3")))["/count"]) == 5000


def test_rows_that_are_no_messages_hide_no_other(tmp_path):
    folder = write(tmp_path / "bag", 10, plugin=StoragePlugin.SQLITE3)
    with sqlite3.connect(next(folder.glob("*.db3"))) as database:
        rows = [(1, -5, b""), (1, START, "text"), (9, START, int32(1)), (1, "never", b"")]
        database.executemany("insert into messages(topic_id, timestamp, data) values (?, ?, ?)", rows)
    database.close()
    bag = read_bag(folder)
    assert bag["/count"]["data"].tolist() == list(range(10))
    assert "4 messages have no topic, no time or no content" in bag.remarks[0]


def test_message_compression_in_mcap(tmp_path):
    from flight_graph.bags.recover import recover
    text = ("rosbag2_bagfile_information:\n  storage_identifier: mcap\n  compression_format: zstd\n"
            "  compression_mode: MESSAGE\n  relative_file_paths: [x.mcap]\n")
    body = record(INT32) + record(COUNT) + b"".join(
        message(1, i, zstandard.compress(int32(i))) for i in range(3000))
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").write_text(text)
    (tmp_path / "bag" / "x.mcap").write_bytes(file(chunk(body)))
    recover(tmp_path / "bag", tmp_path / "saved")
    for folder in ("bag", "saved"):
        bag = read_bag(tmp_path / folder)
        np.testing.assert_array_equal(bag["/count"]["data"], np.arange(3000))
        np.testing.assert_array_equal(bag.sequences("/count"), np.arange(3000))


@pytest.mark.parametrize("text", ["", "- 1\n", "a: 1\n", "\tx: 1", "rosbag2_bagfile_information:\n  relative_file_paths: []\n"])
@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_description_that_says_nothing(tmp_path, text, plugin):
    folder = write(tmp_path / "bag", 10, plugin=plugin)
    (folder / "metadata.yaml").write_text(text)
    bag = read_bag(folder)
    assert len(bag["/count"]) == 10 and "all files were read" in bag.remarks[0]


def test_a_file_that_is_named_twice_is_read_once(tmp_path):
    folder = write(tmp_path / "bag", 10)
    name = next(folder.glob("*.mcap")).name
    (folder / "metadata.yaml").write_text(
        f"rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths: [{name}, {name}]\n")
    assert len(read_bag(folder)["/count"]) == 10


def test_a_database_that_is_no_bag(tmp_path):
    with sqlite3.connect(tmp_path / "x.db3") as database:
        database.execute("create table notes (text)")
    with pytest.raises(BagError, match="its table 'topics' is missing"):
        read_bag(tmp_path / "x.db3")
    (tmp_path / "y.db3").write_bytes(b"SQLite format 3\0" + bytes(200))
    with pytest.raises(BagError, match="not a sound bag"):
        read_bag(tmp_path / "y.db3")


@pytest.mark.parametrize("version", range(1, 10))
def test_every_version_of_the_description(tmp_path, version):
    folder = write(tmp_path / "bag")
    import yaml
    path = folder / "metadata.yaml"
    content = yaml.safe_load(path.read_text())["rosbag2_bagfile_information"]
    content["version"] = version
    content["relative_file_paths"] = [f"bag/{name}" if version < 4 else name for name in content["relative_file_paths"]]
    for name, since in (("compression_mode", 3), ("files", 5), ("custom_data", 6), ("ros_distro", 7)):
        if version < since:
            content.pop(name, None)
    for topic in content["topics_with_message_count"]:
        if version < 4:
            topic["topic_metadata"].pop("offered_qos_profiles", None)
        if version < 7:
            topic["topic_metadata"].pop("type_description_hash", None)
    path.write_text(yaml.safe_dump({"rosbag2_bagfile_information": content}))
    assert len(read_bag(folder)["/count"]) == 40


def test_no_description_split_files_and_an_empty_storage(tmp_path):
    folder = write(tmp_path / "bag")
    first = next(folder.glob("*.mcap"))
    for number in (2, 10):
        shutil.copy(first, folder / f"part_{number}.mcap")
    first.unlink()
    text = (folder / "metadata.yaml").read_text()
    (folder / "metadata.yaml").unlink()
    bag = read_bag(folder)
    assert len(bag["/count"]) == 80 and "metadata.yaml is missing" in bag.remarks[0]
    text = text.replace("storage_identifier: mcap", "storage_identifier: ''").replace(first.name, "part_2.mcap")
    (folder / "metadata.yaml").write_text(text)
    assert len(read_bag(folder)["/count"]) == 40


def test_a_count_that_differs_is_told(tmp_path):
    folder = write(tmp_path / "bag")
    text = (folder / "metadata.yaml").read_text().replace("message_count: 40", "message_count: 41")
    (folder / "metadata.yaml").write_text(text)
    bag = read_bag(folder)
    assert len(bag["/count"]) == 40 and "counts 41 messages, the bag holds 40" in bag.remarks[0]


# -- definitions and bodies --------------------------------------------------------------------------------------------
def topic_bag(tmp_path, name, text, *payloads, encoding="ros2msg"):
    schema = records.Schema(1, text.encode(), encoding, name)
    data = record(schema) + record(records.Channel(1, "/x", "cdr", {}, 1)) + b"".join(
        message(1, i, payload) for i, payload in enumerate(payloads))
    return bag_of(tmp_path, file(data))


def test_idl_with_its_head(tmp_path):
    text = "=" * 80 + ("\nIDL: my_msgs/msg/Wheel\nmodule my_msgs {\n  module msg {\n    struct Wheel {\n      double speed;\n"
                       "      int32 count;\n    };\n  };\n};\n")
    bag = topic_bag(tmp_path, "my_msgs/msg/Wheel", text, b"\0\1\0\0" + struct.pack("<di", 1.5, 3), encoding="ros2idl")
    assert (bag["/x"]["speed"][0], bag["/x"]["count"][0]) == (1.5, 3)


def test_idl_of_other_generators(tmp_path):
    """Lines for a preprocessor, annotations, constants of wide text and enumerations."""
    text = ("=" * 80 + "\nIDL: my_msgs/msg/Wheel\n// generated\n#include \"std_msgs/msg/Header.idl\"\n#include <x.idl>\n"
            "#ifndef WHEEL\n#define WHEEL\nmodule my_msgs { module msg {\n  module Wheel_Constants {\n"
            "    const wstring NAME = L\"a \\\" b\";\n    const octet MOST = 3;\n  };\n"
            "  enum State { IDLE, /* not */ MOVING };\n  typedef double double__2[2];\n"
            "  @verbatim (language=\"comment\", text=\n    \"a text\" \"\\n\" \"of { two }\")\n"
            "  struct Wheel {\n    @unit (value=\"m/s\") double__2 speed; // of both\n    my_msgs::msg::State state;\n"
            "    sequence<State, 3> before;\n  };\n}; };\n#endif\n")
    payload = b"\0\1\0\0" + struct.pack("<ddIIII", 1.5, 2.5, 1, 2, 0, 1)
    for written in (text, text.replace("\n", "\r\n")):
        row = topic_bag(tmp_path, "my_msgs/msg/Wheel", written, payload, encoding="ros2idl")["/x"][0]
        assert (row["speed"].tolist(), row["state"], row["before"].tolist()) == ([1.5, 2.5], 1, [0, 1])


def test_carriage_returns_and_old_names(tmp_path):
    bag = topic_bag(tmp_path, "my_msgs/Pair", "int32 a\r\n# a word\r\nint32 b\r\n", b"\0\1\0\0" + struct.pack("<ii", 1, 2))
    assert bag.topics["/x"].type_name == "my_msgs/msg/Pair" and bag["/x"]["b"].tolist() == [2]


@pytest.mark.parametrize(("text", "sentence"), [
    ("my_msgs/Part part\n", "definition of my_msgs/msg/Part, which my_msgs/msg/Thing contains, is missing"),
    ("int32\n", "cannot be parsed"), ("Thing inner\n", "contains itself"), ("#" * (1 << 21), "has 2097152 characters")])
def test_definitions_that_cannot_be_used(tmp_path, text, sentence):
    bag = topic_bag(tmp_path, "my_msgs/msg/Thing", text, int32(1))
    with pytest.raises(BagError, match=sentence):
        bag["/x"]


def test_service_events_and_action_feedback(tmp_path):
    info = struct.pack("<BxxxiI16sxxxxq", 1, 5, 6, bytes(16), 9)
    request = struct.pack("<Ixxxxqq", 1, 3, 4)
    bag = topic_bag(tmp_path, "my_srvs/srv/Add_Event", "int64 a\nint64 b\n---\nint64 sum\n",
                    b"\0\1\0\0" + info + b"\0" * (-len(info) % 4) + request + struct.pack("<I", 0))
    event = bag["/x"][0]
    assert event["info"]["sequence_number"] == 9 and event["request"][0]["b"] == 4
    assert {"response", "info.event_type"} <= set(table(bag, "/x"))
    bag = topic_bag(tmp_path, "my/action/Count_FeedbackMessage", "int32 to\n---\nint32 all\n---\nint32 done\n",
                    b"\0\1\0\0" + bytes(range(16)) + struct.pack("<i", 8))
    assert bag["/x"]["feedback"]["done"].tolist() == [8]


@pytest.mark.parametrize(("width", "encoding"), [(4, "utf-32-le"), (2, "utf-16-le"), (1, "utf-16-le")])
def test_wide_strings_of_every_writer(tmp_path, width, encoding):
    """The length counts four-byte characters, two-byte ones, or bytes."""
    payloads = []
    for text in ("h\u00e9", "\u20ac", "abcd"):
        raw = text.encode(encoding)
        body = struct.pack("<I", len(raw) // width) + raw
        body += bytes(-len(body) % 4) + struct.pack("<i", len(text))
        payloads.append(b"\0\1\0\0" + body)
    bag = topic_bag(tmp_path, "my_msgs/msg/Named", "wstring name\nint32 length\n", *payloads)
    assert bag["/x"]["name"].tolist() == ["h\u00e9", "\u20ac", "abcd"] and bag["/x"]["length"].tolist() == [2, 1, 4]


def test_bodies_of_other_middleware(tmp_path):
    """Big endian, and XCDR2, which aligns doubles to four bytes."""
    text = "int32 a\nfloat64 b\n"
    payloads = (b"\0\0\0\0" + struct.pack(">ixxxxd", 1, 2.0), b"\0\7\0\0" + struct.pack("<id", 1, 2.0),
                b"\0\6\0\0" + struct.pack(">id", 1, 2.0))
    for payload in payloads:
        bag = topic_bag(tmp_path, "my_msgs/msg/Two", text, payload)
        assert (bag["/x"]["a"][0], bag["/x"]["b"][0]) == (1, 2.0)
        export(bag, tmp_path / "t", "parquet")
        assert parquet.read_table(tmp_path / "t" / "x.parquet").to_pydict()["b"] == [2.0]
    with pytest.raises(BagError, match="no plain CDR: its encapsulation is a parameter list"):
        topic_bag(tmp_path, "my_msgs/msg/Two", text, b"\0\3\0\0" + bytes(16))["/x"]


def test_text_that_is_no_utf8_is_escaped(tmp_path):
    bag = topic_bag(tmp_path, "std_msgs/msg/String", "string data\n", b"\0\1\0\0" + struct.pack("<I", 4) + b"h\xe9j\0")
    assert table(bag, "/x")["data"].tolist() == ["h\\xe9j"]


# -- tables ------------------------------------------------------------------------------------------------------------
def test_images_are_one_column_of_bytes(tmp_path):
    types, kind = TYPESTORE.types, "sensor_msgs/msg/Image"
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](1, 2), "camera")
    rng = np.random.default_rng(3)
    pictures = [rng.integers(0, 256, 240 * 320, dtype=np.uint8) for _ in range(4)]
    payloads = [bytes(TYPESTORE.serialize_cdr(types[kind](header, 240, 320, "mono8", 0, 320, picture), kind))
                for picture in pictures]
    bag = topic_bag(tmp_path, kind, TYPESTORE.generate_msgdef(kind)[0], *payloads)
    assert len(table(bag, "/x")) < 15
    for to in ("parquet", "csv", "npz"):
        path, = export(bag, tmp_path / to, to).paths
        assert path.stat().st_size < 2 * sum(map(len, payloads))
    found = parquet.read_table(tmp_path / "parquet" / "x.parquet").to_pydict()
    assert [np.frombuffer(data, np.uint8).tolist() for data in found["data"]] == [p.tolist() for p in pictures]
    assert found["header.frame_id"] == ["camera"] * 4 and found["encoding"] == ["mono8"] * 4


def test_long_arrays_are_lists(tmp_path):
    values = np.arange(2000.0)
    payload = b"\0\1\0\0" + struct.pack("<Ixxxx", 2000) + values.tobytes()
    bag = topic_bag(tmp_path, "my_msgs/msg/Scan", "float64[] ranges\n", payload, payload)
    path, = export(bag, tmp_path / "t", "parquet").paths
    assert parquet.read_table(path).to_pydict()["ranges"] == [values.tolist()] * 2
    path, = export(bag, tmp_path / "t", "csv").paths
    assert json.loads(path.read_text().splitlines()[1].split(",", 2)[2].strip('"')) == values.tolist()


def test_a_column_called_file_and_names_of_topics_as_files(tmp_path):
    data = record(records.Schema(1, b"string file\nint32 line\n", "ros2msg", "my_msgs/msg/Log"))
    topics = ["/a/b", "/a.b", "../../etc/x", "", "/" + "long" * 90]
    data += b"".join(record(records.Channel(i, topic, "cdr", {}, 1)) for i, topic in enumerate(topics, 1))
    body = struct.pack("<I", 5) + b"a.py\0" + bytes(3) + struct.pack("<i", 12)
    data += b"".join(message(i, i, b"\0\1\0\0" + body) for i in range(1, len(topics) + 1))
    done = export(bag_of(tmp_path, file(data)), tmp_path / "t", "npz")
    assert len({path.name.lower() for path in done.paths}) == len(topics)
    assert all(path.parent == tmp_path / "t" and len(path.name) < 140 for path in done.paths)
    assert np.load(done.paths[0])["file"].tolist() == ["a.py"] and np.load(done.paths[0])["line"].tolist() == [12]


def test_topics_by_any_spelling(tmp_path):
    data = record(INT32) + record(records.Channel(1, "plain", "cdr", {}, 1)) + message(1, 0, int32(3))
    bag = bag_of(tmp_path, file(data))
    assert bag.spelled("/plain") == bag.spelled("plain") == "plain"
    with pytest.raises(ValueError, match="did you mean 'plain'"):
        bag.spelled("/plane")
