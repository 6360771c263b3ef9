"""Bags and live ROS topics: playing, replaying through the real node, kill -9."""

import json
import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from flight_graph.bags.reader import read_bag
from flight_graph.errors import FlightError
from flight_graph.replays.play import Schedule

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

from benchmarks.kill_recovery import kill_once  # noqa: E402
from flight_graph.ros import shared_memory  # noqa: E402
from flight_graph.ros.environment import prepare_environment  # noqa: E402
from flight_graph.ros.patience import at_least  # noqa: E402

prepare_environment()

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-c", "import sys; from flight_graph.cli import main; sys.exit(main())"]
STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types


def command(*arguments, **options):
    return subprocess.Popen([*COMMAND, *map(str, arguments)], env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)


@pytest.fixture(scope="module", autouse=True)
def nothing_of_killed_nodes_stays():
    """What kill -9 leaves in shared memory is removed, as the next run of a scenario would do."""
    yield
    deadline = time.monotonic() + at_least(60.0)  # [s]
    while shared_memory.leftovers(0.0) and time.monotonic() < deadline:
        shared_memory.clean()
        time.sleep(0.1)


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    """A bag by rosbags' own writer: half a second, three topics at equal stamps, a type that the wheels do not have."""
    folder = tmp_path_factory.mktemp("foreign") / "bag"
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kinds = {"/a": "geometry_msgs/msg/Vector3", "/b": "std_msgs/msg/Int32", "/tf": "tf2_msgs/msg/TFMessage"}
        topics = {name: writer.add_connection(name, kind, typestore=STORE) for name, kind in kinds.items()}
        for i in range(50):
            for name, message in (("/b", T["std_msgs/msg/Int32"](2 * i)), ("/a", T[kinds["/a"]](float(i), 0.5, -1.0)),
                                  ("/b", T["std_msgs/msg/Int32"](2 * i + 1)), ("/tf", T[kinds["/tf"]]([]))):
                writer.write(topics[name], 10**18 + i * 10**7, bytes(STORE.serialize_cdr(message, kinds[name])))
    return folder


class Listener:
    """Takes the raw messages of some topics in this process."""

    def __init__(self, topics):
        import rclpy

        from flight_graph.ros.ports import LoopOnly, RawSubscription
        from msg_schemas.qos import RECORDER
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node("listener", context=self._context)
        self._subscriptions = {name: RawSubscription(self._node, name, kind, RECORDER, LoopOnly())
                               for name, kind in topics.items()}
        self.heard = {name: [] for name in topics}

    def listen(self):
        for name, subscription in self._subscriptions.items():
            while (message := subscription.take()) is not None:
                self.heard[name].append((time.monotonic(), message))
        time.sleep(0.002)

    def close(self):
        self._node.destroy_node()
        self._context.try_shutdown()


@pytest.fixture
def listener():
    made = Listener({"/a": "geometry_msgs/msg/Vector3", "/b": "std_msgs/msg/Int32",
                     "/clock": "rosgraph_msgs/msg/Clock"})
    yield made
    made.close()


def test_play_a_foreign_bag(foreign, listener, tmp_path):
    """Bytes, order, times (at half the rate) and /clock as a subscriber gets them; what cannot be played is said."""
    process = command("play", foreign, "--rate", 0.5)
    while process.poll() is None:
        listener.listen()
    listener.listen()
    out, err = process.communicate()
    assert process.returncode == 0 and "150 messages on 2 topics" in out
    assert "/tf is skipped: tf2_msgs/msg/TFMessage is not installed here" in " ".join(err.split())
    recorded = read_bag(foreign)
    for name in ("/a", "/b"):
        heard = [message[:len(payload)] for (_, message), payload in zip(listener.heard[name], recorded.payloads(name))]
        assert heard == [bytes(payload) for payload in recorded.payloads(name)]
    clock = [struct.unpack_from("<iI", message, 4) for _, message in listener.heard["/clock"]]
    clock = [sec * 10**9 + nanosec for sec, nanosec in clock]
    assert clock == sorted(clock) and set(recorded.stamps_ns("/a").tolist()) <= set(clock)
    took = listener.heard["/a"][-1][0] - listener.heard["/a"][0][0]
    assert took > 0.98 - 0.25  # [s] 0.49 s at half the rate; a machine that has other work may be late, never early


def test_play_in_a_loop_until_interrupted(foreign, listener):
    process = command("play", foreign, "--loop", "--start", 0.3, "--topics", "/b", "--rate", 4)
    deadline = time.monotonic() + at_least(60.0)
    while len(listener.heard["/b"]) < 100 and time.monotonic() < deadline:
        listener.listen()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 0 and "Traceback" not in err, err
    numbers = [struct.unpack_from("<i", message, 4)[0] for _, message in listener.heard["/b"]]
    assert numbers[:80] == [*range(60, 100)] * 2
    assert not listener.heard["/a"]


def test_a_playback_is_ordered(tmp_path):
    """Messages written out of order are played by log time; equal ones stay as they are in the file."""
    folder = tmp_path / "bag"
    order = [3, 1, 2, 1, 3, 2]
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/n", "std_msgs/msg/Int32", typestore=STORE)
        for i, stamp in enumerate(order):
            message = T["std_msgs/msg/Int32"](i)
            writer.write(topic, stamp * 10**9, bytes(STORE.serialize_cdr(message, "std_msgs/msg/Int32")))
    played = [(stamp // 10**9, payload[4]) for _, stamp, payload in Schedule.of(folder).messages()]
    assert played == [(1, 1), (1, 3), (2, 2), (2, 5), (3, 0), (3, 4)]
    late = Schedule.of(folder, rate=2.0, start_s=1.0)
    assert [stamp for _, stamp, _ in late.messages()] == [2 * 10**9] * 2 + [3 * 10**9] * 2
    for arguments in ({"rate": 0.0}, {"start_s": 3.0}, {"topics": ["/m"]}):
        with pytest.raises(FlightError):
            Schedule.of(folder, **arguments)


def test_replay_through_the_real_node(asteroid):
    """The estimator as a ROS node, fed by the replayer: 400 firings, byte for byte."""
    process = command("replay", asteroid, "--component", "estimator", "--engine", "ros", "--json")
    out, err = process.communicate(timeout=at_least(300.0))
    assert process.returncode == 0, err
    report = json.loads(out)
    assert (report["verdict"], report["applied"], report["messages"], report["firings"]) == ("equal", "bytes", 800, 400)


@pytest.mark.parametrize("victim, after_s", [("recorder", 0.73), ("graph", 1.38)])
def test_kill_9(tmp_path, victim, after_s):
    """At most 0.25 s of wall time are lost, and all earlier messages are what a second reader saw."""
    kill = kill_once(tmp_path, victim, after_s)
    assert kill.intact and kill.saved > 20
    assert kill.lost_s < 0.25
