"""Faults that are injected while a graph runs: the report of faults takes them, every node learns of them before they
begin.

A scenario with ``live_faults: N`` keeps places ``live_1`` to ``live_N`` for them. The node ``faults`` has the parameters
``inject`` (a fault as in a scenario's block, without id and times), ``clear`` (an id) and ``injected`` (what there is, as
JSON), so that every tool that sets parameters can inject. An injection begins at a time that no node has come to yet, so
it is an ordinary fault of the run: the recorder writes it into the bag, and the bag can be run again from itself.

``/faults/injected`` and ``/faults/taken`` carry std_msgs/String: a fault as JSON, and ``node count`` of one that has been
taken.
"""

import json
import threading
import time

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter

from flight_graph import yaml_text
from flight_graph.errors import FlightError
from flight_graph.faults.fault_set import FaultSet
from flight_graph.faults.injections import Injections
from flight_graph.faults.report import REPORT
from flight_graph.ros.ports import LoopOnly, RawPublisher, RawSubscription
from flight_graph.ros.texts import TYPE, text_of, text_payload
from flight_graph.timebase import SECOND
from msg_schemas.qos import Qos

INJECT, CLEAR, INJECTED = "inject", "clear", "injected"  # parameters
TOPIC, _TAKEN = f"{REPORT}/injected", f"{REPORT}/taken"
QOS = Qos(depth=1000, transient_local=True)
LEAD_WINDOWS = 3  # [1] of flow control, from an injection to its begin in lockstep
LEAD_NS = SECOND // 4  # in realtime
_GRID_NS = 1_000_000  # begins are whole milliseconds


class LiveFaults:
    """A node's part in it: it takes what has been injected between two firings."""

    def __init__(self, node, scenario):
        self._node, self._scenario, self._count = node, scenario, 0
        self.entries = {}  # id -> entry as data
        group = LoopOnly()
        self._news = RawSubscription(node, TOPIC, TYPE, QOS, group)
        self._taken = RawPublisher(node, _TAKEN, TYPE, QOS)
        self.host = Host(node, scenario, self) if node.graph_name == REPORT else None

    def with_entry(self, data: dict) -> FaultSet:
        """The faults of the graph with one more. Raises FlightError."""
        try:
            return self._scenario.with_faults([*(one for one in self.entries.values() if one["id"] != data["id"]), data])
        except FlightError as error:
            raise FlightError(str(error).replace(f"{self._scenario.origin}: faults.{data['id']}", INJECT, 1)) from None

    def check(self, t_ns: int) -> None:
        """Take what has come, before the firing at t."""
        while (message := self._news.take()) is not None:
            data = json.loads(text_of(message))
            found = self.with_entry(data)
            self.entries[data["id"]] = data
            self._node.take_faults(found)
            self._count += 1
            self._taken.publish(text_payload(f"{self._node.graph_name} {self._count}"))
        if self.host:
            self.host.hold(t_ns)


class Host:
    """The part of the node ``faults``: parameters in, injections out, and waiting until all have them."""

    def __init__(self, node, scenario, live):
        self._node, self._scenario, self._live = node, scenario, live
        self._lock, self._sent, self._begins, self._said = threading.Lock(), 0, [], {}
        self._injections = Injections(scenario.live_ids, INJECT)
        self._publisher = RawPublisher(node, TOPIC, TYPE, QOS)
        self._acks = RawSubscription(node, _TAKEN, TYPE, QOS, LoopOnly())
        self._nodes = set(scenario.graph.nodes)
        for name in (INJECT, CLEAR):
            node.declare_parameter(name, "")
        node.declare_parameter(INJECTED, "[]")
        node.free_parameters |= {INJECT, CLEAR, INJECTED}
        self._listed = self._told = "[]"
        self.now_ns = 0
        node.add_on_set_parameters_callback(self._on_set)

    def _on_set(self, parameters):
        try:
            for parameter in parameters:
                if parameter.name == INJECT and parameter.value:
                    return SetParametersResult(successful=True, reason=self._inject(parameter.value))
                if parameter.name == CLEAR and parameter.value:
                    return SetParametersResult(successful=True, reason=self._clear(parameter.value))
        except FlightError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _inject(self, text) -> str:
        data = yaml_text.parse(text, INJECT)
        self._injections.check(data)
        with self._lock:
            return self._send(*self._injections.begun(data, self._begin() / SECOND))

    def _clear(self, name) -> str:
        with self._lock:
            return self._send(*self._injections.ended(name, self._begin() / SECOND, CLEAR))

    def _begin(self) -> int:
        settings = self._node.settings
        lead = LEAD_WINDOWS * settings.window_ns if settings.lockstep else LEAD_NS
        begin = -(-(self.now_ns + lead) // _GRID_NS) * _GRID_NS
        if settings.duration_ns and begin >= settings.duration_ns:
            raise FlightError(f"the run ends at t = {settings.duration_ns / SECOND:.9g} s, before a change could begin")
        return begin

    def _send(self, data, sentence) -> str:
        self._live.with_entry(data)
        self._injections.entries[data["id"]] = data
        self._begins.append(round(data.get("until_s", data["from_s"]) * SECOND))
        self._sent += 1
        self._listed = json.dumps(list(self._injections.entries.values()))
        self._publisher.publish(text_payload(json.dumps(data)))
        self._node.get_logger().info(sentence)
        return sentence

    def hold(self, t_ns: int) -> None:
        """Before the firing at t: wait until every node has taken what begins soon. Raises FlightError."""
        self.now_ns = t_ns
        if self._told != self._listed:
            self._told = self._listed
            self._node.set_parameters([Parameter(INJECTED, value=self._told)])
        deadline = time.monotonic() + self._node.settings.timeout_s
        while True:
            while (message := self._acks.take()) is not None:
                name, _, count = text_of(message).partition(" ")
                self._said[name] = max(int(count), self._said.get(name, 0))
            with self._lock:
                late = [name for name in self._nodes if self._said.get(name, 0) < self._sent] if self._begins else []
                if not late:
                    self._begins.clear()
                soon = min(self._begins, default=None)
            if soon is None or not self._node.settings.lockstep or t_ns + 2 * self._node.settings.window_ns < soon:
                return
            self._node.check_alive()
            if self._node.graph_name in late:
                return  # its own is taken at the next look
            if time.monotonic() > deadline:
                raise FlightError(f"{self._node.graph_name}: waited for {', '.join(sorted(late))} to take an injected "
                                  "fault")
            self._acks.wait(SECOND)
