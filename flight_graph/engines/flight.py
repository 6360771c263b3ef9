"""A run under way in this process: advanced tick by tick by the compiled driver, or by its twin in plain Python."""

import threading
from dataclasses import dataclass

import numpy as np

from flight_graph.engines import checkpoint, driver, reductions
from flight_graph.engines.addresses import address
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.plain_driver import PlainTables
from flight_graph.engines.schedule import Schedule
from flight_graph.engines.stops import FAULT, REASONS, Records, raised_sentence, stop_sentence
from flight_graph.errors import FlightError, RunStopped
from flight_graph.timebase import SECOND, stamp_parts
from msg_schemas.signal import Signal

LAST_TICK_S = 2.0  # [s] that an interrupted tick is waited for


@dataclass
class Track:
    """All recorded messages of one topic. stamps_ns: (n,) time since the start; records: (n,) structured array."""

    topic: str
    signal: Signal
    node: str
    port: str
    stamps_ns: np.ndarray
    records: np.ndarray


class Flight:
    """A run under way: its whole memory is ``arrays``. ``stop`` is the RunStopped that ended it, if one did.

    run: the `flight_graph.engines.compiled.CompiledRun` that it is of; codes: node -> part -> its machine code, None in
    plain Python; begin: where it begins, if not at t = 0.
    """

    _control = None  # in plain Python

    def __init__(self, run, arrays: dict, codes: dict | None, begin: Checkpoint | None = None):
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
