"""One HTML file of figures and tables that needs nothing else: the drawing library (plotly) and all data are in it.

A page is a list of sections; a section has figures, tables and sentences. Every figure carries its numbers as columns,
which the page gives as CSV or JSON. A policy in the page's head forbids it to load anything from anywhere. Names and texts
may come from a stranger's campaign or bag, so all of them are escaped, those inside of figures too.
"""

import csv
import html
import io
import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from plotly import graph_objects
from plotly.offline import get_plotlyjs

from flight_graph.errors import FlightError

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; font-src data:"
COLOURS = ("#0b6e99", "#c0392b", "#2e8b57", "#d68910", "#6c4a9e", "#5d6d7e")  # told apart by most eyes, in this order
GREY = "#5d6d7e"
HEIGHT = 380  # [px] of a figure


@dataclass
class Figure:
    """A drawing and its numbers. columns: name (with unit) -> values, all of one length; None stands for no number."""

    title: str
    drawing: graph_objects.Figure
    columns: dict[str, list]
    text: str = ""
    height: int = HEIGHT


@dataclass
class Table:
    """Rows of cells; of numbers a text that a person reads. title: above it."""

    title: str
    head: list[str]
    rows: list[list[str]]
    text: str = ""


@dataclass
class Section:
    """A part of a page. parts: figures, tables and sentences, in their order."""

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
    return _PAGE.format(policy=POLICY, title=html.escape(title), subtitle=html.escape(subtitle), style=_STYLE,
                        links=" ".join(links), body="\n".join(body), library=get_plotlyjs(), script=_SCRIPT)


def _part(part, numbers) -> str:
    if isinstance(part, str):
        return f"<p>{html.escape(part)}</p>"
    if isinstance(part, Table):
        return _table(part)
    number = next(numbers)
    drawing = graph_objects.Figure(part.drawing)
    drawing.update_layout(template="plotly_white", height=part.height, margin={"l": 70, "r": 20, "t": 20, "b": 55},
                          colorway=COLOURS, font={"size": 12})
    for name, values in part.columns.items():
        if len(values) != len(next(iter(part.columns.values()))):
            raise ValueError(f"the columns of '{part.title}' are of several lengths: {name}")
    data = {"title": part.title, "columns": {name: plain(values) for name, values in part.columns.items()}}
    text = f"<p>{html.escape(part.text)}</p>" if part.text else ""
    return (f'<figure><figcaption>{html.escape(part.title)}</figcaption>'
            f'<div class="drawing" id="f{number}" style="height:{part.height}px"></div>{text}'
            f'<p class="data"><button data-of="{number}" data-as="csv">CSV</button> '
            f'<button data-of="{number}" data-as="json">JSON</button></p>'
            f'<script type="application/json" id="drawing{number}">{_json(json.loads(drawing.to_json()))}</script>'
            f'<script type="application/json" id="data{number}">{_json(data)}</script></figure>')


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


_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1c2833; margin: 0 auto; max-width: 1240px; padding: 0 20px 60px; }
h1 { font-size: 24px; margin: 24px 0 4px; } h2 { font-size: 19px; border-bottom: 1px solid #ccd1d1; margin-top: 36px; }
h3 { font-size: 15px; margin: 18px 0 6px; } nav { position: sticky; top: 0; background: #fff; padding: 8px 0; z-index: 5;
border-bottom: 1px solid #ccd1d1; } nav a { margin-right: 16px; color: #0b6e99; text-decoration: none; }
section { scroll-margin-top: 44px; } figure { margin: 18px 0; } figcaption { font-weight: 600; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; }
th, td { text-align: left; padding: 3px 10px 3px 0; border-bottom: 1px solid #eaecee; vertical-align: top; }
th { position: sticky; top: 0; background: #fff; } .data { margin: 2px 0; } p { max-width: 90ch; }
button { font: 12px system-ui, sans-serif; border: 1px solid #aab7b8; background: #fff; border-radius: 3px; }
"""

_SCRIPT = """
const read = id => JSON.parse(document.getElementById(id).textContent);
for (const place of document.querySelectorAll('.drawing')) {
  const drawing = read('drawing' + place.id.slice(1));
  Plotly.newPlot(place, drawing.data, drawing.layout, {responsive: true, displaylogo: false})
    .then(() => place.dataset.drawn = 'yes');
}
const quoted = text => /[",\\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text;
const cell = value => value === null ? '' : quoted(String(value));
const csv = columns => {
  const names = Object.keys(columns), rows = [names.map(cell).join(',')];
  for (let i = 0; i < columns[names[0]].length; i++) rows.push(names.map(name => cell(columns[name][i])).join(','));
  return rows.join('\\n') + '\\n';
};
window.tableOf = number => csv(read('data' + number).columns);
for (const button of document.querySelectorAll('button[data-of]')) button.addEventListener('click', () => {
  const data = read('data' + button.dataset.of), kind = button.dataset.as;
  const text = kind === 'csv' ? csv(data.columns) : JSON.stringify(data, null, 1);
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([text], {type: kind === 'csv' ? 'text/csv' : 'application/json'}));
  link.download = data.title.replace(/[^A-Za-z0-9_-]+/g, '_') + '.' + kind;
  link.click();
  URL.revokeObjectURL(link.href);
});
"""

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title><style>{style}</style></head>
<body><h1>{title}</h1><p>{subtitle}</p><nav>{links}</nav>
<noscript><p>The figures are drawn by a script in this file; tables and texts can be read without it.</p></noscript>
{body}
<script>{library}</script>
<script>{script}</script>
</body></html>
"""
