"""Damaged bags: recognised whatever byte is hit, never wrong data; what is intact is recovered."""

import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from flight_graph.bags.errors import BagDamaged, BagError
from flight_graph.bags.mcap_records import list_records
from flight_graph.bags.reader import read_bag
from flight_graph.bags.recover import recover
from flight_graph.bags.writer import BagWriter
from msg_schemas.definitions import TYPESTORE
from tests.bag.sample_bags import IMU, diagnostics_payload, write_bag

CASES = 200


def everything(folder):
    """All that a reader can get out of a bag."""
    bag = read_bag(folder)
    arrays = {topic: bag[topic].tolist() if bag.layout(topic) is None else bag[topic].tobytes() for topic in bag.topics}
    beside = {name: (a.media_type, a.data) for name, a in bag.attachments.items()}
    return list(bag.messages()), {t: (i.type_name, i.qos_text) for t, i in bag.topics.items()}, repr(arrays), beside, \
        bag.metadata


def rows(bag, topic):
    return {bytes(payload) for name, _, payload in bag.messages([topic])}


def copy(bag, tmp_path, content):
    folder = tmp_path / "hop"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(bag.folder, folder)
    (folder / "hop_0.mcap").write_bytes(content)
    return folder


def check_recovery(folder, out, original):
    """Whatever `recover` saves is a valid bag and holds nothing that was not recorded."""
    shutil.rmtree(out, ignore_errors=True)
    try:
        report = recover(folder, out)
    except BagError:
        return None
    saved = read_bag(out)
    known = set(original)
    assert all(message in known for message in saved.messages())
    assert sum(topic.saved for topic in report.topics.values()) == sum(info.count for info in saved.topics.values())
    return report


def test_truncation_anywhere(bag, tmp_path):
    content, original = bag.mcap.read_bytes(), list(read_bag(bag.folder).messages())
    rng = np.random.default_rng(11)
    sound_chunks = np.array(_chunk_ends(content))
    for i, size in enumerate(rng.integers(0, len(content), CASES).tolist()):
        folder = copy(bag, tmp_path, content[:size])
        for path in (folder, folder / "hop_0.mcap"):
            with pytest.raises(BagDamaged, match="flight recover"):
                read_bag(path)
        if i % 4 == 0:
            report = check_recovery(folder, tmp_path / "saved", original)
            if (sound_chunks <= size).any():
                saved = list(read_bag(tmp_path / "saved").messages())
                assert saved == original[:len(saved)]
                assert len(saved) == _messages_before(bag, int((sound_chunks <= size).sum()))
            assert report is None or report.attachments in ([], ["scenario.yaml"])


def _chunk_ends(content):
    """Where the chunks of a file end, by the records of the library mcap."""
    from io import BytesIO

    from mcap.reader import make_reader

    return [c.chunk_start_offset + c.chunk_length
            for c in make_reader(BytesIO(content)).get_summary().chunk_indexes]


