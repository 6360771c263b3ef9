"""Metrics without a line of Python: numbers that a run's messages are reduced to, named in its scenario.

    measures:
      rate_peak: {largest: plant.truth.rates, of: absolute}
      settled_s: {settling: plant.truth.angles, within: 0.008}
      effort: {integral: controller.command.effort, of: squared, unit: "N^2 m^2 s"}

=========== ========================================================================================================
largest     largest value at any time;  least: smallest;  final: of the last message
integral    over time: each message holds until the next one, the last until the end [unit s]
first       first time [s] at which the value is ``above`` or ``below`` a limit; none: never
settling    last time [s] at which the value is more than ``within`` away from ``about`` (0); 0: never; none: at the end
=========== ========================================================================================================

What is reduced is a field, as in faults: ``component.output.field[i]``. Of several numbers ``of`` says what counts:
``value`` (each of them; the largest of all), ``absolute`` (their sizes), ``squared`` (the sum of their squares), ``norm``.
Where a record is thinned, the messages that are recorded count. All is computed in float64, and summed in the order of
time.

`Measure.of` is the definition, over the messages of a bag or a recording. A campaign takes the same numbers while its runs
fly, without a log (`flight_graph.engines.reductions`).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from flight_graph.errors import FlightError, sentence_of
from flight_graph.faults import fault_types, places
from flight_graph.graphs.metric_entry import MetricEntry, number
from flight_graph.text_files import short
from flight_graph.timebase import SECOND

KINDS = ("largest", "least", "final", "integral", "first", "settling")
COUNTED = ("value", "absolute", "squared", "norm")


class MeasureEntry(BaseModel):
    """One entry of the block."""

    model_config = ConfigDict(extra="forbid")
    largest: str | None = None
    least: str | None = None
    final: str | None = None
    integral: str | None = None
    first: str | None = None
    settling: str | None = None
    of: Literal[COUNTED] = "value"
    above: float | None = Field(None, allow_inf_nan=False)
    below: float | None = Field(None, allow_inf_nan=False)
    within: float | None = Field(None, gt=0, allow_inf_nan=False)
    about: float = Field(0.0, allow_inf_nan=False)
    unit: str = Field("", max_length=100)

    @model_validator(mode="after")
    def _check(self):
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(f"exactly one of {', '.join(KINDS)} is allowed here, not {' and '.join(given) or 'none'}")
        if (self.first is not None) != ((self.above is None) + (self.below is None) == 1):
            raise ValueError("'first' goes with one limit, above or below, and no other kind has one")
        if (self.settling is not None) != (self.within is not None):
            raise ValueError("'settling' goes with within, and no other kind has it")
        return self


@dataclass(frozen=True)
class Measure:
    """A checked entry. node, port, topic: of the signal; path, field: the numbers in it; stamp: the path of its stamp."""

    name: str
    entry: MeasureEntry
    kind: str
    node: str
    port: str
    topic: str
    path: str
    field: places.Field
    stamp: str

    def of(self, records: np.ndarray, epoch_ns: int, duration_ns: int) -> float | None:
        """The number, of all records (n,) of the signal; None where there is no message, or it never happens."""
        if not len(records):
            return None
        values, entry = self._values(records), self.entry
        if self.kind in ("largest", "least", "final"):
            reduce = np.min if self.kind == "least" else np.max
            return float(reduce(values[-1:] if self.kind == "final" else values)) + 0.0  # zero has no sign
        t = _times(records, self.stamp, epoch_ns)
        if self.kind == "integral":
            held = np.diff(t, append=duration_ns / SECOND)
            return float(_in_order(_in_order(values, 1) * held, 0)) + 0.0
        if self.kind == "first":
            met = values > entry.above if entry.above is not None else values < entry.below
            found = np.flatnonzero(met.any(axis=1))
            return float(t[found[0]]) if len(found) else None
        away = np.flatnonzero((np.abs(values - entry.about) > entry.within).any(axis=1))
        if len(away) and away[-1] == len(t) - 1:
            return None
        return float(t[away[-1]]) if len(away) else 0.0

    def _values(self, records):
        values = _field(records, self.path).reshape(len(records), -1).astype(float)
        if self.entry.of in ("value", "absolute"):
            return np.abs(values) if self.entry.of == "absolute" else values
        squared = _in_order(values * values, 1)[:, None]
        return np.sqrt(squared) if self.entry.of == "norm" else squared


def read(block: dict, nodes: dict, where: str) -> list[Measure]:
    """The measures of a block. nodes: name -> node of the graph. Raises FlightError."""
    return [_measure(str(name), given, nodes, f"{where}.{short(str(name), 60)}") for name, given in block.items()]


def _measure(name, given, nodes, where) -> Measure:
    try:
        entry = MeasureEntry.model_validate(given)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join([where, *map(str, first["loc"])])
        if first["type"] == "extra_forbidden":
            known = ", ".join(MeasureEntry.model_fields)
            raise FlightError(f"{place}: there is no such key; allowed here: {known}") from None
        raise FlightError(f"{place}: {sentence_of(first)} (got {short(repr(first['input']))})") from None
    kind = next(kind for kind in KINDS if getattr(entry, kind) is not None)
    found = places.place(getattr(entry, kind), nodes, f"{where}.{kind}")
    if found.kind != fault_types.OUTPUT or found.field is None:
        raise FlightError(f"{where}.{kind}: '{short(getattr(entry, kind))}' is no field of an output; write "
                          "component.output.field")
    if found.field.dtype.kind not in "fiub":
        raise FlightError(f"{where}.{kind}: '{short(getattr(entry, kind))}' is no number")
    signal = nodes[found.node].component.outputs[found.port]
    if kind == "final" and entry.of == "value" and found.field.count > 1:
        raise FlightError(f"{where}.final: '{entry.final}' has {found.field.count} numbers; name one of them, "
                          f"{entry.final}[0], or say of: absolute, squared or norm")
    return Measure(name, entry, kind, found.node, found.port, signal.topic, found.path, found.field, signal.stamp_path)


def compute(measures: list[Measure], scenario, signals) -> dict[str, float | None]:
    """name -> number of each measure whose signal is recorded; None where it is not."""
    return {one.name: one.of(signals[one.topic], scenario.epoch_ns, scenario.duration_ns) if one.topic in signals else None
            for one in measures}


def entries(measures: list[Measure]) -> list[MetricEntry]:
    """Their declarations. The unit is that of the entry, and seconds of what is a time."""
    found = []
    for one in measures:
        unit = "s" if one.kind in ("first", "settling") else one.entry.unit
        given = {key: getattr(one.entry, key) for key in ("above", "below", "within")}
        limits = [f"{key} {value:g}" for key, value in given.items() if value is not None]
        what = f"{one.entry.of} of {one.path}" if one.entry.of != "value" else one.path
        meaning = " ".join([f"{one.kind}: {what} of /{one.topic}", *limits])
        found.append(number(one.name, unit, meaning, "it does not happen, or was not recorded", headline=True,
                            smallest_is_worst=one.kind == "least"))
    return found


def _in_order(values, axis):
    """The sum along an axis, one after the other; NumPy's own groups them as it likes."""
    return np.add.accumulate(values, axis=axis).take(-1, axis=axis)


def _field(records, path):
    for step in path.split("."):
        name, _, indices = step.partition("[")
        records = records[name]
        for index in indices.rstrip("]").split("][") if indices else ():
            records = records[:, int(index)]
    return records


def _times(records, stamp, epoch_ns) -> np.ndarray:
    for name in stamp.split("."):
        records = records[name]
    return ((records["sec"].astype(np.int64) * SECOND + records["nanosec"]) - epoch_ns) / SECOND
