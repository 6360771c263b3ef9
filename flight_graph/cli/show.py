"""How the command line shows things: console, progress, tables."""

import math
import sys
from contextlib import contextmanager

from rich.console import Console, Group
from rich.measure import Measurement
from rich.padding import Padding
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from flight_graph.bags.errors import quoted
from flight_graph.text_files import printable

_ROWS = 40  # of the table of differing fields
_COMFORT, _SHORT = 22, 36  # [characters] that a column of sentences needs, and of a cell that shares its line


class _Console(Console):
    """Shows the characters that steer a terminal by their numbers: names and texts may come from a stranger's bag. A table
    that is too wide for the terminal is shown row by row, so that it can be read at 80 columns."""

    def print(self, *objects, **options):
        fitted = [printable(item) if isinstance(item, str) else self._fitted(item) for item in objects]
        if any(isinstance(item, Group) for item in fitted):
            options["soft_wrap"] = False  # blocks that are not wrapped would be cut
        super().print(*fitted, **options)

    def _fitted(self, item):
        return rows_below_each_other(item) if isinstance(item, Table) and _needed(self, item) > self.width else item


def _needed(console: Console, table: Table) -> int:
    """The columns [characters] that a table needs: whole words, and room for sentences."""
    width = 1
    for column in table.columns:
        sizes = [Measurement.get(console, console.options, cell) for cell in [column.header, *column.cells]]
        longest = max((size.minimum for size in sizes), default=0)
        width += 3 + max(longest, min(_COMFORT, max((size.maximum for size in sizes), default=0)))
    return width


def rows_below_each_other(table: Table) -> Group:
    """A table as blocks of lines, one a row: the first cell, then the others behind the heads of their columns, short ones
    on one line."""
    parts = [Text(str(table.title), style="italic")] if table.title and not isinstance(table.title, Text) else [
        part for part in [table.title] if part]
    heads = [head.header if isinstance(head.header, Text) else Text.from_markup(str(head.header)) for head in table.columns]
    above = ""
    for cells in zip(*(column.cells for column in table.columns)):
        first, *others = (cell if isinstance(cell, Text) else Text.from_markup(str(cell)) for cell in cells)
        if first.plain not in ("", above):
            parts.append(Text.assemble(first, style="bold"))
        above = first.plain
        named = [Text.assemble((f"{head.plain} ", "dim"), cell) for head, cell in zip(heads[1:], others) if cell.plain]
        short = [text for text in named if len(text) <= _SHORT and "\n" not in text.plain]
        if short:
            parts.append(Padding(Text("   ").join(short), (0, 0, 0, 2)))
        parts += [Padding(text, (0, 0, 0, 2)) for text in named if text not in short]
    return Group(*parts)


console = _Console(soft_wrap=not sys.stdout.isatty(), width=None if sys.stdout.isatty() else 160)
_errors = _Console(stderr=True)
_bars = []  # on the screen now


def status(text: str) -> None:
    """A line for a person, on standard error."""
    _errors.print(text, highlight=False, markup=False, soft_wrap=True)


def next_command(*words) -> None:
    """The one command that a person is likely to want now, on standard error."""
    status(f"next: {' '.join(quoted(word) for word in words)}")


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
            self._bar = Progress(TextColumn("{task.description}"), BarColumn(), TextColumn(
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


@contextmanager
def steps(name: str, wanted: bool):
    """A bar of finished steps on standard error; gives advance(done, total, what)."""
    if not (wanted and _errors.is_terminal):
        yield lambda done, total, what="": None
        return
    with Progress(TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed} of {task.total}"),
                  TimeRemainingColumn(), console=_errors, transient=True) as bar:
        task = bar.add_task(name, total=None)
        _bars.append(bar)
        try:
            yield lambda done, total, what="": bar.update(task, completed=done, total=total, description=f"{name}: {what}")
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
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=_errors,
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