def _messages_before(bag, chunks):
    """Messages in the first ``chunks`` chunks, by their message indexes as the library mcap reads them."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    with open(bag.mcap, "rb") as file:
        found = [record for record in StreamReader(file, emit_chunks=True).records if isinstance(record, Chunk)]
    return sum(type(record).__name__ == "Message" for chunk in found[:chunks] for record in breakup_chunk(chunk))


def test_a_flipped_bit_anywhere(bag, tmp_path):
    content, original, expected = bag.mcap.read_bytes(), list(read_bag(bag.folder).messages()), everything(bag.folder)
    rng = np.random.default_rng(12)
    ends = [*range(8), *range(len(content) - 45, len(content))]  # magic, DataEnd, footer: few bytes, many roles
    places = [*rng.integers(0, len(content), CASES - len(ends)).tolist(), *ends]
    detected = 0
    for i, place in enumerate(places):
        broken = bytearray(content)
        broken[place] ^= 1 << int(rng.integers(8))
        folder = copy(bag, tmp_path, broken)
        try:
            assert everything(folder) == expected
        except BagDamaged as error:
            detected += 1
            assert "flight recover" in str(error)
        if i % 4 == 0:
            report = check_recovery(folder, tmp_path / "saved", original)
            assert report is not None
    assert detected == CASES  # every byte of our files stands under a check


def test_a_record_that_poses_as_another(bag, tmp_path):
    """Every bit of every record's type and length: nothing that was not recorded comes out of a recovery."""
    content, original = bag.mcap.read_bytes(), list(read_bag(bag.folder).messages())
    opcodes, starts, _, _ = list_records(np.frombuffer(content, np.uint8), 8, len(content) - 8)
    data_section = starts[:int(np.flatnonzero(opcodes == 0x0F)[0]) + 1]
    for start in data_section.tolist():
        for place, bit in [(start - 9, bit) for bit in range(8)] + [(start - 8, 0), (start - 7, 3)]:
            broken = bytearray(content)
            broken[place] ^= 1 << bit
            assert check_recovery(copy(bag, tmp_path, broken), tmp_path / "saved", original) is not None


def test_a_flipped_bit_in_metadata_yaml(bag, tmp_path):
    expected = everything(bag.folder)
    content = (bag.folder / "metadata.yaml").read_bytes()
    rng = np.random.default_rng(13)
    folder = copy(bag, tmp_path, bag.mcap.read_bytes())
    for place in rng.integers(0, len(content), CASES).tolist():
        broken = bytearray(content)
        broken[place] ^= 1 << int(rng.integers(8))
        (folder / "metadata.yaml").write_bytes(broken)
        try:
            assert everything(folder) == expected
        except BagError:
            pass


