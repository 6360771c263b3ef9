"""When a node that runs alone fires, whatever clock stamps its messages (the rule is told in docs/extend.md).

A kernel's t is always a multiple of the period. In a graph every stamp is one too; a message of a stranger is answered at
the first tick at or after its stamp, or at the one after the tick that was used last.
"""

from math import gcd

from flight_graph.timebase import J2000, SECOND

_OWN_EPOCH_NS = 10_000_000 * SECOND  # [ns] stamps as near to J2000 as this count from there, as those of our plants
_BACK_NS = SECOND  # [ns] stamps that fall back by more begin again
_FINEST_GRID = 100  # [1] a faster sender on the same grid sends at most this many messages a period


def epoch_of(stamp_ns: int) -> int:
    """The stamp of t = 0 for a node that was told none: J2000, or the first stamp where that is of another clock."""
    return J2000 if 0 <= stamp_ns - J2000 < _OWN_EPOCH_NS else stamp_ns


class Ticks:
    """Finds the t at which each message of the input that sets the firings is answered. tell(sentence): once each."""

    def __init__(self, period_ns: int, topic: str, tell):
        self._period_ns, self._topic, self._tell = period_ns, topic, tell
        self._tick = self._stamp = None  # of the last firing: its t, and the stamp that it answered
        self._is_off_grid = self._passes_over = False

    def of(self, t_ns: int) -> int | None:
        """The t of the firing that answers a message stamped t, or None when it is passed over."""
        period = self._period_ns
        tick = -(-t_ns // period) * period
        if self._tick is None:
            return self._fire(t_ns, tick)
        if not self._is_off_grid:
            if t_ns == tick:
                answered = self._tick == tick and self._stamp < tick  # its tick was used for an earlier message
                return self._fire(t_ns, tick, None if answered else tick)
            if t_ns - self._stamp < period and gcd(t_ns, period) * _FINEST_GRID >= period:
                return None  # one of a faster sender on the same grid: that of the tick is still to come
            self._is_off_grid = True
            self._tell(f"the stamps of {self._topic} are not on this node's grid of {period / 1e6:g} ms: it fires at the "
                       "first tick after each, and its outputs carry the stamp of the message that they answer")
        if tick < self._tick - _BACK_NS:
            return self._fire(t_ns, tick)
        if self._tick >= tick + period:
            if not self._passes_over:
                self._passes_over = True
                self._tell(f"{self._topic} comes faster than this node's {SECOND / period:g} Hz: some messages are not "
                           "answered")
            return None
        return self._fire(t_ns, max(tick, self._tick + period))

    def _fire(self, t_ns, tick, answer=...):
        self._tick, self._stamp = tick, t_ns
        return tick if answer is ... else answer
