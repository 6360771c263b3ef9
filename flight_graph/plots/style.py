"""How pictures look: one set of colours, legends beside the lines, a title that says what ran. No display is needed."""

import textwrap
from pathlib import Path

from flight_graph.errors import FlightError
from flight_graph.text_files import printable

COLOURS = ("#0b6e99", "#c0392b", "#2e8b57", "#d68910", "#6c4a9e", "#5d6d7e", "#16a085", "#a04000", "#34495e")
DASHES = ("-", "--", ":", "-.")
GREY = "#5d6d7e"
DOTS = 110  # an inch
FORMATS = (".png", ".svg", ".pdf")
_WRAP = 110  # [characters] of a title


def check_format(path: Path) -> Path:
    """The path of a picture. Raises FlightError where its ending names no kind of picture."""
    if path.suffix.lower() not in FORMATS:
        raise FlightError(f"'{path}' names no kind of picture; allowed: {', '.join(FORMATS)}")
    return path


def new_figure(width: float, height: float):
    """An empty figure of this size [inch], with room for legends beside its panels."""
    from matplotlib.figure import Figure
    return Figure(figsize=(width, height), layout="constrained")


def plain(text) -> str:
    """A text as it stands: signs that mean mathematics to the drawing library, or steer a terminal, are signs."""
    return "\n".join(printable(line) for line in str(text).split("\n")).replace("$", r"\$")


def legend(panel, **options) -> None:
    """A legend on the right of a panel, where no line runs through it."""
    if panel.get_legend_handles_labels()[1]:
        panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, frameon=False, fontsize=8, **options)


def save(figure, path, title: str = "") -> Path:
    """Write a figure. Raises FlightError."""
    if title:
        lines = [part for line in title.splitlines() for part in textwrap.wrap(line, _WRAP) or [""]]
        figure.suptitle(plain("\n".join(lines)), fontsize=11)
    for panel in figure.axes:
        panel.grid(alpha=0.25)
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=DOTS)
    except OSError as error:
        raise FlightError(f"'{path}' cannot be written: {(error.strerror or str(error)).lower()}") from None
    return path
