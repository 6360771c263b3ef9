"""Columns as a table for a person: a pandas.DataFrame where pandas is installed, else one that shows itself as well.

    table({"t [s]": t, "angles [rad]": angles})     # a column for each number of a vector: angles[0] [rad], ...
"""

import html
import importlib.util
from collections.abc import Mapping

import numpy as np

from flight_graph.errors import FlightError
from flight_graph.extras import required

SHOWN = 10  # rows of a plain table


def table(columns: Mapping, index: str | None = None):
    """A table of columns, name -> (n,) or (n, k) values; a pyarrow.Table and a list of rows, {name: value}, are taken too.

    index: the column that names the rows. Returns a pandas.DataFrame, or a `PlainTable` where pandas is not installed.
    Raises FlightError where columns are of different lengths.
    """
    if importlib.util.find_spec("pandas") is None:
        return PlainTable(flat(columns))
    return to_pandas(columns, index)


def to_pandas(columns: Mapping, index: str | None = None):
    """The same as a pandas.DataFrame. Raises FlightError, which says how to install it, where pandas is missing."""
    pandas = required("pandas", "notebooks", "a table as a DataFrame")
    frame = pandas.DataFrame(flat(columns))
    return frame if index is None else frame.set_index(index)


def flat(columns) -> dict[str, np.ndarray | list]:
    """Columns of single values: those of a vector are several, ``rates [rad/s]`` becomes ``rates[0] [rad/s]`` and so on."""
    found = {}
    for name, values in _columns(columns).items():
        values = values if isinstance(values, np.ndarray) else _array(values)
        if isinstance(values, np.ndarray) and values.ndim == 2:
            plain, bracket, unit = str(name).partition(" [")
            found |= {f"{plain}[{place}]{bracket}{unit}": values[:, place] for place in range(values.shape[1])}
        else:
            found[str(name)] = values
    lengths = {name: len(values) for name, values in found.items()}
    if len(set(lengths.values())) > 1:
        raise FlightError(f"columns of one table are of one length; these are of {lengths}")
    return found


def _columns(source) -> Mapping:
    if isinstance(source, Mapping):
        return source
    if hasattr(source, "column_names"):  # a pyarrow.Table
        return {name: source.column(name).to_pylist() for name in source.column_names}
    rows = list(source)
    return {name: [row.get(name) for row in rows] for name in dict.fromkeys(name for row in rows for name in row)}


def _array(values):
    """A list as an array where it holds numbers, or vectors of one length; else as it is."""
    values = list(values)
    if values and all(isinstance(value, (list, tuple)) for value in values) and len({len(value) for value in values}) == 1:
        return np.array(values)
    return np.array(values) if values and all(type(value) in (int, float, bool) for value in values) else values


class PlainTable:
    """A table without pandas: ``table["name"]`` is a column, ``len(table)`` the number of rows; it shows its first rows."""

    def __init__(self, columns: dict):
        self.columns = columns

    def __getitem__(self, name: str):
        return self.columns[name]

    def __len__(self):
        return max(map(len, self.columns.values()), default=0)

    def _cells(self):
        yield list(self.columns)
        for row in range(min(len(self), SHOWN)):
            yield [_cell(values[row]) for values in self.columns.values()]
        if len(self) > SHOWN:
            yield ["..."] * len(self.columns)

    def __repr__(self):
        rows = list(self._cells())
        widths = [max(map(len, column)) for column in zip(*rows)]
        lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows]
        return "\n".join([*lines, f"{len(self)} rows"])

    def _repr_html_(self):
        head, *rows = ([html.escape(cell) for cell in row] for row in self._cells())
        lines = ["".join(f"<td>{cell}</td>" for cell in row) for row in rows]
        return (f"<table><tr>{''.join(f'<th>{cell}</th>' for cell in head)}</tr>"
                f"{''.join(f'<tr>{line}</tr>' for line in lines)}</table><p>{len(self)} rows</p>")


def _cell(value) -> str:
    if isinstance(value, (float, np.floating)):
        return f"{value:.6g}"
    return "" if value is None else str(value)
