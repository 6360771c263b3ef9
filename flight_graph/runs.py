"""Runs, verifications and replays in any engine, those of ROS among them."""

import os
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from flight_graph.engines.choice import check_engine, pace_text, parse_pace
from flight_graph.errors import FlightError, RunStopped
from flight_graph.graphs import glossary, metrics
from flight_graph.graphs.alarms import alarms
from flight_graph.graphs.scenario import Scenario
from flight_graph.text_files import short

_LONGEST_NAME, _LONGEST_PATH = 255, 4000  # [bytes] that a file system has


@dataclass
class Outcome:
    """What a run left. wall_s: seconds in the loop; compile_s: seconds until the first step (0 in ros); domain: of ROS."""

    bag: Path | None
    engine: str
    pace: str
    wall_s: float
    compile_s: float
    metrics: dict
    statistics: dict = field(default_factory=dict)
    lost: int = 0
    domain: int | None = None
    notes: list = field(default_factory=list)  # what was done to processes
    alarms: list = field(default_factory=list)  # sentences: what of the run makes wary
    earlier: list = field(default_factory=list)  # bags from before the run was taken back, the oldest first
    was_ended: bool = False  # by who controls it; there are no metrics then


def new_folder(wanted: Path | None, scenario: Scenario, engine: str) -> Path:
    """The bag's folder: ``wanted`` (refused when it exists), or the next free runs/<scenario>-<engine>-<n>. Raises
    FlightError."""
    if wanted is not None:
        _check_folder(wanted)
        if os.path.lexists(wanted):
            raise FlightError(f"--out {wanted}: it exists already; name a new folder")
        return wanted
    number = 1
    while (folder := Path("runs") / f"{scenario.name}-{engine}-{number}").exists():
        number += 1
    return folder


def _check_folder(folder: Path) -> None:
    """Refuse a folder that no disk can have, or whose bag's file none can. Raises FlightError."""
    name = f"{folder.resolve().name}_0.mcap" if "\0" not in str(folder) else ""
    if not str(folder).isprintable() or len(os.fsencode(name)) > _LONGEST_NAME or len(os.fsencode(folder)) > _LONGEST_PATH:
        raise FlightError(f"--out {short(repr(str(folder)))}: this is no name of a folder; allowed: printable characters, "
                          f"{_LONGEST_NAME - len('_0.mcap')} bytes")


def execute(scenario: Scenario, engine: str = "compiled", pace: str = "lockstep", out: Path | None = None,
            progress=None, compiling=None, check_bounds: bool = False, tell=None, begin=None,
            controlled: bool = False, live=None) -> Outcome:
    """Run a scenario and record it into a new folder. Raises FlightError.

    begin: a `flight_graph.recordings.beginning.Beginning`, where the run does not begin at t = 0. controlled: of nodes that
    wait for the services of the node ``simulation`` (docs/simulation_control.md). live: a
    `flight_graph.viewers.rerun_stream.RerunStream` that shows the run while it runs; in process it flies at the pace then.

    progress(seconds simulated) is called now and then; compiling(components done, in all, names of those under way) while
    machine code is made; tell(sentence) of what a person should know before. check_bounds: an index beyond an array's end
    stops the run with a sentence. A run that a component stops leaves its bag up to there, and raises RunStopped.
    """
    check_engine(scenario, engine)
    pace, factor = parse_pace(pace)
    if engine != "ros" and pace != "lockstep" and live is None:
        raise FlightError(f"--pace {pace_text(pace, factor)}: the {engine} engine runs as fast as it can; a pace is kept "
                          "with --engine ros, or --live")
    if controlled and engine != "ros":
        raise FlightError(f"--control: the {engine} engine has no services; a run is controlled with --engine ros "
                          "(flight step goes through one in process)")
    metrics.of(scenario)  # a name that is wrong is found before the flight
    folder = new_folder(out, scenario, engine)
    _prepare(folder.parent)
    if engine == "ros":
        return _ros(scenario, folder, pace, factor, progress, compiling, check_bounds, tell, begin, controlled, live)
    from numba import config

    from flight_graph.engines.compiled import CompiledRun
    from flight_graph.recordings.recording import write_recording
    if (engine == "python") != bool(config.DISABLE_JIT):
        raise FlightError("the python engine needs NUMBA_DISABLE_JIT=1 in the environment, and no other engine may have it")
    if live is not None:
        return _live(scenario, folder, engine, factor, progress, compiling, check_bounds, begin, live)
    try:
        recording = CompiledRun(scenario, check_bounds).run(
            progress, compiling=compiling, begin=begin.checkpoint if begin else None, keeping=True)
    except RunStopped as stop:
        write_recording(stop.recording, folder, engine, begin=begin)
        raise
    write_recording(recording, folder, engine, begin=begin)
    found, missing = _judged(scenario, recording, begin)
    return Outcome(folder, engine, "none", recording.wall_s, recording.compile_s, found,
                   alarms=[*missing, *alarms(glossary.of(scenario), found, scenario, recording)])


