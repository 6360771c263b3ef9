"""A node that begins again in its own process: where a launch has started it, and the run is taken back.

``/_simulation/segments`` carries std_msgs/String, JSON of the node ``simulation``: that the recorder is to close its bag,
and then where the parameters of each node stand. A node that hears of its own leaves the middleware and runs its command
again with these (`flight_graph.ros.leaving.begin_again`), so that a launch sees no process end.
"""

import json
import threading
from pathlib import Path

from std_msgs.msg import String

from flight_graph.ros import leaving
from flight_graph.ros.node_processes import RECORDER
from flight_graph.ros.ports import profile
from flight_graph.ros.standing import ORDERED

TOPIC = "_simulation/segments"


class Follower:
    """A node's part: hears that it is to begin again. name: in the graph; segment: its own."""

    def __init__(self, node, name: str, segment: int, stopping: threading.Event):
        self._name, self._segment, self._stopping = name, segment, stopping
        self.closes = ""  # of the recorder: the file to leave when its bag is closed
        node.create_subscription(String, node.in_graph(TOPIC), self._hear, profile(ORDERED))

    def _hear(self, message):
        said = json.loads(message.data)
        if said["segment"] <= self._segment:
            return
        if self._name in said.get("files", {}):
            leaving.begin_again(said["files"][self._name])
            self._stopping.set()
        elif self._name == RECORDER and "close" in said:
            self.closes = said["close"]

    def closed(self) -> None:
        """The recorder's bag is closed: say so, and wait until it may begin again, or end."""
        if self.closes:
            Path(self.closes).touch()
            self._stopping.wait()
