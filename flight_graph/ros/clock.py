"""Simulation time from /clock, for components without inputs."""

import struct

from flight_graph.errors import FlightError
from flight_graph.ros.ports import LoopOnly, RawSubscription
from flight_graph.ros.standing import Deadline
from flight_graph.timebase import SECOND
from msg_schemas.qos import QOS, Role


class ClockInput:
    """Waits until the clock master has reached a time."""

    def __init__(self, node):
        self._t_ns, self._epoch_ns = -1, node.settings.epoch_ns
        self._subscription = RawSubscription(node, "/clock", "rosgraph_msgs/msg/Clock", QOS[Role.SENSOR], LoopOnly())

    def first(self, node) -> int:
        """The time [ns] of the first /clock that is heard. Raises FlightError when none comes for the node's timeout."""
        self.wait_until(0, node)
        return self._t_ns

    def wait_until(self, t_ns: int, node) -> None:
        """Raises FlightError when no clock comes for the node's timeout."""
        deadline = Deadline(node)
        while self._t_ns < t_ns:
            message = self._subscription.take()
            if message is not None:
                sec, nanosec = struct.unpack_from("<iI", message, 4)
                self._t_ns = sec * SECOND + nanosec - self._epoch_ns
                continue
            if deadline.is_over:
                raise FlightError(f"{node.graph_name}: waited {node.settings.timeout_s:g} s for /clock to reach "
                                  f"t = {t_ns / SECOND:.9f} s")
            self._subscription.wait(deadline.left_ns)
            node.check_alive()
