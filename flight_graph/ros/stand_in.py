"""The stand-in of a foreign node in lockstep: it says for it what a foreign node cannot say.

When the inputs of a firing are there, the foreign node has ``answer_within_s`` of wall time for messages with that stamp.
The stand-in tells slots (`flight_graph.ros.slots`): one message, or none where none came in time and the scenario lets
readers hold the last one. So all readers and the recorder come to the same, and the run is run again from its bag. It also
tells how far the foreign node has come (`flight_graph.ros.progress`), and ends the run when that is late or gone. Of a
recorded run it says the recorded answers itself (`flight_graph.ros.played`).
"""

import threading
import time
from functools import partial
from types import SimpleNamespace

from flight_graph.components.names import ros
from flight_graph.errors import FlightError
from flight_graph.graphs.foreign_nodes import stand_in_of
from flight_graph.ros import lockstep, matching, program, recorder, slots, tapes
from flight_graph.ros.answers import Judge
from flight_graph.ros.checkpoint_settings import CheckpointSettings
from flight_graph.ros.checkpoints import NodeMemory
from flight_graph.ros.clock import ClockInput
from flight_graph.ros.managed import ManagedNode
from flight_graph.ros.node_processes import RECORDER
from flight_graph.ros.parameters import declare_once
from flight_graph.ros.patience import at_least
from flight_graph.ros.played import Played
from flight_graph.ros.ports import InputPort, LoopOnly, RawPublisher, RawSubscription
from flight_graph.ros.progress import Progress
from flight_graph.ros.settings import declare
from flight_graph.ros.standing import Reports
from flight_graph.timebase import SECOND
from msg_schemas.signal import SignalMismatch

_UNKNOWN = "_NODE_NAME_UNKNOWN_"  # a node whose end is found before its name
_GONE_S = 2.0  # [s] a topic that has been without a publisher for longer has lost its node


class Answers:
    """One output of a foreign node: its messages, and the slots that are told for them."""

    def __init__(self, node, port: str, signal_, group):
        self.port, self.late, self.refused = port, 0, {}  # sentence -> how often
        self._node, self._judge = node, Judge(signal_)
        self.subscription = RawSubscription(node, signal_.topic, signal_.type_name, signal_.role.qos, group)
        self._slots = RawPublisher(node, slots.slots_topic(signal_.topic), slots.TYPE, slots.QOS_OF_SLOTS)
        self.topic, self.signal, self._newest_ns = self.subscription.topic, signal_, None
        self.readers = node.settings.subscribers[port]

    def unmatched(self) -> str:
        """Who is missing at the start."""
        if self.subscription.publishers() < 1:
            return matching.why_no_publisher(self._node, f"the answers {self.port}", self, self._node.stands_for)
        if self.subscription.publishers() > 1:
            names = {info.node_name for info in self._node.get_publishers_info_by_topic(self.topic)}
            raise FlightError(f"{self._node.stands_for}.{self.port}: {self.topic} has {self.subscription.publishers()} "
                              f"sources ({' and '.join(sorted(names))}); one topic has one source")
        if (found := self._slots.subscribers()) < self.readers:
            return f"readers of {self._slots.topic}: {found} of {self.readers} have appeared"
        return ""

    def wait_for(self, t_ns: int) -> None:
        """Wait for the answer to t and tell the slot. Raises FlightError when it is late and may not be, or never comes."""
        stamp_ns, allowed_s = self._node.settings.epoch_ns + t_ns, at_least(self._node.component.answer_within_s)
        deadline = time.monotonic_ns() + int(allowed_s * SECOND)
        while not self._take(stamp_ns):
            left = deadline - time.monotonic_ns()
            if self.subscription.abandoned_s() > _GONE_S:
                raise FlightError(f"{self._node.stands_for}: the foreign node has ended: nobody publishes {self.topic} any "
                                  f"longer; {self._came()}")
            if left <= 0:
                self._is_late(t_ns, allowed_s)
                self._slots.publish(slots.payload(stamp_ns, 0))
                return
            self.subscription.wait(left)
            self._node.check_alive()
        self._newest_ns = t_ns
        self._slots.publish(slots.payload(stamp_ns, 1))

    def _take(self, stamp_ns) -> bool:
        """Whether the answer to a stamp is there; other messages before it are refused."""
        while (message := self.subscription.take()) is not None:
            try:
                found = self._judge.stamp_ns(message)
            except SignalMismatch as error:
                self._refuse(str(error))
                continue
            if found == stamp_ns:
                return True
            self._refuse(self._wrong_stamp(found - self._node.settings.epoch_ns, stamp_ns - self._node.settings.epoch_ns))
        return False

    def _wrong_stamp(self, found, wanted) -> str:
        if found == self._newest_ns:
            return f"{self.topic}: more than one answer to one stamp; the first is taken"
        if 0 <= found < wanted and found % self._node.settings.period_ns == 0:
            return f"{self.topic}: an answer to a stamp that is over"
        if 0 <= found < wanted + 10 * SECOND:
            return f"{self.topic}: a stamp that was not asked for (the first: t = {found / SECOND:.9f} s, when t = " \
                   f"{wanted / SECOND:.9f} s was awaited)"
        return f"{self.topic}: a stamp of another clock; an answer has the stamp of the message that it answers"

    def _refuse(self, sentence):
        key = sentence.partition(" (the first")[0]
        if key not in self.refused:
            self._node.get_logger().warning(f"refused: {sentence}")
            self.refused[key] = [0, sentence]
        self.refused[key][0] += 1

    def _is_late(self, t_ns, allowed_s):
        self.late += 1
        if self._node.component.late == "hold":
            if self.late == 1:
                self._node.get_logger().warning(f"{self._node.stands_for} is late: t = {t_ns / SECOND:.9f} s on "
                                                f"{self.topic}; its readers hold the last message")
            return
        raise FlightError(f"{self._node.stands_for}: the foreign node is late: {self.topic} has no answer to t = "
                          f"{t_ns / SECOND:.9f} s within {allowed_s:g} s (answer_within_s; late: hold would go on); "
                          f"{self._came()}")

    def _came(self) -> str:
        last = "it has answered nothing" if self._newest_ns is None else (
            f"its last answer is to t = {self._newest_ns / SECOND:.9f} s")
        return "; ".join([last, *(f"refused {count}: {sentence}" for count, sentence in self.refused.values())])


