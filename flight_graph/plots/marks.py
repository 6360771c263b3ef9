"""What happened in a run, at its times: faults, limits that were passed, acts of flight software, modes, settings, the end.

It is read from the topics and the scenario of the bag as data: no code runs.
"""

import json
from dataclasses import dataclass

import numpy as np

from flight_graph.plots.bag_lines import BagLines
from flight_graph.text_files import short

FAULT, LIMIT, ACT, MODE, SETTING, END = "fault", "limit", "act", "mode", "setting", "end"
KINDS = (FAULT, LIMIT, ACT, MODE, SETTING, END)
FAULTS, MONITORS = "/faults", "/monitors"  # topics, see `flight_graph.faults.report`
MOST = 200  # of a bag
_SECOND = 1_000_000_000


@dataclass(frozen=True, order=True)
class Mark:
    """t: [s] since the start of the run."""

    t: float
    kind: str
    text: str


def marks(run: BagLines, modes: dict[str, tuple[str, ...]] | None = None) -> tuple[list[Mark], int]:
    """The events of a bag in the order of time, at most MOST, and how many there are in all.

    modes: topic -> the names of the modes that its numbers stand for; numbers without it.
    """
    first, last = ((stamp - run.start_ns) / _SECOND for stamp in (run.bag.start_ns, run.bag.end_ns))
    found = [*_faults(run), *_monitors(run), *_modes(run, modes or {}), *_end(run),
             *(one for one in _settings(run) if first <= one.t <= last)]  # the others are before or behind what it holds
    found.sort()
    return found[:MOST], len(found)


def _lines(run, topic):
    """(name, t, values) of each number of a topic, where the bag has it."""
    if topic in run.bag.topics:
        for series in run.series(topic):
            for line in series.lines:
                yield series.name + line.entry, series.t, line.values


def _steps(t, values):
    """(time, from, to) of each change; a first value that is not zero counts as one."""
    values = np.asarray(values, float)
    before = np.concatenate([[0.0], values[:-1]]) if len(values) else values
    for at in np.flatnonzero(values != before)[:MOST]:
        yield float(t[at]), float(before[at]), float(values[at])


def _faults(run):
    described = {str(entry.get("id")): entry for entry in _entries(run.data.get("faults"))}
    for name, t, values in _lines(run, FAULTS):
        entry = described.get(name, {})
        what = short(f"{name} ({entry.get('type')} at {entry.get('at')})" if entry else name, 120)
        for at, _, now in _steps(t, values):
            yield Mark(at, FAULT, f"{what} {'begins' if now > 0 else 'ends'}")


def _monitors(run):
    monitors = run.data.get("monitors")
    monitors = monitors if isinstance(monitors, dict) else {}
    watches = {str(entry.get("id")): entry for entry in _entries(monitors.get("watchpoints"))}
    acts = {str(entry.get("id")): entry for entry in _entries(monitors.get("actionpoints"))}
    for name, t, values in _lines(run, MONITORS):
        for at, before, now in _steps(t, values):
            if name in acts and now > before:
                yield Mark(at, ACT, short(f"{name}: {acts[name].get('text') or acts[name].get('when')}", 160))
            elif name in watches:
                limit = watches[name].get("when") or f"{watches[name].get('stale')} is stale"
                yield Mark(at, LIMIT, short(f"{name} {'holds' if now > 0 else 'no longer holds'}: {limit}", 160))


def _modes(run, modes):
    for topic in run.bag.topics:
        names = {name for name, _, _ in _lines(run, topic)} if run.bag.topics[topic].count else set()
        if not {"mode", "changes"} <= names:
            continue
        known = modes.get(topic, ())
        series = run.find(f"{topic}.mode")
        values = series.lines[0].values
        for at in np.flatnonzero(np.diff(values, prepend=np.nan))[:MOST]:
            number = int(values[at]) if np.isfinite(values[at]) else -1
            yield Mark(float(series.t[at]), MODE, known[number] if 0 <= number < len(known) else f"mode {number}")


def _settings(run):
    entries = _entries(run.data.get("events"))
    for text in run.bag.metadata.get("flight_graph.set", {}).values():
        try:
            entries += _entries([json.loads(text)])
        except ValueError:
            continue
    for entry in entries:
        at, given = entry.get("at_s"), {**_mapping(entry.get("set")), **_mapping(entry.get("place"))}
        if isinstance(at, (int, float)) and given:
            yield Mark(float(at), SETTING, short(", ".join(f"{key} = {value}" for key, value in given.items()), 160))


def _mapping(value) -> dict:
    return value if isinstance(value, dict) else {}


def _end(run):
    outcome, wanted = run.bag.metadata.get("flight_graph.outcome", {}), run.data.get("duration_s")
    end = (run.bag.end_ns - run.start_ns) / _SECOND
    if outcome and outcome.get("complete") != "true" and isinstance(wanted, (int, float)):
        yield Mark(end, END, f"the recording ends at {end:.6g} of {wanted:g} s")


def _entries(block):
    return [entry for entry in block if isinstance(entry, dict)] if isinstance(block, list) else []
