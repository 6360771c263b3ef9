"""Drawings over time: the funnel of percentiles of many runs, and the lines of a few."""

import numpy as np
from plotly import graph_objects

from flight_graph.reports.distributions import faint
from flight_graph.reports.page import COLOURS, Figure, safe

PERCENTILES = (5, 25, 50, 75, 95)


def funnel(title: str, label: str, t: np.ndarray, values: np.ndarray, text: str = "") -> Figure:
    """Percentiles over time of many runs. t: (m,) [s]; values: (n, m), NaN where a run has ended."""
    there = np.isfinite(values)
    some = there.any(axis=0)
    t, values, there = t[some], values[:, some], there[:, some]
    low, lower, middle, upper, high = np.nanpercentile(values, PERCENTILES, axis=0)
    drawing = graph_objects.Figure()
    for name, bottom, top, colour in (("5 to 95 %", low, high, faint(COLOURS[0])),
                                      ("25 to 75 %", lower, upper, faint(COLOURS[0]).replace("0.15", "0.35"))):
        drawing.add_scatter(x=np.concatenate([t, t[::-1]]), y=np.concatenate([top, bottom[::-1]]), fill="toself", name=name,
                            line={"width": 0}, fillcolor=colour, hoverinfo="skip")
    drawing.add_scatter(x=t, y=middle, name="median", line={"color": COLOURS[0], "width": 2})
    least, largest = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    for name, edge in (("least", least), ("largest", largest)):
        drawing.add_scatter(x=t, y=edge, name=name, line={"color": COLOURS[0], "width": 1, "dash": "dot"})
    _axes(drawing, label)
    columns = {"t [s]": t, "runs": there.sum(axis=0), "least": least, "5 %": low, "25 %": lower, "median": middle,
               "75 %": upper, "95 %": high, "largest": largest}
    return Figure(title, drawing, {name: column.tolist() for name, column in columns.items()}, text)


def lines(title: str, label: str, t: np.ndarray, named: dict[str, np.ndarray], text: str = "") -> Figure:
    """Some runs over time, or some quantities of one. t: (m,) [s]; named: name of the line -> values (m,)."""
    drawing = graph_objects.Figure()
    for number, (name, values) in enumerate(named.items()):
        drawing.add_scatter(x=t, y=values, name=safe(name), mode="lines", connectgaps=False,
                            line={"color": COLOURS[number % len(COLOURS)], "width": 1.5,
                                  "dash": ("solid", "dash", "dot")[number // len(COLOURS) % 3]})
    _axes(drawing, label)
    drawing.update_layout(showlegend=True)
    columns = {"t [s]": t.tolist(), **{name: values.tolist() for name, values in named.items()}}
    return Figure(title, drawing, columns, text)


def _axes(drawing, label):
    drawing.update_xaxes(title_text="t [s]")
    drawing.update_yaxes(title_text=safe(label))
