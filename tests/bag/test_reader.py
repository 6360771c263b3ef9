"""Reading bags: ours and foreign ones, against the records written and against rosbags' decoder."""

import numpy as np
import pytest
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import read_bag
from flight_graph.bags.writer import BagWriter
from flight_graph.errors import FlightError
from msg_schemas.definitions import TYPESTORE
from msg_schemas.qos import Role
from tests.bag.sample_bags import IMU, WHEELS, diagnostics_payload, write_bag

STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg("uint8 kind\nfloat64 value\nstring<=8 label\nint16[3] triple\nbool[] flags\n"
                                  "uint8 KIND_A=1\ngeometry_msgs/Point32[<=4] corners\n", "foreign_msgs/msg/Odd"))
T = STORE.types


def test_our_topics_are_the_records_that_were_written(bag):
    read = read_bag(bag.folder)
    assert read["/cubli/imu"].dtype == IMU.dtype and read["/cubli/wheels"].dtype == WHEELS.dtype
    for topic, records in (("/cubli/imu", bag.imu), ("/cubli/wheels", bag.wheels)):
        for name in records.dtype.names:
            np.testing.assert_array_equal(read[topic][name], records[name])
        np.testing.assert_array_equal(read.payloads(topic), bag.payloads[topic])
    np.testing.assert_array_equal(read.stamps_ns("/cubli/wheels"), bag.stamps[::2])
    assert read.constants("/cubli/wheels")["name"] == ["wheel_x", "wheel_y", "wheel_z"]
    assert read.constants("/cubli/imu") == {"header.frame_id": "imu_link"}
    assert (read.start_ns, read.end_ns) == (0, bag.stamps[-1])
    assert read.checked


@pytest.mark.parametrize("kept", [1 << 29, 0])
def test_a_bag_of_many_blocks(tmp_path, monkeypatch, kept):
    """Read ahead by a thread; with payloads kept at once, and gathered only when asked for (as of a very large file)."""
    monkeypatch.setattr("flight_graph.bags.verify._KEPT", kept)
    bag = write_bag(tmp_path / "long", count=40_000)  # 17 MB
    read = read_bag(bag.folder)
    for topic, records in (("/cubli/imu", bag.imu), ("/cubli/wheels", bag.wheels)):
        np.testing.assert_array_equal(read.payloads(topic), bag.payloads[topic])
        assert read[topic].tobytes() == records.tobytes()
        assert read.sequences(topic).tolist() == list(range(len(records)))
    assert len(read["/diagnostics"]) == 800 and read.layout("/diagnostics") is None


@pytest.mark.parametrize("odd", [b"", b"\0\1\0", b"\0\1\0\0"])
def test_messages_without_a_body(tmp_path, odd):
    """Payloads shorter than their encapsulation, or ended by it, are handed out as they are and decoded to a sentence."""
    with BagWriter(tmp_path / "odd") as writer:
        topic = writer.add_topic("/a", "geometry_msgs/msg/Vector3", Role.SENSOR.qos)
        for i in range(3):
            writer.write(topic, i, odd)
    bag = read_bag(tmp_path / "odd")
    assert [bytes(payload) for payload in bag.payloads("/a")] == [odd] * 3
    with pytest.raises(BagError, match="topic '/a': a message is unreadable"):
        bag["/a"]


def test_what_stands_beside_the_messages(bag):
    read = read_bag(bag.mcap)
    info = read.topics["/cubli/imu"]
    assert (info.type_name, info.count, info.qos[0]["depth"]) == ("sensor_msgs/msg/Imu", 600, Role.SENSOR.qos.depth)
    assert read.attachments["scenario.yaml"].data == b"name: hop\nseed: 3\n"
    assert read.metadata["versions"] == {"numpy": "2", "seed": "3"}


def test_messages_come_in_write_order(bag):
    found = list(read_bag(bag.folder).messages())
    assert [m[:2] for m in found[:4]] == [
        ("/cubli/imu", 0), ("/cubli/wheels", 0), ("/diagnostics", 0), ("/cubli/imu", 5_000_000)]
    assert len(found) == 912
    assert found[-1][2] == bag.payloads["/cubli/imu"][-1].tobytes()
    assert [m[0] for m in read_bag(bag.folder).messages(["/diagnostics"])] == ["/diagnostics"] * 12


