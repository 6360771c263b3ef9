"""How rare an event is in a scenario: subset simulation (`flight_graph.statistics`) whose samples are runs.

The standard normal numbers behind a case (`flight_graph.sampling.sampler`) are what the chains move through. A key that
counts, such as the seed of the noise, is drawn anew for every run, so the noise is averaged over and not frozen.
"""

import math
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field

import numba
import numpy as np

from flight_graph.campaigns.cases import ONE_BY_ONE, Batch, Cases
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs.scenario import Scenario
from flight_graph.statistics.subset_simulation import RareEvent, Stuck, subset_simulation

SHARE, SMALLEST = 0.1, 1e-30  # [-] probability of a level given the one before, and of the last one
MOST_EVENTS = 100  # runs in the event that are kept


@dataclass(frozen=True)
class Event:
    """metric above or below a limit: exactly one of them."""

    metric: str
    above: float | None = None
    below: float | None = None

    def __post_init__(self):
        if (self.above is None) == (self.below is None):
            raise FlightError("the event: give --above or --below, one of them")
        if not math.isfinite(self.threshold):
            raise FlightError(f"the event: a limit of {self.threshold} is not allowed; allowed: a finite number")

    @property
    def threshold(self) -> float:
        """Of the value that grows towards the event."""
        return self.above if self.above is not None else -self.below

    def towards(self, value: float) -> float:
        """A metric as a value that grows towards the event."""
        return value if self.above is not None else -value

    def sentence(self) -> str:
        """In words."""
        return f"{self.metric} >= {self.above:g}" if self.above is not None else f"{self.metric} <= {self.below:g}"


@dataclass
class Found:
    """The estimate, and runs in the event: each {values by key, metric, status}; stopped: runs that did not end well."""

    event: Event
    estimate: RareEvent
    stopped: int
    runs: list[dict] = field(default_factory=list)

    def plain(self) -> dict:
        """For a machine."""
        shown = {name: value for name, value in asdict(self.estimate).items() if name not in ("samples", "values")}
        return {"event": self.event.sentence(), **shown, "stopped": self.stopped, "runs_in_event": self.runs}


def rare_event(scenario: Scenario, event: Event, runs: int = 1000, seed: int = 0, workers: int | None = None,
               confidence: float = 0.95, batch: Batch = ONE_BY_ONE, progress: Callable | None = None,
               down_to: float = 1e-8) -> Found:
    """The probability of an event over what a scenario draws. Raises FlightError.

    runs: of a level; down_to: the probability at which it gives up, and says that the event's is below. A run that stops,
    or has no such number, counts as the event. progress(runs done, level, its threshold) is called now and then.
    """
    if numba.config.DISABLE_JIT:
        raise FlightError("runs in great number are of the compiled engine; unset NUMBA_DISABLE_JIT")
    _check(scenario, runs)
    if not SMALLEST <= down_to <= SHARE:
        raise FlightError(f"--down-to {down_to}: allowed: {SMALLEST} to {SHARE}")
    runner = _Runner(scenario, event, workers or os.cpu_count() or 1, batch)
    try:
        estimate = subset_simulation(runner, scenario.vary.sampler.dimensions, event.threshold, runs, seed=seed,
                                     confidence=confidence, progress=progress, share=SHARE,
                                     most_levels=math.ceil(round(math.log(down_to) / math.log(SHARE), 9)))
    except Stuck as error:
        raise FlightError(f"{event.metric}: {error}") from None
    finally:
        runner.close()
    return Found(event, estimate, runner.stopped, runner.met)


class _Runner:
    """samples (n, dimensions) -> values (n,): runs of the compiled engine in threads, numbered in the order of asking."""

    def __init__(self, scenario, event, workers, batch):
        self._scenario, self._event, self._batch = scenario, event, batch
        self._pool, self._own = ThreadPoolExecutor(workers, thread_name_prefix="rare"), threading.local()
        self._workers, self._ended = workers, False
        self._numbers, self.stopped, self.met = 0, 0, []
        first = self._rows([(0, scenario.vary.sampler.from_normals(np.zeros(scenario.vary.sampler.dimensions)))])[0]
        if first.status == "ok" and event.metric not in first.metrics:
            raise unknown("metric", event.metric, first.metrics, scenario.origin)
        if isinstance(first.metrics.get(event.metric), str):
            raise FlightError(f"{scenario.origin}: {event.metric}: this is a text, no number")

    def __call__(self, samples):
        sampler = self._scenario.vary.sampler
        cases = [(self._numbers + i, sampler.from_normals(z, self._numbers + i)) for i, z in enumerate(samples)]
        self._numbers += len(cases)
        parts = [cases[first::self._workers] for first in range(min(self._workers, len(cases)))]
        rows = [None] * len(cases)
        for first, part in enumerate(self._pool.map(self._rows, parts)):
            rows[first::self._workers] = part
        values = np.array([self._value(row) for row in rows])
        for (_, given), row, value in zip(cases, rows, values):
            self.stopped += row.status != "ok"
            if not value < self._event.threshold and len(self.met) < MOST_EVENTS:
                self.met.append({"values": given, self._event.metric: row.metrics.get(self._event.metric),
                                 "status": row.status, "sentence": row.sentence})
        return values

    def close(self):
        self._ended = True
        self._pool.shutdown(cancel_futures=True)

    def _rows(self, cases):
        if not hasattr(self._own, "cases"):
            self._own.cases = Cases(self._scenario, self._batch)
        return [self._own.cases.row(0, values, self._watch) for _, values in cases]

    def _watch(self, *_):
        if self._ended:
            raise KeyboardInterrupt

    def _value(self, row):
        value = row.metrics.get(self._event.metric) if row.status == "ok" else None
        if value is None or isinstance(value, str) or not math.isfinite(value):
            return math.nan
        return self._event.towards(float(value))


def _check(scenario, runs):
    vary = scenario.vary
    if vary is None:
        raise FlightError(f"{scenario.origin}: nothing is drawn; a 'vary' block says what, or "
                          "--vary plant.mass=normal:2,0.04")
    if len(vary.combinations) > 1:
        raise FlightError(f"{scenario.origin}: it has {len(vary.combinations)} combinations of fixed values; a probability "
                          "is of one: take the others out of the vary block")
    if vary.file.function:
        raise FlightError(f"{scenario.origin}: vary.function draws for itself; an event is looked for among random and "
                          "correlated")
    if not vary.sampler.dimensions:
        raise FlightError(f"{scenario.origin}: nothing is drawn but counted keys; name distributions under vary.random")
    if not 20 <= runs <= 1_000_000:
        raise FlightError(f"--runs {runs}: allowed: 20 to 1000000 in a level")
