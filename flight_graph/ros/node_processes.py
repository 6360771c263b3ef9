"""The processes of the nodes of one run: started, listened to, ended, and where the run is taken back, started anew."""

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from flight_graph.errors import FlightError
from flight_graph.ros import shared_memory
from flight_graph.ros.patience import at_least
from flight_graph.ros.simulation_settings import NODE as SIMULATION
from flight_graph.timebase import SECOND

RECORDER = "recorder"


@dataclass
class RosRun:
    """What a ros run left behind. statistics: of the realtime loops, by node; outcome: the recorder's; domain: its id."""

    bag: Path
    wall_s: float = 0.0
    statistics: dict = field(default_factory=dict)
    outcome: dict = field(default_factory=dict)
    domain: int = 0
    notes: list = field(default_factory=list)  # what was done to processes
    earlier: list = field(default_factory=list)  # bags of segments before this one, where the run was taken back
    was_ended: bool = False  # by who controls it


class Launch:
    """The life of the nodes of one run."""

    def __init__(self, specs, result, lockstep, progress, domain):
        self.result, self.lockstep, self.progress = result, lockstep, progress
        self.pids, self.error, self.master_done, self.crashed = {}, None, False, False
        self._is_ending = False
        self.result.domain = domain.number
        self.names = [spec["name"] for spec in specs]
        self._unborn = set(self.names)  # nodes that the spawner has not started yet
        self._killed = set()  # nodes that did not end when they were asked to
        environment = {**os.environ, **domain.environment(), "PYTHONUNBUFFERED": "1",
                       "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path),  # with -P: nothing else
                       "OPENBLAS_NUM_THREADS": "1"}  # one thread: it forks
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "flight_graph.ros.spawner"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            text=True, env=environment, process_group=0)
        self._lines = queue.SimpleQueue()  # what the nodes say, line by line; None: all have ended
        threading.Thread(target=self._read, daemon=True).start()
        self.supervisor = self.supervise = None  # of a realtime run, and what makes it
        self.segments = self._wanted = None  # of a controlled run, and the time that it is to go back to
        self.order(specs)

    def order(self, what) -> None:
        """Have nodes started: a list of specs at the start, one spec later."""
        with contextlib.suppress(BrokenPipeError):  # the spawner has ended: its last words say why
            self.process.stdin.write(json.dumps(what) + "\n")
            self.process.stdin.flush()

    def _read(self):
        for line in self.process.stdout:
            self._lines.put(line)
        self._lines.put(None)

    def run(self) -> RosRun:
        try:
            while (line := self._lines.get()) is not None:
                self._event(line)
                if self._wanted and not self.error:
                    self._go_back(**self._wanted)
                if self.error or self.result.outcome or self.result.was_ended or (self.master_done and not self.lockstep):
                    break
        finally:
            self._end_nodes()
        if self.error:
            raise FlightError(self.error)
        if not self.result.outcome:
            raise FlightError("the nodes ended before the recorder closed the bag")
        return self.result

    def _go_back(self, to_ns, from_ns, rate):
        """End the nodes, which stand, and start those of the next segment."""
        self._wanted, self._is_ending = None, True
        self._end(at_least(15.0), stands=True)
        if self.error:
            return
        specs, result = self.segments.back(to_ns, from_ns, rate), self.result
        self.tell(f"taken back from t = {from_ns / SECOND:.9g} to {to_ns / SECOND:.9g} s; what was is in "
                  f"{self.segments.bags[-1]}, what comes in {self.segments.folder}")
        result.bag, result.earlier, result.outcome = self.segments.folder, self.segments.bags, {}
        self._is_ending, self._unborn = False, {spec["name"] for spec in specs}
        if self.supervise:
            self.supervise(specs)
        for spec in specs:
            self.order(spec)

    def _event(self, line):
        try:
            event = json.loads(line)
        except json.JSONDecodeError:
            sys.stderr.write(line)
            return
        name = event["node"]
        if "pid" in event:
            self.pids[name] = event["pid"]
            self._unborn.discard(name)
        elif "reset" in event:
            self._wanted = {"to_ns": event["reset"], "from_ns": event["from_ns"], "rate": event["rate"]}
        elif "quit" in event:
            self.result.was_ended = True
        elif self.supervisor and not self._is_ending and event.keys() & {"fault", "silent", "back", "ready"}:
            self._supervise(name, event)
        elif "error" in event:
            self.error = self.error or event["error"]
        elif "exit" in event:
            self.pids.pop(name, None)
            self.crashed = self.crashed or event["exit"] < 0
            if (event["exit"] or not self._is_ending) and name not in self._killed and not self.error:
                self.error = self._ended(name, how_it_ended(event["exit"]))
        elif "stopped" in event:
            if not self._is_ending and not self.error:
                self.error = (f"the node {name} was asked to end before the run was over (SIGTERM, SIGINT or the shutdown "
                              "transition)")
        elif "progress" in event:
            if self.progress:
                self.progress(event["progress"])
        elif "statistics" in event:
            self.result.statistics[name] = event["statistics"]
        elif "recorded" in event:
            self.result.outcome = event["recorded"]
        elif "done" in event:
            if event["clock_master"]:
                self.master_done, self.result.wall_s = True, event["wall_s"]

    def _supervise(self, name, event):
        if "fault" in event:
            self.supervisor.fault(event["fault"], event["of"], event["type"], event["active"], event["t"])
        elif "silent" in event:
            self.error = self.error or self.supervisor.silent(event["silent"], event["came"], event["t"])
        elif "back" in event:
            self.supervisor.back(event["back"], event["t"])
        else:
            self.supervisor.born(name)

    def _ended(self, name, how) -> str | None:
        """The sentence of a process that ended, where nobody takes care of it."""
        if self.supervisor and not self._is_ending:
            return self.supervisor.ended(name, how)
        return f"the node {name} ended by itself ({how})"

    def _end_nodes(self):
        """SIGTERM to the nodes, then to the recorder, which drains and closes the bag; SIGKILL to what hangs.

        A node that hangs in its own end (the middleware's exit can) has done its work: that is no error of the run.
        """
        self._is_ending = True
        grace_s = at_least(5.0 if self.result.outcome else 15.0)  # [s] without an outcome the recorder still has to drain
        while self._unborn and not self._lines.empty() and (line := self._lines.get()) is not None:
            self._event(line)
        if self._unborn:
            self.process.terminate()  # what it has started gets SIGTERM then
        self._end(grace_s, stands=self.result.was_ended)
        if SIMULATION in self.names:  # it had an answer on its way, perhaps
            self._end_one_after_the_other([[SIMULATION]], grace_s)
        self._end_spawner()
        if self.crashed:
            shared_memory.clean_up()

    def _end(self, grace_s, stands=False):
        """End the nodes of the graph, then the recorder; before them where the run stands, and it has all that there is."""
        nodes = [name for name in self.names if name not in (RECORDER, SIMULATION)]
        self._end_one_after_the_other(([RECORDER], nodes) if stands else (nodes, [RECORDER]), grace_s)

    def _end_one_after_the_other(self, groups, grace_s):
        for names in groups:
            self._signal(names, signal.SIGTERM)
            self._signal(names, signal.SIGCONT)  # a stopped one wakes up and ends
            if not self._wait_gone(names, grace_s):
                self._killed |= {name for name in names if name in self.pids}
                self._signal(names, signal.SIGKILL)
                self._wait_gone(names, at_least(5.0))

    def _end_spawner(self):
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()
        self._wait_spawner()

    def _wait_spawner(self):
        """It ends by itself when its last child has; on a machine that is too busy for that, it is killed with them."""
        try:
            self.process.wait(timeout=at_least(10.0))
        except subprocess.TimeoutExpired:
            self.crashed = True
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()

    def _signal(self, names, number):
        for name in names:
            if name in self.pids:
                try:
                    os.kill(self.pids[name], number)
                except ProcessLookupError:
                    self.pids.pop(name, None)

    def _wait_gone(self, names, seconds) -> bool:
        deadline = time.monotonic() + seconds
        while any(name in self.pids for name in names):
            try:
                line = self._lines.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                return False
            if line is None:
                self.pids.clear()
                return True
            self._event(line)
        return True


def how_it_ended(code: int) -> str:
    """The end of a process in words."""
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"
