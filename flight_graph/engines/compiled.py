"""A run of a scenario in this process: compiled parts and the fixed driver, or, for debuggers, plain Python.

With NUMBA_DISABLE_JIT=1 in the environment the same schedule is walked in plain Python (engine ``python``).
"""

import threading
import time
from dataclasses import dataclass, field

import numba
import numpy as np

from flight_graph.engines import checkpoint, compilation, driver, reductions
from flight_graph.engines.addresses import address
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.choice import refuse_foreign
from flight_graph.engines.memory import refuse_too_long
from flight_graph.engines.plain_driver import PlainTables
from flight_graph.engines.schedule import Schedule
from flight_graph.engines.stops import FAULT, REASONS, Records, raised_sentence, stop_sentence
from flight_graph.errors import FlightError, RunStopped
from flight_graph.graphs.scenario import Scenario
from flight_graph.timebase import SECOND, stamp_parts
from msg_schemas.signal import Signal

SHORTEST_CHUNK = 2000  # [ticks] between calls of progress
LAST_TICK_S = 2.0  # [s] that an interrupted tick is waited for
LONGEST_CHUNK = 200_000  # [ticks] until an interruption is seen


@dataclass
class Track:
    """All recorded messages of one topic. stamps_ns: (n,) time since the start; records: (n,) structured array."""

    topic: str
    signal: Signal
    node: str
    port: str
    stamps_ns: np.ndarray
    records: np.ndarray


@dataclass
class Recording:
    """What a run left behind: tracks in the order of the schedule, and how long it took.

    wall_s: seconds in the loop alone; compile_s: seconds until the first step could run. stopped: the sentence of a
    component that ended the run before its time. checkpoints: those that were kept, by tick.
    """

    scenario: Scenario
    tracks: list[Track] = field(default_factory=list)
    wall_s: float = 0.0
    compile_s: float = 0.0
    stopped: str = ""
    checkpoints: list[Checkpoint] = field(default_factory=list)

    def __getitem__(self, topic: str) -> np.ndarray:
        for track in self.tracks:
            if track.topic == topic.lstrip("/"):
                return track.records
        raise KeyError(topic)

    def __contains__(self, topic: str) -> bool:
        return any(track.topic == topic.lstrip("/") for track in self.tracks)


