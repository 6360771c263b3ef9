"""The running ROS graph as a source for viewers: every topic that there is, and the parameters of its nodes.

Topics and nodes that come later are taken up within a second, those of a run that is known from their first message on.
Messages count as of their header's stamp, those without one as of the newest stamp that has come.
"""

import struct
import threading
import time
from contextlib import contextmanager
from dataclasses import replace

from flight_graph.bags.errors import BagError
from flight_graph.bags.message_types import standard_definition
from flight_graph.errors import FlightError
from flight_graph.recordings.recording import column_units, recorded_topics
from flight_graph.ros.environment import prepare_environment
from flight_graph.ros.installed import is_installed
from flight_graph.timebase import SECOND
from flight_graph.viewers import live
from flight_graph.viewers.messages import LATCHED, Message, Stream
from flight_graph.viewers.opening import series_of
from flight_graph.viewers.source import Source
from msg_schemas.qos import Qos

prepare_environment()

import rclpy  # noqa: E402 (reads the environment)
from rclpy.context import Context  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.parameter_client import AsyncParameterClient  # noqa: E402
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy  # noqa: E402

from flight_graph.ros import slots  # noqa: E402
from flight_graph.ros.ports import LoopOnly, RawSubscription  # noqa: E402
from flight_graph.ros.unsaid import Unsaid  # noqa: E402

NAME = "flight_viewer"
LOOK_S = 1.0  # [s] between two looks for new topics and nodes
DEPTH = 1000
_OWN = ("graph.", "qos_overrides.")  # parameters that are no person's matter
_ON_THE_WALL = ("/rosout", "/parameter_events")  # stamped by the wall clock, whatever the time of the graph
_HEADER = "std_msgs/msg/Header"
_TRANSFORMS = "tf2_msgs/msg/TFMessage"


