"""A run against another one's bag, while it is stepped through: the first component, tick and field that differ."""

from dataclasses import dataclass

import numpy as np

from flight_graph.bags.errors import quoted
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.recordings.recorded_run import RecordedRun
from flight_graph.stepping.stepper import Stepper
from flight_graph.timebase import SECOND

_CHUNK = 4000  # [ticks] that are compared at a time


@dataclass(frozen=True)
class Difference:
    """The first message that differs. here, there: values of the field; None where a side has no such message."""

    component: str
    port: str
    tick: int
    t_s: float
    field: str
    here: object
    there: object

    def __str__(self):
        where = f"{self.component} at tick {self.tick} (t = {self.t_s:.9g} s)"
        if self.field:
            return f"{where}: {self.port}.{self.field} is {self.here} here, {self.there} there"
        return f"{where}: {self.port} has a message only {'here' if self.here is not None else 'there'}"


def first_difference(run: Stepper, other: RecordedRun, tick: int | None = None) -> Difference | None:
    """Run on to the first message that differs from another bag's, and stand behind the firing that published it.

    tick: to compare until before; by default as far as both go. None: nothing differs until there. Raises FlightError.
    """
    topics = [topic for topic in other.topics() if topic.formatted is None and f"/{topic.topic}" in other.bag]
    plan = run.scenario.recorded()
    known = {(topic.node, topic.port): topic for topic in topics if (topic.node, topic.port) in plan
             and topic.signal.dtype == run.scenario.graph.signal(topic.node, topic.port).dtype}
    if not known:
        raise FlightError(f"bag {quoted(other.bag.path)}: it has no topic of this graph")
    base_ns = run.scenario.graph.base_ns
    end = min(tick if tick is not None else run.scenario.ticks, run.scenario.ticks,
              -(-other.recorded_until_ns // base_ns) if not other.complete else other.scenario.ticks)
    first = max(run.tick, other.first.tick if other.first else 0)
    if first >= end:
        raise FlightError(f"bag {quoted(other.bag.path)}: there is nothing of t = {run.t_s:.9g} s or later to compare")
    run.until(tick=first)
    recorded = {key: (other.bag.stamps_ns(f"/{topic.topic}") - other.scenario.epoch_ns, other.signals[topic.topic])
                for key, topic in known.items()}
    machine = CompiledRun(run.scenario, plan={key: plan[key] for key in plan if key in known})
    while run.tick < end:
        count = min(_CHUNK, end - run.tick)
        flight = machine.start(count, begin=run.checkpoint())
        flight.advance(run.tick + count)
        found = _earliest(run, flight.tracks(), recorded, run.tick * base_ns, flight.tick * base_ns)
        if found is not None:
            _stand_behind(run, found)
            return found
        run.until(tick=run.tick + count)
        if run.stopped:
            return None
    return None


def _earliest(run, tracks, recorded, begin_ns, end_ns) -> Difference | None:
    """The first difference among the messages from one time until before another."""
    order, found = [step.node for step in run.scenario.graph.order if step.part != "update"], []
    for track in tracks:
        stamps, records = recorded[track.node, track.port]
        rows = slice(*np.searchsorted(stamps, (begin_ns, end_ns)))
        one = _first_of(run, track, stamps[rows], records[rows])
        if one is not None:
            found.append(one)
    return min(found, key=lambda one: (one.tick, order.index(one.component)), default=None)


def _first_of(run, track, stamps, records) -> Difference | None:
    base_ns, common = run.scenario.graph.base_ns, min(len(stamps), len(track.stamps_ns))
    own, theirs = (np.ascontiguousarray(one[:common]).view("u1").reshape(common, track.signal.dtype.itemsize)
                   for one in (track.records, records))
    wrong = np.flatnonzero((own != theirs).any(axis=1) | (stamps[:common] != track.stamps_ns[:common]))
    for row in wrong:
        t_ns = int(min(stamps[row], track.stamps_ns[row]))
        if stamps[row] != track.stamps_ns[row]:
            return _lone(run, track, t_ns, stamps[row] > track.stamps_ns[row])
        field = _field(track, records, row)
        if field is not None:
            return Difference(track.node, track.port, t_ns // base_ns, t_ns / SECOND, *field)
    if len(stamps) != len(track.stamps_ns):
        longer = track.stamps_ns if len(track.stamps_ns) > len(stamps) else stamps
        return _lone(run, track, int(longer[common]), longer is track.stamps_ns)
    return None


def _lone(run, track, t_ns, is_here) -> Difference:
    return Difference(track.node, track.port, t_ns // run.scenario.graph.base_ns, t_ns / SECOND, "",
                      True if is_here else None, None if is_here else True)


def _field(track, records, row):
    """(path, value here, value there) of the first number that differs; None where only padding does."""
    sides = [np.ascontiguousarray(one[row:row + 1]).view("u1").reshape(-1) for one in (track.records, records)]
    for path, dtype, offset, length in track.signal.leaves():
        here, there = (side[offset:offset + length] for side in sides)
        wrong = np.flatnonzero(here != there)
        if len(wrong):
            index = int(wrong[0]) // dtype.base.itemsize
            values = [part.view(dtype.base)[index].item() for part in (here, there)]
            return f"{path}[{index}]" if length > dtype.base.itemsize else path, *values
    return None


def _stand_behind(run, found):
    """Let a run stand behind the firing that published what differs."""
    run.until(tick=found.tick)
    while run.upcoming and run.tick == found.tick:
        node, part = run.upcoming
        run.step()
        if node == found.component and part != "update":
            return