def test_messages_of_varying_length(bag):
    array = read_bag(bag.folder)["/diagnostics"]
    for i, row in enumerate(array):
        expected = TYPESTORE.deserialize_cdr(diagnostics_payload(i), "diagnostic_msgs/msg/DiagnosticArray")
        assert row["header"]["stamp"]["sec"] == expected.header.stamp.sec
        assert row["header"]["frame_id"] == "cubli"
        assert row["status"]["name"].tolist() == [status.name for status in expected.status]
        for ours, theirs in zip(row["status"]["values"], expected.status):
            assert [(v["key"], v["value"]) for v in ours] == [(v.key, v.value) for v in theirs.values]


def test_unknown_topic_and_missing_bag(bag, tmp_path):
    with pytest.raises(FlightError, match="did you mean '/cubli/imu'"):
        read_bag(bag.folder)["/cubli/imus"]
    with pytest.raises(BagError, match="there is no bag"):
        read_bag(tmp_path / "nothing")
    with pytest.raises(BagError, match="is no bag"):
        read_bag(tmp_path)


def _header(i, frame):
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](i, 5), frame)


def _foreign_messages(i):
    vector, quaternion = T["geometry_msgs/msg/Vector3"], T["geometry_msgs/msg/Quaternion"]
    transform = T["geometry_msgs/msg/Transform"](vector(1.0, i, 3.0), quaternion(0.0, 0.0, 0.0, 1.0))
    stamped = T["geometry_msgs/msg/TransformStamped"]
    point = T["geometry_msgs/msg/Point32"]
    odd = T["foreign_msgs/msg/Odd"]
    yield "/tf", "tf2_msgs/msg/TFMessage", T["tf2_msgs/msg/TFMessage"](
        [stamped(_header(i, "map"), f"body{k}" * (k + 1), transform) for k in range(1 + i % 2)])
    yield "/chatter", "std_msgs/msg/String", T["std_msgs/msg/String"](f"hello {i}")
    yield "/point", "geometry_msgs/msg/Vector3", vector(float(i), -1.0, 0.5)
    yield "/scan", "sensor_msgs/msg/LaserScan", T["sensor_msgs/msg/LaserScan"](
        _header(i, "laser"), 0.0, 1.0, 0.1, 0.0, 0.1, 0.2, 30.0,
        np.arange(5, dtype=np.float32) + i, np.zeros(0, np.float32))
    yield "/odd/fixed", "foreign_msgs/msg/Odd", odd(
        i, i / 3, "same", np.array([1, 2, i], np.int16), np.array([True, i % 2 == 0]), [point(1.0, i, 2.0)] * 2, 1)
    yield "/odd/varying", "foreign_msgs/msg/Odd", odd(
        i, i / 3, "x" * (i % 5), np.array([1, 2, i], np.int16), np.zeros(i % 3, bool),
        [point(1.0, i, 2.0)] * (i % 4), 1)
    yield "/empty", "std_msgs/msg/Empty", T["std_msgs/msg/Empty"]()
    yield "/poses", "geometry_msgs/msg/PoseArray", T["geometry_msgs/msg/PoseArray"](_header(i, "map"), [
        T["geometry_msgs/msg/Pose"](T["geometry_msgs/msg/Point"](1.0, k, i), quaternion(0.0, 0.0, 0.0, 1.0))
        for k in range(2)])
    yield "/path", "nav_msgs/msg/Path", T["nav_msgs/msg/Path"](_header(i, "map"), [
        T["geometry_msgs/msg/PoseStamped"](_header(k, "map"), T["geometry_msgs/msg/Pose"](
            T["geometry_msgs/msg/Point"](1.0, k, i), quaternion(0.0, 0.0, 0.0, 1.0))) for k in range(2)])


@pytest.fixture(scope="module", params=["none", "storage", "file"])
def foreign(request, tmp_path_factory):
    """A bag made by rosbags' own writer."""
    folder = tmp_path_factory.mktemp("foreign") / "bag"
    written = []
    qos = Qos(QosHistory.KEEP_LAST, 7, QosReliability.BEST_EFFORT, QosDurability.VOLATILE, QosTime(0, 0),
              QosTime(0, 0), QosLiveliness.AUTOMATIC, QosTime(0, 0), False)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode[request.param.upper()], CompressionFormat.ZSTD)
    with writer:
        connections = {topic: writer.add_connection(topic, kind, typestore=STORE, offered_qos_profiles=[qos])
                       for topic, kind, _ in _foreign_messages(0)}
        for i in range(3000):
            for topic, kind, message in _foreign_messages(i % 200):
                raw = bytes(STORE.serialize_cdr(message, kind))
                writer.write(connections[topic], 10**18 + i, raw)
                written.append((topic, 10**18 + i, raw))
    return folder, written