class RosSource(Source):
    """What is said on a domain. scenario: of the run whose nodes are heard, where it is known. notes: sentences of what
    cannot be shown, each once."""

    name = "the running graph"

    def __init__(self, domain: int | None = None, scenario=None):
        self.streams, self.typed, self.units, self.notes = [], [], {}, []
        self.now_ns = self.begin_ns = 0
        self._context = Context()
        rclpy.init(context=self._context, args=[NAME], domain_id=domain)
        self._node = Node(NAME, context=self._context, start_parameter_services=False, enable_rosout=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._group, self._subscriptions, self._refused, self._looked_s = LoopOnly(), {}, set(), -LOOK_S
        self._clients, self._values, self._wanted, self._offsets = {}, {}, [], {}
        self._unsaid = None
        if scenario is not None:
            self._expect(scenario)

    def take(self, until_ns: int) -> list[Message]:
        """All that has come since the last call, whatever the time."""
        if self._unsaid is None and time.monotonic() - self._looked_s >= LOOK_S:
            self._looked_s = time.monotonic()
            self._look()
        self._executor.spin_once(timeout_sec=0.0)
        self._ask()
        found = []
        for number, subscription in self._subscriptions.items():
            while (payload := subscription.take()) is not None:
                found.append((number, payload))
        stamps = [self._stamp(number, payload) for number, payload in found]
        self.now_ns = max([self.now_ns, *(stamp for stamp in stamps if stamp is not None)])
        rows = [Message(number, self.now_ns if stamp is None else stamp, payload)
                for (number, payload), stamp in zip(found, stamps)]
        if self._unsaid:
            rows += [one for row in rows for one in self._unsaid.messages(
                self.streams[row.number].topic, row.stamp_ns, row.payload)]
        return sorted(rows, key=lambda message: message.stamp_ns)

    def _stamp(self, number, payload) -> int | None:
        offset = self._offsets[number]
        if offset is None or len(payload) < offset + 8:
            return None
        sec, nanosec = struct.unpack_from("<iI", payload, offset)
        return sec * SECOND + nanosec

    def _expect(self, scenario):
        """Hear the topics of a run from its first message on: before they are there."""
        topics = recorded_topics(scenario)
        self.now_ns = self.begin_ns = scenario.epoch_ns
        self.units = column_units(topics)
        for topic in topics:
            if f"/{topic.topic}" not in self._known() and is_installed(topic.type_name):
                self._hear(f"/{topic.topic}", topic.type_name, replace(topic.role.qos, depth=DEPTH))
        self._unsaid = Unsaid(topics, scenario.epoch_ns, len(self.streams))
        self.streams += self._unsaid.streams

    # -- topics ----------------------------------------------------------------------------------------------------
    def _look(self):
        known = self._known()
        for topic, types in self._node.get_topic_names_and_types():
            if topic not in known and not any(part.startswith("_") for part in topic.split("/")) and (
                    types != [slots.TYPE] or not topic.endswith(slots.slots_topic(""))):  # what faults lose between nodes
                self._subscribe(topic, types)
        for name, namespace in self._node.get_node_names_and_namespaces():
            full = f"{namespace.rstrip('/')}/{name}"
            if full not in self._clients and name != NAME and not name.startswith("_"):
                self._clients[full] = AsyncParameterClient(self._node, full)
                self._list(full)

    def _known(self) -> set[str]:
        return {stream.topic for stream in self.streams} | self._refused

    def _subscribe(self, topic, types):
        offered = [info.qos_profile for info in self._node.get_publishers_info_by_topic(topic)]
        if not offered:
            return  # only readers so far
        self._hear(topic, types[0], Qos(DEPTH, all(one.reliability == ReliabilityPolicy.RELIABLE for one in offered),
                                        all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in offered)))

    def _hear(self, topic, type_name, qos):
        try:
            definition = standard_definition(type_name)
            subscription = RawSubscription(self._node, topic, type_name, qos, self._group)
        except (BagError, ImportError, AttributeError) as error:
            self._refused.add(topic)
            self.notes.append(f"not shown: {topic} ({type_name}): {error}")
            return
        self._subscriptions[len(self.streams)] = subscription
        self._offsets[len(self.streams)] = None if topic in _ON_THE_WALL else _stamp_offset(type_name)
        self.streams.append(Stream(topic, type_name, definition.text, latched=qos.transient_local or topic in LATCHED))

    # -- parameters ------------------------------------------------------------------------------------------------
    def _list(self, node):
        client = self._clients[node]
        if not client.services_are_ready():
            del self._clients[node]  # looked at again
            return
        client.list_parameters([], 0).add_done_callback(lambda future: self._listed(node, future))

    def _listed(self, node, future):
        names = [name for name in (future.result().result.names if future.result() else ()) if not name.startswith(_OWN)]
        if names:
            self._clients[node].get_parameters(names).add_done_callback(lambda answer: self._got(node, names, answer))

    def _got(self, node, names, future):
        for name, value in zip(names, future.result().values if future.result() else ()):
            found = rclpy.parameter.parameter_value_to_python(value)
            if found is not None and not isinstance(found, bytes):
                self._values[f"{node}.{name}"] = list(found) if not isinstance(found, (bool, int, float, str)) else found

    def parameters(self) -> dict[str, object]:
        """``/node.parameter`` -> value, of all nodes."""
        return dict(self._values)

    def set(self, key: str, value) -> None:
        """Ask a node to set a parameter; what it answers comes as a note. Raises FlightError."""
        if key not in self._values:
            raise FlightError(f"{key}: no node has such a parameter")
        before = self._values[key]
        if isinstance(before, float) and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        elif isinstance(before, list) and before and isinstance(before[0], float) and isinstance(value, list):
            value = [float(one) if isinstance(one, int) else one for one in value]
        self._wanted.append((key, value))

    def _ask(self):
        while self._wanted:
            key, value = self._wanted.pop(0)
            node, _, name = key.partition(".")
            self._clients[node].set_parameters([Parameter(name, value=value)]).add_done_callback(
                lambda future, key=key: self._answered(key, future))

    def _answered(self, key, future):
        node, _, name = key.partition(".")
        answer = future.result().results[0] if future.result() else None
        if answer is not None and (answer.reason or not answer.successful):
            self.notes.append(f"{key}: {answer.reason or 'refused'}")
        self._list(node)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)


@contextmanager
def shown(scenario, stream, domain: int):
    """While a run of nodes runs: its topics in Rerun, as they come."""
    source, stop = RosSource(domain, scenario), threading.Event()
    stream.begin(series_of(scenario, source.units))
    thread = threading.Thread(target=live.show, args=(source, stream, 1.0, stop))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
        source.close()
        stream.flush()


def _stamp_offset(type_name: str) -> int | None:
    """Where in a payload of little-endian CDR the stamp is, or None."""
    if type_name == _TRANSFORMS:
        return 8  # behind the number of transforms
    fields = standard_definition(type_name).fields
    _, node = fields[0] if fields else ("", (None, None))
    return 4 if node[1] in (_HEADER, "builtin_interfaces/msg/Time") else None
