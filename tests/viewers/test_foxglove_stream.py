"""`flight serve` as a client of its protocol sees it: schemas and values are those of the bag, latched ones come again."""

import threading
from contextlib import contextmanager

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from flight_graph.bags.reader import read_bag
from flight_graph.graphs.scenario import load
from flight_graph.runs import simulate
from flight_graph.viewers.bag_source import BagSource
from flight_graph.viewers.flying import FlyingSource
from flight_graph.viewers.foxglove_stream import CLEAR, INJECT, SPEED, FoxgloveStream
from tests.viewers.client import Viewer

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed: make develop brings it")
BAG = "bags/cubli_asteroid"


@contextmanager
def served(source, speed):
    """A viewer that is connected to a source, and the sentences that a person at the server sees."""
    said, stop = [], threading.Event()
    stream = FoxgloveStream(source, "127.0.0.1", 0, speed, said.append)

    def run():
        stream.wait_for_viewer(stop)
        stream.run(stop)

    thread = threading.Thread(target=run)
    thread.start()
    viewer = Viewer(stream.port)
    try:
        viewer.until(lambda: len(viewer.channels) >= len(source.streams) + len(source.typed), "all channels")
        yield viewer, said
    finally:
        stop.set()
        thread.join()
        viewer.close()
        stream.close()


def reader(channel):
    """A message's reader that knows nothing but what the server says of the channel."""
    store = get_typestore(Stores.EMPTY)
    text, _, rest = channel["schema"].partition("=" * 80)
    types = dict(get_types_from_msg(text, channel["schemaName"]))
    for part in rest.split("=" * 80):
        head, _, body = part.strip().partition("\n")
        name = head.removeprefix("MSG: ").strip()
        types |= get_types_from_msg(body, name if "/msg/" in name else name.replace("/", "/msg/"))
    store.register(types)
    return lambda payload: store.deserialize_cdr(payload, channel["schemaName"])


def test_a_bag_comes_whole_and_every_named_number_has_its_name_and_value():
    bag = read_bag(BAG)
    source = BagSource(bag)
    with served(source, 50.0) as (viewer, _):
        viewer.subscribe()
        last = [one.own_topic for one in source.typed if one.topic == "/cubli/funnel"]
        viewer.until(lambda: all(len(viewer.messages.get(topic, ())) == info.count for topic, info in bag.topics.items())
                     and all(len(viewer.messages.get(topic, ())) == 50 for topic in last), "every message of the bag")
    for topic, info in bag.topics.items():
        assert viewer.channels[topic]["schemaName"] == info.type_name
        assert viewer.channels[topic]["schema"] == info.definition
        times, payloads = zip(*viewer.messages[topic])
        assert list(times) == bag.stamps_ns(topic).tolist()
        assert list(payloads) == [bytes(payload) for payload in bag.payloads(topic)]
    names = bag.constants("/cubli/funnel")["name"]
    for quantity, count in (("attitude_xi", 3), ("torque_demand", 3), ("outside", 1)):
        channel = viewer.channels[f"/cubli/funnel/{quantity}"]
        assert channel["schemaEncoding"] == "ros2msg" and channel["encoding"] == "cdr"
        read = reader(channel)
        found = np.array([np.atleast_1d(read(payload).value) for _, payload in viewer.messages[channel["topic"]]])
        columns = [k for k, name in enumerate(names) if name == quantity or name.startswith(f"{quantity}[")]
        assert found.shape == (50, count)
        np.testing.assert_array_equal(found, bag["/cubli/funnel"]["position"][:, columns])
    wheels = viewer.channels["/cubli/wheel_command/effort"]
    message = reader(wheels)(viewer.messages["/cubli/wheel_command/effort"][7][1])
    assert [message.wheel_x, message.wheel_y, message.wheel_z] == bag["/cubli/wheel_command"]["effort"][7].tolist()
    assert message.stamp.sec * 10**9 + message.stamp.nanosec == bag.stamps_ns("/cubli/wheel_command")[7]


def test_what_is_latched_comes_again_to_who_subscribes_late():
    bag = read_bag(BAG)
    with served(BagSource(bag), 50.0) as (viewer, _):
        viewer.subscribe(["/cubli/imu"])
        viewer.until(lambda: len(viewer.messages.get("/cubli/imu", ())) == 50, "the end of the bag")
        viewer.subscribe(["/robot_description"])
        viewer.until(lambda: "/robot_description" in viewer.messages, "the model, though it was said at the start")
    assert viewer.messages["/robot_description"][-1][1] == bytes(bag.payloads("/robot_description")[0])


def test_a_run_that_flies_takes_parameters_and_faults_from_the_viewer_and_verifies(tmp_path):
    from flight_graph.runs import verify
    scenario = load("cubli_asteroid", {"duration_s": 2, "live_faults": 2})
    source = FlyingSource(scenario)
    with served(source, 0.0) as (viewer, said):
        viewer.subscribe(["/cubli/funnel/attitude_xi"])
        viewer.ask(op="getParameters", parameterNames=[], id="1")
        viewer.until(lambda: "controller.lambda_a" in viewer.parameters, "the parameters")
        assert viewer.parameters["controller.lambda_a"] == [0.041] * 3 and viewer.parameters[SPEED] == 0

        def set_(name, value, answer):
            viewer.ask(op="setParameters", parameters=[{"name": name, "value": value}], id="2")
            viewer.until(lambda: any(answer in one for one in (*said, *viewer.statuses)), answer)

        set_("controller.lambda_a", [0.03, 0.03, 0.03], "controller.lambda_a = [0.03")
        set_("controller.lambda_a", [-1, 0, 0], "greater than 0")
        set_("controller.lambda_b", 1, "no parameter called 'controller.lambda_b'")
        set_(INJECT, '{"at": "imu.imu.angular_velocity[2]", "type": "bias", "value": 0.001}', "live_1 begins")
        set_(INJECT, '{"at": "imu", "type": "explode"}', "explode")
        set_(SPEED, 10.0, "")
        viewer.until(lambda: source.is_over, "the end of the run")
        set_(CLEAR, "live_1", "the run is over")
    source.write(tmp_path / "flown", "compiled")
    found = verify(tmp_path / "flown")
    assert found.applied == "bytes" and found.holds, found.sentences
    same = simulate(load("cubli_asteroid", {"duration_s": 2, "live_faults": 2}))
    assert not np.array_equal(source.recording()["cubli/funnel"], same["cubli/funnel"])  # both did something
