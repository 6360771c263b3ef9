"""A bag run again from itself: its scenario, its code, this machine; every message compared with the recorded one.

In any engine: that ROS nodes, the compiled loop and plain Python leave the same bytes is what it shows then.
"""

import tempfile
from pathlib import Path

import numpy as np

from flight_graph.bags.reader import read_bag
from flight_graph.engines.compiled import CompiledRun, Recording
from flight_graph.errors import FlightError, RunStopped
from flight_graph.recordings.comparison import NOT_COMPARED, TOLERANCE, Comparison, compare, write_topics
from flight_graph.recordings.recorded_run import RecordedRun, open_recorded, shortened
from flight_graph.recordings.recording import payloads
from flight_graph.runs import check_engine


def verify(path, engine: str = "compiled", trust: bool = False, tolerance: float = TOLERANCE, progress=None,
           compiling=None) -> Comparison:
    """Run a recorded scenario again and compare all recorded topics. Raises FlightError.

    engine: ``compiled``, ``python`` or ``ros`` (all nodes, in lockstep). A run that was interrupted, or recovered after a
    crash, is compared as far as its bag goes (not in ros). What a realtime run did depended on when its messages
    arrived: nothing is compared then.
    """
    run = open_recorded(path, trust)
    check_engine(run.scenario, engine)
    remarks = [run.changes_sentence()] if run.changed else []
    if run.is_realtime:
        return Comparison(NOT_COMPARED, "nothing", changed=run.changed, sentences=[
            "not compared: the run was in realtime, so the wall clock decided which message reached whom in time; "
            "record in lockstep to have a run that can be repeated", *remarks])
    if engine == "ros":
        result = _as_nodes(run, tolerance, progress)
        result.sentences += remarks
        return result
    recording, stopped = _again(run, progress, compiling)
    if recording is None:
        return Comparison(NOT_COMPARED, "nothing", changed=run.changed, sentences=[
            f"not compared: {stopped or 'the bag holds no messages'}", *remarks])
    with tempfile.TemporaryDirectory(prefix="flight_verify_") as folder:
        again = _as_bag(run, recording, Path(folder) / "again")
        result = _compare(run, again, tolerance)
    if not run.complete:
        what = "was recovered after a crash" if run.recovered else "was interrupted"
        remarks.append(f"the run {what}: {run.recorded_until_ns / 1e9:.9g} of {run.scenario.duration_ns / 1e9:g} s are "
                       "recorded, and these were compared")
    if stopped:
        remarks.append(f"run again, {stopped}")
    result.sentences += remarks
    return result


def _compare(run, again, tolerance):
    topics = [topic for topic in run.topics() if f"/{topic.topic}" in again]
    result = compare(run.bag, again, topics, run.changed, tolerance)
    unexpected = [name for name in run.bag.topics if name not in again.topics]
    if unexpected:
        result.sentences.append(
            "not compared, for the scenario does not say what is on them: " + ", ".join(unexpected))
    return result


def _as_nodes(run, tolerance, progress):
    """The comparison with a run of ROS nodes."""
    from flight_graph.ros import launcher
    if not run.complete:
        raise FlightError(f"{run.bag.path}: the run did not come to its end; a part of a run is compared by the compiled "
                          "engine only")
    with tempfile.TemporaryDirectory(prefix="flight_verify_") as folder:
        launcher.run(run.scenario, Path(folder) / "again", progress=progress)
        return _compare(run, read_bag(Path(folder) / "again"), tolerance)


def _again(run: RecordedRun, progress, compiling) -> tuple[Recording | None, str]:
    """The run again, as far as the bag goes; and the sentence of a component that stopped it before."""
    scenario = run.scenario if run.complete else None
    if scenario is None:
        if not run.recorded_until_ns:
            return None, ""
        scenario = shortened(run.scenario, run.recorded_until_ns)
    try:
        return _run(scenario, progress, compiling), ""
    except RunStopped as stop:
        if stop.t_ns == 0:
            return None, str(stop)
        return _run(shortened(run.scenario, stop.t_ns), progress, compiling), str(stop)


def _run(scenario, progress, compiling):
    return CompiledRun(scenario).run(progress, compiling=compiling)


def _as_bag(run: RecordedRun, recording, folder):
    """The recording as a bag; of an unfinished run only the messages whose stamps were recorded."""
    tracks = {(track.node, track.port): track for track in recording.tracks}
    topics, stamps, rows = run.topics(), [], []
    for topic in topics:
        track = tracks[topic.node, topic.port]
        times, written = track.stamps_ns + run.scenario.epoch_ns, payloads(topic, track.records)
        if not run.complete and "/" + topic.topic in run.bag:
            kept = np.flatnonzero(np.isin(times, run.bag.stamps_ns("/" + topic.topic)))
            times = times[kept]
            written = written[kept] if isinstance(written, np.ndarray) else [written[i] for i in kept]
        stamps.append(times)
        rows.append(written)
    return write_topics(folder, topics, stamps, rows)
