"""The runs behind the claims of a paper: named in the claims file, made once each, on the compiled engine.

    runs:
      printed: {scenario: cubli_asteroid_paper}
      hanging: {scenario: cubli_asteroid_paper, set: {plant.gravity_sign: -1}}
      narrow: {scenario: cubli_boundaries, case: case 3}       # one case of a sweep, by its name or number
      seeds: {scenario: cubli_seeds, cases: all}               # all of them, or a list of names and numbers

Runs that are the same in all that decides their numbers are made once, whatever they are called. A run that stops
(a fault, a number that is not finite) has the metrics ``stopped`` and ``stopped_s`` alone.
"""

import json
import os
import threading
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from flight_graph.claims.claim_expressions import Several
from flight_graph.components.foreign import Consent, agree
from flight_graph.errors import FlightError, RunStopped, unknown
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario, load, vary_case

IDLE_KEYS = ("name", "title", "description", "paper", "figure", "only")  # of a scenario: they decide no number


class RunEntry(BaseModel):
    """A run, or several, that rows refer to."""

    model_config = ConfigDict(extra="forbid")

    scenario: str
    set: dict[str, Any] = Field(default_factory=dict)
    case: int | str | None = None
    cases: Literal["all"] | list[int | str] | None = Field(default=None, min_length=1)

    @model_validator(mode="after")
    def _one(self):
        if self.case is not None and self.cases is not None:
            raise ValueError("a run has either case or cases")
        return self

    def scenarios(self, consent: Consent = agree) -> dict[str, Scenario]:
        """The scenarios to run, by the label of the case ('' for a single run). Raises FlightError.

        consent: is asked before code runs that does not come with the packages.
        """
        scenario = load(self.scenario, self.set, consent=consent)
        if self.case is None and self.cases is None:
            return {"": scenario}
        if scenario.vary is None:
            raise FlightError(f"{self.scenario} has no 'vary' block, so it has no cases")
        if self.case is not None:
            return {"": vary_case(scenario, _number(scenario, self.case), self.set)}
        wanted = range(scenario.vary.count) if self.cases == "all" else self.cases
        numbers = [_number(scenario, case) for case in wanted]
        return {case_label(scenario, number): vary_case(scenario, number, self.set) for number in numbers}


def case_label(scenario: Scenario, number: int) -> str:
    """A case in words: its name, and the values of the grid that it has."""
    vary = scenario.vary
    name, values = vary.combinations[number % len(vary.combinations)]
    words = [] if name is None else [name]
    words += [f"{key.partition('.')[2] or key} {_short(values[key])}" for key in vary.file.grid]
    if vary.is_random:
        words.append(f"draw {vary.draw_number(number)}")
    return ", ".join(words)


def _number(scenario, case):
    """The number of a case given by name or number."""
    vary = scenario.vary
    if isinstance(case, int):
        return case
    found = [number for number, (name, _) in enumerate(vary.combinations) if name == case]
    if not found:
        raise unknown("case", case, {name for name, _ in vary.combinations if name}, scenario.name)
    if len(found) > 1:
        raise FlightError(f"{scenario.name}: '{case}' is {len(found)} cases of the grid; name it by its number")
    return found[0]


def _short(value):
    if isinstance(value, list):
        return "/".join(map(_short, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def identity(scenario: Scenario) -> str:
    """What decides the numbers of a run, as text: equal for runs that are the same."""
    data = {key: value for key, value in scenario.resolved().items() if key not in IDLE_KEYS}
    return json.dumps(data, sort_keys=True, default=str)


def run_one(scenario: Scenario, logs: dict | None = None, kept=None) -> dict:
    """Metrics of one run, with ``stopped`` and ``stopped_s``. logs: memory that runs of one thread hand on.

    kept(scenario) gives the signals of a run that is kept as a bag (`flight_graph.claims.kept_runs`).
    """
    from flight_graph.engines.compiled import CompiledRun
    try:
        recording = kept(scenario) if kept else CompiledRun(scenario).run(None, logs)
    except RunStopped as error:
        return {"stopped": True, "stopped_s": error.t_ns / 1e9, "sentence": str(error)}
    return {**metrics.compute(scenario, recording), "stopped": False, "stopped_s": None}


def run_all(entries: dict[str, RunEntry], jobs: int, progress=None, kept=None) -> dict:
    """Metrics of each named run: {metric: value}, or a `Several` of them by case.

    progress(done, total, name) is called after each run; kept: see `run_one`.
    """
    return run_scenarios({name: _checked(name, entry) for name, entry in entries.items()}, jobs, progress, kept)


def run_scenarios(named: dict[str, dict[str, Scenario]], jobs: int, progress=None, kept=None) -> dict:
    """`run_all` of scenarios: name -> label of the case ('' for a single run) -> scenario."""
    wanted, scenarios, first = {}, {}, {}
    for name, labelled in named.items():
        wanted[name] = {}
        for label, scenario in labelled.items():
            wanted[name][label] = key = identity(scenario)
            scenarios.setdefault(key, scenario)
            first.setdefault(key, f"{name} {label}".strip())
    memory, found = threading.local(), {}
    _compile(scenarios.values(), progress)

    def one(key):
        if not hasattr(memory, "logs"):
            memory.logs = {}
        return key, run_one(scenarios[key], memory.logs, kept)

    with ThreadPoolExecutor(max_workers=max(1, jobs or os.cpu_count() or 1)) as pool:
        futures = [pool.submit(one, key) for key in scenarios]
        try:
            for done, future in enumerate(as_completed(futures), 1):
                key, result = future.result()
                found[key] = result
                if progress:
                    progress(done, len(futures), first[key])
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return {name: found[keys[""]] if list(keys) == [""] else Several({label: found[key] for label, key in keys.items()})
            for name, keys in wanted.items()}


def _compile(scenarios, progress):
    """Make the machine code of all runs at once, before threads wait for each other."""
    from flight_graph.engines import compilation
    components = {node.use: node.component for scenario in scenarios for node in scenario.graph.nodes.values()}

    def tell(done, total, names):
        if progress:
            progress(done, total, f"compiling {names}")
    compilation.load(components, progress=tell)


def _checked(name, entry):
    try:
        return entry.scenarios()
    except FlightError as error:
        raise FlightError(f"claims: run {name}: {error}") from None
