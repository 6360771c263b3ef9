"""Some cases of a campaign run again, for what a table does not hold: their traces over time."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError, RunStopped
from flight_graph.graphs.glossary import Trace
from flight_graph.graphs.scenario import Scenario, vary_case
from flight_graph.timebase import SECOND

POINTS = 400  # of a trace


@dataclass
class Flights:
    """Traces of some cases. t: (m,) [s]; values: name of the trace -> (cases, m), NaN after the end of a run."""

    cases: list[int]
    t: np.ndarray
    values: dict[str, np.ndarray]

    def row(self, case: int) -> int:
        """Where a case stands."""
        return self.cases.index(case)


def fly(scenario: Scenario, traces: tuple[Trace, ...], cases: list[int], jobs: int,
        progress: Callable | None = None) -> Flights:
    """Run cases of a scenario with a ``vary`` block, logging only what the traces need. progress(done, total)."""
    topics = [signal.topic for _, _, signal in scenario.graph.outputs()]
    traces = tuple(trace for trace in traces if set(trace.topics) <= set(topics))
    t = np.linspace(0.0, scenario.duration_ns / SECOND, POINTS)
    logging = _logging(scenario, traces)
    found = {trace.name: np.full((len(cases), POINTS), np.nan) for trace in traces}

    def one(number):
        for name, values in _traced(logging, cases[number], traces, t).items():
            found[name][number] = values

    with ThreadPoolExecutor(max(1, jobs)) as pool:
        for done, _ in enumerate(pool.map(one, range(len(cases))), 1):
            if progress:
                progress(done, len(cases))
    moving = _moving(found, t)
    return Flights(cases, t[:moving], {name: values[:, :moving] for name, values in found.items()})


def _logging(scenario, traces) -> Scenario:
    """The scenario that records the traces' topics, about as often as they are drawn."""
    record = {"topics": sorted({topic for trace in traces for topic in trace.topics}),
              "max_rate_hz": max(2.0 * POINTS * SECOND / scenario.duration_ns, 1e-6)}
    data = scenario.file.model_dump(by_alias=True)
    return Scenario({**data, "record": {**data["record"], **record}}, scenario.origin, scenario.folder)


def _traced(scenario, case, traces, t) -> dict:
    """The traces of a case at the times t; nothing of a case that is refused."""
    try:
        made = vary_case(scenario, case)
    except FlightError:
        return {}
    try:
        signals = CompiledRun(made).run()
    except RunStopped as stop:
        signals = stop.recording
    found = {}
    for trace in traces:
        at, values = trace.function(made, signals)
        if len(at):
            period = np.median(np.diff(at)) if len(at) > 1 else 0.0
            found[trace.name] = np.where(t <= at[-1] + 1.5 * period, np.interp(t, at, values), np.nan)
    return found


def _moving(found, t) -> int:
    """How many of the times are drawn: those until nothing changes any more, and a little."""
    last = 1
    for values in found.values():
        change = np.abs(np.diff(values, axis=1)) > 1e-6 * (np.nanmax(np.abs(values), initial=0.0) or 1.0)
        moving = np.flatnonzero(change.any(axis=0))
        last = max(last, int(moving[-1]) + 1 if len(moving) else 1)
    return min(len(t), int(1.05 * last) + 2)
