"""Runs a scenario as ROS 2 nodes: starts them, watches them, ends them, and leaves the bag."""

import contextlib
import importlib.util
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from flight_graph.components.names import ros
from flight_graph.components.records import flat
from flight_graph.engines import compilation
from flight_graph.engines.choice import check_engine
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.beginning import Beginning
from flight_graph.ros import checkpoint_settings, shared_memory
from flight_graph.ros.domain import Domain
from flight_graph.ros.installed import is_installed, not_live
from flight_graph.ros.patience import at_least, patience_s
from flight_graph.ros.supervisor import Supervisor
from flight_graph.timebase import SECOND
from msg_schemas.qos import WINDOW, WINDOW_LIVE

RECORDER = "recorder"
EVENTS = "events.jsonl"  # what was done to processes, for the bag


@dataclass
class RosRun:
    """What a ros run left behind. statistics: of the realtime loops, by node; outcome: the recorder's; domain: its id."""

    bag: Path
    wall_s: float = 0.0
    statistics: dict = field(default_factory=dict)
    outcome: dict = field(default_factory=dict)
    domain: int = 0
    notes: list = field(default_factory=list)  # what was done to processes


def node_parameters(scenario: Scenario, pace: str, factor: float, timeout_s: float,
                    check_bounds: bool = False, origin: str = "", begin: str = "") -> dict[str, dict]:
    """node name -> its ROS parameters: those of the component, and its place in the graph. Launch files use it too.

    origin: the name or the file of the scenario, for nodes with faults (by default its name); begin: the file of the
    checkpoint that the run begins at.
    """
    graph, faults = scenario.graph, scenario.faults
    master = graph.clock_master
    names = [name for name in graph.nodes if name != master] + [RECORDER]
    window_ns = (WINDOW_LIVE if faults.is_live else WINDOW) * min(node.period_ns for node in graph.nodes.values())
    recorded = set(scenario.recorded())
    common = {"pace": pace, "factor": float(factor), "window_ns": window_ns, "timeout_s": float(timeout_s),
              "supervised": True, "linger": True}
    parameters, memories = {}, checkpoint_settings.settings_of(scenario, pace == "lockstep", begin)
    for name, node in graph.nodes.items():
        patience = timeout_s if name == master else 2.0 * timeout_s  # the clock master sees who is behind: it speaks first
        settings = {**common, "timeout_s": float(patience), "check_bounds": check_bounds, "epoch_ns": scenario.epoch_ns,
                    "duration_s": scenario.duration_ns / SECOND,
                    "clock_master": name == master, "wait_for": names if name == master else [""]}
        if scenario.file.watchdog and pace == "realtime":
            settings["beats_often"] = True
            if name == master:
                gap_ns = round(scenario.file.watchdog.gap_s * SECOND)
                settings["beats"] = json.dumps({other: gap_ns + round(graph.nodes[other].period_ns / factor)
                                                for other in names[:-1]})
        for port, edge in node.inputs.items():
            source = graph.nodes[edge.node]
            settings[f"inputs.{port}.topic"] = graph.signal(edge.node, edge.port).topic
            settings[f"inputs.{port}.period_ns"] = source.output_period_ns(edge.port)
            settings[f"inputs.{port}.delay"] = edge.delay
            settings[f"inputs.{port}.slotted"] = faults.is_irregular(edge.node, edge.port)
        if faults.concerns(name):
            settings["scenario"] = origin or scenario.name
        if name in memories:
            settings["checkpoints"] = memories[name]
        for port in node.component.outputs:
            readers = {consumer.name + "." + target for consumer, target, _ in graph.consumers(name, port)}
            readers |= {f"{other}.when {name}.{port}" for other in graph.nodes if (name, port) in faults.watched(other)}
            settings[f"outputs.{port}.slotted"] = faults.is_irregular(name, port)
            heard = (name, port) in recorded or is_installed(graph.signal(name, port).type_name)  # the recorder has ears
            settings[f"outputs.{port}.subscribers"] = len(readers) + heard
        values = {key: flat(value) for key, value in node.values.items()}
        parameters[name] = {**values, "rate_hz": float(node.rate_hz),
                            **{f"graph.{key}": value for key, value in settings.items()}}
    common["timeout_s"] = 2.0 * timeout_s
    parameters[RECORDER] = {f"graph.{key}": value for key, value in common.items()}
    return parameters


