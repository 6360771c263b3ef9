"""Series of bags over time, or one over another, as one picture: a panel for each, all runs in it.

``A - B`` is the difference of two series with equally many numbers, at the messages of the first: an estimate less the
truth.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flight_graph.bags.series import Series
from flight_graph.errors import FlightError
from flight_graph.plots import style
from flight_graph.plots.bag_lines import BagLines
from flight_graph.plots.marks import ACT, END, FAULT, LIMIT, MODE, SETTING, Mark
from flight_graph.plots.thinning import chosen

MOST_PANELS = 12
MOST_LINES = 12  # of a panel and run
MOST_POINTS = 20_000  # of a line
MOST_MARKS = 25
MINUS = " - "  # between two fields: their difference
OR = " or "  # in the unit of a joint that may turn or slide
LINES_AT_FIRST = 4  # of a series that is drawn without having been asked for
MARK_COLOURS = {FAULT: "#c0392b", LIMIT: "#d68910", ACT: "#6c4a9e", MODE: "#0b6e99", SETTING: "#2e8b57", END: "#1c2833"}


@dataclass(frozen=True)
class Panel:
    """A series of some runs. title: what it is; shown: (name of the run, series), one a run that has it."""

    title: str
    shown: list[tuple[str, Series]]


def panels(runs: list[BagLines], fields: list[str]) -> list[Panel]:
    """A panel for each field, ``TOPIC.FIELD`` or a difference of two. Raises FlightError.

    Runs without it are left out where another one has it.
    """
    if len(fields) > MOST_PANELS:
        raise FlightError(f"{len(fields)} fields are too many for one picture; allowed: {MOST_PANELS}")
    found = []
    for field in fields:
        shown, missing = [], None
        for run in runs:
            try:
                shown.append((run.name, series_of(run, field)))
            except FlightError as error:
                missing = missing or error
        if not shown:
            raise missing
        found.append(Panel(shown[0][1].key, shown))
    return found


def series_of(run: BagLines, field: str) -> Series:
    """What ``TOPIC.FIELD`` or ``TOPIC.FIELD - TOPIC.FIELD`` names in a run. Raises FlightError."""
    first, minus, second = field.partition(MINUS)
    if not minus:
        return run.find(field)
    a, b = run.find(first.strip()), run.find(second.strip())
    if len(a.lines) != len(b.lines):
        raise FlightError(f"'{field}': the first has {len(a.lines)} numbers, the second {len(b.lines)}")
    shared = [unit for unit in a.unit.split(OR) if unit in b.unit.split(OR)]
    if a.unit and b.unit and not shared:
        raise FlightError(f"'{field}': the first is in {a.unit}, the second in {b.unit}")
    newest = np.searchsorted(b.t, a.t, side="right") - 1  # message of the second
    lines = tuple(replace(one, values=_less(one.values, other.values, newest)) for one, other in zip(a.lines, b.lines))
    return replace(a, name=f"{a.name} less {b.key}", unit=OR.join(shared) or a.unit or b.unit, lines=lines)


def _less(values, others, newest) -> np.ndarray:
    """Values (n,) less those of the other at its messages ``newest`` (n,), NaN before its first."""
    if not len(others):
        return np.full(len(values), np.nan)
    return np.where(newest >= 0, values - others[np.maximum(newest, 0)], np.nan)


def first_panels(runs: list[BagLines]) -> list[Panel]:
    """Panels of what changes in the first topics, where nobody has asked for any. Raises FlightError where nothing does."""
    names = {}
    for run in runs:
        for topic in run.topics:
            for series in run.series(topic):
                if not series.is_constant and len(series.lines) <= LINES_AT_FIRST:
                    names.setdefault(topic, []).append(series.key)
    fields = []
    while len(fields) < MOST_PANELS // 2 and any(names.values()):
        for topic in names:
            if names[topic] and len(fields) < MOST_PANELS // 2:
                fields.append(names[topic].pop(0))
    if not fields:
        raise FlightError(f"{runs[0].bag.path}: no number in it changes, so there is nothing to plot")
    return panels(runs, fields)


def draw(found: list[Panel], path: Path, title: str, over: list[Panel] | None = None, begin: float | None = None,
         end: float | None = None, marks: list[Mark] = ()) -> tuple[Path, int]:
    """Write the picture; return it and how many messages of a line were thinned, 0 when none was. Raises FlightError.

    over: the panel with the series on the horizontal axis, in place of time; begin, end: the times [s] that are drawn.
    """
    _refuse_empty(found, begin, end)
    columns = 1 if len(found) < 4 else 2
    rows = -(-len(found) // columns)
    figure = style.new_figure(7.5 * columns + 2.0, max(3.6, 2.4 * rows + 0.8))
    places = figure.subplots(rows, columns, squeeze=False, sharex=over is None).ravel()
    thinned = 0
    for place, panel in zip(places, found):
        thinned = max(thinned, *(_draw(place, panel, at, run, series, over, begin, end)
                                 for at, (run, series) in enumerate(panel.shown)))
        place.set_title(style.plain(panel.title), fontsize=9, loc="left")
        unit = panel.shown[0][1].unit
        place.set_ylabel(style.plain(f"[{unit}]" if unit else ""))
        if over is None:
            _marks(place, marks)
        style.legend(place)
    for place in places[len(found):]:
        place.set_visible(False)
    label = "t [s]" if over is None else f"{over[0].title} [{over[0].shown[0][1].unit}]"
    for place in places[max(0, len(found) - columns):len(found)]:
        place.set_xlabel(style.plain(label))
    return style.save(figure, path, title), thinned


def _refuse_empty(found, begin, end):
    """Refuse a stretch of time in which nothing was said. Raises FlightError."""
    t = [series.t for panel in found for _, series in panel.shown if len(series.t)]
    if t and not any(_inside(one, begin, end).any() for one in t):
        window = " ".join(f"{name} {value:g}" for name, value in (("--from", begin), ("--until", end)) if value is not None)
        raise FlightError(f"{window}: there is no message then; these have t = {min(one.min() for one in t):.6g} s to "
                          f"{max(one.max() for one in t):.6g} s")


def _inside(t, begin, end) -> np.ndarray:
    """Which times (n,) are drawn."""
    return (t >= (-np.inf if begin is None else begin)) & (t <= (np.inf if end is None else end))


def _draw(place, panel, at, run, series, over, begin, end) -> int:
    """The lines of a run; returns the number of its messages where they were thinned."""
    inside = _inside(series.t, begin, end)
    lines = {line.entry: line.values[inside] for line in series.lines[:MOST_LINES]}
    t, several = series.t[inside], len(panel.shown) > 1
    x = t if over is None else _matched(over[0], run, t)
    rows = chosen(list(lines.values()), MOST_POINTS)
    keep = slice(None) if rows is None else rows
    for number, (name, values) in enumerate(lines.items()):
        own = name.lstrip(".") if name or several else series.name
        label = " ".join(part for part in (run if several else "", own) if part)
        colour = style.COLOURS[(at if several else number) % len(style.COLOURS)]
        dash = style.DASHES[(number if several else number // len(style.COLOURS)) % len(style.DASHES)]
        place.plot(x[keep], values[keep], dash, color=colour, lw=1.0, marker="" if len(values) > 1 else "o",
                   label=style.plain(label))
    if len(series.lines) > MOST_LINES:
        place.plot([], [], " ", label=f"{len(series.lines) - MOST_LINES} more entries not drawn")
    return len(t) if rows is not None else 0


def _matched(panel, run, t) -> np.ndarray:
    """The series of the horizontal axis at the times of the other. Raises FlightError where it has several lines."""
    series = next((one for name, one in panel.shown if name == run), None)
    if series is None:
        raise FlightError(f"--over: {run} has no {panel.title}")
    if len(series.lines) != 1:
        names = ", ".join(series.key + line.entry for line in series.lines)
        raise FlightError(f"--over {panel.title}: it has {len(series.lines)} numbers; name one: {names}")
    return np.interp(t, series.t, series.lines[0].values, left=np.nan, right=np.nan)


def _marks(place, marks):
    for mark in list(marks)[:MOST_MARKS]:
        place.axvline(mark.t, color=MARK_COLOURS[mark.kind], ls=":", lw=0.8)
    if marks:
        for kind in dict.fromkeys(mark.kind for mark in list(marks)[:MOST_MARKS]):
            place.plot([], [], ":", color=MARK_COLOURS[kind], label=kind)
