"""How the command line shows things: console, progress, tables."""

import math
import os
import shutil
import sys
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console, Group
from rich.measure import Measurement
from rich.padding import Padding
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from flight_graph.bags.errors import quoted
from flight_graph.text_files import printable
from flight_graph.viewers.display import has_display

_ROWS = 40  # of the table of differing fields
_COMFORT, _SHORT = 22, 36  # [characters] that a column of sentences needs, and of a cell that shares its line
_BETWEEN, _INDENT = "   ", 2
_PIPED = 160  # [characters] of a line where nobody says how wide they are


class _Console(Console):
    """Shows the characters that steer a terminal by their numbers: names and texts may come from a stranger's bag. A table
    that is too wide for the terminal is shown row by row, so that it can be read at 80 columns."""

    def print(self, *objects, **options):
        fitted = [printable(item) if isinstance(item, str) else self._fitted(item) for item in objects]
        if any(isinstance(item, Group) for item in fitted):
            options["soft_wrap"] = False  # blocks that are not wrapped would be cut
        super().print(*fitted, **options)

    def _fitted(self, item):
        if not isinstance(item, Table):
            return item
        if isinstance(item.title, str):  # brackets stand for themselves, as in [s] and in names of files
            item.title = Text(item.title, style="table.title")
        for column in item.columns:
            column.header = Text(column.header) if isinstance(column.header, str) else column.header
        if _needed(self, item) > self.width:
            return rows_below_each_other(item, self.width)
        for column in item.columns:
            least, most = _sizes(self, column)
            column.no_wrap, column.overflow = least == most, "fold"  # names stay whole, sentences give way
        return item


def _needed(console: Console, table: Table) -> int:
    """The columns [characters] that a table needs: whole words, and room for sentences."""
    width = 1
    for column in table.columns:
        least, most = _sizes(console, column)
        width += 3 + max(least, min(_COMFORT, most))
    return width


def _sizes(console: Console, column) -> tuple[int, int]:
    """The longest word and the longest line [characters] of a column."""
    sizes = [Measurement.get(console, console.options, cell) for cell in [column.header, *column.cells]]
    return max((size.minimum for size in sizes), default=0), max((size.maximum for size in sizes), default=0)


def rows_below_each_other(table: Table, width: int) -> Group:
    """A table as blocks of lines, one a row: the first cell, then the others behind the heads of their columns, as many
    short ones on a line as fit whole into the width."""
    parts = [table.title] if table.title else []
    heads = [column.header for column in table.columns]
    above = ""
    for cells in zip(*(column.cells for column in table.columns)):
        first, *others = (cell if isinstance(cell, Text) else Text.from_markup(str(cell)) for cell in cells)
        if first.plain not in ("", above):
            parts.append(Text.assemble(first, style="bold"))
        above = first.plain
        named = [Text.assemble((f"{head.plain} ", "dim"), cell) for head, cell in zip(heads[1:], others) if cell.plain]
        parts += [Padding(text, (0, 0, 0, _INDENT)) for text in _lines(named, width - _INDENT)]
    return Group(*parts)


def _lines(texts: list[Text], width: int) -> list[Text]:
    """Texts on as few lines as their order allows; long ones have lines of their own, below the others."""
    short = [text for text in texts if len(text) <= _SHORT and "\n" not in text.plain]
    lines: list[Text] = []
    for text in short:
        if lines and len(lines[-1]) + len(_BETWEEN) + len(text) <= width:
            lines[-1] = Text.assemble(lines[-1], _BETWEEN, text)
        else:
            lines.append(text)
    return lines + [text for text in texts if text not in short]


_width = None if sys.stdout.isatty() or os.environ.get("COLUMNS") else _PIPED  # None: the console's own
console = _Console(soft_wrap=_width is not None, width=_width)
_errors = _Console(stderr=True)
_bars = []  # on the screen now


def status(text: str) -> None:
    """A line for a person, on standard error."""
    _errors.print(text, highlight=False, markup=False, soft_wrap=True)


def next_command(*words) -> None:
    """The one command of ``flight`` that a person is likely to want now, on standard error, as it can be typed here."""
    status(f"next: {' '.join(quoted(word) for word in (_program(), *words))}")


def report_next(bag) -> None:
    """After a run: its page, in which the vehicle moves, is likely to be wanted now; opened where there is a display."""
    next_command("report", bag, *(["--open"] if has_display() else []))


def _program() -> str:
    """``flight``, or its path as it was typed where nobody finds it by name."""
    typed = sys.argv[0]
    return typed if Path(typed).stem == "flight" and os.sep in typed and shutil.which("flight") is None else "flight"


def warn_of(alarms: list[str]) -> None:
    """What of a run makes wary, on standard error: in its last lines, where it is seen."""
    for sentence in alarms:
        status(f"warning: {sentence}")


