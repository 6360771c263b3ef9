"""A recorded run, taken up at one of its ticks: the same run continued, or a branch of it with something set.

The memory at the tick is that of the nearest checkpoint before it, run on without a log; of a bag without checkpoints, the
start. Any engine goes on from there.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from flight_graph.bags.errors import quoted
from flight_graph.components import names
from flight_graph.engines import checkpoint
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs import setting, vehicles
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.beginning import Beginning
from flight_graph.recordings.recorded_run import RecordedRun, open_recorded
from flight_graph.text_files import short
from flight_graph.timebase import SECOND
from flight_math.noise import stream_key

CHUNK = 100_000  # [ticks] between calls of progress
_BESIDE = ("duration_s", "record", "title", "description", "metrics", "figure", "paper")  # keys that change no bit


@dataclass(frozen=True)
class Continuation:
    """What runs, and where it begins. warnings: what a person should know before."""

    scenario: Scenario
    begin: Beginning
    warnings: list[str] = field(default_factory=list)


def split(text: str, option: str) -> tuple[Path, float | None]:
    """``BAG@SECONDS`` as path and time; the time may be left out. Raises FlightError."""
    path, at, seconds = text.rpartition("@")
    if not at:
        return Path(text), None
    try:
        number = float(seconds)
    except ValueError:
        number = float("nan")
    if not 0.0 <= number < 1e9:
        raise FlightError(f"{option} {short(text)}: '{short(seconds)}' is no time; write BAG@SECONDS, as runs/hop@42.5")
    return Path(path), number


def tick_at(seconds: float, base_ns: int, where: str) -> int:
    """The tick at a time [s]. Raises FlightError where there is none."""
    t_ns = round(seconds * SECOND)
    if t_ns % base_ns:
        before = t_ns // base_ns * base_ns
        raise FlightError(f"{where}: there is no tick at t = {t_ns / SECOND:.9g} s; the nearest are at "
                          f"{before / SECOND:.9g} and {(before + base_ns) / SECOND:.9g} s")
    return t_ns // base_ns


def continued(text: str, settings: dict | None = None, duration_s: float | None = None, trust=False, progress=None,
              compiling=None, option: str = "--from") -> Continuation:
    """Take a run up at ``BAG@SECONDS``. Raises FlightError.

    settings: ``component.parameter`` -> value; with any it is a branch. duration_s: simulated time from there on; by
    default to the end of the run. trust: as for `open_recorded`. progress(seconds simulated, where to) on the
    way from the checkpoint.
    """
    path, seconds = split(text, option)
    if seconds is None:
        raise FlightError(f"{option} {short(text)}: at which time? Write BAG@SECONDS, as {quoted(path)}@42.5")
    run = open_recorded(path, trust)
    tick = tick_at(seconds, run.scenario.graph.base_ns, f"{option} {short(text)}")
    memory = memory_at(run, tick, progress, compiling)
    made = branch(run.scenario, memory, path.resolve().name, settings or {}, duration_s,
                  [run.changes_sentence()] if run.changed else [])
    if run.scenario.foreign and not run.complete:
        _refuse_unsaid(run.scenario, made.scenario.duration_ns, run.recorded_until_ns)
    return made


def taken_back(path: Path, t_ns: int) -> Continuation:
    """A run that was ended at a later time, to go on from a tick of it; what was set from there on is forgotten.

    Whoever ran it has agreed to its code. Raises FlightError.
    """
    run = open_recorded(path, trust=True, set_before_ns=t_ns)
    memory = memory_at(run, t_ns // run.scenario.graph.base_ns)
    return branch(run.scenario, memory, path.resolve().name, {})


def memory_at(run: RecordedRun, tick: int, progress=None, compiling=None) -> Checkpoint:
    """The memory of a recorded run before a tick. Raises FlightError where the bag does not reach to it."""
    where, base_ns = f"bag {quoted(run.bag.path)}", run.scenario.graph.base_ns
    refuse_realtime(run)
    first = run.first.tick if run.first else 0
    last = run.scenario.ticks if run.complete else -(-run.recorded_until_ns // base_ns)
    if not first <= tick <= last:
        raise FlightError(f"{where}: tick {tick} (t = {tick * base_ns / SECOND:.9g} s) is outside of it; it holds the run "
                          f"from tick {first} (t = {first * base_ns / SECOND:.9g} s) to {last} "
                          f"({last * base_ns / SECOND:.9g} s)")
    return memory_from(run.scenario, run.checkpoint_before(tick), tick, progress, compiling)


def refuse_realtime(run: RecordedRun) -> None:
    """Refuse a run that cannot be made again. Raises FlightError."""
    if run.is_realtime:
        raise FlightError(f"bag {quoted(run.bag.path)}: the run was in realtime, where the wall clock decided which "
                          "message reached whom in time; only a run in lockstep can be taken up")


def memory_from(scenario: Scenario, begin: Checkpoint | None, tick: int, progress=None, compiling=None) -> Checkpoint:
    """The memory before a tick, run on from a checkpoint (None: from the start). Raises FlightError."""
    machine = CompiledRun(scenario, plan={})
    machine.compile(compiling)
    flight = machine.start(0, begin=begin)
    while not flight.stop and flight.tick < tick:
        flight.advance(min(tick, flight.tick + CHUNK))
        if progress:
            progress(flight.tick * scenario.graph.base_ns / SECOND, tick * scenario.graph.base_ns / SECOND)
    if flight.stop:
        raise flight.stop
    return flight.checkpoint()


def branch(scenario: Scenario, memory: Checkpoint, parent: str, settings: dict, duration_s: float | None = None,
           warnings=()) -> Continuation:
    """The scenario that goes on from a memory, with something set. Raises FlightError."""
    changes = {key: value for key, value in settings.items() if key not in _BESIDE}
    if duration_s is not None:
        if not 0.0 < duration_s < 1e9:
            raise FlightError(f"--duration {duration_s:g}: allowed: a time in seconds greater than 0")
        settings = {**settings, "duration_s": (memory.t_ns + round(duration_s * SECOND)) / SECOND}
    if scenario.foreign:
        _refuse_unheard(scenario, changes)
    changed = _with(scenario, settings, memory.tick) if settings else scenario
    if scenario.foreign:
        _refuse_unsaid(scenario, changed.duration_ns, scenario.duration_ns)
    if memory.tick >= changed.ticks:
        raise FlightError(f"at t = {memory.t_ns / SECOND:.9g} s the run of {changed.duration_ns / SECOND:g} s is over; "
                          "--duration SECONDS goes on")
    begin, found = (memory, []) if not changes else _set(scenario, changed, memory)
    return Continuation(changed, Beginning(begin, parent, memory.digest, changes), [*warnings, *found])


def _refuse_unheard(scenario: Scenario, changes: dict) -> None:
    """Refuse changes to which a foreign node would have answered otherwise: those that reach it. Raises FlightError."""
    for key in changes:
        name, parameter = names.split(key, scenario.graph.nodes)
        heard = reached(scenario, name) if parameter and name in scenario.graph.nodes else scenario.graph.nodes
        if found := [one for one in scenario.foreign if one in heard]:
            raise FlightError(f"--set {key}: {' and '.join(found)} stands for a foreign node, which this reaches; what it "
                              "would have answered to a change is not in the bag")


def _refuse_unsaid(scenario: Scenario, end_ns: int, known_ns: int) -> None:
    """Refuse to go on to a time for which nobody knows what a foreign node would have said. Raises FlightError."""
    if end_ns > known_ns:
        raise FlightError(f"--duration: {' and '.join(scenario.foreign)} stands for a foreign node; what it would have "
                          f"said after t = {known_ns / SECOND:.9g} s is not in the bag")


def reached(scenario: Scenario, name: str) -> set[str]:
    """The components to which a change of one can come: itself, who reads it, who reads them; all, behind monitors that may
    act.
    """
    graph, faults = scenario.graph, scenario.faults
    found, waiting = set(), {name}
    while waiting:
        one = waiting.pop()
        if faults.monitors_at(one) is not None:
            return {*graph.nodes}
        found.add(one)
        waiting |= {consumer.name for consumer, _, _ in graph.consumers(one)} - found
        waiting |= {other for other in graph.nodes if any(node == one for node, _ in faults.watched(other))} - found
    return found


def _past(entry: dict, settings: dict, t_ns: int) -> dict:
    """An event, with what a branch sets in the place of what the event has set by then."""
    if round(entry["at_s"] * SECOND) > t_ns or "set" not in entry:
        return entry
    return {**entry, "set": {key: settings.get(key, value) for key, value in entry["set"].items()}}


def _with(scenario: Scenario, settings: dict, tick: int) -> Scenario:
    data = setting.override(scenario.resolved(), settings, folder=scenario.folder)
    if "events" not in settings:
        data = _with_past(data, settings, tick * scenario.graph.base_ns)
    made = Scenario(_with_streams(data, scenario, settings), scenario.origin, scenario.folder)
    made.tapes = scenario.tapes
    return made


def _with_past(data: dict, settings: dict, t_ns: int) -> dict:
    """A scenario's data with events that set what a branch sets."""
    made = {**data, "events": [_past(entry, settings, t_ns) for entry in data.get("events") or []] or None}
    for name, entry, inside in vehicles.inside(data):
        made["include"] = {**made["include"], name: {**entry, "scenario": _with_past(inside, _of(name, settings), t_ns)}}
    return made


