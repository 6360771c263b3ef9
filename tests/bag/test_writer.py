"""Bags against independent readers (rosbags, mcap-ros2-support, @mcap/core), and what happens when writing fails."""

import errno
import json
import os
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader

from flight_graph.bags.errors import BagDamaged, BagError
from flight_graph.bags.reader import read_bag
from flight_graph.bags.writer import BagWriter
from msg_schemas.definitions import TYPESTORE
from msg_schemas.qos import Role
from tests.bag.sample_bags import IMU, WHEELS, diagnostics_payload, recorded, write_bag


def test_rosbags_reads_every_message(bag):
    with AnyReader([bag.folder], default_typestore=TYPESTORE) as reader:
        assert {c.topic: (c.msgtype, c.msgcount) for c in reader.connections} == {
            "/cubli/imu": ("sensor_msgs/msg/Imu", 600), "/cubli/wheels": ("sensor_msgs/msg/JointState", 300),
            "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", 12)}
        imu = [(time_ns, reader.deserialize(raw, connection.msgtype))
               for connection, time_ns, raw in reader.messages() if connection.topic == "/cubli/imu"]
    assert [time_ns for time_ns, _ in imu] == bag.stamps.tolist()
    assert [m.header.frame_id for _, m in imu] == ["imu_link"] * 600
    spin = np.array([[m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z] for _, m in imu])
    np.testing.assert_array_equal(spin, bag.imu["angular_velocity"])


