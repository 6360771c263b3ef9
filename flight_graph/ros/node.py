"""One component as a ROS 2 lifecycle node: ports, parameters, start-up, and the two paces of its loop."""

import threading
import time

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

from flight_graph.engines.single import SingleComponent
from flight_graph.errors import FlightError, unknown
from flight_graph.recordings.recording import formatted_payload
from flight_graph.ros.checkpoints import CheckpointSettings, NodeMemory
from flight_graph.ros.live_faults import CLEAR, INJECT, LiveFaults
from flight_graph.ros.parameter_changes import ParameterChanges
from flight_graph.ros.parameters import ComponentParameters
from flight_graph.ros.ports import InputPort, LoopOnly, OutputPort, RawPublisher, is_importable
from flight_graph.ros.progress import Progress, Watch
from flight_graph.ros.recorder import read_scenario
from flight_graph.ros.settings import Source, declare
from flight_graph.ros.strangers import Strangers, misfits
from flight_graph.timebase import SECOND, stamp_parts
from msg_schemas.qos import Qos
from msg_schemas.signal import ENCAPSULATION

CLOCK = ("/clock", "rosgraph_msgs/msg/Clock", Qos(depth=100))
DISCOVERY_S = 1.0  # [s] nodes of one machine find each other in less
CLOCK_PERIOD_NS = 1_000_000  # [ns] /clock is published at most at 1 kHz


class Stopped(Exception):
    """The node was asked to end (SIGINT, SIGTERM or the shutdown transition)."""


