"""The processes of a graph in realtime: stopped, killed and started as faults of components want it, and as a watchdog
must.

Who runs the graph feeds it events: ``{"fault", "active"}`` of the report of faults, ``{"silent", ...}`` and ``{"back",
...}`` of the clock master, and the ends of processes. What it did stands in ``notes``, and in a file that the recorder
puts into the bag.
"""

import json
import os
import signal
import time
from pathlib import Path

import yaml

from flight_graph.ros.patience import at_least

_BACK_S = 20.0  # [s] a node that was started again is there within this time, or it has failed
_FIRST_BEAT_S = 10.0  # [s] after that, until it beats: the middleware's discovery can take seconds on a busy machine


class Supervisor:
    """Decides about the nodes of one run. launch: with ``pids`` and ``order(spec)``; specs: of the nodes, by name."""

    def __init__(self, scenario, launch, specs: dict, events: Path):
        self._watchdog = scenario.file.watchdog
        self._launch, self._specs, self._file = launch, specs, events
        self._gone = set()  # nodes that a fault has killed
        self._killed = set()  # nodes that the watchdog has killed, and whose end has not been heard of
        self._coming = {}  # node that was started again -> until when its silence is allowed (monotonic) [s]
        self._starts = {}  # node -> wall times of its restarts by the watchdog
        self._time = 0.0  # [s] of the run, as last heard
        self.notes = []

    def note(self, text: str, t: float | None = None) -> None:
        """Keep what has happened."""
        self._time = self._time if t is None else t
        self.notes.append(f"t = {self._time:.6g} s: {text}")
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(self.notes[-1]) + "\n")

    # -- faults ---------------------------------------------------------------------------------------------------
    def fault(self, name: str, node: str, kind: str, active: bool, t: float) -> None:
        """A fault of a kind, of a node, begins or ends at t [s]."""
        self._time = t
        if kind == "hang":
            self._signal(node, signal.SIGSTOP if active else signal.SIGCONT)
            self.note(f"{name}: the node {node} {'is stopped' if active else 'goes on'}")
        elif active:
            self._gone.add(node)
            self._signal(node, signal.SIGKILL)
            self.note(f"{name}: the node {node} is killed")
        elif kind == "restart":
            self._gone.discard(node)
            self._start(node)
            self.note(f"{name}: the node {node} is started again")

    # -- watchdog -------------------------------------------------------------------------------------------------
    def ended(self, name: str, how: str) -> str | None:
        """A process has ended by itself, or was killed: nothing where that is taken care of, else the sentence."""
        if name in self._gone or name in self._killed:
            self._killed.discard(name)
            return None
        if name in self._specs and self._may_start(name):
            self.note(f"the node {name} ended ({how}) and is started again")
            self._start(name)
            return None
        return f"the node {name} ended by itself ({how}){self._why_not(name)}"

    def silent(self, name: str, came: float, t: float) -> str | None:
        """A node has not beaten for too long: nothing where it is started again, else the sentence."""
        self._time = t
        if name in self._gone or time.monotonic() < self._coming.get(name, 0.0):
            return None
        if self._may_start(name):
            self.note(f"the node {name} was silent since t = {came:.6g} s; it is killed and started again")
            self._killed.add(name)
            self._signal(name, signal.SIGKILL)
            self._start(name)
            return None
        return (f"the node {name} is silent: it has come to t = {came:.6g} s and says nothing more; the watchdog allows "
                f"{self._watchdog.gap_s:g} s{self._why_not(name)}")

    def back(self, name: str, t: float) -> None:
        """A node beats again."""
        self._coming.pop(name, None)
        self.note(f"the node {name} beats again", t)

    def born(self, name: str) -> None:
        """A node that was started again is there: it beats soon."""
        if name in self._coming:
            self._coming[name] = time.monotonic() + at_least(_FIRST_BEAT_S)

    def _may_start(self, name) -> bool:
        restart = self._watchdog.restart if self._watchdog else None
        if restart is None:
            return False
        now = time.monotonic()
        recent = [one for one in self._starts.get(name, []) if now - one < restart.window_s]
        if len(recent) >= restart.limit:
            return False
        self._starts[name] = [*recent, now]
        return True

    def _why_not(self, name) -> str:
        restart = self._watchdog.restart if self._watchdog else None
        return f"; it was started again {restart.limit} times in {restart.window_s:g} s" if restart else ""

    def _start(self, name) -> None:
        """Start a node again, into the running graph."""
        spec = self._specs[name]
        path = Path(spec["arguments"][-1]).with_suffix(".again.yaml")
        values = yaml.safe_load(Path(spec["arguments"][-1]).read_text(encoding="utf-8"))
        for block in values.values():
            block["ros__parameters"]["graph.joins"] = True
        path.write_text(yaml.safe_dump(values), encoding="utf-8", newline="\n")
        self._coming[name] = time.monotonic() + at_least(_BACK_S)
        self._launch.order({**spec, "arguments": [*spec["arguments"][:-1], str(path)]})

    def _signal(self, name, number) -> None:
        if name in self._launch.pids:
            try:
                os.kill(self._launch.pids[name], number)
            except ProcessLookupError:
                pass
