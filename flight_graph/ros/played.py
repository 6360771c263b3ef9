"""What a foreign node said in a recorded run, said again by its stand-in: all others fly as nodes, from the bag alone.

The stand-in publishes the recorded answer to each slot, and the slot; where none came in time then, none comes now.
"""

import numpy as np

from flight_graph.ros import slots
from flight_graph.ros.ports import RawPublisher


class Played:
    """One output of a foreign node, from its tape; used as `flight_graph.ros.stand_in.Answers` is."""

    def __init__(self, node, port: str, signal, tape: dict[str, np.ndarray]):
        self._node, self._times_ns, self._messages = node, tape[f"{port} times"], tape[f"{port} messages"]
        self._publisher = RawPublisher(node, signal.topic, signal.type_name, signal.role.qos)
        self._slots = RawPublisher(node, slots.slots_topic(signal.topic), slots.TYPE, slots.QOS_OF_SLOTS)
        self._readers = node.settings.subscribers[port]
        self.late, self.refused = 0, {}

    def unmatched(self) -> str:
        """Who is missing at the start."""
        for publisher in (self._publisher, self._slots):
            if (found := publisher.subscribers()) < self._readers:
                return f"readers of {publisher.topic}: {found} of {self._readers} have appeared"
        return ""

    def wait_for(self, t_ns: int) -> None:
        """Say what was said to t, and the slot."""
        at = int(np.searchsorted(self._times_ns, t_ns))
        is_there = at < len(self._times_ns) and int(self._times_ns[at]) == t_ns
        if is_there:
            self._publisher.publish(self._messages[at].tobytes())
        self.late += not is_there
        self._slots.publish(slots.payload(self._node.settings.epoch_ns + t_ns, int(is_there)))
