"""Drawings of how numbers hang together: a matrix of scatter plots, and points on the ground with their ellipses."""

import numpy as np
from plotly import graph_objects
from plotly.subplots import make_subplots
from scipy import stats

from flight_graph.reports.page import COLOURS, GREY, Figure, safe

MOST_POINTS = 500  # in one panel; a drawing with more is slow in a browser
MOST_LANDINGS = 4000
SHARES = (0.5, 0.9, 0.99)  # of the ellipses
AROUND = 1.35  # the ground that is drawn, over the farthest point or ellipse
LINES = 61  # of the ground's grid


def chosen(n: int, most: int, always: np.ndarray) -> np.ndarray:
    """Numbers of the points that are drawn: evenly spread over n, and those of ``always``."""
    every = np.arange(n) if n <= most else np.linspace(0, n - 1, most).round().astype(int)
    return np.unique(np.concatenate([every, always]).astype(int))


def scatter_matrix(title: str, columns: dict[str, np.ndarray], good: np.ndarray, cases: np.ndarray,
                   text: str = "") -> Figure:
    """Each of some columns (n,) against each other. good: (n,) bool, how points are coloured; cases: (n,) numbers."""
    names = list(columns)
    size = len(names) - 1
    drawing = make_subplots(rows=size, cols=size, shared_xaxes=True, shared_yaxes=True, horizontal_spacing=0.012,
                            vertical_spacing=0.012)
    for row in range(size):
        for column in range(row + 1):
            for colour, mark, rows in ((COLOURS[0], "success", good), (COLOURS[1], "no success", ~good)):
                if rows.any():
                    drawing.add_scatter(
                        x=columns[names[column]][rows], y=columns[names[row + 1]][rows], mode="markers", name=mark,
                        marker={"size": 4, "color": colour, "opacity": 0.6}, customdata=cases[rows], row=row + 1,
                        col=column + 1, showlegend=row == column == 0 and not good.all(),
                        hovertemplate="case %{customdata}<br>%{x:.4g}, %{y:.4g}<extra></extra>")
        drawing.update_yaxes(title_text=_short(names[row + 1]), row=row + 1, col=1)
        drawing.update_xaxes(title_text=_short(names[row]), row=size, col=row + 1)
    data = {"case": cases, **columns, "success": good}
    return Figure(title, drawing, {name: values.tolist() for name, values in data.items()}, text, height=160 + 150 * size)


def _short(name):
    """A label in two lines: component and parameter, or name and unit."""
    return safe(name).replace(".", ".<br>", 1) if "." in name else safe(name).replace(" [", "<br>[", 1)


def ellipse(points: np.ndarray, share: float) -> np.ndarray:
    """Outline (m, 2) of the ellipse that holds the next point of a plane normal distribution with probability ``share``.

    points: (n, 2), n > 2, from which mean and covariance are estimated; the size follows from Hotelling's T^2:
    2 (n + 1) (n - 1) / (n (n - 2)) F(share; 2, n - 2). Raises ValueError for points on a line.
    """
    size, root = _size(len(points), share), np.linalg.cholesky(_covariance(points))
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    return points.mean(axis=0) + np.sqrt(size) * np.stack([np.cos(turn), np.sin(turn)], axis=1) @ root.T


def share_inside(points: np.ndarray, share: float) -> float:
    """The part of the points (n, 2) that lies in their own `ellipse`."""
    from_mean = points - points.mean(axis=0)
    distance = (from_mean @ np.linalg.inv(_covariance(points)) * from_mean).sum(axis=1)
    return float((distance <= _size(len(points), share)).mean())


def _covariance(points):
    covariance = np.cov(points.T)
    if not np.linalg.det(covariance) > 1e-12 * np.trace(covariance) ** 2:
        raise ValueError("the points lie on a line")
    return covariance


def _size(n, share):
    return 2.0 * (n + 1) * (n - 1) / (n * (n - 2)) * float(stats.f.ppf(share, 2, n - 2))


def landing(title: str, points: np.ndarray, cases: np.ndarray, good: np.ndarray, labels: tuple[str, str],
            terrain=None) -> Figure:
    """Where runs came down. points: (n, 2) [m]; terrain(x, y) -> height [m], of arrays alike, or None."""
    drawing, outlines, held = graph_objects.Figure(), [], []
    for share in SHARES if len(points) > 4 else ():
        try:
            outlines.append((share, ellipse(points, share)))
            held.append(f"{100.0 * share_inside(points, share):.4g} % in that of {100.0 * share:g} %")
        except ValueError:
            held = ["the points lie on a line, so there are no ellipses"]
            break
    everything = np.concatenate([points, [[0.0, 0.0]], *(outline for _, outline in outlines)])
    middle, reach = 0.5 * (everything.max(axis=0) + everything.min(axis=0)), float(np.ptp(everything, axis=0).max()) or 1.0
    side = 0.5 * AROUND * reach
    if terrain is not None:
        x, y = (np.linspace(middle[axis] - side, middle[axis] + side, LINES) for axis in range(2))
        drawing.add_contour(x=x, y=y, z=terrain(*np.meshgrid(x, y)), colorscale="Earth", opacity=0.55, line={"width": 0.5},
                            colorbar={"title": "ground [m]"}, hovertemplate="ground %{z:.5g} m<extra></extra>")
    shown = chosen(len(points), MOST_LANDINGS, np.zeros(0, int))
    marks = ((COLOURS[0], "success", shown[good[shown]]), (COLOURS[1], "no success", shown[~good[shown]]))
    for colour, mark, rows in marks:
        drawing.add_scatter(x=points[rows, 0], y=points[rows, 1], mode="markers", name=mark, customdata=cases[rows],
                            marker={"size": 5, "color": colour, "opacity": 0.7},
                            hovertemplate="case %{customdata}<br>%{x:.4g} m, %{y:.4g} m<extra></extra>")
    for dash, (share, outline) in zip(("solid", "dash", "dot"), outlines):
        drawing.add_scatter(x=outline[:, 0], y=outline[:, 1], mode="lines", name=f"{100.0 * share:g} %",
                            line={"color": "#1c2833", "width": 1.5, "dash": dash}, hoverinfo="skip")
    drawing.add_scatter(x=[0.0], y=[0.0], mode="markers", name="site",
                        marker={"symbol": "cross", "size": 11, "color": GREY})
    drawing.update_xaxes(title_text=safe(labels[0]), range=[middle[0] - side, middle[0] + side], constrain="domain")
    drawing.update_yaxes(title_text=safe(labels[1]), range=[middle[1] - side, middle[1] + side], scaleanchor="x")
    drawing.update_layout(legend={"x": 0.0, "y": 1.0, "bgcolor": "rgba(255,255,255,0.7)"})
    text = "Ellipses of a normal distribution with the mean and covariance of the points"
    text += f"; of the points lie {', '.join(held)}." if held else "."
    if len(shown) < len(points):
        text += f" {len(shown)} of {len(points)} points are drawn, spread evenly over the cases."
    columns = {"case": cases[shown].tolist(), labels[0]: points[shown, 0].tolist(), labels[1]: points[shown, 1].tolist(),
               "success": good[shown].tolist()}
    return Figure(title, drawing, columns, text, height=640)