def test_flipped_bits_in_a_foreign_bag_never_crash(tmp_path):
    """rosbags writes no checksums: a flip in a payload cannot be seen by anyone, but nothing may crash."""
    folder = tmp_path / "bag"
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kind = "diagnostic_msgs/msg/DiagnosticArray"
        topics = [writer.add_connection(f"/t{i}", kind, typestore=TYPESTORE) for i in range(3)]
        for i in range(30):
            writer.write(topics[i % 3], i, diagnostics_payload(i))
    path = next(folder.glob("*.mcap"))
    content = path.read_bytes()
    rng = np.random.default_rng(14)
    for place in rng.integers(0, len(content), CASES).tolist():
        broken = bytearray(content)
        broken[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(broken)
        shutil.rmtree(tmp_path / "saved", ignore_errors=True)
        for act in (lambda: everything(folder), lambda: recover(folder, tmp_path / "saved")):
            try:
                act()
            except BagError:
                pass


def test_a_lost_chunk_in_the_middle(bag, tmp_path):
    """Everything before and behind it is saved; the report says how many messages and how much time are gone."""
    content, original = bytearray(bag.mcap.read_bytes()), list(read_bag(bag.folder).messages())
    first, second = _chunk_ends(bytes(content))[:2]
    begin, end = _messages_before(bag, 1), _messages_before(bag, 2)
    content[second - 1000] ^= 0x10
    report = recover(copy(bag, tmp_path, content), tmp_path / "saved")
    assert list(read_bag(tmp_path / "saved").messages()) == original[:begin] + original[end:]
    assert sum(topic.lost for topic in report.topics.values()) == end - begin
    assert report.seconds_lost == pytest.approx((original[end][1] - original[begin - 1][1]) / 1e9, abs=1e-12)
    assert (report.attachments, report.metadata) == (["scenario.yaml"], ["versions"])
    assert read_bag(tmp_path / "saved").attachments["scenario.yaml"].data == b"name: hop\nseed: 3\n"
    sequences = read_bag(tmp_path / "saved").sequences("/cubli/imu")
    assert sequences[-1] == 599 and len(sequences) < 600  # the numbers of the original: the loss stays visible
    with Reader(tmp_path / "saved") as reader:
        assert reader.message_count == len(original) - (end - begin)


def test_recovering_a_sound_bag_changes_no_message(bag, tmp_path):
    report = recover(bag.folder, tmp_path / "saved")
    assert list(read_bag(tmp_path / "saved").messages()) == list(read_bag(bag.folder).messages())
    assert (report.gaps, report.remarks, report.seconds_lost) == ([], [], 0)


def test_missing_files(bag, tmp_path):
    folder = copy(bag, tmp_path, bag.mcap.read_bytes())
    (folder / "metadata.yaml").unlink()
    without = read_bag(folder)  # what other recorders leave when they are killed, and what people send each other
    assert "metadata.yaml is missing" in without.remarks[0]
    assert list(without.messages()) == list(read_bag(bag.folder).messages())
    recover(folder, tmp_path / "saved")
    assert everything(tmp_path / "saved")[0] == everything(bag.folder)[0]
    folder = copy(bag, tmp_path, bag.mcap.read_bytes())
    (folder / "hop_0.mcap").unlink()
    with pytest.raises(BagDamaged, match="hop_0.mcap is missing"):
        read_bag(folder)
    with pytest.raises(BagError, match="holds no .mcap file"):
        recover(folder, tmp_path / "saved2")


def test_swapped_files_are_noticed(bag, tmp_path):
    """A sound .mcap beside the metadata.yaml of another bag."""
    other = write_bag(tmp_path / "other" / "hop", count=100)
    folder = copy(bag, tmp_path, other.mcap.read_bytes())
    with pytest.raises(BagDamaged, match="metadata.yaml differs"):
        read_bag(folder)


WRITER = """
import sys, time
from flight_graph.bags.writer import BagWriter
from tests.bag.sample_bags import IMU, stamp
import numpy as np

writer = BagWriter(sys.argv[1])
topic = writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
writer.attach("scenario.yaml", "application/yaml", b"name: hop")
payload, record = IMU.new()
print("started", flush=True)
i = 0
while True:
    now = time.monotonic_ns()  # the stamp is the wall time of writing
    record["angular_velocity"] = i
    stamp(record, np.array([now]))
    writer.write(topic, now, payload)
    i += 1
    time.sleep(0.001)
"""


@pytest.mark.parametrize("delay", [0.15, 0.6, 1.3, 2.05])
def test_kill_9(tmp_path, delay):
    """At most 0.25 s of wall time are lost, and every message before is intact."""
    process = subprocess.Popen([sys.executable, "-c", WRITER, tmp_path / "hop"], stdout=subprocess.PIPE, text=True,
                               cwd=os.getcwd(), env={**os.environ, "PYTHONPATH": "."})
    process.stdout.readline()
    time.sleep(delay)
    killed = time.monotonic_ns()
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    with pytest.raises(BagDamaged, match="stopped before it could finish"):
        read_bag(tmp_path / "hop")
    report = recover(tmp_path / "hop", tmp_path / "saved")
    bag = read_bag(tmp_path / "saved")
    stamps, imu = bag.stamps_ns("/cubli/imu"), bag["/cubli/imu"]
    assert killed - stamps[-1] < 250_000_000  # [ns]
    np.testing.assert_array_equal(imu["angular_velocity"][:, 2], np.arange(len(imu)))
    np.testing.assert_array_equal(bag.sequences("/cubli/imu"), np.arange(len(imu)))
    np.testing.assert_array_equal(
        imu["header"]["stamp"]["sec"].astype(np.int64) * 10**9 + imu["header"]["stamp"]["nanosec"], stamps)
    assert report.attachments == ["scenario.yaml"] and report.seconds_lost is None


def test_a_running_recorder_is_not_recovered(tmp_path):
    with BagWriter(tmp_path / "hop") as writer:
        writer.add_topic("/cubli/imu", IMU.type_name, IMU.role.qos)
        with pytest.raises(BagError, match="still being recorded"):
            recover(tmp_path / "hop", tmp_path / "saved")
