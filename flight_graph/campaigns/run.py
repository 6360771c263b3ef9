"""Running a chunk: a pure function of (manifest, chunk number). Where and when it runs is no part of it.
"""

from collections.abc import Callable, Iterable

import pyarrow

from flight_graph.campaigns.cases import Batch, Cases
from flight_graph.campaigns.chunk import encode
from flight_graph.campaigns.manifest import Manifest
from flight_graph.campaigns.rows import Row, table_of
from flight_graph.components.foreign import Consent, refuse
from flight_graph.graphs.scenario import Scenario
from flight_graph.lanes.batch import SideBySide
from flight_graph.lanes.operations import LANES


class ChunkRunner:
    """The chunks of one campaign in one thread: what cases share is prepared once.

    scenario: of the manifest, where it is loaded already. consent: as for `Manifest.load`. batch: how several runs are
    advanced (when left out: side by side where that pays); no bit of a row depends on it.
    """

    def __init__(self, manifest: Manifest, scenario: Scenario | None = None, consent: Consent = refuse,
                 batch: Batch | None = None):
        self.manifest = manifest
        self.together = SideBySide(manifest.runs)
        self.cases = Cases(manifest.load(consent) if scenario is None else scenario,
                           Batch(LANES, self.together.advance) if batch is None else batch)

    def rows(self, numbers: Iterable[int], watch: Callable | None = None) -> list[Row]:
        """The rows of some cases. watch(): is called now and then; what it raises ends the work."""
        return self.cases.rows(numbers, watch)

    def table(self, chunk: int, watch: Callable | None = None, earlier: pyarrow.Table | None = None) -> pyarrow.Table:
        """The table of a chunk. earlier: the table of its first cases, which are not run again."""
        numbers = self.manifest.cases(chunk)
        if earlier is not None:
            from flight_graph.campaigns.rows import rows_of
            known = rows_of(earlier)
            return table_of(known + self.rows(numbers[len(known):], watch), self.cases.units)
        return table_of(self.rows(numbers, watch), self.cases.units)

    def part(self, chunk: int, watch: Callable | None = None, earlier: pyarrow.Table | None = None) -> bytes:
        """The file of a chunk, as bytes."""
        return encode(self.table(chunk, watch, earlier), self.manifest.identity, chunk)


def run_chunk(manifest: Manifest, chunk: int, consent: Consent = refuse) -> pyarrow.Table:
    """The table of a chunk: the same wherever and however often it is run. Raises FlightError."""
    return ChunkRunner(manifest, consent=consent).table(chunk)