def _assert_same(ours, theirs):
    """Compare a value of our array with the object that rosbags decodes."""
    if hasattr(theirs, "__msgtype__"):
        names = [name for name in theirs.__dataclass_fields__ if name != "__msgtype__" and not name.isupper()]
        if ours.dtype.names is None:
            assert ours.tolist() == [getattr(theirs, name) for name in names]
        else:
            for name in names:
                if name in ours.dtype.names:
                    _assert_same(ours[name], getattr(theirs, name))
    elif isinstance(theirs, list):
        assert len(ours) == len(theirs)
        for a, b in zip(ours, theirs):
            _assert_same(a, b)
    elif isinstance(theirs, np.ndarray):
        np.testing.assert_array_equal(ours, theirs)
    else:
        assert ours == theirs


def test_foreign_bag_against_the_decoder_of_rosbags(foreign):
    folder, written = foreign
    bag = read_bag(folder)
    assert list(bag.messages()) == written
    assert not bag.checked  # rosbags writes no checksums
    for topic, info in bag.topics.items():
        raws = [raw for name, _, raw in written if name == topic]
        array = bag[topic]
        assert len(array) == info.count == len(raws) == 3000
        for i in (*range(0, 200, 7), 2999):
            _assert_same(array[i], STORE.deserialize_cdr(raws[i], info.type_name))
        assert info.qos[0]["reliability"] == "best_effort" and info.qos[0]["depth"] == 7
    assert bag.layout("/odd/fixed") is not None and bag.layout("/odd/varying") is None
    assert bag.layout("/scan") is not None
    assert bag.constants("/scan")["intensities"] == 0
    assert bag["/poses"]["poses"]["position"].shape == (3000, 2, 3)
    assert bag.layout("/path") is None  # the padding in its two poses differs


def test_big_endian_and_changing_frames(tmp_path):
    """Big-endian CDR reads the same values; a frame that changes at equal length is no fixed layout; bytes behind a
    message are ignored."""
    point = T["geometry_msgs/msg/PointStamped"]
    kind = "geometry_msgs/msg/PointStamped"
    messages = [point(_header(i, "abcd"[i % 4]), T["geometry_msgs/msg/Point"](1.5, i, -2.0)) for i in range(8)]
    with BagWriter(tmp_path / "bag") as writer:
        frames = writer.add_topic("/frames", kind, Role.SENSOR.qos)
        big = writer.add_topic("/big", kind, Role.SENSOR.qos)
        behind = writer.add_topic("/behind", kind, Role.SENSOR.qos)
        for i, message in enumerate(messages):
            writer.write(behind, i, bytes(STORE.serialize_cdr(message, kind)) + bytes(8))
            writer.write(frames, i, bytes(STORE.serialize_cdr(message, kind)))
            writer.write(big, i, bytes(STORE.serialize_cdr(messages[0], kind, little_endian=False)))
    bag = read_bag(tmp_path / "bag")
    assert [frame for frame in bag["/frames"]["header"]["frame_id"]] == list("abcdabcd")
    np.testing.assert_array_equal(bag["/frames"]["point"][:, 1], np.arange(8))
    np.testing.assert_array_equal(bag["/behind"]["point"], bag["/frames"]["point"])
    np.testing.assert_array_equal(bag["/big"]["point"], [[1.5, 0.0, -2.0]] * 8)
    assert bag.constants("/big") == {"header.frame_id": "a"}


def test_payload_that_is_no_message(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        writer.write(writer.add_topic("/cubli/imu", IMU.type_name, Role.SENSOR.qos), 0, IMU.template[:-40])
        writer.write(writer.add_topic("/xcdr2", IMU.type_name, Role.SENSOR.qos), 0, b"\0\11" + IMU.template[2:])
    bag = read_bag(tmp_path / "bag")
    with pytest.raises(BagError, match="fewer bytes than its definition needs"):
        bag["/cubli/imu"]
    with pytest.raises(BagError, match="no plain CDR"):
        bag["/xcdr2"]
