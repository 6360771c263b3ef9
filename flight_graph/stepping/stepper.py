"""A run in the hands of a program: run to where one wants, look, step, go back, branch.

    run = Stepper("cubli_asteroid")                          # a scenario, or the bag of a run
    run.until("controller.funnel.attitude_xi[0] > 0.9")      # or a time [s], a component, tick=4250
    run.state["estimator"]                                   # the record as it is now
    run.step()                                               # one firing; run.back() takes it back
    other = run.branch(set={"controller.lambda_a": 0.03})    # goes on from here, otherwise

Whatever way led to a tick, the memory there is the same, bit for bit: a step back runs from the nearest checkpoint.
"""

from collections.abc import Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numba import config

from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.compiled import CompiledRun
from flight_graph.engines.stepped import SteppedFlight
from flight_graph.errors import FlightError, unknown
from flight_graph.faults.conditions import condition
from flight_graph.graphs import placements
from flight_graph.graphs import scenario as scenarios
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings import beginning, continuation
from flight_graph.recordings.recorded_run import RecordedRun, open_recorded
from flight_graph.stepping import fields
from flight_graph.stepping.kept import SPACING, Kept
from flight_graph.timebase import SECOND

_PLAIN_SPACING = 16  # [ticks] between checkpoints in plain Python, where a tick takes long
_CHUNK = 4096  # [ticks] between calls of progress


class Records(Mapping):
    """The records of one kind by component, as they are now: fields by attribute, ``run.state["estimator"].bias``.

    What is read is a copy: the run is changed by `Stepper.branch` alone.
    """

    def __init__(self, arrays: dict, kind: str, names):
        self._arrays, self._kind, self._names = arrays, kind, list(names)

    def __getitem__(self, name: str) -> np.record:
        if name not in self._names:
            raise KeyError(f"there is no component '{name}'; known: {', '.join(self._names)}")
        return self._arrays[f"{self._kind}{name}"].copy().view(np.recarray)[0]

    def __iter__(self):
        return iter(self._names)

    def __len__(self):
        return len(self._names)


