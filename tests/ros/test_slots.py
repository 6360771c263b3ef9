"""Messages and their slots find each other again after either was lost, as when a process is killed between the two."""

from types import SimpleNamespace

import pytest
import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.serialization import deserialize_message, serialize_message

from flight_graph.ros.ports import LoopOnly, RawPublisher, RawSubscription
from flight_graph.ros.slots import TYPE, SlotReader, payload, slots_topic
from msg_schemas.qos import RECORDER
from tests.ros.processes import until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("strangers")]
DATA = "geometry_msgs/msg/PointStamped"


@pytest.fixture
def line():
    """One topic with its slots, both ends here: send(tick), send_slot(tick, count), reader(lossy)."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("slots", context=context, start_parameter_services=False)
    node.settings = SimpleNamespace(supervised=True)
    ends = [(topic, kind) for topic, kind in (("/point", DATA), (slots_topic("/point"), TYPE))]
    data, slots = (RawPublisher(node, topic, kind, RECORDER) for topic, kind in ends)
    group = LoopOnly()
    data_in, slots_in = (RawSubscription(node, topic, kind, RECORDER, group) for topic, kind in ends)
    until(lambda: data.subscribers() and slots.subscribers() and data_in.publishers() and slots_in.publishers(), 30.0,
          "both ends of both topics")

    def send(tick):
        message = PointStamped()
        message.point.x = float(tick)
        data.publish(serialize_message(message))

    def received(reader):
        """(stamp, ticks of the messages) of the next slot, once it is there."""
        stamp, messages = until(reader.next, 10.0, "a slot")
        return stamp, [deserialize_message(bytes(message), PointStamped).point.x for message in messages]

    yield SimpleNamespace(send=send, send_slot=lambda tick, count=1: slots.publish(payload(tick, count)), received=received,
                          reader=lambda lossy: SlotReader(data_in, slots_in, lossy))
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.mark.parametrize("lossy", [False, True])
def test_each_slot_has_its_messages(line, lossy):
    reader = line.reader(lossy)
    for tick, count in enumerate((1, 0, 2, 1)):
        for _ in range(count):
            line.send(tick)
        line.send_slot(tick, count)
    assert [line.received(reader) for _ in range(4)] == [(0, [0.0]), (1, []), (2, [2.0, 2.0]), (3, [3.0])]
    assert reader.next() is None


def test_a_lost_message_is_not_waited_for(line):
    reader = line.reader(lossy=True)
    line.send_slot(0)
    line.send(1)
    line.send_slot(1)
    assert [line.received(reader), line.received(reader)] == [(0, []), (1, [1.0])]


def test_messages_without_a_slot_shift_nothing(line):
    reader = line.reader(lossy=True)
    for tick in range(4):
        line.send(tick)
    line.send_slot(3)
    line.send(4)
    line.send_slot(4)
    assert [line.received(reader), line.received(reader)] == [(3, [3.0]), (4, [4.0])]