class StandIn(ManagedNode):
    """The node: inputs as those of a component, answers in place of outputs."""

    def __init__(self, name: str, stopping: threading.Event):
        super().__init__(name, stopping)
        self.begin()

    def _configure(self):
        self.stands_for = declare_once(self, "stands_for", "", None)
        scenario_file = declare_once(self, "graph.scenario", "", None)
        if not (self.stands_for and scenario_file):
            raise FlightError(f"{self.get_name()}: give it stands_for, a foreign node of graph.scenario")
        graph = recorder.read_scenario(scenario_file).graph
        self.component = graph.nodes[self.stands_for].component
        own = {stand_in_of(name) if node.is_foreign else ros(name) for name, node in graph.nodes.items()} | {RECORDER,
               self.get_name()}
        self._known = {f"{self.get_namespace().rstrip('/')}/{name}" for name in own}
        self.settings = declare(self, self.component)
        tape = declare_once(self, "tape", "", None)
        self._is_played = bool(tape)
        group, self.outputs, self.watches = LoopOnly(), {}, {}
        self.changes = SimpleNamespace(unmatched=lambda: None)
        self.inputs = {}
        for port, signal_ in self.component.inputs.items():
            if (source := self.settings.sources[port]).is_connected:
                self.inputs[port] = InputPort(self, port, signal_, source, self.settings.epoch_ns, group)
        self.memory = NodeMemory(self, CheckpointSettings(**self.settings.checkpoints), None)
        self.memory.restore_inputs()
        made = partial(Played, tape=tapes.read(tape)) if tape else partial(Answers, group=group)
        self.answers = {port: made(self, port, signal_) for port, signal_ in self.component.outputs.items()}
        self.progress = Progress(self, self.settings)
        self.clock, self.reports = None, Reports(self) if self.settings.control else None

    def unmatched(self) -> str:
        """Which of the foreign node's ends are missing, for `matching.match`."""
        for port in self.inputs.values() if not self._is_played else ():
            topic = port.subscription.topic
            if not self._strangers(topic):
                return (f"a subscription of {self.stands_for} to {topic} ({port.signal.type_name}): it is a foreign node, "
                        f"which is started beside this run ({matching.here()})")
        return next(filter(None, (answers.unmatched() for answers in self.answers.values())), "")

    def _strangers(self, topic) -> list[str]:
        """The nodes that read a topic and are not of this graph."""
        return [name for info in self.get_subscriptions_info_by_topic(topic) if info.node_name != _UNKNOWN
                and (name := f"{info.node_namespace.rstrip('/')}/{info.node_name}") not in self._known]

    def run(self) -> None:
        """Stand in from the start of the run to its end. Raises FlightError, Stopped."""
        settings, begin_ns = self.settings, self.memory.begin_ns
        period_ns = settings.period_ns
        clock = None if any(source.period_ns for source in settings.sources.values()) else ClockInput(self)
        matching.match(self, self.unmatched)
        self.progress.tell(begin_ns)
        for t_ns in range(-(-begin_ns // period_ns) * period_ns, settings.duration_ns, period_ns):
            self.check_alive()
            if clock:
                clock.wait_until(t_ns, self)
            lockstep.join(self, t_ns)
            for answers in self.answers.values():
                answers.wait_for(t_ns)
            self.progress.tell(t_ns + period_ns)
        self.progress.tell(settings.duration_ns, now=True)

    def summary(self) -> dict:
        """What it counted."""
        return {"late": sum(one.late for one in self.answers.values()),
                "refused_messages": sum(count for one in self.answers.values() for count, _ in one.refused.values()),
                "reasons": [sentence for one in self.answers.values() for _, sentence in one.refused.values()]}


def _live(stopping, announce):
    node = None
    try:
        node = StandIn("stand_in", stopping)
        node.wait_until_configured()
        announce({"ready": node.get_name()})
        node.run()
        announce({"statistics": node.summary()})
        announce({"done": True, "clock_master": False, "wall_s": 0.0})
        program.linger(node, stopping)
    finally:
        if node is not None:
            node.close()


run_stand_in = partial(program.run, "stand_in", _live)


def main(arguments: list[str], announce=None) -> int:
    """The executable ``stand_in``: of launch files."""
    return program.main("stand_in: stands in for a foreign node of a graph in lockstep; flight run and launch files start "
                        "it\n\nusage: flight node sim_nodes/stand_in --ros-args -p stands_for:=controller "
                        "-p graph.scenario:=FILE.yaml", run_stand_in, arguments, announce)
