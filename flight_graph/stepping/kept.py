"""Checkpoints kept in memory while a run is stepped through: always few, and never far from any tick that was passed."""

from bisect import bisect_right

from flight_graph.engines.checkpoint import Checkpoint

MOST = 128  # checkpoints that are kept
SPACING = 256  # [ticks] between them at first; twice as many whenever there would be too many


class Kept:
    """Checkpoints by tick, on a grid that becomes coarser as the run becomes longer. first: the one it begins with."""

    def __init__(self, first: Checkpoint, spacing: int = SPACING):
        self.first, self.spacing, self._ticks, self._known = first, spacing, [first.tick], {first.tick: first}

    def __len__(self):
        return len(self._ticks)

    def next_tick(self, tick: int) -> int:
        """The first tick behind this one of which a checkpoint is wanted."""
        return (tick // self.spacing + 1) * self.spacing

    def add(self, tick: int, made) -> None:
        """Keep the checkpoint of a tick on the grid, which ``made()`` gives where it is wanted."""
        if tick % self.spacing or tick in self._known:
            return
        if len(self._ticks) >= MOST:
            self._thin()
            if tick % self.spacing:
                return
        self._known[tick] = made()
        self._ticks.insert(bisect_right(self._ticks, tick), tick)

    def _thin(self):
        self.spacing *= 2
        self._ticks = [tick for tick in self._ticks if tick == self.first.tick or tick % self.spacing == 0]
        self._known = {tick: self._known[tick] for tick in self._ticks}

    def before(self, tick: int) -> Checkpoint:
        """The newest checkpoint not behind a tick."""
        return self._known[self._ticks[max(bisect_right(self._ticks, tick) - 1, 0)]]
