"""One HTML file of figures and tables that needs nothing else: the drawing library (plotly) and all data are in it.

A page is a list of sections; a section has figures, tables and sentences. Every figure carries its numbers as columns,
which the page gives as CSV or JSON, and is drawn when it comes into view. The library stands in the file compressed. A
policy in the page's head forbids it to load anything from anywhere. Names and texts may come from a stranger's campaign or
bag, so all of them are escaped, those inside of figures too.
"""

import base64
import csv
import gzip
import html
import io
import json
import math
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
from plotly import graph_objects
from plotly import io as pio
from plotly.offline import get_plotlyjs

from flight_graph.errors import FlightError

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; font-src data:"
COLOURS = ("#0b6e99", "#c0392b", "#2e8b57", "#d68910", "#6c4a9e", "#5d6d7e")  # told apart by most eyes, in this order
GREY = "#5d6d7e"
HEIGHT = 380  # [px] of a figure
TEMPLATE = "plotly_white"


@dataclass
class Figure:
    """A drawing and its numbers. columns: name (with unit) -> values, all of one length; None stands for no number.

    sources: the columns that each trace takes x and y from, so that numbers stand in the page once; none: the traces have
    them. Columns of several time axes may have several lengths then.
    """

    title: str
    drawing: graph_objects.Figure
    columns: dict[str, list | np.ndarray]
    text: str = ""
    height: int = HEIGHT
    sources: list[tuple[str, str]] = field(default_factory=list)


@dataclass
class View:
    """A picture in space that a slider moves through time. data: as `flight_graph.reports.space` makes it."""

    title: str
    data: dict
    text: str = ""
    height: int = 560


@dataclass
class Table:
    """Rows of cells; of numbers a text that a person reads. title: above it."""

    title: str
    head: list[str]
    rows: list[list[str]]
    text: str = ""


@dataclass
class Fold:
    """Parts that a reader opens. title: what is in it."""

    title: str
    parts: list
    is_open: bool = False


@dataclass
class Section:
    """A part of a page. parts: figures, views, tables, folds and sentences, in their order."""

    title: str
    parts: list = field(default_factory=list)


def safe(text) -> str:
    """A text for a label inside of a drawing, which knows a little HTML itself."""
    return html.escape(str(text), quote=False)


def plain(values) -> list:
    """Values for JSON: what is no finite number is None."""
    found = values.tolist() if isinstance(values, np.ndarray) else list(values)
    return [None if isinstance(value, float) and not math.isfinite(value) else value for value in found]