def _with_streams(data: dict, scenario: Scenario, settings: dict) -> dict:
    """A scenario's data where a seed is set: without the seeds of components that follow from it."""
    made = {**data, "components": {name: dict(entry) for name, entry in data["components"].items()}}
    if data["seed"] != scenario.seed:
        for name, entry in made["components"].items():
            if entry["parameters"].get("seed") == stream_key(scenario.seed, name) and f"{name}.seed" not in settings:
                entry["parameters"] = {key: value for key, value in entry["parameters"].items() if key != "seed"}
    for name, entry, inside in vehicles.inside(data):
        inside = {"seed": vehicles.seed_of(data["seed"], name), **inside}
        inside = _with_streams(inside, scenario.vehicles[name], _of(name, settings))
        if inside["seed"] == vehicles.seed_of(data["seed"], name):
            del inside["seed"]
        made["include"] = {**made["include"], name: {**entry, "scenario": inside}}
    return made


def _of(vehicle: str, settings: dict) -> dict:
    """The settings of a vehicle, by the paths in it."""
    return {key.removeprefix(f"{vehicle}."): value for key, value in settings.items() if key.startswith(f"{vehicle}.")}


def _set(scenario: Scenario, changed: Scenario, memory: Checkpoint) -> tuple[Checkpoint, list[str]]:
    """A memory with the parameters that differ between two scenarios, and warnings."""
    flights = [CompiledRun(one, plan={}).start(0) for one in (scenario, changed)]
    old, new = (flight.arrays for flight in flights)
    if found := checkpoint.differences(flights[0].shape, flights[1].shape):
        raise FlightError("--set: a branch keeps the shape of its graph; this changes it: " + "; ".join(found[:3]))
    arrays, warnings = dict(memory.arrays), []
    for name, node in changed.graph.nodes.items():
        parameters, before = new[f"P_{name}"], old[f"P_{name}"]
        entries = [entry for entry in parameters.dtype.names
                   if parameters[entry].tobytes() != before[entry].tobytes()]
        for array in (f"P_{name}", f"N_{name}"):
            if array in arrays and entries:
                values = np.frombuffer(arrays[array], parameters.dtype).copy()
                for entry in entries:
                    values[entry] = parameters[entry]
                arrays[array] = values.tobytes()
        if new[f"X_{name}"].tobytes() != old[f"X_{name}"].tobytes():
            what = ", ".join(entries) or "what was set"
            warnings.append(f"{name}: {what} acts at the start, too, which is over: the state stays what it has become")
        elif node.values != scenario.graph.nodes[name].values and not entries:
            warnings.append(f"{name}: what was set acts at the start alone, which is over")
    return Checkpoint(memory.tick, memory.shape, arrays), warnings
