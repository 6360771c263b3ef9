"""One component as a ROS 2 lifecycle node: ports, parameters, start-up, and the two paces of its loop."""

from contextlib import nullcontext

from rclpy.exceptions import ParameterException

from flight_graph.components.placement import pose_signal
from flight_graph.engines.single import SingleComponent
from flight_graph.errors import FlightError, unknown
from flight_graph.recordings.recording import formatted_payload
from flight_graph.ros.checkpoint_settings import CheckpointSettings
from flight_graph.ros.checkpoints import NodeMemory
from flight_graph.ros.following import Follower
from flight_graph.ros.installed import is_installed
from flight_graph.ros.live_faults import CLEAR, INJECT, LiveFaults
from flight_graph.ros.managed import ManagedNode
from flight_graph.ros.node_processes import RECORDER
from flight_graph.ros.pacing import Pacing
from flight_graph.ros.parameter_changes import ParameterChanges
from flight_graph.ros.parameters import ComponentParameters
from flight_graph.ros.placing import Placing
from flight_graph.ros.ports import InputPort, LoopOnly, OutputPort, RawPublisher
from flight_graph.ros.progress import Progress, Watch
from flight_graph.ros.recorder import read_scenario
from flight_graph.ros.settings import Source, declare
from flight_graph.ros.standing import Reports
from flight_graph.ros.strangers import Strangers
from flight_graph.timebase import SECOND, stamp_parts
from msg_schemas.qos import Qos
from msg_schemas.signal import ENCAPSULATION

CLOCK = ("/clock", "rosgraph_msgs/msg/Clock", Qos(depth=100))
CLOCK_PERIOD_NS = 1_000_000  # [ns] /clock is published at most at 1 kHz


