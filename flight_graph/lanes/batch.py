"""Many flights of one scenario, eight of them side by side: the same bits as one after the other, in less time.

    run = CompiledRun(scenario)
    flights = [run_of_a_case.start(ticks) for ...]
    report = advance_together(flights, ticks)
    tracks = [flight.tracks() for flight in flights]
"""

from dataclasses import dataclass, field

from flight_graph.lanes import wide_parts
from flight_graph.lanes.group import Group
from flight_graph.lanes.operations import LANES

FEWEST = 24  # flights for which machine code is made
CHUNK = 20_000  # [ticks] until an interruption is heard


@dataclass
class Report:
    """How flights were advanced. side_by_side, singly: how many; reasons: why a component, or a flight, works singly."""

    side_by_side: int = 0
    singly: int = 0
    reasons: dict[str, str] = field(default_factory=dict)

    def sentence(self) -> str:
        """What a person reads."""
        text = f"{self.side_by_side} runs {LANES} at a time, {self.singly} one at a time"
        return text + "".join(f"; {name}: {reason}" for name, reason in self.reasons.items())


def advance_together(flights: list, tick: int, fewest: int = FEWEST, progress=None) -> Report:
    """Advance flights (`flight_graph.engines.compiled.Flight`) until before a tick, or until each stops.

    It is what ``flight.advance(tick)`` does to each, bit by bit. fewest: with fewer flights of one form no machine code is
    made. progress: as that of `CompiledRun.compile`. Raises FlightError.
    """
    report, groups = Report(), {}
    for flight in flights:
        if not flight.stop and flight.tick < tick:
            groups.setdefault(_form(flight), []).append(flight)
    for alike in groups.values():
        _advance(alike, tick, fewest, report, progress)
    return report


def _form(flight):
    """What flights must share to be lanes of one loop."""
    if flight.control is None:
        return None
    schedule = flight.schedule
    firings = tuple((firing.node, firing.part, firing.period, firing.records, _is_plain(firing), tuple(
        (made.port, made.period, made.record, made.visible, made.log, made.log_period) for made in firing.publications))
        for firing in schedule.firings)
    uses = tuple((name, node.use, node.component) for name, node in schedule.graph.nodes.items())
    return (flight.tick, int(flight.control["base_ns"][0]), int(flight.control["epoch_ns"][0]), flight.check_bounds, uses,
            firings, tuple(schedule.holds))


def _is_plain(firing):
    """Whether faults leave a firing alone."""
    return firing.own is None and all(made.channel is None and made.times is None for made in firing.publications)


def _advance(flights, tick, fewest, report, progress):
    wide = _wide(flights, fewest, report, progress) if len(flights) >= max(fewest, 2) else {}
    if not wide:
        if len(flights) < max(fewest, 2):
            report.reasons.setdefault("few", f"machine code for {LANES} at a time pays from {fewest} runs of one form on")
        for flight in flights:
            flight.advance(tick)
        report.singly += len(flights)
        return
    group = Group(flights[0], wide)
    for first in range(0, len(flights), LANES):
        group.bind(flights[first:first + LANES])
        reached = flights[first].tick
        while reached < tick and int(group.control["alive"][0]):
            reached = min(tick, reached + CHUNK)
            group.advance(reached)
        group.release()
    report.side_by_side += len(flights)


def _wide(flights, fewest, report, progress):
    """node -> its wide parts."""
    first = flights[0]
    if first.control is None or first.check_bounds:
        report.reasons["engine"] = "plain Python and checked bounds work on one run at a time"
        return {}
    nodes = first.schedule.graph.nodes
    faulty = {firing.node for firing in first.schedule.firings if not _is_plain(firing)}
    asked = {name: (node.use, node.component, wide_parts.differing([flight.arrays[f"P_{name}"] for flight in flights]))
             for name, node in nodes.items() if name not in faulty}
    found = wide_parts.load(asked, progress)
    report.reasons.update({name: "faults" for name in faulty})
    report.reasons.update({name: wide.refused for name, wide in found.items() if wide.refused})
    return {name: wide for name, wide in found.items() if not wide.refused}

