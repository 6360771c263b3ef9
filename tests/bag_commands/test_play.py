"""flight play as ros2 bag play: profiles, latched messages, /clock between messages, gaps, names, keys."""

import os
import pty
import struct
import subprocess
import time

import pytest
from mcap import records

from flight_graph.errors import FlightError
from flight_graph.replays.play import Schedule
from tests.bag.foreign_files import INT32, START, file, int32, message, record

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

from tests.bag_commands.test_bags_over_ros import COMMAND, ROOT, Listener, command  # noqa: E402

TEXT = records.Schema(2, b"string data\n", "ros2msg", "std_msgs/msg/String")


def profile(reliability="reliable", durability="volatile", depth=10):
    return f"- history: keep_last\n  depth: {depth}\n  reliability: {reliability}\n  durability: {durability}\n"


def bag_of(tmp_path, *channels, messages):
    """channels: (topic, schema, profiles); messages: (channel number from 1, time [s], payload)."""
    data = record(INT32) + record(TEXT)
    for number, (topic, schema, profiles) in enumerate(channels, 1):
        data += record(records.Channel(number, topic, "cdr", {"offered_qos_profiles": profiles}, schema))
    for channel, seconds, payload in messages:
        data += message(channel, 0, payload, START + round(seconds * 1e9) if seconds is not None else 0)
    path = tmp_path / "bag.mcap"
    path.write_bytes(file(data))
    return path


def text(words):
    raw = words.encode() + b"\0"
    return b"\0\1\0\0" + struct.pack("<I", len(raw)) + raw


def played(path, topics, *arguments):
    """What a listener hears of a playback, and what the command says."""
    listener = Listener(topics)
    try:
        process = command("play", path, *arguments)
        while process.poll() is None:
            listener.listen()
        listener.listen()
        out, err = process.communicate()
        assert process.returncode == 0, err
        return {name: [raw for _, raw in heard] for name, heard in listener.heard.items()}, out + " ".join(err.split())
    finally:
        listener.close()


def test_profiles_are_merged(tmp_path):
    """Best effort and reliable publishers on one topic: every reader gets the messages."""
    mixed = profile("best_effort") + profile("reliable")
    path = bag_of(tmp_path, ("/count", 1, mixed), ("/slow", 1, profile("best_effort")),
                  ("/map", 1, profile(durability="transient_local", depth=1) * 2),
                  ("/half", 1, profile(durability="transient_local") + profile()), ("/numbers", 1, profile(1, 1)),
                  ("/none", 1, ""), ("/odd", 1, "{}"), messages=[(i, 0.0, int32(i)) for i in range(1, 8)])
    found = {name: (qos.reliable, qos.transient_local) for name, qos in Schedule.of(path).profiles.items()}
    assert found == {"/count": (True, False), "/slow": (False, False), "/map": (True, True), "/half": (True, False),
                     "/numbers": (True, True), "/none": (True, False), "/odd": (True, False)}
    assert Schedule.of(path).profiles["/map"].depth == 2  # one message of each of its two publishers
    heard, _ = played(path, {"/count": "std_msgs/msg/Int32"}, "--topics", "count")
    assert [raw[:8] for raw in heard["/count"]] == [int32(1)]


def test_latched_messages_from_before_the_start(tmp_path):
    path = bag_of(tmp_path, ("/description", 2, profile(durability="transient_local", depth=1)), ("/count", 1, profile()),
                  messages=[(1, 0.0, text("old")), (1, 0.1, text("new")),
                            *((2, 0.1 * i, int32(i)) for i in range(12))])
    schedule = Schedule.of(path, start_s=1.0)
    assert [payload for _, _, payload in schedule.latched()] == [text("new")]
    heard, out = played(path, {"/description": "std_msgs/msg/String", "/count": "std_msgs/msg/Int32"}, "--start", 1)
    assert [raw[:len(text("new"))] for raw in heard["/description"]] == [text("new")]
    assert [raw[:8] for raw in heard["/count"]] == [int32(10), int32(11)] and "3 messages on 2 topics" in out


def test_the_clock_goes_on_between_messages(tmp_path):
    path = bag_of(tmp_path, ("/count", 1, profile()), messages=[(1, 0.0, int32(0)), (1, 1.5, int32(1))])
    heard, _ = played(path, {"/clock": "rosgraph_msgs/msg/Clock"}, "--clock", 20)
    stamps = [sec + 1e-9 * nanosec for sec, nanosec in (struct.unpack_from("<iI", raw, 4) for raw in heard["/clock"])]
    assert len(stamps) >= 10 and stamps == sorted(stamps)  # 30, on a machine that has nothing else to do
    assert stamps[0] == pytest.approx(START / 1e9, abs=0.2) and stamps[-1] == pytest.approx(START / 1e9 + 1.5)


