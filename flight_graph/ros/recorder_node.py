"""The recorder's ROS node: its settings and its life from start to signal."""

import threading
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rcl_interfaces.msg import ParameterDescriptor

from flight_graph.engines.choice import pace_text
from flight_graph.errors import FlightError
from flight_graph.ros import checkpoint_settings, program, recorder
from flight_graph.ros.following import Follower
from flight_graph.ros.managed import ManagedNode, Stopped
from flight_graph.ros.node_processes import RECORDER
from flight_graph.ros.parameters import declare_once
from flight_graph.ros.simulation_settings import Control, control_of


@dataclass
class RecorderSettings:
    """The recorder's part of a node's settings."""

    lockstep: bool
    epoch_ns: int
    duration_ns: int
    window_ns: int
    timeout_s: float
    supervised: bool
    linger: bool
    control: Control | None = None
    clock_master: bool = False


class RecorderNode(ManagedNode):
    """A node with the parameters of the recorder. While it is inactive it takes no message, and the graph waits for it."""

    def __init__(self, stopping: threading.Event):
        super().__init__("recorder", stopping)
        self.begin()

    def _configure(self):
        pace, factor = self._get("graph.pace", "realtime"), self._get("graph.factor", 1.0)
        if pace not in ("lockstep", "realtime"):
            raise FlightError(f"recorder.graph.pace: {pace!r} is not allowed; allowed: lockstep or realtime")
        self.pace = pace_text(pace, factor)
        self.scenario = recorder.read_scenario(self._required("scenario"))
        self.folder = Path(self._required("out"))
        self.events = self._get("events", "")
        self.beginning = checkpoint_settings.read(self._get("begin", ""))
        self.settings = RecorderSettings(
            lockstep=pace == "lockstep", epoch_ns=self.scenario.epoch_ns, duration_ns=self.scenario.duration_ns,
            window_ns=self._get("graph.window_ns", 10**9), timeout_s=self._get("graph.timeout_s", 30.0),
            supervised=self._get("graph.supervised", False),
            linger=self._get("graph.linger", False), control=control_of(self._get("graph.control", "")))
        self.follower = Follower(self, RECORDER, self.settings.control.segment, self.stopping) if (
            self._get("graph.again", False) and self.settings.control) else None

    def _get(self, name, default):
        return declare_once(self, name, default, ParameterDescriptor())

    def _required(self, name):
        value = self._get(name, "")
        if not value:
            raise FlightError(f"recorder.{name} is missing; give it with --ros-args -p {name}:=...")
        return value

    def should_end(self) -> bool:
        """Whether it was asked to end; waits while it is inactive."""
        try:
            self.check_alive()
        except Stopped:
            return True
        return bool(self.follower and self.follower.closes)


def _live(stopping, announce):
    node = None
    try:
        node = RecorderNode(stopping)
        node.wait_until_configured()
        announce({"ready": node.get_name()})
        outcome = recorder.run(node, node.scenario, node.folder, node.settings)
        if stopping.is_set() and outcome["complete"] != "true":
            announce({"stopped": True})
        announce({"recorded": outcome, "bag": str(node.folder)})
        if node.follower:
            node.follower.closed()
        program.linger(node, stopping)
    finally:
        if node is not None:
            node.close()


run_recorder = partial(program.run, "recorder", _live)


def main(arguments: list[str], announce=None) -> int:
    """The executable ``recorder``: records the topics of a scenario file until they are complete or it is ended."""
    return program.main("recorder: records the topics of a scenario to MCAP\n\n"
                        "usage: flight node sim_nodes/recorder --ros-args -p scenario:=cubli_asteroid -p out:=FOLDER",
                        run_recorder, arguments, announce)