def as_csv(columns: dict[str, list]) -> str:
    """Columns as a CSV text; what is missing is empty."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return sink.getvalue()


def write(path: Path, title: str, subtitle: str, sections: list[Section]) -> Path:
    """Write the page. Raises FlightError."""
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        Path(path).write_text(rendered(title, subtitle, sections), encoding="utf-8", newline="\n")
    except OSError as error:
        raise FlightError(f"'{path}' cannot be written: {(error.strerror or str(error)).lower()}") from None
    return Path(path)


def rendered(title: str, subtitle: str, sections: list[Section]) -> str:
    """The page as a text."""
    numbers, body, links = iter(range(1, 1_000_000)), [], []
    for place, section in enumerate(sections):
        links.append(f'<a href="#s{place}">{html.escape(section.title)}</a>')
        body.append(f'<section id="s{place}"><h2>{html.escape(section.title)}</h2>')
        body += [_part(part, numbers) for part in section.parts]
        body.append("</section>")
    texts = {"title": html.escape(title), "subtitle": html.escape(subtitle), "links": " ".join(links),
             "body": "\n".join(body), "library": _library(), "template": _template(), "policy": POLICY,
             "style": _own("page.css"),
             "script": _own("page.js") + (_own("space.js") if any(map(_has_view, sections)) else "")}
    return _PAGE.format(**texts)


def _has_view(holder) -> bool:
    return isinstance(holder, View) or any(map(_has_view, getattr(holder, "parts", ())))


@cache
def _library() -> str:
    """The drawing library, compressed."""
    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), 9, mtime=0)).decode()


@cache
def _template() -> str:
    """How drawings look, once for all of them."""
    return _json(pio.templates[TEMPLATE].to_plotly_json())


@cache
def _own(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _part(part, numbers) -> str:
    if isinstance(part, str):
        return f"<p>{html.escape(part)}</p>"
    if isinstance(part, Table):
        return _table(part)
    if isinstance(part, Fold):
        inside = "\n".join(_part(one, numbers) for one in part.parts)
        return f"<details{' open' if part.is_open else ''}><summary>{html.escape(part.title)}</summary>{inside}</details>"
    if isinstance(part, View):
        return _view(part, next(numbers))
    return _figure(part, next(numbers))


def _figure(part, number) -> str:
    drawing = json.loads(part.drawing.to_json())
    layout = drawing["layout"]
    layout.pop("template", None)  # the page's own
    layout.update({"height": part.height, "colorway": COLOURS, "font": {"size": 12}},
                  margin={"l": 70, "r": 20, "t": 20, "b": 55, **layout.get("margin", {})})
    for name, values in part.columns.items() if not part.sources else ():
        if len(values) != len(next(iter(part.columns.values()))):
            raise ValueError(f"the columns of '{part.title}' are of several lengths: {name}")
    data = {"title": part.title, "columns": {name: packed(values) for name, values in part.columns.items()},
            "sources": part.sources}
    text = f"<p>{html.escape(part.text)}</p>" if part.text else ""
    return (f'<figure><figcaption>{html.escape(part.title)}</figcaption>'
            f'<div class="drawing" id="f{number}" style="height:{part.height}px"></div>{text}'
            f'<p class="data"><button data-of="{number}" data-as="csv">CSV</button> '
            f'<button data-of="{number}" data-as="json">JSON</button></p>'
            f'<script type="application/json" id="drawing{number}">{_json(drawing)}</script>'
            f'<script type="application/json" id="data{number}">{_json(data)}</script></figure>')


def _view(part, number) -> str:
    text = f"<p>{html.escape(part.text)}</p>" if part.text else ""
    return (f'<figure class="view"><figcaption>{html.escape(part.title)}</figcaption>'
            f'<div class="space" id="v{number}" style="height:{part.height}px"></div>'
            f'<p class="time"><button class="play">Play</button> <input type="range" min="0" step="any" aria-label="time"> '
            f'<output></output> <label><input type="checkbox" class="follow"> follow</label></p>{text}'
            f'<script type="application/json" id="space{number}">{_json(part.data)}</script></figure>')


def packed(values):
    """Values for JSON: a list, or of an array of real numbers its bytes, which are shorter: {"f4" or "f8": base64}."""
    if isinstance(values, np.ndarray) and values.dtype in (np.float32, np.float64):
        little = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
        return {f"f{values.dtype.itemsize}": base64.b64encode(little.tobytes()).decode()}
    return plain(values)


def _table(table) -> str:
    head = "".join(f"<th>{html.escape(name)}</th>" for name in table.head)
    cells = ["".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) for row in table.rows]
    rows = "\n".join(f"<tr>{row}</tr>" for row in cells)
    text = f"<p>{html.escape(table.text)}</p>" if table.text else ""
    return (f'<h3>{html.escape(table.title)}</h3>{text}<div class="table"><table><thead><tr>{head}</tr></thead>'
            f"<tbody>{rows}</tbody></table></div>")


def _json(value) -> str:
    """JSON that can stand in a script element: nothing in it ends the element."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")


_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title><style>{style}</style></head>
<body><h1>{title}</h1><p>{subtitle}</p><nav>{links}</nav>
<noscript><p>The figures are drawn by a script in this file; tables and texts can be read without it.</p></noscript>
{body}
<script type="application/json" id="template">{template}</script>
<script type="application/gzip" id="library">{library}</script>
<script>{script}</script>
</body></html>
"""
