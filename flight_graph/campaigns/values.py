"""The columns of a campaign as numbers, some at a time, and which rows belong together.

Rows of two combinations of fixed values (variants, points of a grid) are never put together unless someone asks for it, and
of a design of Saltelli only the rows A and B are draws of the block's distributions.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pyarrow

from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.rows import Column
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs.vary import Vary

COLUMN_BYTES = 64 << 20  # [bytes] of numbers that are read at a time
POOLED = "all combinations together"


@dataclass(frozen=True)
class Group:
    """The rows of one combination of fixed values. label: None where there is one only; rows: (n,) bool of the table."""

    label: str | None
    rows: np.ndarray


class Values:
    """A campaign's table by columns. pool: put all combinations together.

    cases: (n,) numbers; ok: (n,) bool, runs that ended well; plan: of the draws. Raises FlightError when no run has ended.
    """

    def __init__(self, campaign: Campaign, pool: bool = False):
        self.campaign, self.pool = campaign, pool
        self.vary = Vary(campaign.manifest.vary, campaign.manifest.origin or campaign.manifest.name)
        self.plan = self.vary.file.sampling.plan
        parts = list(campaign.batches(["case", "status"])) if campaign.schema().names else []
        table = pyarrow.concat_tables(parts) if parts else None
        if table is None or not table.num_rows:
            raise FlightError(f"{campaign.path}: no run of this campaign has ended; flight sweep {campaign.path} runs them")
        self.cases = table.column("case").to_numpy()
        status = np.array(table.column("status").to_pylist())
        self.ok, names = status == "ok", sorted(set(status.tolist()))
        self.statuses = {name: int((status == name).sum()) for name in names}

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Every column by its name."""
        return {column.name: column for column in self.campaign.columns()}

    @property
    def metrics(self) -> list[str]:
        """Names of the metrics."""
        return [name for name, column in self.columns.items() if column.kind == "metric"]

    def checked(self, name: str, option: str) -> str:
        """A metric that is there. Raises FlightError."""
        if name not in self.metrics:
            raise unknown("metric", name, self.metrics, option)
        return name

    @cached_property
    def combinations(self) -> list[str | None]:
        """The label of each combination."""
        found = self.vary.combinations
        if len(found) == 1:
            return [None]
        fixed = dict.fromkeys(key for _, values in found for key in values)
        told = [key for key in fixed if len({repr(values.get(key)) for _, values in found}) > 1]
        grid = [key for key in told if key in self.vary.file.grid]
        return [", ".join([*([name] if name else []), *(f"{key} {_word(values[key])}" for key in (grid if name else told)
                                                        if key in values)]) for name, values in found]

    @cached_property
    def groups(self) -> list[Group]:
        """The groups that have rows; of a design of Saltelli its rows A and B alone."""
        drawn = (self.cases // len(self.combinations)) % self.vary.sampler.rows < 2 if self.plan == "saltelli" else True
        if self.pool or len(self.combinations) == 1:
            label = POOLED if len(self.combinations) > 1 else None
            return [Group(label, np.full(len(self.cases), True) & drawn)]
        member = self.cases % len(self.combinations)
        found = [Group(label, (member == number) & drawn) for number, label in enumerate(self.combinations)]
        return [group for group in found if group.rows.any()]

    def read(self, names: list[str]) -> Iterator[tuple[str, np.ndarray | list, np.ndarray]]:
        """(name, column, rows without it (n,)) of each: (n,) or of vectors (n, size) numbers, NaN where there is none; of
        texts a list, with None."""
        at_once = max(1, COLUMN_BYTES // (8 * max(1, len(self.cases))))
        for first in range(0, len(names), at_once):
            block = names[first:first + at_once]
            parts = {name: [] for name in block}
            for batch in self.campaign.batches(block):
                for name in block:
                    column = batch.column(name)
                    parts[name].append((_numbers(column), column.is_null().to_numpy()))
            for name in block:
                found, empty = zip(*parts.pop(name))
                if isinstance(found[0], list):
                    yield name, [value for part in found for value in part], np.concatenate(empty)
                else:
                    yield name, np.concatenate(found), np.concatenate(empty)

    def inputs(self) -> tuple[dict[str, np.ndarray], list[str]]:
        """What is drawn, by key, in columns of numbers: ``key`` or, of a vector, ``key[i]``; and the keys that are none."""
        keys = [key for key in self.vary.sampler.keys if key in self.columns]
        counted = {key for key, found in self.vary.file.random.items() if found.count is not None}
        found, others = {}, [key for key in keys if key in counted]
        for key, column, _ in self.read([key for key in keys if key not in counted]):
            if isinstance(column, list):
                others.append(key)
            elif column.ndim == 2:
                found |= {f"{key}[{i}]": column[:, i] for i in range(column.shape[1])}
            else:
                found[key] = column
        return found, others


def _word(value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _numbers(column: pyarrow.ChunkedArray):
    kind = column.type
    if pyarrow.types.is_fixed_size_list(kind):
        if pyarrow.types.is_string(kind.value_type):
            return column.to_pylist()
        empty = [None] * kind.list_size
        rows = [empty if row is None else row for row in column.to_pylist()]
        return np.array(rows, dtype=float).reshape(len(rows), kind.list_size)
    if pyarrow.types.is_string(kind):
        return column.to_pylist()
    if pyarrow.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pyarrow.types.is_boolean(kind):
        column = column.cast(pyarrow.int8())
    return column.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False).astype(float)
