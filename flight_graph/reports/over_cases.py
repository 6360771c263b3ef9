"""Metrics of campaigns: how often each value came, or a metric over what was varied; several campaigns in one picture."""

from pathlib import Path

import numpy as np

from flight_graph.campaigns.report import Choices
from flight_graph.components.foreign import refuse
from flight_graph.errors import FlightError, unknown
from flight_graph.plots import style
from flight_graph.plots.over_time import MOST_PANELS
from flight_graph.reports.campaign_page import Subject, subject
from flight_graph.reports.distributions import bins

MOST_GROUPS = 9


def draw(campaigns: list, names: list[str], fields: list[str], over: str | None, path: Path) -> Path:
    """Write the picture of some campaigns (`flight_graph.campaigns.folder.Campaign`). Raises FlightError.

    fields: metrics, by default those that are declared to matter; over: what was varied, for the horizontal axis; without
    it histograms, or, where one number alone is varied on a grid, over that.
    """
    about = [subject(campaign, Choices(), refuse) for campaign in campaigns]
    metrics = [_metric(name, about) for name in fields] or about[0].headlines[:6]
    if not metrics:
        raise FlightError(f"{campaigns[0].path}: its runs have no metric that is a number")
    if len(metrics) > MOST_PANELS:
        raise FlightError(f"{len(metrics)} metrics are too many for one picture; allowed: {MOST_PANELS}")
    over = over or _only_grid(about[0])
    columns = 1 if len(metrics) < 3 else 2
    rows = -(-len(metrics) // columns)
    figure = style.new_figure(6.5 * columns + 2.0, max(3.6, 2.8 * rows + 0.8))
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for place, metric in zip(places, metrics):
        entry = about[0].glossary.entry(metric)
        if over is None:
            _histogram(place, about, names, metric)
        else:
            _over(place, about, names, metric, over)
        place.set_title(style.plain(f"{metric}: {entry.meaning}" if entry.meaning else metric)[:90], fontsize=9, loc="left")
        style.legend(place)
    for place in places[len(metrics):]:
        place.set_visible(False)
    found = about[0].found
    manifest = campaigns[0].manifest
    varied = ", ".join(column.name for column in about[0].values.columns.values() if column.kind == "parameter")
    draws = f", seed {about[0].values.vary.file.seed} of the draws" if about[0].values.vary.is_random else ""
    title = (f"{manifest.scenario.get('title', manifest.name)}\n{', '.join(names)}: {found['rows']} runs{draws}; "
             f"varied: {varied or 'nothing'}")
    if manifest.set_by_hand:
        title += "; set: " + ", ".join(f"{key} = {value}" for key, value in manifest.set_by_hand.items())
    return style.save(figure, path, title)


def _metric(name: str, about: list[Subject]) -> str:
    """A metric that each campaign has, as a number. Raises FlightError with the nearest names."""
    for one in about:
        one.values.checked(name, str(one.campaign.path))
        if isinstance(one.column(name), list):
            raise FlightError(f"{one.campaign.path}: {name} is a word, no number; flight report counts it")
    return name


def _varied(one: Subject, key: str) -> np.ndarray:
    """A varied number (n,) by its key, ``key[i]`` of a vector. Raises FlightError with the nearest names."""
    name, bracket, index = key.partition("[")
    columns = one.values.columns
    if name not in columns:
        raise unknown("column", key, [column.name for column in columns.values() if column.kind in ("parameter", "metric")],
                      f"--over: {one.campaign.path}")
    values = next(one.values.read([name]))[1]
    if isinstance(values, list):
        raise FlightError(f"--over {key}: it is no number")
    if values.ndim == 2:
        equal = (values == values[:, :1]).all()
        if not bracket and not equal:
            raise FlightError(f"--over {key}: it has {values.shape[1]} numbers; name one, as {key}[0]")
        place = int(index[:-1]) if bracket and index[:-1].isdigit() else 0
        if place >= values.shape[1]:
            raise FlightError(f"--over {key}: it has {values.shape[1]} numbers, counted from 0")
        values = values[:, place]
    return values


def _only_grid(one: Subject) -> str | None:
    """The one thing that is varied, where it is a number with several values, none of them drawn."""
    keys = [column.name for column in one.values.columns.values() if column.kind == "parameter"]
    if len(keys) != 1 or one.values.inputs()[0]:
        return None
    try:
        return keys[0] if len(np.unique(_varied(one, keys[0]))) > 2 else None
    except FlightError:
        return None


def _series(about, names, metric, groups=True):
    """(label, campaign, rows, values) of each group of each campaign."""
    for one, name in zip(about, names):
        column = one.column(metric)
        members = one.values.groups[:MOST_GROUPS] if groups else [None]
        for group in members:
            rows = np.isfinite(column) & (group.rows if group is not None else True)
            parts = (name if len(about) > 1 else "", (group.label or "") if group else "")
            label = " ".join(part for part in parts if part)
            yield label or name, one, rows, column


def _histogram(place, about, names, metric):
    shown = [(label, column[rows]) for label, _, rows, column in _series(about, names, metric)]
    edges = bins(np.concatenate([values for _, values in shown]))
    for number, (label, values) in enumerate(shown):
        place.hist(values, edges, histtype="stepfilled" if len(shown) == 1 else "step", alpha=0.8,
                   color=style.COLOURS[number % len(style.COLOURS)], label=style.plain(f"{label} ({len(values)})"))
    place.set_xlabel(style.plain(about[0].label(metric)))
    place.set_ylabel("runs")


def _over(place, about, names, metric, key):
    grid = len(about[0].values.groups) > 1
    for number, (label, one, rows, column) in enumerate(_series(about, names, metric, groups=not grid)):
        x, colour = _varied(one, key), style.COLOURS[number % len(style.COLOURS)]
        rows = rows & np.isfinite(x)
        place.plot(x[rows], column[rows], ".", ms=4, alpha=0.6, color=colour, label=style.plain(label))
        levels, counts = np.unique(x[rows], return_counts=True)
        if 1 < len(levels) <= 60:
            middle = [np.median(column[rows & (x == level)]) for level in levels]
            place.plot(levels, middle, "-", lw=1.2, color=colour, label="median" if counts.max() > 1 else None)
        lost = int((~np.isfinite(column)).sum())
        if lost:
            place.plot([], [], " ", label=f"{lost} runs have none")
    column = about[0].values.columns[key.partition("[")[0]]
    place.set_xlabel(style.plain(f"{key} [{column.unit}]" if column.unit not in ("", "1") else key))
    place.set_ylabel(style.plain(about[0].label(metric)))