class RunProgress:
    """A bar of simulated seconds on standard error, where that is a terminal and it is wanted."""

    def __init__(self, scenario, wanted: bool):
        self._total, self._wanted = scenario.duration_ns / 1e9, wanted and _errors.is_terminal
        self._name, self._bar = scenario.name, None

    def __enter__(self):
        if self._wanted:
            self._bar = Progress(TextColumn("{task.description}", markup=False), BarColumn(), TextColumn(
                "{task.completed:.1f} of {task.total:g} s simulated"), TimeRemainingColumn(), console=_errors,
                transient=True)
            self._bar.start()
            self._task = self._bar.add_task(self._name, total=self._total)
        return self

    def __exit__(self, *_):
        if self._bar:
            self._bar.stop()

    def compiling(self, done: int, total: int, names: str) -> None:
        """Say what machine code is being made."""
        if self._bar:
            self._bar.update(self._task, description=compiling_text(self._name, done, total, names))

    def advance(self, seconds: float) -> None:
        """Move the bar to ``seconds`` simulated."""
        if self._bar:
            self._bar.update(self._task, completed=seconds, description=self._name)


def compiling_text(name: str, done: int, total: int, names: str) -> str:
    """What is being compiled, for a bar."""
    return f"{name}: compiling {names or 'components'} (once; it is kept), {done} of {total} done"


class _Either(ProgressColumn):
    """One column where the end is known, another one where nobody knows it."""

    def __init__(self, known: ProgressColumn, unknown: ProgressColumn):
        super().__init__()
        self._known, self._unknown = known, unknown

    def render(self, task):
        return (self._unknown if task.total is None else self._known).render(task)


class _Count(ProgressColumn):
    """What has been done, of how much where that is known."""

    def render(self, task):
        of_all = "" if task.total is None else f" of {task.total:g}"
        return Text(f"{round(task.completed, 1):g}{of_all}" if task.completed or of_all else "")


@contextmanager
def steps(name: str, wanted: bool):
    """A bar of finished steps on standard error, with the time that is left; where nobody knows how many there are, how
    many have been done, and the time that took. Gives advance(done, total, what)."""
    if not (wanted and _errors.is_terminal):
        yield lambda done, total, what="": None
        return
    with Progress(TextColumn("{task.description}", markup=False), _Either(BarColumn(), SpinnerColumn()), _Count(),
                  _Either(TimeRemainingColumn(), TimeElapsedColumn()), console=_errors,
                  transient=True) as bar:
        task = bar.add_task(printable(name), total=None)
        _bars.append(bar)
        try:
            yield lambda done, total, what="": bar.update(
                task, completed=done, total=total, description=printable(f"{name}: {what}"))
        finally:
            _bars.remove(bar)


@contextmanager
def without_bar():
    """Take the bar of `steps` away while a question is asked."""
    for bar in _bars:
        bar.stop()
    yield
    for bar in _bars:
        bar.start()


@contextmanager
def working(text: str, wanted: bool):
    """A turning wheel on standard error, with the time it takes, while something goes on whose end nobody can tell."""
    if not (wanted and _errors.is_terminal):
        yield
        return
    with Progress(SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn(), console=_errors,
                  transient=True) as bar:
        bar.add_task(printable(text), total=None)
        yield


def add(table: Table, *cells) -> None:
    """Add a row of plain text: brackets (``[rad]``) stand for themselves."""
    table.add_row(*(Text(printable(str(cell))) for cell in cells))


def metrics_table(scenario, outcome) -> Table:
    """The metrics of a run, with units and meanings; of one that the run does not have, why."""
    from flight_graph.graphs import glossary
    known = glossary.of(scenario)
    table = Table("metric", "value", "unit", "meaning", title=f"{scenario.name} ({outcome.engine}, "
                  f"{scenario.duration_ns / 1e9:g} s in {outcome.wall_s:.3g} s)", title_justify="left")
    for name, value in outcome.metrics.items():
        entry = known.entry(name)
        why = f" - none: {entry.missing}" if value is None and entry.missing else ""
        add(table, name, number(value), entry.unit, f"{entry.meaning}{why}")
    return table


def number(value) -> str:
    """A metric for a person; one that is missing is none."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def fields_table(topics):
    """The fields that differ, with their largest differences."""
    table = Table("topic", "messages", "field", "absolute", "relative", title_justify="left",
                  title="largest differences")
    rows = []
    for topic in topics:
        counts = str(topic.count_a) if topic.count_a == topic.count_b else f"{topic.count_a} and {topic.count_b}"
        if not topic.fields:
            rows.append((topic.topic, counts, topic.remark or "", "", ""))
        for name, difference in topic.fields.items():
            rows.append((topic.topic, counts, name, *(
                number(value) if math.isfinite(value) else "not a number" for value in
                (difference.absolute, difference.relative))))
    for row in rows[:_ROWS]:
        add(table, *row)
    if len(rows) > _ROWS:
        add(table, f"and {len(rows) - _ROWS} more fields", "", "(--json has all)", "", "")
    return table
