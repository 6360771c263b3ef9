"""When a recorder stops waiting: a topic's node has gone, or a graph that nobody has paused has fallen silent."""

import time

from flight_graph.components.names import ros
from flight_graph.ros.patience import at_least
from flight_graph.ros.ports import LoopOnly, RawSubscription
from flight_graph.timebase import SECOND
from msg_schemas.definitions import deserialize
from msg_schemas.qos import Qos

GONE_S = 2.0  # [s] a topic that has been without a publisher for longer has lost its node
_LOOK_S = 0.5  # [s] between two looks at publishers
_REST_S = 5.0  # [s] realtime: after the last tick of the run, what still comes comes within this time
TRANSITION = "lifecycle_msgs/msg/TransitionEvent"
_PAUSED = ("inactive", "unconfigured")  # states of a node that may go on


class Silence:
    """Judges, each time the recorder has taken what has come, whether more will come. sentence: why not, if it should."""

    def __init__(self, node, scenario, settings, streams, reports=None):
        self.sentence = ""
        self._name, self._settings, self._streams, self._reports = node.get_name(), settings, streams, reports
        self._heard = self._looked = time.monotonic()
        self._states = {}
        group = LoopOnly()
        self._transitions = {name: RawSubscription(node, f"{ros(name)}/transition_event", TRANSITION, Qos(depth=10), group)
                             for name in scenario.graph.nodes} if settings.supervised else {}

    def is_final(self, count: int) -> bool:
        """Whether nothing more will come. count: messages that have just been taken."""
        now = time.monotonic()
        if count or self._is_paused():
            self._heard = now
        is_over = any(stream.done for stream in self._streams) and not self._settings.lockstep
        if is_over:
            return now - self._heard > at_least(_REST_S)
        self.sentence = self._lost_source(now)
        if not self.sentence and now - self._heard > self._settings.timeout_s:
            self.sentence = (f"{self._name}: nothing has come for {self._settings.timeout_s:g} s; "
                             f"{self._where(self._behind())}")
        return bool(self.sentence)

    def _lost_source(self, now) -> str:
        """The sentence of a topic whose publisher has gone."""
        if now - self._looked < _LOOK_S:
            return ""
        self._looked = now
        lost = [stream for stream in self._streams if not stream.excused and stream.subscription.abandoned_s() > GONE_S]
        if not lost:
            return ""
        first = min(lost, key=lambda stream: stream.next_ns)
        return f"{self._name}: the node {first.topic.node} has ended before the run was over; {self._where(first)}"

    def _behind(self):
        return min((stream for stream in self._streams if not stream.done), key=lambda stream: stream.next_ns)

    def _where(self, stream) -> str:
        return (f"/{stream.topic.topic} of the node {stream.topic.node} has come to t = "
                f"{max(stream.next_ns - stream.topic.source_period_ns, 0) / SECOND:.9f} s of {stream.end_ns / SECOND:g} s")

    def _is_paused(self) -> bool:
        """Whether somebody lets the run stand, or has put a node into a state from which it may go on."""
        for name, subscription in self._transitions.items():
            while (message := subscription.take()) is not None:
                self._states[name] = deserialize(message, TRANSITION).goal_state.label
        return any(state in _PAUSED for state in self._states.values()) or bool(self._reports and self._reports.stands)
