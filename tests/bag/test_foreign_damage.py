"""Damaged bags of other recorders: no traceback, and every message that the damage did not touch is saved."""

import shutil

import numpy as np
import pytest

from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import read_bag
from flight_graph.bags.recover import recover
from msg_schemas.definitions import TYPESTORE
from tests.bag.foreign_files import COUNT, INT32, START, STEP, chunk, file, int32, message, record
from tests.bag.sample_bags import diagnostics_payload

CASES = 40  # of each kind of damage and file
KIND = "diagnostic_msgs/msg/DiagnosticArray"


def content_of(form):
    """(file, [(first byte, last + 1, topic, payload) of each message record that stands in it uncompressed])"""
    from mcap import records
    head = record(INT32) + record(COUNT) + record(
        records.Schema(2, TYPESTORE.generate_msgdef(KIND)[0].encode(), "ros2msg", KIND)) + record(
        records.Channel(2, "/diagnostics", "cdr", {}, 2))
    made = []
    for i in range(120):
        channel, payload = (1, int32(i)) if i % 3 else (2, diagnostics_payload(i))
        made.append((channel, payload, message(channel, i, payload)))
    if form == "unchunked":
        data = head + b"".join(raw for _, _, raw in made)
    else:
        parts = [made[i:i + 30] for i in range(0, len(made), 30)]
        data = head + b"".join(chunk(b"".join(raw for _, _, raw in part), crc=False,
                                     compression="zstd" if form == "compressed" else "") for part in parts)
    whole, places = file(data), []
    position = 0
    for channel, payload, raw in made if form != "compressed" else ():
        position = whole.index(raw, position)
        places.append((position, position + len(raw), "/count" if channel == 1 else "/diagnostics", payload))
        position += len(raw)
    return whole, places


def truncated(rng, content):
    size = int(rng.integers(400, len(content)))
    return content[:size], (size, len(content))


def flipped(rng, content):
    place = int(rng.integers(400, len(content)))
    broken = bytearray(content)
    broken[place] ^= 1 << int(rng.integers(8))
    return bytes(broken), (place, place + 1)


def zeroed(rng, content):
    place = int(rng.integers(400, len(content) - 64))
    return content[:place] + bytes(64) + content[place + 64:], (place, place + 64)


@pytest.mark.parametrize("form", ["unchunked", "chunked", "compressed"])
@pytest.mark.parametrize("damage", [truncated, flipped, zeroed])
def test_what_is_untouched_is_saved(tmp_path, form, damage):
    content, places = content_of(form)
    rng = np.random.default_rng(5)
    known = {payload for _, _, _, payload in places}
    declared = content.index(message(1, 1, int32(1))) if places else len(content)
    lost = 0
    for _ in range(CASES):
        broken, (first, last) = damage(rng, content)
        (tmp_path / "x.mcap").write_bytes(broken)
        shutil.rmtree(tmp_path / "saved", ignore_errors=True)
        try:
            bag = read_bag(tmp_path / "x.mcap")
            for topic in bag.topics:
                bag[topic]
        except BagError:
            pass
        try:
            recover(tmp_path / "x.mcap", tmp_path / "saved")
        except BagError:
            assert form == "compressed" or damage is truncated
            continue
        saved = [bytes(payload) for _, _, payload in read_bag(tmp_path / "saved").messages()]
        topics = set(read_bag(tmp_path / "saved").topics)  # one whose declaration is hit cannot be saved
        assert topics == {"/count", "/diagnostics"} or first < declared
        untouched = [payload for begin, end, topic, payload in places
                     if (last <= begin or end <= first) and topic in topics]
        missing = [payload for payload in untouched if payload not in set(saved)]
        lost += len(missing)
        # a chunk's own head, or its length, may be what is hit: then its messages cannot be found by their neighbours
        assert len(missing) <= 30, (damage.__name__, first, len(missing))
        wrong = [payload for payload in saved if places and payload not in known]
        assert len(wrong) <= 1 + (last - first) // 30  # only what was hit itself
    print(form, damage.__name__, lost)
    assert lost <= 90, lost


