"""The parts of a report of bags: tables of what ran, what happened and what came of it, and the lines of every topic."""

import hashlib
from dataclasses import replace

import numpy as np
from plotly import graph_objects

from flight_graph.bags.series import Line, Series
from flight_graph.errors import FlightError
from flight_graph.graphs.metrics import told
from flight_graph.plots.marks import ACT, END, FAULT, LIMIT, MODE, MOST, SETTING
from flight_graph.plots.thinning import chosen
from flight_graph.recordings.what_ran import what_ran
from flight_graph.reports.page import COLOURS, GREY, Figure, Fold, Table, safe
from flight_graph.reports.verdicts import number

OPEN_TOPICS = 1  # that are unfolded at first
MOST_LINES = 8  # single numbers of one unit in a drawing
MOST_ENTRIES = 12  # of an array; the rest is left out, and said so
MOST_FIGURES = 150  # of a page
MOST_DRAWN_MARKS = 40
HEIGHT = 250  # [px] of a drawing of a topic
DASHES = ("solid", "dash", "dot", "dashdot")
MARK_COLOURS = {FAULT: "#c0392b", LIMIT: "#d68910", ACT: "#6c4a9e", MODE: "#0b6e99", SETTING: "#2e8b57", END: "#1c2833"}


def overview(runs) -> list:
    """What ran, a column a bag."""
    rows = {}
    for place, run in enumerate(runs):
        for key, value in _facts(run).items():
            rows.setdefault(key, [""] * len(runs))[place] = value
    notes = [f"{run.name}: metrics, requirements and claims are left out: {run.why}." for run in runs if run.why]
    notes += [f"{run.name}: {remark}" for run in runs for remark in run.bag.remarks]
    notes += [f"{run.name} carries no checksums, so damage that keeps its messages' form cannot be seen."
              for run in runs if not run.bag.checked]
    return [Table("What ran", ["", *(run.name for run in runs)], [[key, *cells] for key, cells in rows.items()]), *notes]


def _facts(run) -> dict[str, str]:
    """What is known of a bag, in words."""
    bag, data = run.bag, run.lines.data
    made, outcome = bag.metadata.get("flight_graph", {}), bag.metadata.get("flight_graph.outcome", {})
    seconds = (bag.end_ns - bag.start_ns) / 1e9
    facts = {"bag": str(bag.path), "scenario": f"{data['name']}: {data.get('title', '')}" if data.get("name") else
             "none: it was not recorded by a run of this project"}
    if run.scenario is not None:
        ran = what_ran(run.scenario)
        if ran.known:
            facts["case, seed, what was set"] = ran.words(run.scenario.seed, 40)
        if ran.case < 0 and not ran.known:
            facts["seed"] = str(run.scenario.seed)
    if made:
        facts["engine, pace"] = f"{made.get('engine', '?')}, {made.get('pace', '?')}"
        facts["made with"] = ", ".join(f"{key} {value}" for key, value in made.items()
                                       if key not in ("scenario", "engine", "pace", "seed"))
    count = sum(info.count for info in bag.topics.values())
    facts["recorded"] = f"{seconds:.6g} s, {count} messages on {len(bag.topics)} topics"
    if outcome:
        complete = outcome.get("complete") == "true"
        others = ", ".join(f"{key} {value}" for key, value in outcome.items() if key != "complete" and value != "0")
        facts["how it ended"] = ("complete" if complete else "not complete") + (f"; {others}" if others else "")
    if "recovered" in bag.metadata:
        facts["recovered"] = "it was saved from a damaged bag (flight recover)"
    facts["digest of its messages"] = f"SHA-256 {digest(bag)}"
    facts["verified"] = run.verified or ("not asked: flight verify runs it again and compares every byte; --verify does so "
                                         "for this page" if made else "-")
    return facts


def digest(bag) -> str:
    """SHA-256 over all messages in write order: topic, log time [ns, 8 bytes little endian], payload."""
    found = hashlib.sha256()
    for topic, stamp, payload in bag.messages():
        found.update(topic.encode())
        found.update(int(stamp).to_bytes(8, "little"))
        found.update(payload)
    return found.hexdigest()


