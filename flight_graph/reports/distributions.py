"""Drawings of how a number is distributed: histogram, distribution function with its band, rates with their intervals."""

import math

import numpy as np
from plotly import graph_objects
from plotly.subplots import make_subplots

from flight_graph.reports.page import COLOURS, GREY, Figure, safe

MOST_BINS = 60
FINE = 500  # points of a grid in a bin: where there are more, one more or less does not show
ROUNDING = 1e-12  # of the largest value
ON_GRID = 0.01  # steps
MOST_STEPS = 400  # of a distribution function that is drawn
FADED = 0.6


def dispersion(title: str, label: str, groups: dict[str, np.ndarray], confidence: float, text: str = "") -> Figure:
    """Histogram and distribution function of a number. groups: label -> finite values (n,); label: name and unit.

    The band holds the whole true distribution function with this confidence (`band`).
    """
    drawing = make_subplots(rows=1, cols=2, horizontal_spacing=0.12)
    edges = bins(np.concatenate(list(groups.values())))
    columns = {"group": [], "from": [], "to": [], "runs": []}
    for colour, (group, values) in zip(_colours(), groups.items()):
        counts = np.histogram(values, edges)[0]
        drawing.add_bar(x=0.5 * (edges[1:] + edges[:-1]), y=counts, width=np.diff(edges), name=safe(group), row=1,
                        col=1, marker={"color": colour}, opacity=FADED if len(groups) > 1 else 0.85, showlegend=False)
        x, share, low, high = distribution(values, confidence)
        if len(x):
            drawing.add_scatter(x=np.concatenate([x, x[::-1]]), y=np.concatenate([high, low[::-1]]), fill="toself", row=1,
                                col=2, line={"width": 0}, fillcolor=faint(colour), hoverinfo="skip", showlegend=False)
            drawing.add_scatter(x=x, y=share, name=safe(group), line={"color": colour, "shape": "hv"}, row=1, col=2,
                                showlegend=len(groups) > 1)
        for start, end, count in zip(edges, edges[1:], counts):
            for name, value in zip(columns, (group, float(start), float(end), int(count))):
                columns[name].append(value)
    drawing.update_layout(barmode="overlay")
    drawing.update_xaxes(title_text=safe(label))
    drawing.update_yaxes(title_text="runs", row=1, col=1)
    drawing.update_yaxes(title_text="share of the runs at or below", range=[0.0, 1.02], row=1, col=2)
    return Figure(title, drawing, columns, text)


def distribution(values: np.ndarray, confidence: float) -> tuple[np.ndarray, ...]:
    """x, share of the values at or below, and the ends of the band, at no more than MOST_STEPS values."""
    ordered = np.sort(values)
    n = len(ordered)
    ranks = np.unique(np.linspace(0, n - 1, min(n, MOST_STEPS)).round().astype(int)) if n else np.zeros(0, int)
    share = (ranks + 1.0) / max(n, 1)
    reach = band(n, confidence)
    return ordered[ranks], share, np.maximum(share - reach, 0.0), np.minimum(share + reach, 1.0)


def band(n: int, confidence: float) -> float:
    """Half the width of the band about the distribution function of n independent values that holds the whole true one.

    sqrt(ln(2 / (1 - confidence)) / (2 n)): A. Dvoretzky, J. Kiefer and J. Wolfowitz, with the constant of P. Massart,
    Annals of Probability 18 (1990) 1269-1283.
    """
    return math.sqrt(math.log(2.0 / (1.0 - confidence)) / (2.0 * n)) if n else 1.0