class ComponentNode(ManagedNode):
    """A component with its ports. ``announce(dict)`` tells the starter of the node what happens."""

    def __init__(self, name: str, use: str, component, announce):
        super().__init__(name.rpartition(".")[2], namespace=component.namespace)
        self.use, self.component, self.announce = use, component, announce
        self.free_parameters = {"use_sim_time"}  # that are no parameters of the component and may be set all the same
        self.progress = self.placing = None
        self.begin()

    def _configure(self):
        """Parameters, ports, and the component's memory. Raises FlightError."""
        component = self.component
        self.settings = declare(self, component)
        self.parameters = ComponentParameters(self, component)
        self.parameters.record["period"] = self.settings.period_ns / SECOND
        group = LoopOnly()
        self.faults = self.live = scenario = None
        if self.settings.scenario:
            scenario = read_scenario(self.settings.scenario)
            self.component = component = scenario.graph.nodes[self.graph_name].component  # with its texts
            self.faults = scenario.faults
            if scenario.live_ids:
                self.free_parameters |= {INJECT, CLEAR}
                self.live = LiveFaults(self, scenario)
        try:
            self._make_ports(component, group)
        except (RuntimeError, ParameterException) as error:  # of parameters qos_overrides
            raise FlightError(f"{self.graph_name}: {error}") from None
        records = {port: self.inputs[port].record if port in self.inputs else signal.new()[1]
                   for port, signal in component.inputs.items()}
        self._watched = self._watch(scenario, group)
        self.formatted = [(made, RawPublisher(self, made.topic, made.type_name, made.role.qos))
                          for made in component.said(self.parameters.values) if is_installed(made.type_name)]
        self.output_periods = {port: self.settings.output_period_ns(component, port) for port in self.outputs}
        self.progress = Progress(self, self.settings)
        self.watches = {other: Watch(self, other, group) for other in self.settings.wait_for}
        self.clock = RawPublisher(self, *CLOCK) if self.settings.clock_master else None
        self._follow_control()
        Strangers(self, [port.subscription for port in self.inputs.values()],
                  [port.publisher for port in self.outputs.values()] + [publisher for _, publisher in self.formatted])
        self.state = component.initial_state(self.parameters.values)
        self.parameters.accept_changes()
        self.changes = ParameterChanges(self, scenario)
        self._arguments = (
            self.graph_name, self.use, component, self.parameters.record, self.state,
            records, {port: entry.record for port, entry in self.outputs.items()}, self.output_periods,
            self.settings.epoch_ns, self.settings.check_bounds)
        self.machine = SingleComponent(*self._arguments, self.faults, self._watched)
        self.memory = NodeMemory(self, CheckpointSettings(**self.settings.checkpoints), lambda: self.machine)
        self.memory.watch(self.outputs, component.output_rate_hz)
        self.memory.restore()
        if self.settings.control and pose_signal(component) is not None:
            self.placing = Placing(self, self._arguments)
            if self.memory.is_restored:
                self.placing.came(-(-self.memory.begin_ns // self.settings.period_ns) * self.settings.period_ns)

    def _follow_control(self):
        """Where somebody may let the run stand: as who lets it, or as who hears of it."""
        control, is_master = self.settings.control, self.settings.clock_master
        self.pacing = Pacing(self, control, [name for name in self.watches if name != RECORDER]) if (
            control and is_master) else None
        self.reports = Reports(self) if control and not is_master else None
        if control and self.settings.again:
            Follower(self, self.graph_name, control.segment, self.stopping)

    def _make_ports(self, component, group):
        """Outputs first: who finds the inputs, and sends, will have found where the answers come from."""
        settings = self.settings
        self.outputs = {port: OutputPort(self, port, signal, signal.topic, settings.slotted[port])
                        for port, signal in component.outputs.items()}
        self.inputs = {port: self._input(port, signal, group)
                       for port, signal in component.inputs.items() if settings.sources[port].is_connected}

    def _input(self, port, signal, group):
        source = self.settings.sources[port]
        return InputPort(self, port, signal, source, self.settings.epoch_ns, group)

    def _watch(self, scenario, group) -> dict:
        """The signals that conditions of faults of this node read, as inputs: (node, port) -> record."""
        records, self.watched = {}, []
        for name, port in self.faults.watched(self.graph_name) if self.faults else ():
            node, key = self.faults.nodes[name], f"when {name}.{port}"
            signal = node.component.outputs[port]
            is_slotted = scenario.is_irregular(name, port) and (self.settings.lockstep or not node.is_foreign)
            self.settings.sources[key] = Source(signal.topic, node.output_period_ns(port), 1, slotted=is_slotted,
                                                foreign=name if node.is_foreign else "")
            self.inputs[key] = self._input(key, signal, group)
            records[name, port] = self.inputs[key].record
            self.watched.append(key)
        return records

    def introduce(self):
        """Say what this node does, where nobody else does."""
        if not self.settings.supervised:
            pace = "lockstep" if self.settings.lockstep else "realtime"
            reads = ", ".join(port.subscription.topic for port in self.inputs.values()) or "nothing"
            writes = ", ".join(port.publisher.topic for port in self.outputs.values()) or "nothing"
            self.get_logger().info(f"{SECOND / self.settings.period_ns:g} Hz, {pace}; reads {reads}; writes {writes}")
            for made in self.component.formatted:
                if not is_installed(made.type_name):
                    self.get_logger().info(f"/{made.topic} is not published: {made.type_name} is not installed here")
        for name in self._parameter_overrides:
            if not self.has_parameter(name) and not name.startswith("qos_overrides"):
                self.get_logger().warning(str(unknown("parameter", name, self.component.parameters.entries)))

    def _beat(self):
        if self.progress:
            self.progress.beat()

    # -- kernels -------------------------------------------------------------------------------------------------
    def count_from(self, epoch_ns: int) -> None:
        """Let t = 0 have another stamp: that of the first message, for a node among strangers."""
        for port in self.inputs.values():
            port.count_from(epoch_ns)
        self.machine.count_from(epoch_ns)
        self.settings.epoch_ns = epoch_ns

    def take_faults(self, faults) -> None:
        """Go on with other faults."""
        self.faults = faults
        machine = SingleComponent(*self._arguments, faults, self._watched)
        machine.take_over(self.machine)
        self.machine = machine

    def look(self, t_ns: int) -> None:
        """Before a firing at t or later: take over what was set, where it was put, and what was injected."""
        self.changes.look(t_ns)
        if self.placing and (entry := self.placing.look(t_ns)):
            self.changes.tell(entry)
        if self.live:
            self.live.check(t_ns)
        if self.reports and not self.settings.lockstep and self.reports.new():
            self.settings.factor = self.reports.rate

    def call(self, part: str, t_ns: int, stamp_ns: int | None = None, span_ns: int = 1) -> None:
        """Run one part of the component at t, its outputs stamped. Raises FlightError on a fault or a non-finite output.

        stamp_ns, span_ns: see `SingleComponent.call`.
        """
        with self.placing.lock if self.placing else nullcontext():
            sentence = self.machine.call(part, t_ns, stamp_ns, span_ns)
            if self.placing and part in ("start", "update"):
                self.placing.came(t_ns + self.settings.period_ns if part == "update" else t_ns)
        if sentence:
            raise FlightError(sentence)

    def publish_outputs(self, t_ns: int, span_ns: int = 1) -> None:
        """Publish what is due at t: records, then the messages formatted from them. span_ns: see `call`."""
        for name, port in self.outputs.items():
            if t_ns % self.output_periods[name] < span_ns:
                count = self.machine.delivered(name)
                port.publish(self.settings.epoch_ns + t_ns, count)
                self.memory.published(name, port.record, count)
                for made, publisher in self.formatted * count:
                    if made.port == name and not (made.once and t_ns):
                        publisher.publish(formatted_payload(made, port.record))

    def publish_clock(self, t_ns: int) -> None:
        if self.clock and (self.pacing or t_ns % CLOCK_PERIOD_NS == 0):  # who may not go ahead of it needs each
            sec, nanosec = stamp_parts(self.settings.epoch_ns + t_ns)
            self.clock.publish(clock_payload(sec, nanosec))


def clock_payload(sec: int, nanosec: int) -> bytes:
    """A serialised rosgraph_msgs/Clock."""
    return ENCAPSULATION + sec.to_bytes(4, "little", signed=True) + nanosec.to_bytes(4, "little")