def test_rosbags_sees_version_qos_and_type_hash(bag):
    with Reader(bag.folder) as reader:
        imu = next(c for c in reader.connections if c.topic == "/cubli/imu")
        qos = imu.ext.offered_qos_profiles[0]
        assert (qos.reliability, qos.durability, qos.depth) == (
            QosReliability.RELIABLE, QosDurability.VOLATILE, Role.SENSOR.qos.depth)
        assert imu.digest == TYPESTORE.hash_rihs01("sensor_msgs/msg/Imu")
        assert (reader.start_time, reader.end_time) == (0, int(bag.stamps[-1]) + 1)
    info = yaml.safe_load((bag.folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (info["version"], info["storage_identifier"]) == (9, "mcap")


def test_mcap_ros2_decodes_every_message(bag):
    with open(bag.mcap, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header, summary = reader.get_header(), reader.get_summary()
        decoded = [m for m in reader.iter_decoded_messages(topics=["/cubli/wheels"])]
        attachments = [(a.name, a.data) for a in reader.iter_attachments()]
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    assert header.profile == "ros2"
    assert {(s.name, s.encoding) for s in summary.schemas.values()} >= {("sensor_msgs/msg/Imu", "ros2msg")}
    channel = next(c for c in summary.channels.values() if c.topic == "/cubli/imu")
    assert channel.message_encoding == "cdr"
    assert channel.metadata["topic_type_hash"] == TYPESTORE.hash_rihs01("sensor_msgs/msg/Imu")
    assert yaml.safe_load(channel.metadata["offered_qos_profiles"])[0]["reliability"] == "reliable"
    np.testing.assert_array_equal([m.decoded_message.effort for m in decoded], bag.wheels["effort"])
    assert [m.message.sequence for m in decoded] == list(range(300))
    assert attachments == [("scenario.yaml", b"name: hop\nseed: 3\n")]
    assert metadata["versions"] == {"numpy": "2", "seed": "3"}
    assert yaml.safe_load(metadata["rosbag2"]["serialized_metadata"])["message_count"] == 912


def test_javascript_reader(bag, tmp_path):
    """@mcap/core with every check it has; the zstd decoder is the npm package fzstd."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    folder = Path(__file__).parent / "javascript"
    if not (folder / "node_modules" / "@mcap/core").is_dir():
        pytest.skip(f"the npm packages of {folder} are not installed (make test does that where npm is there)")
    run = subprocess.run([node, folder / "read_bag.cjs", bag.mcap], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout)
    assert found["counts"] == {"/cubli/imu": 600, "/cubli/wheels": 300, "/diagnostics": 12}
    assert found["last"] == str(bag.stamps[-1])
    assert bytes.fromhex(found["payload"]) == bag.payloads["/cubli/imu"][-1].tobytes()
    assert found["profile"] == "ros2" and found["attachments"] == ["scenario.yaml"]


def test_same_input_gives_the_same_file(bag, tmp_path):
    again = write_bag(tmp_path / "hop")
    assert again.mcap.read_bytes() == bag.mcap.read_bytes()
    assert (again.folder / "metadata.yaml").read_bytes() == (bag.folder / "metadata.yaml").read_bytes()


def test_the_timer_leaves_no_trace_in_the_file(bag, tmp_path):
    """A flush after every few messages, at wall-clock times of its own, changes no byte of the bag."""
    with BagWriter(tmp_path / "slow", flush_period_s=0.002) as slow, BagWriter(tmp_path / "fast") as fast:
        topics = [w.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos) for w in (slow, fast)]
        for i, at in enumerate(bag.stamps.tolist()):
            for writer, topic in zip((slow, fast), topics):
                writer.write(topic, at, bag.payloads["/cubli/imu"][i])
            if i % 100 == 0:
                time.sleep(0.005)
    assert (tmp_path / "slow/slow_0.mcap").stat().st_size == (tmp_path / "fast/fast_0.mcap").stat().st_size
    data_end = (tmp_path / "fast/fast_0.mcap").read_bytes().index(b"rosbag2")
    assert (tmp_path / "slow/slow_0.mcap").read_bytes()[:data_end] == \
        (tmp_path / "fast/fast_0.mcap").read_bytes()[:data_end]


def test_write_many_equals_write(tmp_path):
    stamps, imu, wheels = recorded(4, 1001)
    blocks = {"/cubli/imu": (stamps, IMU.payloads(imu)), "/cubli/wheels": (stamps[::2], WHEELS.payloads(wheels))}
    for name in ("one", "many"):
        with BagWriter(tmp_path / name / "bag") as writer:
            a, b = (writer.add_topic(s, g.type_name, g.role.qos) for s, g in zip(blocks, (IMU, WHEELS)))
            (start, raw), (start_b, raw_b) = blocks.values()
            if name == "many":
                writer.write_many([(a, start[:300], raw[:300]), (b, start_b[:150], raw_b[:150])])
                writer.write_many([(a, start[300:], raw[300:]), (b, start_b[150:], raw_b[150:])])
            else:
                for i, at in enumerate(start.tolist()):
                    writer.write(a, at, raw[i])
                    if i % 2 == 0:
                        writer.write(b, at, raw_b[i // 2])
    assert (tmp_path / "one/bag/bag_0.mcap").read_bytes() == (tmp_path / "many/bag/bag_0.mcap").read_bytes()


def test_an_empty_bag_is_valid(tmp_path):
    with BagWriter(tmp_path / "empty") as writer:
        writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
    with Reader(tmp_path / "empty") as reader:
        assert reader.message_count == 0
    assert len(read_bag(tmp_path / "empty")["/cubli/imu"]) == 0


def test_the_mark_is_there_while_recording_and_gone_after(tmp_path):
    writer = BagWriter(tmp_path / "hop")
    topic = writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
    writer.write(topic, 0, IMU.template)
    assert (tmp_path / "hop/RECORDING").read_bytes().startswith(b"This bag is being recorded")
    with pytest.raises(BagError, match="still being recorded"):
        read_bag(tmp_path / "hop")
    writer.close()
    assert sorted(p.name for p in (tmp_path / "hop").iterdir()) == ["hop_0.mcap", "metadata.yaml"]
    with pytest.raises(BagError, match="closed"):
        writer.write(topic, 1, IMU.template)


def test_an_exception_leaves_a_marked_bag(tmp_path):
    with pytest.raises(RuntimeError):
        with BagWriter(tmp_path / "hop") as writer:
            writer.write(writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos), 0, IMU.template)
            raise RuntimeError("the run failed")
    with pytest.raises(BagDamaged, match="flight recover"):
        read_bag(tmp_path / "hop")


def test_existing_folder(tmp_path, bag):
    (tmp_path / "hop").mkdir()
    (tmp_path / "hop/notes.txt").write_text("keep me")
    with pytest.raises(BagError, match="exists already"):
        BagWriter(tmp_path / "hop")
    with pytest.raises(BagError, match="notes.txt"):
        BagWriter(tmp_path / "hop", overwrite=True)
    assert (tmp_path / "hop/notes.txt").read_text() == "keep me"
    shutil.copytree(bag.folder, tmp_path / "old")
    BagWriter(tmp_path / "old", overwrite=True).close()
    assert read_bag(tmp_path / "old").topics == {}


def test_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BagError, match="cannot be written: not a directory"):
        BagWriter(tmp_path / "file" / "bag")
    with pytest.raises(BagError, match="cannot be written"):
        BagWriter("/proc/bag")


@pytest.mark.parametrize("where", ["chunk", "timer", "close"])
def test_disk_full(tmp_path, monkeypatch, where):
    """Every later call says so, the mark stays, and what reached the disk before can be recovered."""
    from flight_graph.bags.recover import recover

    writer = BagWriter(tmp_path / "hop")
    topic = writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
    for i in range(200):  # more than one chunk
        writer.write(topic, i, IMU.template)
    writer.flush()

    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "lseek" if where == "timer" else "write", full)
        with pytest.raises(BagError, match="no space left on device"):
            if where == "chunk":
                for i in range(200, 500):
                    writer.write(topic, i, IMU.template)
            elif where == "timer":
                writer.write(topic, 200, IMU.template)
                for _ in range(100):
                    time.sleep(0.02)
                    writer.write(topic, 201, IMU.template)
            else:
                writer.close()
    if where != "close":
        with pytest.raises(BagError, match="no space left"):
            writer.write(topic, 999, IMU.template)
        with pytest.raises(BagError, match="no space left"):
            writer.close()
    with pytest.raises(BagDamaged, match="flight recover"):
        read_bag(tmp_path / "hop")
    report = recover(tmp_path / "hop", tmp_path / "saved")
    assert report.topics["/cubli/imu"].saved >= 200
    assert (read_bag(tmp_path / "saved")["/cubli/imu"].tobytes()
            == IMU.zeros(report.topics["/cubli/imu"].saved).tobytes())


def test_refused_messages_leave_the_bag_whole(tmp_path):
    with BagWriter(tmp_path / "hop") as writer:
        topic = writer.add_topic("/d", "diagnostic_msgs/msg/DiagnosticArray", Role.DIAGNOSTICS.qos)
        with pytest.raises(BagError, match="stamp -1"):
            writer.write(topic, -1, b"\0\1\0\0")
        with pytest.raises(TypeError):
            writer.write(topic, 0, "text")
        with pytest.raises(BagError, match="already has the topic"):
            writer.add_topic("/d", "diagnostic_msgs/msg/DiagnosticArray", Role.DIAGNOSTICS.qos)
        with pytest.raises(BagError, match="do not fall"):
            writer.write_many([(topic, np.array([2, 1]), np.zeros((2, 9), np.uint8))])
        writer.write(topic, 5, diagnostics_payload(2))
    assert read_bag(tmp_path / "hop")["/d"]["status"][0]["name"].tolist() == ["part 2"] * 2
