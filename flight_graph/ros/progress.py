"""Flow control: every node tells how far it has come, and the clock master never runs further ahead than a window.

``<node>/_progress`` carries rosgraph_msgs/Clock, latched: the stamp up to which the node is done. The epoch itself means
"ready": all endpoints are matched. Where a watchdog listens, it is also the beat of the node, sent while it waits, too.
Tools leave the topic out of their lists: the underscore says that it is nobody else's.
"""

import struct
import time

from flight_graph.components.names import ros
from flight_graph.ros.ports import RawPublisher, RawSubscription
from flight_graph.timebase import SECOND, stamp_parts
from msg_schemas.qos import Qos
from msg_schemas.signal import ENCAPSULATION

_TYPE = "rosgraph_msgs/msg/Clock"
_QOS = Qos(depth=10, transient_local=True)
BEAT_S = 0.04  # [s] between two beats of a node that waits


class Progress:
    """Publishes how far this node has come."""

    def __init__(self, node, settings):
        self._watched = settings.supervised and not settings.clock_master
        self._beats = getattr(settings, "beats_often", False)
        self._epoch_ns, self._told_ns, self._said = settings.epoch_ns, -1, 0.0
        self._every_ns = 0 if self._beats or settings.control else settings.window_ns // 4
        self._publisher = RawPublisher(node, f"{ros(node.graph_name)}/_progress", _TYPE, _QOS) if self._watched else None

    def unmatched(self) -> str | None:
        if self._watched and self._publisher.subscribers() < 1:
            return "the clock master: it has not appeared"
        return None

    def tell(self, t_ns: int, now: bool = False) -> None:
        """Say that everything stamped before t is done (sent now and then, and always when ``now``)."""
        if self._watched and (now or self._told_ns < 0 or t_ns - self._told_ns >= self._every_ns):
            self._told_ns = t_ns
            self._say()

    def beat(self) -> None:
        """Say that this node lives, while it waits: what it said last, again."""
        if self._beats and self._told_ns >= 0 and time.monotonic() - self._said > BEAT_S:
            self._say()

    def _say(self):
        self._said = time.monotonic()
        sec, nanosec = stamp_parts(self._epoch_ns + self._told_ns)
        self._publisher.publish(ENCAPSULATION + struct.pack("<iI", sec, nanosec))


class Watch:
    """Reads how far another node has come; ``t_ns`` is -1 before it is ready. heard: when it spoke last (monotonic) [s]."""

    def __init__(self, node, other: str, group):
        self.t_ns, self.heard, self._epoch_ns = -1, time.monotonic(), node.settings.epoch_ns
        self._subscription = RawSubscription(node, f"{ros(other)}/_progress", _TYPE, _QOS, group)

    def is_matched(self) -> bool:
        return self._subscription.publishers() > 0

    def read(self) -> int:
        """Take what has arrived; return the newest t [ns]."""
        while (message := self._subscription.take()) is not None:
            sec, nanosec = struct.unpack_from("<iI", message, 4)
            self.heard = time.monotonic()
            self.t_ns = max(self.t_ns, sec * SECOND + nanosec - self._epoch_ns)  # one that was started again begins at 0
        return self.t_ns

    def abandoned_s(self) -> float:
        """How long [s] the node has been gone."""
        return self._subscription.abandoned_s()

    def wait(self, nanoseconds: int) -> None:
        self._subscription.wait(nanoseconds)
