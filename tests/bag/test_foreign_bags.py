"""Bags of any recorder: what the MCAP specification lets a file be, and what rosbag2 leaves, read as the library mcap
or rosbags reads it; one topic that cannot be decoded hides no other."""

import itertools
import shutil
import sqlite3
import struct

import numpy as np
import pytest
import zstandard
from mcap import records
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from flight_graph.bags.errors import BagDamaged, BagError
from flight_graph.bags.export import export
from flight_graph.bags.reader import read_bag
from msg_schemas.definitions import TYPESTORE
from tests.bag import foreign_files as made
from tests.bag.foreign_files import (
    COUNT,
    INT32,
    START,
    STEP,
    bag_of,
    by_mcap,
    chunk,
    counting,
    file,
    int32,
    message,
    record,
)


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
    from flight_graph.bags.recover import recover
    for damaged in (tmp_path, tmp_path / "x.db3"):
        with pytest.raises(BagError, match="x.db3' is an SQLite bag: sqlite3 itself saves what is intact"):
            recover(damaged, tmp_path / "saved")
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
