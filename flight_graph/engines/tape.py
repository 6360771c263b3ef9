"""What foreign nodes said in a recorded run, brought back at its ticks: their outputs are inputs of the run made again."""

from dataclasses import dataclass

import numpy as np

from flight_graph.engines.addresses import address

_NEVER = 2**62  # [ticks]


@dataclass(frozen=True)
class Tape:
    """The messages of an output. target: name of the array that readers see.

    ticks: (n,) int64, rising; records: (n,) of the signal, each seen from its tick on.
    """

    node: str
    port: str
    target: str
    ticks: np.ndarray
    records: np.ndarray

    def index(self, tick: int) -> int:
        """The number of messages before a tick."""
        return int(np.searchsorted(self.ticks, tick))

    def between(self, first: int, tick: int) -> slice:
        """The messages from one tick until before another."""
        return slice(self.index(first), self.index(tick))

    def play(self, tick: int, arrays: dict[str, np.ndarray]) -> None:
        """Bring the message of a tick, where there is one."""
        at = self.index(tick)
        if at < len(self.ticks) and self.ticks[at] == tick:
            arrays[self.target].view("u1")[:] = self.records[at:at + 1].view("u1")


class Reels:
    """Tapes as the driver takes them: rows of holds whose origin moves on. rows: (n,) records of ``kind``."""

    def __init__(self, tapes: list[Tape], arrays: dict[str, np.ndarray], kind: np.dtype):
        self._tapes = tapes
        self._ticks = [np.append(tape.ticks, _NEVER).astype("<i8") for tape in tapes]
        self._records = [np.ascontiguousarray(tape.records) for tape in tapes]
        self.rows = np.array([(ticks[0], 0, address(arrays[tape.target]), address(records), arrays[tape.target].nbytes,
                               address(ticks))
                              for tape, ticks, records in zip(tapes, self._ticks, self._records)], kind)

    def begin(self, rows: np.ndarray, tick: int) -> None:
        """Let each be due at its first message from a tick on. rows: those of the driver."""
        for row, tape, ticks, records in zip(rows, self._tapes, self._ticks, self._records):
            at = tape.index(tick)
            row["next"], row["origin"] = ticks[at], address(records) + at * records.dtype.itemsize
            row["ticks"] = address(ticks) + 8 * at