def run(scenario: Scenario, folder: Path, pace: str = "lockstep", factor: float = 1.0, progress=None, compiling=None,
        check_bounds: bool = False, tell=None, begin: Beginning | None = None) -> RosRun:
    """Run a scenario as ROS 2 nodes and record it into ``folder``. Raises FlightError with the first node's sentence.

    pace: lockstep (as fast as the graph answers) or realtime (``factor`` simulated seconds per wall second).
    progress(seconds simulated) is called about once a simulated second; compiling: see `flight_graph.engines.compilation`;
    check_bounds: with checked indices; tell(sentence): of what a person should know before it starts. begin: where the run
    begins, if not at t = 0. KeyboardInterrupt ends the nodes, closes the bag, and goes on to the caller.
    """
    refuse(scenario)
    checkpoint_settings.refuse_realtime(scenario, pace, begin, tell)
    timeout_s = patience_s()
    compile_nodes(scenario.graph.nodes.values(), check_bounds, compiling)
    shared_memory.clean()
    with tempfile.TemporaryDirectory(prefix="flight_") as work, Domain(published(scenario.graph)) as domain:
        specs = _specs(scenario, Path(work), Path(folder).absolute(), pace, factor, timeout_s, check_bounds, begin)
        if tell and domain.is_own:
            tell(domain.sentence())
        if tell and (sentence := not_live(node.component for node in scenario.graph.nodes.values())):
            tell(sentence)
        launch = Launch(specs, RosRun(Path(folder)), pace == "lockstep", progress, domain)
        if pace == "realtime":
            own = {spec["name"]: spec for spec in specs if spec["name"] not in (RECORDER, scenario.graph.clock_master)}
            launch.supervisor = Supervisor(scenario, launch, own, Path(work) / EVENTS)
        result = launch.run()
        result.notes = launch.supervisor.notes if launch.supervisor else []
        return result


def published(graph) -> list[str]:
    """The topics of a graph."""
    return [graph.signal(name, port).topic for name, node in graph.nodes.items() for port in node.component.outputs]


def compile_nodes(nodes, check_bounds: bool = False, compiling=None) -> None:
    """Make the machine code of nodes before they start: no node's timeout runs meanwhile. Raises FlightError."""
    compilation.load({node.use: node.component for node in nodes}, check_bounds, compiling)


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
        self.supervisor = None  # of a realtime run
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
                if self.error or self.result.outcome or (self.master_done and not self.lockstep):
                    break
        finally:
            self._end_nodes()
        if self.error:
            raise FlightError(self.error)
        if not self.result.outcome:
            raise FlightError("the nodes ended before the recorder closed the bag")
        return self.result

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
        for names in ([name for name in self.names if name != RECORDER], [RECORDER]):
            self._signal(names, signal.SIGTERM)
            self._signal(names, signal.SIGCONT)  # a stopped one wakes up and ends
            if not self._wait_gone(names, grace_s):
                self._killed |= {name for name in names if name in self.pids}
                self._signal(names, signal.SIGKILL)
                self._wait_gone(names, at_least(5.0))
        self._end_spawner()
        if self.crashed:
            shared_memory.clean_up()

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


def _specs(scenario, work, folder, pace, factor, timeout_s, check_bounds, begin):
    start = checkpoint_settings.write(work, begin)
    resolved = work / "scenario.json"
    resolved.write_text(json.dumps(scenario.resolved()), encoding="utf-8", newline="\n")
    specs = []
    for name, values in node_parameters(scenario, pace, factor, timeout_s, check_bounds, str(resolved),
                                        start).items():
        if name == RECORDER:
            values = {**values, "scenario": str(resolved), "out": str(folder), "events": str(work / EVENTS),
                      "begin": start}
        path = work / f"{name}.yaml"
        path.write_text(yaml.safe_dump({f"/**/{ros(name)}": {"ros__parameters": values}}), encoding="utf-8", newline="\n")
        use = RECORDER if name == RECORDER else scenario.graph.nodes[name].use
        specs.append({"name": name, "use": use, "check_bounds": check_bounds,
                      "arguments": ["--ros-args", "-r", f"__node:={name.rpartition('.')[2]}", "--params-file", str(path)]})
    return specs


def refuse(scenario: Scenario) -> None:
    """Refuse a scenario or a machine that the ros engine cannot serve."""
    check_engine(scenario, "ros")
    if importlib.util.find_spec("rclpy") is None:
        raise FlightError("the ros engine needs rclpy; source a ROS 2 Jazzy, or install the extra: pip install "
                          "'flight_graph[ros]'")


def how_it_ended(code: int) -> str:
    """The end of a process in words."""
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"
