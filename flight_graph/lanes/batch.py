"""Flights of one scenario, eight of them side by side: the same bits as one after the other, in less time.

    together = SideBySide(runs=10000)
    together.advance(flights, ticks)        what flight.advance(ticks) does to each
    together.report.sentence()              what worked side by side, and what did not
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from flight_graph.engines.flight import Flight
from flight_graph.errors import FlightError
from flight_graph.lanes import wide_parts
from flight_graph.lanes.group import Group
from flight_graph.lanes.operations import LANES

FEWEST = 4  # flights that are faster side by side than one after the other
CHUNK = 20_000  # [ticks] between calls of watch
ROUNDS = 8  # until it is judged whether lanes pay
SAVED = 0.6  # part of a run's time
PRICE = 5.0  # [s] of CPU to compile a part
_LOADING = threading.Lock()


@dataclass
class Report:
    """How flights were advanced. side_by_side, singly: how many; reasons: why a component, or flights, worked singly."""

    side_by_side: int = 0
    singly: int = 0
    reasons: dict[str, str] = field(default_factory=dict)

    def add(self, other: "Report") -> None:
        """Count the flights of another one as well."""
        self.side_by_side, self.singly = self.side_by_side + other.side_by_side, self.singly + other.singly
        self.reasons |= other.reasons

    def sentence(self) -> str:
        """What a person reads."""
        text = f"{self.side_by_side} runs {LANES} at a time, {self.singly} one at a time"
        return text + "".join(f"; {name}: {reason}" for name, reason in self.reasons.items())


class SideBySide:
    """Advances flights of one scenario in one thread. runs: how many there will be; None: enough for machine code to pay.

    Machine code is made when it is thought to save more time than it takes, judged by the first flights, which go one by
    one. No bit of a flight depends on that.
    """

    def __init__(self, runs: int | None = None):
        self.report, self._runs, self._seconds = Report(), runs, None  # [s] for a tick of a run that goes alone
        self._hopeless, self._slow, self._times = False, set(), {}  # the compiler failed; forms that took longer
        self._differs, self._groups = {}, {}  # form -> node -> ranges; form -> (wide parts, Group)

    def advance(self, flights: list[Flight], ticks: int, watch: Callable | None = None) -> None:
        """Advance flights until before a tick, or until each stops. Raises FlightError.

        watch(): is called now and then; what it raises ends the work.
        """
        forms = {}
        for flight in flights:
            if not flight.stop and flight.tick < ticks:
                forms.setdefault(_form(flight), []).append(flight)
        for form, alike in forms.items():
            for first in range(0, len(alike), LANES):
                self._advance(form, alike[first:first + LANES], ticks, watch)

    def _advance(self, form, flights, ticks, watch):
        group = self._group(form, flights, ticks) if len(flights) >= FEWEST else None
        if group is None:
            self._one_by_one(flights, ticks, watch)
            return
        began, start = _clock(), flights[0].tick
        group.bind(flights)
        reached = start
        while reached < ticks and group.is_alive():
            reached = min(ticks, reached + CHUNK)
            group.advance(reached)
            if watch:
                watch()
        group.release()
        self.report.side_by_side += len(flights)
        if reached > start:
            self._compare(form, (_clock() - began) / (reached - start) / len(flights))

    def _compare(self, form, seconds):
        """Go back to one by one where the best of some rounds took longer for a tick of a flight."""
        times = self._times.setdefault(form, [])
        times.append(seconds)
        if len(times) == ROUNDS and self._seconds is not None and min(times) > self._seconds:
            self._slow.add(form)
            self.report.reasons["time"] = "side by side took longer than one by one"

    def _one_by_one(self, flights, ticks, watch):
        for flight in flights:
            began, start = _clock(), flight.tick
            while not flight.stop and flight.tick < ticks:
                flight.advance(min(ticks, flight.tick + CHUNK))
                if watch:
                    watch()
            if flight.tick > start:
                seconds = (_clock() - began) / (flight.tick - start)
                self._seconds = seconds if self._seconds is None else min(seconds, self._seconds)
        self.report.singly += len(flights)

    def _group(self, form, flights, ticks) -> Group | None:
        """Woven memory for flights of a form; None where they go one by one."""
        first = flights[0]
        if self._hopeless or form in self._slow:
            return None
        if form is None or first.bounds_checked:
            self.report.reasons["engine"] = "plain Python and checked bounds work on one run at a time"
            return None
        faulty = {firing.node for firing in first.schedule.firings if not _is_plain(firing)}
        asked = {}
        known = self._differs.setdefault(form, {})
        for name, node in first.schedule.graph.nodes.items():
            if name not in faulty:
                found = wide_parts.differing([flight.arrays[f"P_{name}"] for flight in flights])
                known[name] = tuple(sorted({*found, *known.get(name, ())}))
                asked[name] = node.use, node.component, known[name]
        kept = self._groups.get(form)
        if kept is None or kept[0] != asked:
            kept = self._groups[form] = (asked, self._made(first, asked, faulty, ticks))
            if kept[1] is None:
                del self._groups[form]
        return kept[1]

    def _made(self, flight, asked, faulty, ticks) -> Group | None:
        with _LOADING:
            missing = wide_parts.missing(asked)
            if missing and not self._pays(len(missing), ticks):
                self.report.reasons["machine code"] = f"{len(missing)} parts to compile for {LANES} at a time would not pay"
                return None
            self.report.reasons.pop("machine code", None)
            try:
                found = wide_parts.load(asked)
            except FlightError as error:
                self.report.reasons["machine code"] = str(error)
                self._hopeless = True
                return None
        reasons = {name: "faults, monitors or events" for name in faulty} | {
            name: wide.refused for name, wide in found.items() if wide.refused}
        self.report.reasons.update(reasons)
        wide = {name: one for name, one in found.items() if not one.refused}
        return Group(flight, wide) if wide else None

    def _pays(self, missing, ticks) -> bool:
        if self._runs is None:
            return True
        left = self._runs - self.report.singly - self.report.side_by_side
        return self._seconds is not None and left * ticks * self._seconds * SAVED > PRICE * missing


def _clock() -> float:
    """Seconds of this thread; of the wall in the main thread, where a flight that goes alone flies in another one."""
    return time.perf_counter() if threading.current_thread() is threading.main_thread() else time.thread_time()


def _form(flight):
    """What flights must share to be lanes of one loop; None for those that cannot."""
    if flight.control is None:
        return None
    schedule = flight.schedule
    firings = tuple((firing.node, firing.part, firing.period, firing.records, _is_plain(firing), tuple(
        (made.port, made.period, made.record, made.visible, made.log, made.log_period, len(made.reductions))
        for made in firing.publications))
        for firing in schedule.firings)
    uses = tuple((name, node.use, node.component) for name, node in schedule.graph.nodes.items())
    return (flight.tick, int(flight.control["base_ns"][0]), int(flight.control["epoch_ns"][0]), flight.bounds_checked, uses,
            firings, tuple(schedule.holds))


def _is_plain(firing):
    """Whether faults leave a firing alone."""
    return firing.own is None and all(made.channel is None and made.times is None for made in firing.publications)