def bins(values: np.ndarray) -> np.ndarray:
    """Edges of a histogram's bins: those of Freedman and Diaconis, no more than MOST_BINS.

    Where the values lie on a grid (times at multiples of a period, counts), each bin holds equally many of its points;
    otherwise bins with a point more than their neighbours would stand out.
    """
    if not len(values):
        return np.array([0.0, 1.0])
    least, largest = float(values.min()), float(values.max())
    if not largest > least:
        reach = 0.5 * abs(least) or 0.5
        return np.linspace(least - reach, least + reach, 4)
    width = 2.0 * float(np.subtract(*np.percentile(values, [75, 25]))) / len(values) ** (1.0 / 3.0)
    count = max(math.ceil(min((largest - least) / width, MOST_BINS)) if width > 0.0 else MOST_BINS, 1)
    width = (largest - least) / count
    step = _grid(values, width / FINE)
    if step is None:
        return np.linspace(least, largest, count + 1)
    points = round((largest - least) / step) + 1
    held = max(round(width / step), -(-points // MOST_BINS), 1)
    return least + step * (held * np.arange(-(-points // held) + 1) - 0.5)


def _grid(values: np.ndarray, least_step: float) -> float | None:
    """The step of the grid that all values lie on, but for rounding; None where it is smaller than this, or there is none.

    It is the greatest common divisor of the distances of neighbours.
    """
    rounding = ROUNDING * float(np.abs(values).max())
    distances = np.sort(np.diff(np.unique(values)))
    distances = distances[distances > rounding]
    step = 0.0
    for distance in distances[np.diff(distances, prepend=0.0) > rounding].tolist():
        larger, smaller = distance, step
        while smaller > rounding:
            larger, smaller = smaller, abs(larger - smaller * round(larger / smaller))
        step = larger
        if step < least_step:
            return None
    if not step:
        return None
    span = float(np.ptp(values))
    step = span / round(span / step)
    places = (values - values.min()) / step
    return step if (np.abs(places - places.round()) < ON_GRID).all() else None


def rates(title: str, rows: list[dict], confidence: float) -> Figure:
    """Shares of runs with their intervals. rows: {name, rate, low, high, successes, runs}, from top to bottom."""
    drawing = graph_objects.Figure()
    share = np.array([row["rate"] for row in rows])
    drawing.add_scatter(
        x=share, y=[safe(row["name"]) for row in rows], mode="markers", marker={"size": 9, "color": COLOURS[0]},
        error_x={"type": "data", "symmetric": False, "array": np.array([row["high"] for row in rows]) - share,
                 "arrayminus": share - np.array([row["low"] for row in rows]), "color": COLOURS[0]},
        customdata=[[row["successes"], row["runs"]] for row in rows], showlegend=False,
        hovertemplate="%{y}: %{x:.4f} (%{customdata[0]} of %{customdata[1]})<extra></extra>")
    drawing.update_xaxes(title_text="share of the runs", range=[-0.02, 1.02])
    drawing.update_yaxes(range=[len(rows) - 0.5, -0.5], automargin=True)
    columns = {key: [row[key] for row in rows] for key in ("name", "rate", "low", "high", "successes", "runs")}
    return Figure(title, drawing, columns, f"Intervals of {100.0 * confidence:g} % confidence, Clopper and Pearson.",
                  height=max(170, 110 + 26 * len(rows)))


def bars(title: str, label: str, rows: list[dict], reach: tuple[float, float], text: str = "") -> Figure:
    """Bars with intervals, from top to bottom. rows: {name, series, value, low, high}, of values None where there is none;
    reach: of the axis."""
    drawing = graph_objects.Figure()
    series = list(dict.fromkeys(row["series"] for row in rows))
    for colour, name in zip(_colours(), series):
        mine = [row for row in rows if row["series"] == name and row["value"] is not None]
        value = np.array([row["value"] for row in mine], float)
        ends = [np.array([value[at] if row[key] is None else row[key] for at, row in enumerate(mine)], float)
                for key in ("low", "high")]
        drawing.add_bar(x=value, y=[safe(row["name"]) for row in mine], orientation="h", name=safe(name),
                        marker={"color": colour}, error_x={"type": "data", "symmetric": False, "array": ends[1] - value,
                                                           "arrayminus": value - ends[0], "color": GREY})
    drawing.update_xaxes(title_text=safe(label), range=reach, zeroline=True, zerolinecolor=GREY)
    drawing.update_yaxes(autorange="reversed", automargin=True)
    drawing.update_layout(barmode="group", showlegend=len(series) > 1)
    names = len({row["name"] for row in rows})
    columns = {key: [row[key] for row in rows] for key in ("name", "series", "value", "low", "high")}
    return Figure(title, drawing, columns, text, height=max(190, 110 + 30 * names * max(1, len(series))))


def faint(colour: str) -> str:
    """A colour #rrggbb as that of an area behind a line."""
    return f"rgba({', '.join(str(int(colour[at:at + 2], 16)) for at in (1, 3, 5))}, 0.15)"


def _colours():
    while True:
        yield from COLOURS
