"""A run of a scenario in this process: compiled parts and the fixed driver, or, for debuggers, plain Python.

With NUMBA_DISABLE_JIT=1 in the environment the same schedule is walked in plain Python (engine ``python``).
"""

import time
from dataclasses import dataclass, field

import numba
import numpy as np

from flight_graph.engines import checkpoint, compilation
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.choice import refuse_foreign
from flight_graph.engines.flight import Flight, Track
from flight_graph.engines.memory import refuse_too_long
from flight_graph.engines.schedule import Schedule
from flight_graph.graphs.scenario import Scenario
from flight_graph.timebase import SECOND

SHORTEST_CHUNK = 2000  # [ticks] between calls of progress
LONGEST_CHUNK = 200_000  # [ticks] until an interruption is seen


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
