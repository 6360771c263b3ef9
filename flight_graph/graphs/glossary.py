"""The glossary of a scenario's metrics and traces: name, unit and meaning, declared beside the functions that compute them.

A module with a metrics function declares the metrics as ``METRICS`` and what is worth a line over time as ``TRACES``:

    METRICS = (
        number("settling_time_s", "s", "last time any |e_a| > 0.008 rad", missing="not settled within the run"),
        flag("landed", "the contact trigger fired within the run"),
    )
    TRACES = (recorded("speed", "m/s", "relative to the site", "lander/truth/summary", "speed"),)

One rule for what is missing: a metric that a run does not have is ``None``, never a number that stands for it, and its
declaration says what that means. A metric that no run of this graph can have is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flight_graph.components import names, namespaces
from flight_graph.graphs import fault_scores, measures, metrics
from flight_graph.graphs.fault_scores import times
from flight_graph.graphs.metric_entry import Alarm, MetricEntry, flag, number, word

__all__ = ["Alarm", "Glossary", "LandingPoints", "MetricEntry", "Trace", "flag", "number", "of", "recorded", "word"]


@dataclass(frozen=True)
class Trace:
    """A quantity of a run over time.

    topics: what it is computed from; function(scenario, signals) -> t (n,) [s] since the start, values (n,) [unit].
    """

    name: str
    unit: str
    meaning: str
    topics: tuple[str, ...]
    function: Callable


@dataclass(frozen=True)
class LandingPoints:
    """Where runs came down. x, y: the names of two metrics [m]; terrain(scenario, x, y) -> height [m] of arrays alike."""

    x: str
    y: str
    terrain: Callable


@dataclass(frozen=True)
class Glossary:
    """What is declared of a scenario's numbers. metrics: by name."""

    metrics: dict[str, MetricEntry]
    traces: tuple[Trace, ...] = ()
    landing: LandingPoints | None = None
    is_declared: bool = True  # False: the metrics function declares nothing, so any name may be a metric

    def entry(self, name: str) -> MetricEntry:
        """The declaration of a metric; one without unit and meaning where there is none."""
        return self.metrics.get(name) or MetricEntry(name, "", "")


def of(scenario) -> Glossary:
    """The glossary of a scenario: that of its metrics function's module, its measures, the scores of faults, and those of
    its vehicles with their names in front.

    Raises FlightError.
    """
    function = metrics.of(scenario)
    declared = {} if function is None else function.__globals__
    entries = [*fault_scores.METRICS, *measures.entries(scenario.measures), *declared.get("METRICS", ())]
    traces, is_declared = list(declared.get("TRACES", ())), function is None or "METRICS" in declared
    for name, vehicle in scenario.vehicles.items():
        inside = of(vehicle)
        entries += [replace(one, name=names.joined(name, one.name)) for one in inside.metrics.values()]
        traces += [_inside(one, name, vehicle) for one in inside.traces]
        is_declared = is_declared and inside.is_declared
    return Glossary({entry.name: entry for entry in entries}, tuple(traces), declared.get("LANDING"), is_declared)


def joined(some) -> Glossary:
    """Several glossaries as one: of equal names the first. Of runs beside each other."""
    found = {}
    for one in some:
        found = one.metrics | found
    return Glossary(found)


def _inside(trace: Trace, name: str, vehicle) -> Trace:
    """The trace of a vehicle as one of the whole."""
    def function(scenario, signals):
        return trace.function(scenario.vehicles[name], metrics.Inside(signals, name))
    return replace(trace, name=names.joined(name, trace.name), function=function,
                   topics=tuple(namespaces.topic_within(topic, name) for topic in trace.topics))


def recorded(name: str, unit: str, meaning: str, topic: str, field: str, scale: float = 1.0,
             reduce: str | int | None = None) -> Trace:
    """The trace of a field of a topic, times ``scale``. reduce: of a vector its "norm", or its "largest" |component|; a
    number picks a component."""
    def function(scenario, signals):
        records = records_of = signals[topic]
        for part in field.split("."):
            records_of = records_of[part]
        values = records_of * scale
        if reduce == "norm":
            values = np.sqrt((values * values).sum(axis=1))
        elif reduce == "largest":
            values = np.abs(values).max(axis=1)
        elif reduce is not None:
            values = values[:, int(reduce)]
        return times(scenario, records), values
    return Trace(name, unit, meaning, (topic,), function)