def events(runs) -> list:
    """What happened, in the order of time."""
    rows = [[f"{mark.t:.6g}", *([run.name] if len(runs) > 1 else []), mark.kind, mark.text]
            for run in runs for mark in run.marks]
    if not rows:
        return []
    rows.sort(key=lambda row: float(row[0]))
    left = [f"{run.name}: the first {MOST} of {run.all_marks} events are shown." for run in runs if run.all_marks > MOST]
    return [Table("Events", ["t [s]", *(["bag"] if len(runs) > 1 else []), "what", ""], rows, (
        "Triangles above the drawings stand at these times; pointing at one says what it is.")), *left]


def metric_table(runs) -> list:
    """Every metric with its unit and meaning, a column a bag; what matters first."""
    names = dict.fromkeys(name for run in runs for name in run.metrics)
    if not names:
        return []
    entries = {name: next(run.glossary.entry(name) for run in runs if name in run.metrics) for name in names}
    rows = []
    for name, entry in entries.items():
        absent = entry.missing and any(run.metrics.get(name, 0) is None for run in runs)
        rows.append([name, *(number(run.metrics[name]) if name in run.metrics else "-" for run in runs), entry.unit,
                     entry.meaning + (f" - none: {entry.missing}" if absent else "")])
    first = [row for row in rows if entries[row[0]].headline] or rows
    head = ["metric", *(run.name for run in runs), "unit", "meaning"]
    return [Table("What matters", head, first), *([Fold(f"All {len(rows)} metrics", [Table("", head, rows)])]
                                                  if len(first) < len(rows) else [])]


def glance(runs) -> list:
    """What the scenarios declare to be worth a line over time."""
    found, odd = {}, []
    for run in runs:
        if run.scenario is None:
            continue
        signals = run.signals
        for trace in run.glossary.traces:
            if not all(topic in signals for topic in trace.topics):
                continue
            try:
                with told(f"{run.name}: {trace.name}"):
                    t, values = trace.function(run.scenario, signals)
            except FlightError as error:
                odd.append(str(error))
                continue
            if len(t):
                series = Series("", trace.name, trace.unit, np.asarray(t), (Line("", "", np.asarray(values, float)),))
                found.setdefault((trace.name, trace.unit, trace.meaning), []).append((run, series))
    return [_figure(f"{name}: {meaning}", unit, shown, runs) for (name, unit, meaning), shown in found.items()] + odd


def topic(runs, name: str) -> list:
    """The drawings of a topic, in a fold; what of it never changes as a sentence."""
    having = [run for run in runs if name in run.bag.topics]
    found, constant, left = {}, {}, []
    for run in having:
        for series in run.lines.series(name):
            if series.is_constant:
                constant.setdefault(series.label, series)
            else:
                found.setdefault((series.name, series.unit), []).append((run, series))
    for key in found:
        constant.pop(f"{key[0]} [{key[1]}]" if key[1] else key[0], None)
    parts = []
    for title, unit, shown in _together(found):
        parts.append(_figure(title, unit, shown, runs))
        left += [f"{title}: the first {MOST_ENTRIES} of {len(series.lines)} entries are drawn" for _, series in shown
                 if len(series.lines) > MOST_ENTRIES]
    if constant:
        parts.append("Never changes: " + "; ".join(_constant(series) for series in list(constant.values())[:60]) + ".")
    parts += dict.fromkeys(left)
    info = next(run.bag.topics[name] for run in having)
    counts = ", ".join(str(run.bag.topics[name].count) for run in having)
    return [Fold(f"{name} ({info.type_name}, {counts} messages)", parts)] if parts else []


def _together(found):
    """(title, unit, [(run, series)]) of each drawing: single numbers of one unit share one."""
    single = {}
    for (name, unit), shown in found.items():
        if all(not series.lines[0].entry for _, series in shown):
            prefix = name.rpartition(".")[0]
            single.setdefault((prefix, unit), []).append((name, shown))
        else:
            yield name, unit, shown
    for (_, unit), members in single.items():
        for first in range(0, len(members), MOST_LINES):
            block = members[first:first + MOST_LINES]
            merged = {}
            for name, shown in block:
                for run, series in shown:
                    merged.setdefault(id(run), (run, series, []))[2].append(replace(series.lines[0], entry=name))
            yield ", ".join(name for name, _ in block), unit, [
                (run, replace(series, name="", lines=tuple(lines))) for run, series, lines in merged.values()]


