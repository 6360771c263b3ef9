"""Numbers that messages are reduced to while a run flies: one source for machine code and plain Python.

A reduction is one measure (`flight_graph.graphs.measures`) at one output. It is fed with every message that is recorded,
or would be, in the moment in which it would go into the log. So it needs no log: its memory is one row, however long the
run is. `result` says at the end what `Measure.of` says of all messages, bit for bit.
"""

import math
from dataclasses import dataclass

import numpy as np

from flight_graph import timebase
from flight_graph.engines.addresses import address, compiled, half_at, row
from flight_graph.engines.condition_steps import SECOND, number_at, number_kind, table
from flight_graph.graphs.measures import COUNTED, KINDS, Measure

REDUCTION = table("kind of offset count number width stamp epoch_ns below memory*", "limit about")
MEMORY = table("messages met", "value total since")
_SIZE = REDUCTION.itemsize
_LARGEST, _LEAST, _FINAL, _INTEGRAL, _FIRST, _SETTLING = range(len(KINDS))
_VALUE, _ABSOLUTE, _SQUARED, _NORM = range(len(COUNTED))


@compiled
def _time(stamp_at, lanes, epoch_ns):
    """The time [s] since the epoch in the stamp (sec, nanosec) of a record, or of one of so many woven ones."""
    sec, nanosec = half_at(stamp_at), half_at(stamp_at + 4 * lanes)
    if sec >= 1 << 31:
        sec -= 1 << 32
    return (sec * 1000000000 + nanosec - epoch_ns) / SECOND


@compiled
def _counted(reduction, first, lanes, index):
    """What counts of a message: its number ``index``, or of all together their sum of squares or norm."""
    width = reduction.width * lanes
    if reduction.of == _VALUE:
        return number_at(first + index * width, reduction.number, reduction.width)
    if reduction.of == _ABSOLUTE:
        return abs(number_at(first + index * width, reduction.number, reduction.width))
    total = 0.0
    for i in range(reduction.count):
        value = number_at(first + i * width, reduction.number, reduction.width)
        total += value * value
    return math.sqrt(total) if reduction.of == _NORM else total


@compiled
def _feed(reduction, record, lanes, lane):
    """Take a message up into one reduction."""
    memory = row(reduction.memory, MEMORY)
    first = record + lanes * reduction.offset + lane * reduction.width
    count = reduction.count if reduction.of <= _ABSOLUTE else 1
    kind = reduction.kind
    if kind <= _FINAL and (memory.messages == 0 or kind == _FINAL):
        memory.value = np.inf if kind == _LEAST else -np.inf
    total, is_met = 0.0, False
    for i in range(count):
        value = _counted(reduction, first, lanes, i)
        if kind <= _FINAL:
            known = memory.value
            if known == known and (not value >= known if kind == _LEAST else not value <= known):  # NaN stays
                memory.value = value
        elif kind == _INTEGRAL:
            total += value
        elif kind == _FIRST:
            is_met = is_met or (value < reduction.limit if reduction.below != 0 else value > reduction.limit)
        else:
            is_met = is_met or abs(value - reduction.about) > reduction.limit
    if kind == _INTEGRAL:
        t = _time(record + lanes * reduction.stamp + 4 * lane, lanes, reduction.epoch_ns)
        if memory.messages != 0:
            memory.total += memory.value * (t - memory.since)
        memory.value, memory.since = total, t
    elif is_met and not (kind == _FIRST and memory.met != 0):
        memory.since = _time(record + lanes * reduction.stamp + 4 * lane, lanes, reduction.epoch_ns)
    if is_met:
        memory.met = 1
    elif kind == _SETTLING:
        memory.met = 0
    memory.messages += 1


@compiled
def feed(at, end, record, lanes, lane):
    """Take a message up into some reductions. lanes: records that are woven into each other there, 1 or
    `flight_graph.lanes.operations.LANES`; lane: the one that is meant.
    """
    while at < end:
        _feed(row(at, REDUCTION), record, lanes, lane)
        at += _SIZE


@dataclass(frozen=True)
class Reduction:
    """A measure in a schedule, which keeps its memory in an array of the run."""

    measure: Measure
    memory: str

    def row(self, stamp: int, memory: np.ndarray, epoch_ns: int) -> tuple:
        """Its row of the table `REDUCTION`. stamp: offset of the signal's stamp."""
        measure = self.measure
        entry, field = measure.entry, measure.field
        limits = [limit for limit in (entry.above, entry.below, entry.within) if limit is not None]
        return (KINDS.index(measure.kind), COUNTED.index(entry.of), field.offset, field.count, number_kind(field.dtype),
                field.dtype.itemsize, stamp, epoch_ns, entry.below is not None, address(memory), *(limits or [0.0]),
                entry.about)


def result(measure: Measure, memory: np.ndarray, duration_ns: int) -> float | None:
    """The number of a measure at the end of a run of this duration; None where there is no message, or it never happens."""
    messages, met, value, total, since = memory[0].item()
    if not messages or (measure.kind == "first" and not met) or (measure.kind == "settling" and met):
        return None
    if measure.kind in ("first", "settling"):
        return since
    if measure.kind == "integral":
        total += value * (duration_ns / timebase.SECOND - since)
        return total + 0.0
    return value + 0.0  # zero has no sign
