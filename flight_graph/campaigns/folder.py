"""Reading a campaign: its manifest, its columns, and its rows in case order, in constant memory.

    campaign = Campaign.at("runs/rates")
    table = campaign.read(["case", "settling_time_s"])     # a pyarrow.Table
    for batch in campaign.batches():                       # a pyarrow.Table a chunk
        ...

Nothing of it runs code of the campaign's scenario, and every row that is given out is the one that was written.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pyarrow
import pyarrow.parquet

from flight_graph.campaigns import rows as tables
from flight_graph.campaigns.chunk import Damaged, Part, about_of, decode, part_name
from flight_graph.campaigns.manifest import Manifest
from flight_graph.campaigns.rows import Column, Row
from flight_graph.errors import FlightError, unknown

DISAGREEMENT = re.compile(r"disagreement-(\d{6,})-[0-9a-f]+\.parquet")


@dataclass
class Campaign:
    """A campaign's folder, open for reading."""

    path: Path
    manifest: Manifest

    @classmethod
    def at(cls, path) -> "Campaign":
        """Raises FlightError when there is no campaign, or when its manifest is damaged."""
        return cls(Path(path), Manifest.read(Path(path)))

    def part(self, number: int) -> Path:
        """The file of a chunk, whether it is there or not."""
        return self.path / part_name(number)

    def chunks(self) -> list[int]:
        """The numbers of the chunks that the campaign is to have: of its rows, where a stopping rule has ended it."""
        return list(range(-(-self.manifest.rows // self.manifest.chunk)))

    def missing(self) -> list[int]:
        """The numbers of the chunks that are not there whole: absent, or short of runs since the campaign was extended."""
        return [number for number in self.chunks() if not self._is_whole(number)]

    def _is_whole(self, number):
        try:
            return self._about(number)["rows"] >= len(self._cases(number))
        except (FileNotFoundError, Damaged):
            return False

    def _cases(self, number):
        size = self.manifest.chunk
        return range(number * size, min((number + 1) * size, self.manifest.rows))

    def _about(self, number) -> dict:
        what = str(self.part(number))
        try:
            schema = pyarrow.parquet.read_schema(self.part(number))
        except FileNotFoundError:
            raise
        except (pyarrow.ArrowException, OSError, ValueError) as error:
            raise Damaged(f"{what} is damaged: {str(error).splitlines()[0]}") from None
        return about_of(schema.metadata, what) | {"schema": schema.remove_metadata()}

    def columns(self) -> list[Column]:
        """Name, unit, kind (run, parameter, metric) and type of every column, over all chunks that are there."""
        return tables.columns_of(self.schema())

    def schema(self) -> pyarrow.Schema:
        """The columns of the whole table in Arrow's form."""
        found = [pyarrow.schema([])]
        for number in self.chunks():
            if self.part(number).is_file():
                found.append(self._told(number, lambda number=number: self._about(number)["schema"]))
        return tables.unified(found)

    def batches(self, columns: list[str] | None = None) -> Iterator[pyarrow.Table]:
        """The rows that are there, a chunk at a time, in case order. Raises FlightError on a damaged part.

        columns: names of those that are wanted; all when left out.
        """
        schema = self.schema()
        for name in columns or []:
            if name not in schema.names:
                raise unknown("column", name, schema.names, str(self.path))
        if columns is not None:
            schema = pyarrow.schema([schema.field(name) for name in columns])
        for number in self.chunks():
            if self.part(number).is_file():
                part = self._told(number, lambda number=number: self.read_part(number, columns))
                yield tables.cast(part.table, schema).slice(0, len(self._cases(number)))

    def read(self, columns: list[str] | None = None) -> pyarrow.Table:
        """All rows that are there as one table, in case order."""
        found = list(self.batches(columns))
        if found:
            return pyarrow.concat_tables(found).combine_chunks()
        schema = self.schema()
        return schema.empty_table() if columns is None or not schema.names else schema.empty_table().select(columns)

    def read_part(self, number: int, columns: list[str] | None = None) -> Part:
        """A chunk, checked. Raises Damaged, and FileNotFoundError when it is not there."""
        part = decode(self.part(number), str(self.part(number)), columns)
        if part.campaign != self.manifest.identity:
            raise Damaged(f"{self.part(number)} belongs to another campaign")
        if part.number != number:
            raise Damaged(f"{self.part(number)} is chunk {part.number} under another name")
        return part

    def rows(self) -> Iterator[Row]:
        """The rows that are there, one by one, in case order."""
        for batch in self.batches():
            yield from tables.rows_of(batch)

    def row(self, case: int) -> Row:
        """One row. Raises FlightError when it is not there."""
        number = case // self.manifest.chunk
        if not 0 <= case < self.manifest.rows or not self.part(number).is_file():
            raise FlightError(f"{self.path}: there is no row of case {case}")
        part = self._told(number, lambda: self.read_part(number))
        return next(row for row in tables.rows_of(part.table) if row.case == case)

    def differences(self, case: int, metrics: dict) -> list[str]:
        """What a run of a case came to otherwise than its row says, in words; [] also where the campaign has no such row.

        metrics: those of the run, NaN and infinity as None.
        """
        try:
            row = self.row(case)
        except FlightError:
            return []
        known = {name: None if isinstance(value, float) and not math.isfinite(value) else value
                 for name, value in row.metrics.items()}
        return [f"case {case} in {self.path} has {name} {known[name]!r}, and here {metrics.get(name)!r}" for name in known
                if row.status == "ok" and known[name] != metrics.get(name)]

    def disagreements(self) -> list[Path]:
        """Parts that were made a second time, and came out otherwise."""
        return sorted(path for path in self.path.iterdir() if DISAGREEMENT.fullmatch(path.name))

    def _told(self, number, read):
        try:
            return read()
        except Damaged as error:
            raise FlightError(f"{error}; flight sweep {self.path} --resume runs its {len(self._cases(number))} cases "
                              "again") from None