def test_gaps_are_told_and_passed_over(tmp_path):
    """One message of time zero, the others fifty years later."""
    path = bag_of(tmp_path, ("/count", 1, profile()), messages=[(1, None, int32(0)), (1, 0.0, int32(1)), (1, 0.1, int32(2))])
    gap, = Schedule.of(path).gaps()
    assert (gap.stamp_ns, gap.seconds, gap.passed_over) == (0, START / 1e9, True)
    assert not Schedule.of(path, longest_gap_s=float("inf")).gaps()[0].passed_over
    heard, out = played(path, {"/count": "std_msgs/msg/Int32"})
    assert [raw[:8] for raw in heard["/count"]] == [int32(0), int32(1), int32(2)]
    assert "nothing was recorded for 1.7e+09 s from 0 s on: this is passed over" in out


def test_names_and_profiles_of_ones_own(tmp_path):
    path = bag_of(tmp_path, ("plain", 1, profile()), ("/b-2", 1, ""), messages=[(1, 0.0, int32(1)), (2, 0.0, int32(2))])
    with pytest.raises(FlightError, match="'/b-2' cannot be published"):
        Schedule.of(path, topics=["b-2"])
    assert (Schedule.of(path).topics, Schedule.of(path).unnamed) == (["plain"], ["/b-2"])
    with pytest.raises(FlightError, match="'/b-2' cannot be published as '/b 2'"):
        Schedule.of(path, remap=["/b-2:=b 2"])
    schedule = Schedule.of(path, remap=["/b-2:=other/b"], topics=["/plain", "b-2"])
    assert schedule.names == {"plain": "/plain", "/b-2": "/other/b"}
    heard, _ = played(path, {"/plain": "std_msgs/msg/Int32"}, "--topics", "plain")
    assert [raw[:8] for raw in heard["/plain"]] == [int32(1)]
    for remap, sentence in ((["/b-2:=plain"], "two topics would be published as /plain"), (["x"], "allowed: old:=new"),
                            (["/b-3:=c"], "did you mean '/b-2'")):
        with pytest.raises(FlightError, match=sentence):
            Schedule.of(path, remap=remap)
    overrides = tmp_path / "qos.yaml"
    overrides.write_text("/plain: {reliability: best_effort, durability: transient_local, depth: 3}")
    found = Schedule.of(path, topics=["plain"], overrides=overrides).profiles["plain"]
    assert (found.reliable, found.transient_local, found.depth) == (False, True, 3)
    for content, sentence in (("/plain: {reliable: true}", "no setting called 'reliable'"), ("[1]", "needed is topic"),
                              ("/plain: {reliability: sure}", "allowed: reliable or best_effort"), ("{", "this is no YAML"),
                              ("/plain: {depth: 0}", "a whole number from 1"), ("/none: {}", "no topic called")):
        overrides.write_text(content)
        with pytest.raises(FlightError, match=sentence):
            Schedule.of(path, topics=["plain"], overrides=overrides)


def test_keys_of_a_terminal(tmp_path):
    """Space pauses, s plays one message, space resumes: in a real pseudo-terminal."""
    path = bag_of(tmp_path, ("/count", 1, profile()), messages=[(1, 0.3 * i, int32(i)) for i in range(20)])
    listener = Listener({"/count": "std_msgs/msg/Int32"})
    screen, keys = pty.openpty()
    process = subprocess.Popen([*COMMAND, "play", str(path)], stdin=keys, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True)

    def heard_until(count, seconds=30.0):
        deadline = time.monotonic() + seconds
        while len(listener.heard["/count"]) < count and time.monotonic() < deadline:
            listener.listen()
        return len(listener.heard["/count"])

    try:
        assert heard_until(2) >= 2, "no messages came"
        os.write(screen, b" ")
        before = heard_until(99, 1.0)
        assert heard_until(99, 1.5) == before, "a paused playback went on"
        os.write(screen, b"s")
        assert heard_until(before + 1) == before + 1
        assert heard_until(99, 1.0) == before + 1
        os.write(screen, b" ")
        assert heard_until(20) == 20
        out, err = process.communicate(timeout=30)
        assert process.returncode == 0 and "paused at" in err and "resumed at" in err, err
    finally:
        process.kill()
        listener.close()
        os.close(screen)
        os.close(keys)
