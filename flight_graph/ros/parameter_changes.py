"""Parameters that change while a node of a graph runs: when they are set by ROS, and what events of the scenario set.

``/_parameter_changes`` carries std_msgs/String: an entry of a scenario's ``events`` as JSON, with the time of the firing
that was the first to see it. The recorder writes these into the bag, so that it can be run again from itself.
"""

import json

from flight_graph.errors import FlightError
from flight_graph.graphs import events
from flight_graph.ros.ports import RawPublisher
from flight_graph.ros.texts import TYPE, text_payload
from msg_schemas.qos import Qos

TOPIC = "_parameter_changes"
QOS = Qos(depth=1000, transient_local=True)


class ParameterChanges:
    """A node's part in it. scenario: its graph's, where faults or events concern it."""

    def __init__(self, node, scenario):
        self._node, self._publisher = node, None
        if node.settings.supervised:
            self._publisher = RawPublisher(node, TOPIC, TYPE, QOS)
        self._own = scenario.graph.nodes[node.graph_name] if scenario else None
        self._coming = list(self._known())

    def _known(self):
        return self._node.faults.changes.get(self._node.graph_name, []) if self._own else []

    def unmatched(self) -> str | None:
        """What is missing before nothing can be lost."""
        if self._publisher is None or self._publisher.subscribers():
            return None
        return f"the recorder: it does not read {self._publisher.topic} yet"

    def look(self, t_ns: int) -> None:
        """Take over what was set since the last firing. t_ns: no later than the next one. Raises FlightError."""
        while self._coming and self._coming[0].begin_ns <= t_ns:
            self._node.parameters.follow(self._coming.pop(0).values)
        given = self._node.parameters.taken()
        if not given:
            return
        if self._known():
            self._put_among_events(t_ns, given)
        else:
            self._node.parameters.refresh()
        self.tell(events.as_entry(self._node.graph_name, t_ns, given))

    def tell(self, entry: dict) -> None:
        """Tell what has changed, as an entry of a scenario's ``events``."""
        if self._publisher:
            self._publisher.publish(text_payload(json.dumps(entry)))

    def _put_among_events(self, t_ns, given):
        faults, name = self._node.faults, self._node.graph_name
        try:
            faults.changes[name] = events.with_change(self._known(), self._own, t_ns, given)
        except FlightError as error:
            raise FlightError(f"{name}: what was set at t = {t_ns / 1e9:g} s does not go with the events that follow: "
                              f"{error}") from None
        self._node.parameters.follow([one.values for one in faults.changes[name] if one.begin_ns <= t_ns][-1])
        self._coming = [one for one in faults.changes[name] if one.begin_ns > t_ns]
        self._node.take_faults(faults)