def _constant(series) -> str:
    values = [line.values[0] for line in series.lines if len(line.values)][:MOST_ENTRIES]
    dots = ", ..." if len(series.lines) > MOST_ENTRIES else ""
    text = ", ".join(f"{value:.6g}" for value in values)
    return f"{series.name} {f'[{text}{dots}]' if len(values) > 1 else text} {series.unit}".strip()


def _figure(title, unit, shown, runs) -> Figure:
    """The lines of series over time, of one run or of several, with what happened in them."""
    traces, columns, sources, thinned = [], {}, [], 0
    several = len(runs) > 1
    for run, series in shown:
        place = next(place for place, one in enumerate(runs) if one is run)
        lines = {line.entry: line.values for line in series.lines[:MOST_ENTRIES]}
        rows = chosen(list(lines.values()))
        thinned = max(thinned, len(series.t) if rows is not None else 0)
        rows = slice(None) if rows is None else rows
        ending = f", {run.name}" if several else ""
        times = f"t [s]{ending}"
        columns[times] = _short_floats(series.t[rows])
        for at, (line, values) in enumerate(lines.items()):
            label = (f"{series.name}{line}" or title) + ending
            colour = COLOURS[(place if several else at) % len(COLOURS)]
            dash = DASHES[(at if several else at // len(COLOURS)) % len(DASHES)]
            column = f"{label} [{unit}]" if unit else label
            columns[column] = values[rows].astype(np.float32)
            sources.append((times, column))
            traces.append({"type": "scatter", "name": safe(label), "connectgaps": False,
                           "mode": "lines" if len(columns[times]) > 1 else "markers",
                           "line": {"color": colour, "width": 1.3, "dash": dash}})
    drawing = graph_objects.Figure(traces)
    drawing.update_layout(showlegend=True, meta="time", xaxis={"title": {"text": "t [s]"}},
                          yaxis={"title": {"text": safe(f"[{unit}]" if unit else "")}}, margin={"r": 210},
                          legend={"x": 1.01, "xanchor": "left", "entrywidth": 165})
    _draw_marks(drawing, runs)
    words = f"{thinned} messages; drawn are the extremes of each stretch." if thinned else ""
    return Figure(title, drawing, columns, words, HEIGHT, sources)


def _draw_marks(drawing, runs):
    """Triangles above the axis, and faint lines."""
    shapes, notes = [], []
    for run, mark in [(one, mark) for one in runs for mark in one.marks][:MOST_DRAWN_MARKS]:
        colour, name = MARK_COLOURS.get(mark.kind, GREY), f"{safe(run.name)}<br>" if len(runs) > 1 else ""
        shapes.append({"type": "line", "x0": mark.t, "x1": mark.t, "y0": 0.0, "y1": 1.0, "yref": "paper", "opacity": 0.5,
                       "line": {"color": colour, "width": 1, "dash": "dot"}})
        notes.append({"x": mark.t, "y": 1.0, "yref": "paper", "yanchor": "bottom", "text": "\u25be", "showarrow": False,
                      "font": {"color": colour, "size": 14},
                      "hovertext": f"{name}{mark.t:.6g} s, {safe(mark.kind)}: {safe(mark.text)}"})
    drawing.update_layout(shapes=shapes, annotations=notes)


def not_drawn(runs) -> list:
    """Topics whose messages cannot be read, and topics without numbers."""
    rows = [[run.name, name, why] for run in runs for name, why in run.lines.problems.items()]
    empty = dict.fromkeys(name for run in runs for name in run.lines.topics
                          if name not in run.lines.problems and not run.lines.series(name))
    parts = [Table("Not read", ["bag", "topic", "why"], rows)] if rows else []
    return parts + ([f"Without numbers of a fixed layout: {', '.join(empty)}."] if empty else [])


def _short_floats(t) -> np.ndarray:
    """Times as float32 where that tells neighbours apart."""
    apart = np.diff(t)
    least = float(apart[apart > 0].min()) if (apart > 0).any() else 1.0
    return t.astype(np.float32) if np.abs(t).max(initial=0.0) * 2.0**-23 < 0.05 * least else t