class CompiledRun:
    """One run of a scenario. `compile` makes the machine code ready, `run` fills the recording.

    plan: (node, port) -> every how manieth message is logged; as the scenario says when left out. like: a compiled run of
    the same components. reducing: whether the scenario's measures are taken while it flies (`Flight.reduced`).
    """

    def __init__(self, scenario: Scenario, check_bounds: bool = False, plan: dict | None = None,
                 like: "CompiledRun | None" = None, reducing: bool = False):
        self.scenario, self.graph, self.check_bounds = scenario, scenario.graph, check_bounds
        refuse_foreign(scenario)
        plan = scenario.recorded() if plan is None else plan
        self.schedule = Schedule.of(self.graph, plan, scenario.faults, scenario.measured() if reducing else None,
                                    scenario.tapes)
        self._codes = None if like is None else like._codes
        self.shape = None  # of its checkpoints, once it is asked for

    @property
    def ticks(self) -> int:
        """Ticks of the whole run."""
        return self.scenario.ticks

    @property
    def components(self) -> dict:
        """use -> component, of all nodes."""
        return {node.use: node.component for node in self.graph.nodes.values() if not node.is_foreign}

    def is_compiled(self) -> bool:
        """Whether all machine code lies in the cache."""
        return bool(numba.config.DISABLE_JIT) or compilation.is_ready(self.components, self.check_bounds)

    def compile(self, progress=None) -> float:
        """Make the machine code ready (from the cache where it can be); return the seconds it took.

        progress(components done, in all, names of those under way) is called while something is compiled.
        """
        began = time.perf_counter()
        if self._codes is None and not numba.config.DISABLE_JIT:
            found = compilation.load(self.components, self.check_bounds, progress)
            self._codes = {name: found[node.use] for name, node in self.graph.nodes.items() if not node.is_foreign}
        return time.perf_counter() - began

    def start(self, ticks: int, logs: dict | None = None, begin: Checkpoint | None = None, kind: type | None = None):
        """A `Flight` in fresh memory for so many ticks: every component started, or as it stood at a checkpoint.

        kind: of flight. Raises FlightError where the checkpoint is of another graph.
        """
        self.refuse_too_long_a_run(ticks)
        self.compile()
        return (kind or Flight)(self, self.schedule.memory(ticks, logs), self._codes, begin)

    def flight(self, arrays: dict) -> "Flight":
        """A flight in this memory, with every component started."""
        return Flight(self, arrays, self._codes)

    def refuse_too_long_a_run(self, ticks: int, keeping: bool = False) -> None:
        """Refuse a run whose log (and checkpoints, where it keeps them) does not fit into memory. Raises FlightError."""
        size = self.schedule.log_bytes(ticks)
        if keeping and self.scenario.checkpoint_period_ns:
            kept = sum(array.nbytes for name, array in self.schedule.memory(0).items() if checkpoint.is_kept(name))
            size += kept * (ticks * self.graph.base_ns // self.scenario.checkpoint_period_ns)
        refuse_too_long(size, f"{self.scenario.origin}: a run of {ticks} ticks of "
                        f"{self.graph.base_ns / SECOND:g} s")

    def run(self, progress=None, logs: dict | None = None, compiling=None, begin: Checkpoint | None = None,
            keeping: bool = False) -> Recording:
        """Run the scenario. progress(seconds simulated) is called now and then.

        Raises RunStopped on a fault; what was recorded until then is its ``recording``. logs: takes the arrays of the log,
        and gives those of an earlier run back to this one: a recording made with the same dictionary before is
        overwritten. compiling: as the progress of `compile`. begin: where the run begins, if not at t = 0; keeping: whether
        the checkpoints that the scenario asks for are kept.
        """
        first, ticks = begin.tick if begin else 0, self.ticks
        if logs is None or not logs:
            self.refuse_too_long_a_run(max(ticks - first, 0), keeping)
        compile_s = self.compile(compiling)
        began = time.perf_counter()
        flight = self.start(max(ticks - first, 0), logs, begin)
        chunk, checkpoints = min(max(SHORTEST_CHUNK, ticks // 100) if progress else max(ticks, 1), LONGEST_CHUNK), []
        while not flight.stop and flight.tick < ticks:
            due = self.scenario.next_checkpoint(flight.tick) if keeping else ticks
            flight.advance(min(ticks, flight.tick + chunk, due))
            if flight.tick == due < ticks and not flight.stop:
                checkpoints.append(flight.checkpoint())
            if progress:
                progress(flight.tick * self.graph.base_ns / SECOND)
        wall_s = time.perf_counter() - began
        if logs is not None:
            logs.update((name, array) for name, array in flight.arrays.items() if name.startswith("L_"))
        recording = Recording(self.scenario, flight.tracks(), wall_s, compile_s, checkpoints=checkpoints)
        if flight.stop:
            flight.stop.recording, recording.stopped = recording, str(flight.stop)
            raise flight.stop
        return recording


class Flight:
    """A run under way: its whole memory is ``arrays``. ``stop`` is the RunStopped that ended it, if one did."""

    _control = None  # in plain Python

    def __init__(self, run: CompiledRun, arrays: dict, codes: dict | None, begin: Checkpoint | None = None):
        self.arrays, self.stop = arrays, None
        self._run, self._graph, self._schedule, self._codes = run, run.graph, run.schedule, codes
        self._tick = self._first = begin.tick if begin else 0
        if begin:
            begin.restore(arrays, self.shape, run.scenario.origin)
        with np.errstate(all="ignore"):
            if codes is None:
                components = {name: node.component for name, node in self._graph.nodes.items()}
                self._tables = PlainTables(self._schedule, arrays, components, run.scenario.epoch_ns)
            else:
                self._tables = driver.Tables(self._schedule, arrays, codes, run.scenario.epoch_ns)
                self._control = self._tables.control(run.scenario.epoch_ns, self._graph.base_ns)
            self._seek(self._tick)
            if begin is None:
                self._start()

    @property
    def shape(self) -> dict:
        """What a checkpoint of it must have, see `flight_graph.engines.checkpoint.shape`."""
        if self._run.shape is None:
            self._run.shape = checkpoint.shape(self._graph, self.arrays, self._run.scenario.epoch_ns)
        return self._run.shape

    def _seek(self, tick):
        """Let the next tick be this one."""
        self._tick = tick
        self._tables.begin(tick)
        if self._codes is not None:
            self._control["tick"] = tick

    def checkpoint(self) -> Checkpoint:
        """The memory as it is now, before the next tick."""
        return Checkpoint.of(self._tick, self.shape, self.arrays)

    def begin_again(self, contents: dict[str, np.ndarray]) -> None:
        """Start anew in the same memory, with these contents of the arrays: all of them, but for logs."""
        for name, content in contents.items():
            self.arrays[name].view(np.uint8)[...] = content.view(np.uint8)
        self._tables.rewind()
        self._control["tick"] = self._control["stop"] = self._control["who"] = self._tick = 0
        self.stop = None
        self._start()

    @property
    def tick(self) -> int:
        """The next tick."""
        return self._tick

    @property
    def schedule(self) -> Schedule:
        """The order of a tick."""
        return self._schedule

    @property
    def codes(self) -> dict | None:
        """node -> part -> its machine code; None in plain Python."""
        return self._codes

    @property
    def bounds_checked(self) -> bool:
        """Whether its machine code checks the bounds of arrays."""
        return self._run.check_bounds

    @property
    def tables(self):
        """What the driver walks and counts in."""
        return self._tables

    @property
    def control(self) -> np.ndarray | None:
        """The record that the driver works on; None in plain Python."""
        return self._control

    def _start(self):
        for node, parameters, state in self._schedule.starts:
            if not self.stop:
                parameters, state = self.arrays[parameters], self.arrays[state]
                self._guarded(node, "start", self._tables.start, node, parameters, state)
                if not self.stop and state["fault"][0]:
                    self._stopped(node, "start", FAULT)

    def advance(self, tick: int) -> None:
        """Run until before a tick, or until a component stops the run."""
        if self._codes is None:
            self._advance_plainly(tick)
            return
        self._control["end"] = tick
        try:
            code = self._drive()
        finally:
            self._tick = int(self._control["tick"][0])
        if code == 1:
            firing = self._schedule.firings[int(self._control["who"][0])]
            self.stopped_at(self._tick, firing.node, firing.part, int(self._control["stop"][0]))

    def went_to(self, tick: int) -> None:
        """Another driver (`flight_graph.lanes`) has brought memory and tables to a tick."""
        self._control["tick"] = self._tick = tick

    def stopped_at(self, tick: int, node: str, part: str, code: int) -> None:
        """A part stopped the run at a tick. code: one of `stops`."""
        self.went_to(tick)
        self._stopped(node, part, code)

    def _drive(self) -> int:
        """Run the driver to its end; in a thread, where this one is to hear signals: inside of machine code it cannot."""
        run, control = driver.CODE.function("run"), address(self._control)
        if threading.current_thread() is not threading.main_thread():
            return run(control)
        said, ended = [], threading.Event()  # an interrupted join of CPython 3.11 takes its thread for ended
        threading.Thread(target=lambda: (said.append(run(control)), ended.set()), daemon=True).start()
        try:
            ended.wait()
        except KeyboardInterrupt:
            self._control["end"] = 0  # the driver leaves between two ticks
            if not ended.wait(LAST_TICK_S):
                raise FlightError("interrupted, and a kernel does not come to its end: flight check finds which") from None
            raise
        return said[0]

    def _advance_plainly(self, end):
        with np.errstate(all="ignore"):
            while not self.stop and self._tick < end and not self._plain_tick(self._tick * self._graph.base_ns):
                pass

    def _plain_tick(self, t_ns) -> bool:
        """Run one tick; whether to end here."""
        self._tables.hold(self._tick)
        stamp = stamp_parts(self._run.scenario.epoch_ns + t_ns)
        for firing, bound in zip(self._schedule.firings, self._tables.firings):
            if self._tick % firing.period == 0:
                code = self._guarded(firing.node, firing.part, bound.fire, self._tick, t_ns, stamp)
                if code:
                    self._stopped(firing.node, firing.part, code)
                if self.stop:
                    return True
        self._tick += 1
        return False

    def _guarded(self, node, part, call, *arguments):
        """What a kernel raises in plain Python stops the run, as it does when compiled."""
        try:
            return call(*arguments)
        except FlightError:
            raise
        except Exception as error:
            text = raised_sentence(node, part, f"{type(error).__name__}: {error}", self._seconds())
            self.stop = RunStopped(text, "error", self._tick * self._graph.base_ns)
            self.stop.__cause__ = error
            return 0

    def _seconds(self):
        return self._tick * self._graph.base_ns / SECOND

    def _stopped(self, name, part, code):
        component = self._graph.nodes[name].component
        records = Records(self.arrays[f"P_{name}"], self.arrays[f"X_{name}"], {
            port: self.arrays.get(f"E_{name}.{port}", self.arrays[f"O_{name}.{port}"]) for port in component.outputs})
        errors = self._codes[name][part].errors if self._codes else None
        sentence = stop_sentence(name, part, component, code, records, self._seconds(), errors)
        self.stop = RunStopped(sentence, REASONS[code], self._tick * self._graph.base_ns)

    def logged(self) -> dict[str, np.ndarray]:
        """topic -> its records so far."""
        counts = self._tables.logged()
        return {made.signal.topic: self.arrays[made.log][:counts[made.log]] for firing in self._schedule.firings
                for made in firing.publications if made.log is not None}

    def reduced(self) -> dict[str, float | None]:
        """name -> number of each measure that is taken while it flies, of the messages so far and the whole duration."""
        duration_ns = self._run.scenario.duration_ns
        return {one.measure.name: reductions.result(one.measure, self.arrays[one.memory], duration_ns)
                for firing in self._schedule.firings for made in firing.publications for one in made.reductions}

    def tracks(self) -> list[Track]:
        """What was logged so far."""
        tracks, counts = [], self._tables.logged()
        for firing in self._schedule.firings:
            for made in firing.publications:
                if made.log is not None:
                    records = self.arrays[made.log][:counts[made.log]]
                    period = self._schedule.log_period_ns(firing.node, made.port)
                    begin = -(-self._first * self._graph.base_ns // period)
                    stamps = (begin + np.arange(len(records))) * period if made.times is None else (
                        self.arrays[made.times][:len(records)] * self._graph.base_ns)
                    tracks.append(Track(made.signal.topic, made.signal, firing.node, made.port, stamps, records))
        for tape in self._schedule.tapes:
            if (tape.node, tape.port) in self._schedule.plan:
                signal, played = self._graph.signal(tape.node, tape.port), tape.between(self._first, self._tick)
                stamps = tape.ticks[played] * self._graph.base_ns
                tracks.append(Track(signal.topic, signal, tape.node, tape.port, stamps, tape.records[played]))
        return tracks