class Stepper:
    """A run that stands still until it is told to go on. Raises FlightError on everything that is wrong.

    source: a `Scenario`, the name or file of one, or a bag (``BAG`` or ``BAG@SECONDS``): its run, from itself. settings:
    for a scenario, as for `flight_graph.graphs.scenario.load`; for a bag, a branch. trust: whether a bag's own code may
    run. In a process with NUMBA_DISABLE_JIT=1 the kernels are plain Python. progress(seconds simulated) is called now and
    then.
    """

    def __init__(self, source, settings: dict | None = None, trust=False, check_bounds: bool = False, progress=None):
        self.recorded: RecordedRun | None = None
        self.progress = progress or (lambda seconds: None)
        self.notes: list[str] = []
        begin, seconds = None, None
        if not isinstance(source, Scenario):
            path, seconds = continuation.split(str(source), "step")
            if _is_bag(path):
                self.recorded = open_recorded(path, trust)
                source, begin = self.recorded.scenario, self.recorded.first
                continuation.refuse_realtime(self.recorded)
            elif seconds is not None:
                raise FlightError(f"step {source}: there is no bag at '{path}', and a time behind @ is one of a bag")
            else:
                source = scenarios.load(str(source), settings)
        self._open(source, begin, check_bounds)
        if seconds is not None:
            self._begin_at(seconds)
        if self.recorded and settings:
            self._become(self.branch(settings))

    def _begin_at(self, seconds: float):
        tick, run = continuation.tick_at(seconds, self.scenario.graph.base_ns, f"@{seconds:g}"), self.scenario
        if not self.first_tick <= tick <= run.ticks:
            raise FlightError(f"there is no t = {seconds:.9g} s in this bag: the run goes from "
                              f"{self.first_tick * run.graph.base_ns / SECOND:.9g} to {run.duration_ns / SECOND:.9g} s")
        self.until(tick=tick)

    def _open(self, scenario: Scenario, begin: Checkpoint | None, check_bounds: bool):
        self.scenario, self._check_bounds = scenario, check_bounds
        machine = CompiledRun(scenario, check_bounds, plan={})
        self.schedule = machine.schedule
        self.flight: SteppedFlight = machine.start(0, begin=begin, kind=SteppedFlight)
        self._kept = Kept(self.flight.checkpoint(), _PLAIN_SPACING if config.DISABLE_JIT else SPACING)
        names = list(scenario.graph.nodes)
        self.state = Records(self.flight.arrays, "X_", names)
        self.parameters = Records(self.flight.arrays, "P_", names)

    def _become(self, other: "Stepper"):
        for name in ("scenario", "schedule", "flight", "_kept", "state", "parameters", "recorded", "notes"):
            setattr(self, name, getattr(other, name))

    # -- where it stands -------------------------------------------------------------------------------------------
    @property
    def tick(self) -> int:
        """The tick that it stands in or before."""
        return self.flight.tick

    @property
    def t_s(self) -> float:
        """Time of that tick [s]."""
        return self.tick * self.scenario.graph.base_ns / SECOND

    @property
    def first_tick(self) -> int:
        """The tick before which there is nothing."""
        return self._kept.first.tick

    @property
    def upcoming(self) -> tuple[str, str] | None:
        """(component, part) of the firing that comes next; None at the end of the run, and where a component stopped it."""
        if self.stopped or self.tick >= self.scenario.ticks:
            return None
        firing = self.flight.upcoming[1]
        return firing.node, firing.part

    @property
    def stopped(self) -> str:
        """The sentence of a component that stopped the run; empty: none did."""
        return str(self.flight.stop or "")

    def read(self, name: str):
        """A number, an array or a record (as a dictionary) by its name, see `flight_graph.stepping.fields`."""
        return fields.find(name, self.schedule, "read").read(self.flight.arrays)

    # -- forward ---------------------------------------------------------------------------------------------------
    def until(self, what=None, *, tick: int | None = None) -> bool:
        """Run until something; return whether it came before the end of the run and any stop.

        what: a time [s]; the name of a component, to stand before its next firing; or a condition, to stand before the
        first tick, from the next one on, at which it holds. A time or a tick that is past is gone back to.
        """
        if what is None and tick is None:
            raise FlightError("until: a time in seconds, a component, a condition or tick=NUMBER")
        if tick is not None:
            return self._to(tick)
        if isinstance(what, (int, float)):
            if not 0 <= what < 1e9:
                raise FlightError(f"until {what}: no time; allowed: seconds from 0 on")
            return self._to(continuation.tick_at(float(what), self.scenario.graph.base_ns, f"until {what:g}"))
        if what in self.scenario.graph.nodes:
            return self._until_firing(what)
        if what.strip().isidentifier():
            raise unknown("component", what.strip(), self.scenario.graph.nodes, "until")
        return self._until_condition(what)

    def _to(self, tick: int) -> bool:
        if tick < self.first_tick:
            raise FlightError(f"tick {tick}: the run begins at tick {self.first_tick}")
        known = self._before(tick)
        if tick < self.tick or self.stopped or self.flight.fired and tick == self.tick or known.tick > self.tick:
            self.flight.restore(known)
        self._run(min(tick, self.scenario.ticks))
        return self.tick == tick and not self.stopped

    def _until_firing(self, name: str) -> bool:
        if self.upcoming and self.upcoming[0] == name:
            self._fire()
        node = self.scenario.graph.nodes[name]
        period = self.scenario.graph.ticks(node)
        if not self.flight.fired and self.tick % period:
            self._run(min(-(-self.tick // period) * period, self.scenario.ticks))
        while self.upcoming and self.upcoming[0] != name:
            self._fire()
            if not self.flight.fired and self.tick % period:
                self._run(min(-(-self.tick // period) * period, self.scenario.ticks))
        return self.upcoming is not None

    def _until_condition(self, text: str) -> bool:
        asked = condition(text, self.scenario.graph.nodes, "until")
        self.flight.watch(asked)
        try:
            self._run(self.scenario.ticks)
            return not self.stopped and self.tick > self.first_tick and self.flight.is_met()
        finally:
            self.flight.watch(None)

    def _run(self, tick: int) -> None:
        """Run forward until before a tick, a stop, or where a condition that is watched for holds."""
        while self.tick < tick and not self.stopped:
            goal = min(tick, self._kept.next_tick(self.tick), self.tick + _CHUNK)
            with self._whole():
                self.flight.advance(goal)
            if not self.stopped and not self.flight.fired:
                self._kept.add(self.tick, self.flight.checkpoint)
            self.progress(self.t_s)
            if self.tick < goal or self.flight.is_met():
                return

    def step(self, firings: int = 1, *, ticks: int = 0, around=None) -> bool:
        """Go on by some firings, or by ticks; return whether the run came so far.

        around(function, *arguments): calls the kernel of the firing in its place, in plain Python (a debugger does so).
        """
        if ticks:
            return self._to(self.tick + ticks)
        for _ in range(firings):
            if self.upcoming is None:
                return False
            self._fire(around)
        return not self.stopped

    def _fire(self, around=None):
        if not self.flight.fired:
            self._kept.add(self.tick, self.flight.checkpoint)
        with self._whole():
            self.flight.fire(around)

    @contextmanager
    def _whole(self):
        """A kernel in plain Python that was interrupted has half changed its state: stand before its tick again."""
        try:
            yield
        except KeyboardInterrupt:
            if config.DISABLE_JIT:
                tick = self.tick
                self.flight.restore(self._before(tick))
                self.flight.advance(tick)
            raise

    # -- back ------------------------------------------------------------------------------------------------------
    def back(self, firings: int = 1, *, ticks: int = 0) -> bool:
        """Go back by some firings, or by ticks, bit for bit; return whether there was so much to take back.

        A firing that stopped the run counts: one back, and it comes next.
        """
        if ticks:
            goal = self.tick - ticks
            self._to(max(goal, self.first_tick))
            return goal >= self.first_tick
        tick, fired = self.tick, self.flight.fired + bool(self.stopped)
        while firings > fired and tick > self.first_tick:
            firings -= fired
            tick -= 1
            fired = len(self.flight.due(tick))
        self.go(tick, max(fired - firings, 0))
        return firings <= fired

    def go(self, tick: int, fired: int = 0) -> None:
        """Stand in a tick, behind so many of its firings."""
        self._to(tick)
        for _ in range(fired):
            self._fire()

    def _before(self, tick: int) -> Checkpoint:
        """The nearest checkpoint not behind a tick, of those in memory and in the bag."""
        kept = self._kept.before(tick)
        if self.recorded is None:
            return kept
        known = [one for one in beginning.ticks(self.recorded.bag) if kept.tick < one <= tick]
        return beginning.checkpoint(self.recorded.bag, known[-1]) if known else kept

    def checkpoint(self) -> Checkpoint:
        """The memory, where the run stands between two ticks. Raises FlightError within one."""
        if self.flight.fired or self.stopped:
            raise FlightError("a checkpoint is taken between two ticks; run to a tick first")
        return self.flight.checkpoint()

    # -- elsewhere -------------------------------------------------------------------------------------------------
    def branch(self, set: dict | None = None, place: dict | None = None) -> "Stepper":  # noqa: A002 (as a person says it)
        """Another run that begins at this tick, with something set, ``component.parameter`` -> value, or put elsewhere,
        component -> quantities, see `flight_graph.components.placement`: ``place={"plant": {"velocity": [0.1, 0, 0]}}``.

        ``notes`` of it say what of that acted at the start only. Within a tick it begins before the tick.
        """
        memory = self.memory_of_tick()
        settings = dict(set or {})
        if place:
            nodes = self.scenario.graph.nodes
            given = {name: placements.require(nodes, name, found, "place") for name, found in place.items()}
            settings["events"] = [*(self.scenario.resolved().get("events") or []),
                                  {"at_s": memory.t_ns / SECOND, "place": given}]
        made = continuation.branch(self.scenario, memory, "the run that was stepped", settings, None)
        other = object.__new__(Stepper)
        other.recorded, other.progress, other.notes = None, self.progress, made.warnings
        other._open(made.scenario, made.begin.checkpoint, self._check_bounds)
        return other

    def memory_of_tick(self) -> Checkpoint:
        """The memory before the tick that it stands in."""
        if not self.flight.fired and not self.stopped:
            return self.flight.checkpoint()
        return continuation.memory_from(self.scenario, self._before(self.tick), self.tick)

    def history(self, name: str, seconds: float, most: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
        """(times [s] (n,), values (n, m)) of the m numbers of a field in the last seconds, at its component's firings."""
        found = fields.find(name, self.schedule, "plot")
        if not found.path:
            raise FlightError(f"plot: {name} is a record; name a number of it")
        node = self.scenario.graph.nodes[fields.node_and_port(found, self.schedule)[0]]
        base_ns, period = self.scenario.graph.base_ns, self.scenario.graph.ticks(node)
        first = max(self.first_tick, self.tick - round(seconds * SECOND) // base_ns)
        period *= max(1, -(-(self.tick - first) // (period * most)))
        flight = CompiledRun(self.scenario, self._check_bounds, plan={}).start(
            0, begin=self._before(first), kind=SteppedFlight)
        numbers, times, values = found.view(flight.arrays), [], []
        for tick in range(-(-first // period) * period, self.tick + 1, period):
            flight.advance(tick)
            if flight.stop:
                break
            times.append(tick * base_ns / SECOND)
            values.append(numbers.astype(float))
        return np.array(times), np.array(values).reshape(len(times), -1)


def _is_bag(path: Path) -> bool:
    return path.is_dir() or path.suffix in (".mcap", ".db3", ".zstd")