class ComponentNode(LifecycleNode):
    """A component with its ports. ``announce(dict)`` tells the starter of the node what happens."""

    def __init__(self, name: str, use: str, component, announce):
        super().__init__(name, automatically_declare_parameters_from_overrides=False)
        self.component, self.announce = component, announce
        self.free_parameters = {"use_sim_time"}  # that are no parameters of the component and may be set all the same
        self.stopping = threading.Event()
        self.active = threading.Event()
        autostart = self.declare_parameter("autostart", True).value
        self.settings = declare(self, component)
        self.parameters = ComponentParameters(self, component)
        self.parameters.record["period"] = self.settings.period_ns / SECOND
        group = LoopOnly()
        self.faults = self.live = scenario = None
        if self.settings.scenario:
            scenario = read_scenario(self.settings.scenario)
            self.component = component = scenario.graph.nodes[self.get_name()].component  # with its texts
            self.faults, self._is_slotted = scenario.faults, scenario.faults.is_irregular
            if scenario.live_ids:
                self.free_parameters |= {INJECT, CLEAR}
                self.live = LiveFaults(self, scenario)
        try:
            self._make_ports(component, group)
        except (RuntimeError, ParameterException) as error:  # of parameters qos_overrides
            raise FlightError(f"{self.get_name()}: {error}") from None
        records = {port: self.inputs[port].record if port in self.inputs else signal.new()[1]
                   for port, signal in component.inputs.items()}
        watched = self._watch(group)
        self.formatted = [(made, RawPublisher(self, made.topic, made.type_name, made.role.qos))
                          for made in component.formatted if is_importable(made.type_name)]
        self.output_periods = {port: self.settings.output_period_ns(component, port) for port in self.outputs}
        self.progress = Progress(self, self.settings)
        self.watches = {other: Watch(self, other, group) for other in self.settings.wait_for}
        self.clock = RawPublisher(self, *CLOCK) if self.settings.clock_master else None
        Strangers(self, [port.subscription for port in self.inputs.values()],
                  [port.publisher for port in self.outputs.values()] + [publisher for _, publisher in self.formatted])
        self.state = component.initial_state(self.parameters.values)
        self.parameters.accept_changes()
        self.changes = ParameterChanges(self, scenario)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._arguments = (
            name, use, component, self.parameters.record, self.state,
            records, {port: entry.record for port, entry in self.outputs.items()}, self.output_periods,
            self.settings.epoch_ns, self.settings.check_bounds)
        self._watched = watched
        self._machine = SingleComponent(*self._arguments, self.faults, watched)
        self.memory = NodeMemory(self, CheckpointSettings(**self.settings.checkpoints), lambda: self._machine)
        self.memory.watch(self.outputs, component.output_rate_hz)
        self.memory.restore()
        self._thread.start()
        if autostart:
            self.trigger_configure()
            self.trigger_activate()

    def _make_ports(self, component, group):
        """Outputs first: who finds the inputs, and sends, will have found where the answers come from."""
        settings = self.settings
        self.outputs = {port: OutputPort(self, port, signal, signal.topic, settings.slotted[port])
                        for port, signal in component.outputs.items()}
        self.inputs = {port: self._input(port, signal, group)
                       for port, signal in component.inputs.items() if settings.sources[port].is_connected}

    def _input(self, port, signal, group):
        source = self.settings.sources[port]
        return InputPort(self, port, signal, source.topic, self.settings.epoch_ns, group, source.slotted)

    def _watch(self, group) -> dict:
        """The signals that conditions of faults of this node read, as inputs: (node, port) -> record."""
        records, self.watched = {}, []
        for name, port in self.faults.watched(self.get_name()) if self.faults else ():
            node, key = self.faults.nodes[name], f"when {name}.{port}"
            signal = node.component.outputs[port]
            self.settings.sources[key] = Source(signal.topic, node.output_period_ns(port), 1,
                                                slotted=self._is_slotted(name, port))
            self.inputs[key] = self._input(key, signal, group)
            records[name, port] = self.inputs[key].record
            self.watched.append(key)
        return records

    # -- lifecycle -----------------------------------------------------------------------------------------------
    def on_activate(self, state):
        self.active.set()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state):
        self.active.clear()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.stopping.set()
        return TransitionCallbackReturn.SUCCESS

    def _serve(self):
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass

    def introduce(self):
        """Say what this node does, where nobody else does."""
        if not self.settings.supervised:
            pace = "lockstep" if self.settings.lockstep else "realtime"
            reads = ", ".join(port.subscription.topic for port in self.inputs.values()) or "nothing"
            writes = ", ".join(port.publisher.topic for port in self.outputs.values()) or "nothing"
            self.get_logger().info(f"{SECOND / self.settings.period_ns:g} Hz, {pace}; reads {reads}; writes {writes}")
        for name in self._parameter_overrides:
            if not self.has_parameter(name) and not name.startswith("qos_overrides"):
                self.get_logger().warning(str(unknown("parameter", name, self.component.parameters.entries)))

    def close(self):
        """End the service thread and the node."""
        self._executor.shutdown(timeout_sec=1.0)
        self._thread.join(timeout=2.0)
        self.destroy_node()

    def check_alive(self):
        """Raise Stopped when the node is to end; wait while it is inactive."""
        while True:
            if self.stopping.is_set() or not rclpy.ok():
                raise Stopped
            self.progress.beat()
            if self.active.wait(0.05):
                return

    # -- kernels -------------------------------------------------------------------------------------------------
    def count_from(self, epoch_ns: int) -> None:
        """Let t = 0 have another stamp: that of the first message, for a node among strangers."""
        for port in self.inputs.values():
            port.count_from(epoch_ns)
        self._machine.count_from(epoch_ns)
        self.settings.epoch_ns = epoch_ns

    def take_faults(self, faults) -> None:
        """Go on with other faults."""
        self.faults = faults
        machine = SingleComponent(*self._arguments, faults, self._watched)
        machine.take_over(self._machine)
        self._machine = machine

    def look(self, t_ns: int) -> None:
        """Before a firing at t or later: take over what was set, and what was injected."""
        self.changes.look(t_ns)
        if self.live:
            self.live.check(t_ns)

    def call(self, part: str, t_ns: int, stamp_ns: int | None = None, span_ns: int = 1) -> None:
        """Run one part of the component at t, its outputs stamped. Raises FlightError on a fault or a non-finite output.

        stamp_ns, span_ns: see `SingleComponent.call`.
        """
        sentence = self._machine.call(part, t_ns, stamp_ns, span_ns)
        if sentence:
            raise FlightError(sentence)

    def publish_outputs(self, t_ns: int, span_ns: int = 1) -> None:
        """Publish what is due at t: records, then the messages formatted from them. span_ns: see `call`."""
        for name, port in self.outputs.items():
            if t_ns % self.output_periods[name] < span_ns:
                count = self._machine.delivered(name)
                port.publish(self.settings.epoch_ns + t_ns, count)
                self.memory.published(name, port.record, count)
                for made, publisher in self.formatted * count:
                    if made.port == name:
                        publisher.publish(formatted_payload(made, port.record))

    def publish_clock(self, t_ns: int) -> None:
        if self.clock and t_ns % CLOCK_PERIOD_NS == 0:
            sec, nanosec = stamp_parts(self.settings.epoch_ns + t_ns)
            self.clock.publish(clock_payload(sec, nanosec))

    # -- start ---------------------------------------------------------------------------------------------------
    def match(self) -> None:
        """Wait until every declared reader and writer is matched. Raises FlightError naming what is missing."""
        if not self.settings.joins:  # in a running graph the dead one's topics linger for a while
            self._refuse_second_source()
        deadline = time.monotonic() + self.settings.timeout_s
        while missing := self._unmatched():
            self.check_alive()
            if time.monotonic() > deadline:
                raise FlightError(f"{self.get_name()}: waited {self.settings.timeout_s:g} s for {missing}")
            time.sleep(0.01)
        if not self.settings.joins:
            self._refuse_second_source()
        for port in self.inputs.values():
            port.sources = self.sources_of(port)

    def sources_of(self, port) -> str:
        """The nodes that publish an input's topic, in words."""
        return " and ".join(sorted(info.node_name for info in self.get_publishers_info_by_topic(port.subscription.topic)))

    def _unmatched(self) -> str | None:
        for other, watch in self.watches.items():
            if not watch.is_matched():
                return f"the node {other}: it has not appeared"
        for name, port in self.inputs.items():
            source_ = self.settings.sources[name]
            if source_.period_ns and port.subscription.publishers() < 1:
                return self._why_no_publisher(name, port)
        for name, port in self.outputs.items() if not self.settings.joins else ():  # a running graph may have lost readers
            wanted = self.settings.subscribers[name]
            found = port.subscribers()
            if found < wanted:
                return f"readers of its output {name} on {port.publisher.topic}: {found} of {wanted} have appeared"
        return self.memory.unmatched() or self.progress.unmatched() or self.changes.unmatched()

    def _why_no_publisher(self, name, port):
        topic = port.subscription.topic
        others = {info.topic_type for info in self.get_publishers_info_by_topic(topic)} - {port.signal.type_name}
        if others:
            return f"its input {name}: {topic} carries {', '.join(others)}, this input takes {port.signal.type_name}"
        if unfit := misfits(self, [port.subscription], []):
            return f"its input {name}: {unfit[0]}"
        return f"its input {name} on {topic}: no publisher has appeared"

    def look_around(self) -> None:
        """Before a lone clock master speaks: wait until it would have found another source of its topics."""
        deadline = time.monotonic() + DISCOVERY_S
        while time.monotonic() < deadline:
            self._refuse_second_source(patient=True)
            self.check_alive()
            self.stopping.wait(0.05)
        self._refuse_second_source()

    def _refuse_second_source(self, patient=False):
        own = (self.get_name(), self.get_namespace())
        for name, port in self.outputs.items():
            found = [(info.node_name, info.node_namespace)
                     for info in self.get_publishers_info_by_topic(port.publisher.topic)]
            others = [other for other in found if other != own] or found[1:]  # a second one may have this node's name
            if others and others[0][0].startswith("_NODE_NAME_UNKNOWN") and patient:
                continue  # just appearing: its name comes a moment later
            if others:
                raise FlightError(
                    f"{self.get_name()}.{name}: {port.publisher.topic} has a source already (node "
                    f"{others[0][1].rstrip('/')}/{others[0][0]}); one topic has one source")


def clock_payload(sec: int, nanosec: int) -> bytes:
    """A serialised rosgraph_msgs/Clock."""
    return ENCAPSULATION + sec.to_bytes(4, "little", signed=True) + nanosec.to_bytes(4, "little")