def test_times_of_gaps(tmp_path):
    content, places = content_of("unchunked")
    begin, end = places[40][0], places[44][1]
    (tmp_path / "x.mcap").write_bytes(content[:begin] + bytes(end - begin) + content[end:])
    report = recover(tmp_path / "x.mcap", tmp_path / "saved")
    assert [(gap.start_ns, gap.end_ns) for gap in report.gaps] == [(START + 39 * STEP, START + 45 * STEP)]
    assert sum(topic.saved for topic in report.topics.values()) == 115


@pytest.mark.parametrize("offset", [15, 31])  # [bytes] its time, its payload
def test_a_message_that_the_damage_reaches_is_dropped(tmp_path, offset):
    """Zeros that begin inside of a message leave a record of the right form in front of the hole."""
    for form in ("unchunked", "chunked"):
        content, places = content_of(form)
        known = {payload for _, _, _, payload in places}
        begin = places[40][0] + offset
        (tmp_path / "x.mcap").write_bytes(content[:begin] + bytes(64) + content[begin + 64:])
        recover(tmp_path / "x.mcap", tmp_path / form)
        saved = read_bag(tmp_path / form)
        assert saved.start_ns == START and {bytes(payload) for _, _, payload in saved.messages()} <= known
        assert len(list(saved.messages())) in (117, 118)


def split(tmp_path, damage):
    """Three files of forty messages each, the second of them damaged; what is recovered of them."""
    import yaml
    folder = tmp_path / "bag"
    folder.mkdir()
    for part in range(3):
        body = record(INT32) + record(COUNT) + b"".join(message(1, i, int32(i)) for i in range(40 * part, 40 * part + 40))
        content = file(chunk(body))
        content = damage(content) if part == 1 else content
        if content is not None:
            (folder / f"b_{part}.mcap").write_bytes(content)
    (folder / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": {
        "storage_identifier": "mcap", "relative_file_paths": [f"b_{part}.mcap" for part in range(3)]}}))
    report = recover(folder, tmp_path / "saved")
    return report, read_bag(tmp_path / "saved")["/count"]["data"].tolist()


@pytest.mark.parametrize("damage", [lambda content: b"", lambda content: b"some words\n" * 50, lambda content: None])
def test_a_lost_file_of_several_hides_no_other(tmp_path, damage):
    report, saved = split(tmp_path, damage)
    assert saved == [*range(40), *range(80, 120)]
    assert [(gap.start_ns, gap.end_ns) for gap in report.gaps] == [(START + 39 * STEP, START + 80 * STEP)]
    assert any("b_1.mcap" in remark for remark in report.remarks)


def test_a_chunk_that_is_cut_is_taken_once(tmp_path):
    report, saved = split(tmp_path, lambda content: content[:len(content) // 2])
    assert saved == sorted(set(saved)) and 80 < len(saved) < 120
    assert [(gap.start_ns, gap.end_ns) for gap in report.gaps] == [(START + (len(saved) - 41) * STEP, START + 80 * STEP)]


def test_declarations_of_a_summary_without_checksum(tmp_path):
    first, second = (b"".join(message(1, i, int32(i)) for i in part) for part in (range(20), range(20, 40)))
    head = chunk(record(INT32) + record(COUNT) + first, "zstd", crc=False)
    content = bytearray(file(head + chunk(second, "zstd", crc=False), record(INT32) + record(COUNT)))
    content[60:160] = bytes(100)
    (tmp_path / "x.mcap").write_bytes(content)
    recover(tmp_path / "x.mcap", tmp_path / "saved")
    assert read_bag(tmp_path / "saved")["/count"]["data"].tolist() == list(range(20, 40))


def test_impossible_times_are_left_out(tmp_path):
    body = record(INT32) + record(COUNT) + message(1, 0, int32(0)) + message(1, 1, int32(1), time=(1 << 64) - 1)
    (tmp_path / "x.mcap").write_bytes(file(chunk(body)))
    report = recover(tmp_path / "x.mcap", tmp_path / "saved")
    assert read_bag(tmp_path / "saved")["/count"]["data"].tolist() == [0]
    assert "1 messages of an impossible time are left out" in report.remarks
