"""A bag run again from itself: its scenario, its code, this machine; every message compared with the recorded one.

In any engine: that ROS nodes, the compiled loop and plain Python leave the same bytes is what it shows then.
"""

import tempfile
from pathlib import Path

import numpy as np

from flight_graph.bags.reader import read_bag
from flight_graph.engines.checkpoint import Checkpoint, differences
from flight_graph.engines.choice import check_engine
from flight_graph.engines.compiled import CompiledRun, Recording
from flight_graph.errors import FlightError, RunStopped
from flight_graph.recordings import beginning
from flight_graph.recordings.comparison import (
    DIFFERENT,
    NOT_COMPARED,
    TOLERANCE,
    Comparison,
    compare,
    recorded_until,
    write_topics,
)
from flight_graph.recordings.recorded_run import RecordedRun, open_recorded, shortened
from flight_graph.recordings.recording import messages
from flight_graph.timebase import SECOND


def verify(path, engine: str = "compiled", trust: bool = False, tolerance: float = TOLERANCE, progress=None,
           compiling=None, check_bounds: bool = False, as_nodes=None) -> Comparison:
    """Run a recorded scenario again and compare all recorded topics. Raises FlightError.

    engine: ``compiled``, ``python`` or ``ros`` (all nodes, in lockstep, by ``as_nodes``, see `flight_graph.runs.verify`).
    check_bounds: with checked indices. progress(seconds simulated, in all) is called now and then. A run that was
    interrupted, or recovered after a crash, is compared as far as its bag goes (not in ros). What a realtime run did
    depended on when its messages arrived: nothing is compared then.
    """
    run = open_recorded(path, trust)
    check_engine(run.scenario, engine)
    remarks = [run.changes_sentence()] if run.changed else []
    told = progress and (lambda seconds: progress(seconds, (run.scenario.duration_ns if run.complete else
                                                            run.recorded_until_ns) / SECOND))
    if run.is_realtime:
        return Comparison(NOT_COMPARED, "nothing", changed=run.changed, sentences=[
            "not compared: the run was in realtime, so the wall clock decided which message reached whom in time; "
            "record in lockstep to have a run that can be repeated", *remarks])
    remarks = [*(_foreign_sentence(run, name) for name in run.scenario.foreign), *remarks]
    if engine == "ros":
        result = _as_nodes(run, tolerance, told, check_bounds, as_nodes)
        result.sentences += remarks
        return result
    recording, stop = _again(run, told, compiling, check_bounds)
    if recording is None or (stop and not stop.t_ns):
        return Comparison(NOT_COMPARED, "nothing", changed=run.changed, sentences=[
            f"not compared: {stop or 'the bag holds no messages'}", *remarks])
    with tempfile.TemporaryDirectory(prefix="flight_verify_") as folder:
        again = _as_bag(run, recording, Path(folder) / "again", stop.t_ns if stop else run.scenario.duration_ns)
        bag = run.bag
        if stop:
            bag = recorded_until(run, run.topics(), again, stop.t_ns, Path(folder) / "recorded")
        result = _compare(run, bag, again, tolerance)
    _compare_checkpoints(result, run, {one.tick: one for one in recording.checkpoints})
    if not run.complete:
        what = "was recovered after a crash" if run.recovered else "was interrupted"
        remarks.append(f"the run {what}: {run.recorded_until_ns / 1e9:.9g} of {run.scenario.duration_ns / 1e9:g} s are "
                       "recorded, and these were compared")
    if stop:
        remarks.append(f"run again, {stop}")
    result.sentences += remarks
    return result


def _foreign_sentence(run, name) -> str:
    """What was taken from the bag."""
    outcome = run.bag.metadata.get("flight_graph.outcome", {})
    topics = [f"/{signal.topic}" for signal in run.scenario.graph.nodes[name].component.outputs.values()]
    said = ", ".join(f"{run.bag.topics[topic].count if topic in run.bag.topics else 0} on {topic}"
                     + (f" ({late} late)" if (late := outcome.get(f"late {topic}")) else "") for topic in topics)
    return f"{name} is a foreign node: its messages were taken from the bag ({said or 'it publishes none'})"


def _compare(run, bag, again, tolerance):
    topics = [topic for topic in run.topics() if f"/{topic.topic}" in again]
    result = compare(bag, again, topics, run.changed, tolerance)
    unexpected = [name for name in run.bag.topics if name not in again.topics]
    if unexpected:
        result.sentences.append(
            "not compared, for the scenario does not say what is on them: " + ", ".join(unexpected))
    return result


def _compare_checkpoints(result: Comparison, run: RecordedRun, again: dict[int, Checkpoint]) -> None:
    """Compare the checkpoints of a bag with those of the run made again: tick -> checkpoint."""
    known = [tick for tick in beginning.ticks(run.bag) if tick in again and tick != (run.first.tick if run.first else None)]
    for tick in known:
        recorded = beginning.checkpoint(run.bag, tick)
        if found := differences(recorded.shape, again[tick].shape) or recorded.difference(again[tick]):
            where = found if isinstance(found, str) else f"its graph: {found[0]}"
            result.sentences.append(f"the checkpoint of tick {tick} is another one: {where}")
            if not run.changed:
                result.verdict = DIFFERENT
            return
    if known:
        result.sentences.append(f"equal, too: {len(known)} checkpoint{'s' if len(known) > 1 else ''}")


def _as_nodes(run, tolerance, progress, check_bounds, as_nodes):
    """The comparison with a run of ROS nodes."""
    if as_nodes is None:
        raise FlightError("a run of nodes is verified by flight_graph.runs.verify")
    if not run.complete:
        raise FlightError(f"{run.bag.path}: the run did not come to its end; a part of a run is compared by the compiled "
                          "engine only")
    with tempfile.TemporaryDirectory(prefix="flight_verify_") as folder:
        as_nodes(run.scenario, Path(folder) / "again", progress, check_bounds, run.begin)
        again = read_bag(Path(folder) / "again")
        result = _compare(run, run.bag, again, tolerance)
        _compare_checkpoints(result, run, {tick: beginning.checkpoint(again, tick) for tick in beginning.ticks(again)})
        return result


def _again(run: RecordedRun, progress, compiling, check_bounds) -> tuple[Recording | None, RunStopped | None]:
    """The run again, as far as the bag goes; and what stopped it before."""
    scenario = run.scenario
    if not run.complete:
        if not run.recorded_until_ns:
            return None, None
        scenario = shortened(run.scenario, run.recorded_until_ns)
    try:
        return CompiledRun(scenario, check_bounds).run(
            progress, compiling=compiling, begin=run.first, keeping=True), None
    except RunStopped as stop:
        return stop.recording, stop


def _as_bag(run: RecordedRun, recording, folder, end_ns):
    """The recording before a time as a bag; of an unfinished run only the messages whose stamps were recorded."""
    tracks = {(track.node, track.port): track for track in recording.tracks}
    topics, stamps, rows = run.topics(), [], []
    for topic in topics:
        track = tracks[topic.node, topic.port]
        count = int(np.searchsorted(track.stamps_ns, end_ns))
        times, written = messages(topic, track.stamps_ns[:count], track.records[:count])
        times = times + run.scenario.epoch_ns
        if not run.complete and "/" + topic.topic in run.bag:
            kept = np.flatnonzero(np.isin(times, run.bag.stamps_ns("/" + topic.topic)))
            times = times[kept]
            written = written[kept] if isinstance(written, np.ndarray) else [written[i] for i in kept]
        stamps.append(times)
        rows.append(written)
    return write_topics(folder, topics, stamps, rows)
