"""The bag of ROS nodes in lockstep is the bag of the compiled loop, byte for byte; and other programs can read it."""

from collections import defaultdict

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from flight_graph.ros.patience import at_least
from tests.graph import toy

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("lockstep")]

ASTEROID = ("cubli_asteroid",)
EARTH = ("cubli_earth", "--duration", "2")
ROS = ("--engine", "ros")


def messages(bag) -> dict:
    """Topic -> [(log time, publish time, bytes)] in the order of the file, by the mcap package."""
    found = defaultdict(list)
    with next(bag.glob("*.mcap")).open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            found[channel.topic].append((message.log_time, message.publish_time, message.data))
    return found


def order(bag) -> list:
    """(stamp, topic) of every message in the order of the file."""
    with next(bag.glob("*.mcap")).open("rb") as file:
        return [(message.log_time, channel.topic)
                for _, channel, message in make_reader(file).iter_messages(log_time_order=False)]


def assert_equal(one, other):
    a, b = messages(one), messages(other)
    assert sorted(a) == sorted(b)
    for topic in a:
        assert len(a[topic]) == len(b[topic]), topic
        first = next((i for i, (x, y) in enumerate(zip(a[topic], b[topic])) if x != y), None)
        assert first is None, f"{topic}: message {first} of {len(a[topic])} differs"


LATCHED = {"/tf_static": 1, "/robot_description": 1, "/scene": 1}
COUNTS = {  # 60 s: rate of each topic [Hz]
    "/cubli/truth": 100, "/cubli/truth/attitude": 100, "/cubli/truth/pose": 10, "/tf": 10, "/cubli/wheel_state": 100,
    "/cubli/truth/frames": 10, "/joint_states": 10,
    "/cubli/imu": 100, "/cubli/star_tracker": 4, "/cubli/attitude": 100, "/cubli/attitude_filter": 100,
    "/cubli/wheel_command": 100, "/cubli/funnel": 100, "/cubli/jump_margins": 100, "/cubli/jump_status": 10,
    "/diagnostics": 10,
}


def test_asteroid_60_s_all_topics(runs):
    _, compiled = runs("asteroid_compiled", *ASTEROID)
    made, ros = runs("asteroid_ros", *ASTEROID, *ROS)
    assert made["lost"] == 0 and made["engine"] == "ros" and made["pace"] == "lockstep"
    assert_equal(compiled, ros)
    assert {topic: len(found) for topic, found in messages(ros).items()} == {
        **LATCHED, **{topic: 60 * rate for topic, rate in COUNTS.items()}}


def test_messages_of_all_topics_have_one_order(runs):
    _, compiled = runs("asteroid_compiled", *ASTEROID)
    _, ros = runs("asteroid_ros", *ASTEROID, *ROS)
    assert order(compiled) == order(ros)


def test_metrics_of_both_engines_are_the_same_numbers(runs):
    assert (runs("asteroid_compiled", *ASTEROID)[0]["metrics"]
            == runs("asteroid_ros", *ASTEROID, *ROS)[0]["metrics"])


def test_earth_2_s(runs):
    _, compiled = runs("earth_compiled", *EARTH)
    _, ros = runs("earth_ros", *EARTH, *ROS)
    assert_equal(compiled, ros)
    assert len(messages(ros)["/cubli/wheel_command"]) == 2000


def test_two_ros_runs_are_equal(runs):
    _, one = runs("earth_ros", *EARTH, *ROS)
    _, other = runs("earth_ros_again", *EARTH, *ROS)
    assert_equal(one, other)


def test_multi_rate_delays_and_slow_outputs(runs):
    """The toy graph: rates 200, 100, 50 and 10 Hz, a delayed edge, counters that depend on which stamp is fresh."""
    path = runs.folder / "toy.yaml"
    path.write_text(yaml.safe_dump(toy.scenario()))
    _, compiled = runs("toy_compiled", path, "--trust")
    _, ros = runs("toy_ros", path, "--trust", *ROS)
    assert_equal(compiled, ros)
    assert {topic: len(found) for topic, found in messages(ros).items()} == {
        "/toy/truth": 400, "/toy/imu": 400, "/toy/command": 200, "/toy/watch": 20}


def test_rates_that_do_not_divide_each_other(runs):
    """Plant 80, sensor 100, controller 64, watcher 50 Hz, one more delayed edge: who reads which message is still the same."""
    data = toy.scenario(name="odd")
    for name, rate in {"plant": 80, "sensor": 100, "controller": 64, "watcher": 50}.items():
        data["components"][name]["rate_hz"] = rate
    data["connect"]["controller.imu"] = {"from": "sensor.imu", "delay": 1}
    path = runs.folder / "odd.yaml"
    path.write_text(yaml.safe_dump(data))
    assert_equal(runs("odd_compiled", path, "--trust")[1], runs("odd_ros", path, "--trust", *ROS)[1])


@pytest.mark.parametrize("engine", ["compiled", "ros"])
def test_bag_opens_in_rosbags(runs, engine):
    _, bag = runs(f"asteroid_{engine}", *ASTEROID, *(ROS if engine == "ros" else ()))
    with AnyReader([bag]) as reader:
        assert {connection.topic: connection.msgcount for connection in reader.connections} == {
            **LATCHED, **{topic: 60 * rate for topic, rate in COUNTS.items()}}
        stamps = defaultdict(list)
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/cubli/attitude":
                assert message.header.frame_id == "cubli_base"
                norm = np.linalg.norm([getattr(message.orientation, axis) for axis in "xyzw"])
                assert abs(norm - 1.0) < 1e-12
                assert stamp == message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            stamps[connection.topic].append(stamp)
    for topic, rate in COUNTS.items():
        assert np.unique(np.diff(stamps[topic])).tolist() == [10**9 // rate], topic
    assert min(map(min, stamps.values())) == 946_728_000 * 10**9  # J2000


def test_bag_opens_in_mcap_ros2_support(runs):
    _, bag = runs("asteroid_ros", *ASTEROID, *ROS)
    with next(bag.glob("*.mcap")).open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        count = 0
        for schema, channel, _, decoded in reader.iter_decoded_messages(topics=["/cubli/funnel", "/diagnostics", "/tf"]):
            assert schema.encoding == "ros2msg" and channel.message_encoding == "cdr"
            if channel.topic == "/cubli/funnel":
                assert list(decoded.name)[:2] == ["attitude_error[0]", "attitude_error[1]"]
                assert len(decoded.position) == len(decoded.name)
            elif channel.topic == "/tf":
                assert decoded.transforms[0].child_frame_id == "cubli_base"
            else:
                assert decoded.status[0].name == "jump_monitor"
            count += 1
    assert count == 6000 + 600 + 600


def test_metadata_is_version_9(runs):
    _, bag = runs("asteroid_ros", *ASTEROID, *ROS)
    described = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert described["version"] == 9 and described["storage_identifier"] == "mcap"
    assert described["message_count"] == 60 * sum(COUNTS.values()) + len(LATCHED)
    topics = {entry["topic_metadata"]["name"]: entry for entry in described["topics_with_message_count"]}
    assert topics["/cubli/imu"]["topic_metadata"]["type"] == "sensor_msgs/msg/Imu"
    assert topics["/cubli/imu"]["topic_metadata"]["type_description_hash"].startswith("RIHS01_")
    assert topics["/cubli/imu"]["message_count"] == 6000


def test_lockstep_of_60_s_is_quick_enough_for_ci(runs):
    """12 kHz of messages between seven processes; measured at 9 s on two busy cores."""
    assert runs("asteroid_ros", *ASTEROID, *ROS)[0]["wall_s"] < at_least(120.0)