def _judged(scenario, signals, begin) -> tuple[dict, list[str]]:
    """The metrics of a run; of a part of one, which may be too short for them, none and a sentence."""
    try:
        return metrics.compute(scenario, signals), []
    except FlightError as error:
        if begin is None:
            raise
        return {}, [f"no metrics: this part of the run may be too short for them: {error}"]


def _prepare(parent: Path) -> None:
    """Make the folder that will hold a bag, before anything runs. Raises FlightError."""
    try:
        parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FlightError(f"the bag cannot be written to '{parent}': {(error.strerror or str(error)).lower()}") from None
    if not os.access(parent, os.W_OK | os.X_OK):
        raise FlightError(f"the bag cannot be written to '{parent}': this folder is read-only")


def verify(path, engine: str = "compiled", **options):
    """Run a bag's scenario again in any engine, see `flight_graph.replays.verify.verify`. Raises FlightError."""
    from flight_graph.replays.verify import verify as run_again

    def as_nodes(scenario, folder, progress, check_bounds, begin):
        from flight_graph.ros import launcher
        launcher.run(scenario, folder, progress=progress, check_bounds=check_bounds, begin=begin)
    return run_again(path, engine, as_nodes=as_nodes, **options)


def replay(path, component: str, engine: str = "compiled", **options):
    """Replay one component in any engine, see `flight_graph.replays.replay.replay`. Raises FlightError."""
    from flight_graph.replays.replay import replay as run_again

    def as_node(*arguments):
        from flight_graph.ros import replay_launcher
        return replay_launcher.run(*arguments)
    return run_again(path, component, engine, as_node=as_node, **options)


def simulate(scenario: Scenario):
    """Run a scenario in process without a bag; return its Recording."""
    from flight_graph.engines.compiled import CompiledRun
    return CompiledRun(scenario).run()


def _live(scenario, folder, engine, factor, progress, compiling, check_bounds, begin, stream):
    """Fly at a pace, shown while it flies."""
    import threading
    import time

    from flight_graph.viewers import live, opening
    from flight_graph.viewers.flying import FlyingSource
    if begin or check_bounds:
        raise FlightError("--live: a run is shown from its start, and without --check-bounds; flight view shows its bag")
    began = time.perf_counter()
    source = FlyingSource(scenario, compiling)
    compiled = time.perf_counter()
    stream.begin(opening.series_of(scenario, source.units))
    try:
        live.show(source, stream, factor, threading.Event(), progress)
    finally:
        source.write(folder, engine)
    stream.flush()
    if source.stop:
        raise source.stop
    recording = source.recording()
    found = metrics.compute(scenario, recording)
    return Outcome(folder, engine, pace_text("realtime", factor), time.perf_counter() - compiled, compiled - began, found,
                   alarms=alarms(glossary.of(scenario), found, scenario, recording))


def _ros(scenario, folder, pace, factor, progress, compiling, check_bounds, tell, begin, controlled, live):
    from flight_graph.bags.reader import read_bag
    from flight_graph.recordings.recording import BagSignals
    from flight_graph.ros import launcher
    around = None
    if live is not None:
        from flight_graph.ros.listening import shown
        around = partial(shown, scenario, live)
    result = launcher.run(
        scenario, folder, pace, factor, progress, compiling, check_bounds, tell, begin, controlled, around)
    signals = BagSignals(read_bag(result.bag), scenario)
    found, missing = ({}, []) if result.was_ended else _judged(scenario, signals, begin)
    return Outcome(result.bag, "ros", pace_text(pace, factor), result.wall_s, 0.0, found, result.statistics,
                   int(result.outcome.get("lost", 0)), result.domain, result.notes,
                   [*missing, *alarms(glossary.of(scenario), found, scenario, signals)], result.earlier, result.was_ended)
