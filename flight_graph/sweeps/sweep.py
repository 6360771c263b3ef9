"""Sweeps: many runs of one scenario on the compiled engine, in parallel threads; one row of a table for each.

A run is a function of its case number alone, so the table does not depend on how many threads ran or in which order
they finished. A run that stops, is refused or cannot be judged is a row that says so. The table is rewritten as a whole
(to a new file that then takes the old one's place) every few seconds and at the end, also when it is interrupted.
"""

import hashlib
import json
import os
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import numba
import pyarrow
import pyarrow.parquet

from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError, RunStopped
from flight_graph.faults import fault_file
from flight_graph.faults.report import REPORT
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario, vary_case
from flight_graph.graphs.vary import MOST_RUNS
from flight_graph.text_files import parse_json, read_bytes

TABLE = "runs.parquet"
DESCRIPTION = "sweep.json"  # what was swept: a table is continued only by the same sweep
SAVE_EVERY = 5.0  # [s]


class _Interrupted(Exception):
    """Raised inside of a run when the sweep is to end."""


@dataclass
class Row:
    """One run. status: ok, fault, nonfinite, refused or error; sentence: why it is not ok."""

    case: int
    name: str | None
    varied: dict
    seed: int
    status: str = "ok"
    sentence: str = ""
    metrics: dict = field(default_factory=dict)


@dataclass
class Sweep:
    """The cases of a scenario with a ``vary`` block. overrides: what was set by hand, for all of them."""

    scenario: Scenario
    overrides: dict = field(default_factory=dict)

    def __post_init__(self):
        if self.scenario.vary is None:
            raise FlightError(f"{self.scenario.origin}: there is nothing to sweep; a 'vary' block says what is varied")
        clash = sorted(set(self.scenario.vary.keys()) & set(self.overrides))
        if clash:
            raise FlightError(f"{self.scenario.origin}: '{clash[0]}' is varied by the sweep; it cannot be set as well")

    def cases(self, runs: int | None = None) -> range:
        """The case numbers of a sweep of ``runs`` runs (default: as the scenario says)."""
        vary = self.scenario.vary
        if runs is None:
            return range(vary.count)
        if runs > MOST_RUNS:
            raise FlightError(f"--runs {runs}: allowed: 1 to {MOST_RUNS} in one sweep")
        if runs < 1 or (runs > vary.count and not vary.is_random):
            raise FlightError(f"--runs {runs}: allowed: 1 to {vary.count}, the number of cases; nothing is random here")
        return range(runs)

    def case(self, number: int) -> Scenario:
        """The scenario of one case. Raises FlightError when its values do not go together."""
        return vary_case(self.scenario, number, self.overrides)

    def run(self, number: int, progress=None, logs: dict | None = None) -> Row:
        """Run one case and judge it. progress(seconds simulated) is called now and then; what it raises ends the run.

        logs: memory that runs of one thread hand on, see `CompiledRun.run`.
        """
        vary = self.scenario.vary
        row = Row(number, vary.name(number), {}, self.scenario.seed)
        try:
            row.varied = vary.overrides(number)
            scenario = self.case(number)
            row.seed = scenario.seed
            row.varied = {key: _value(scenario, key) for key in vary.keys()}
        except FlightError as error:
            row.status, row.sentence = "refused", str(error)
            return row
        try:
            row.metrics = metrics.compute(scenario, CompiledRun(scenario).run(progress, logs))
        except RunStopped as error:
            row.status, row.sentence = error.reason, str(error)
        except (ValueError, ArithmeticError, LookupError) as error:
            row.status, row.sentence = "error", f"{type(error).__name__}: {error}"
        return row

    def fingerprint(self) -> str:
        """SHA-256 of all that decides the rows: the scenario resolved, and its vary block."""
        data = [self.scenario.resolved(), self.scenario.vary.file.model_dump()]
        return hashlib.sha256(json.dumps(data, sort_keys=True, default=str).encode()).hexdigest()


def run_sweep(sweep: Sweep, folder: Path, runs: int | None = None, jobs: int | None = None, resume: bool = False,
              progress=None) -> list[Row]:
    """Run a sweep's cases in ``jobs`` threads (default: one a core), keep the table in ``folder``, return all rows.

    resume: continue the table that is there. progress(rows done, rows in all) is called from this thread.
    KeyboardInterrupt leaves a valid table and is raised again.
    """
    if numba.config.DISABLE_JIT:
        raise FlightError("a sweep runs on the compiled engine; unset NUMBA_DISABLE_JIT")
    metrics.of(sweep.scenario)  # a name that is wrong is found before the flight
    jobs = jobs or os.cpu_count() or 1
    wanted = sweep.cases(runs)
    rows = _earlier(sweep, folder) if resume else {}
    if not resume:
        _describe(sweep, folder)
    todo = iter([number for number in wanted if number not in rows])
    take, stop = threading.Lock(), threading.Event()
    failures = []

    def watch(_):
        if stop.is_set():
            raise _Interrupted

    def work():
        logs = {}
        while not stop.is_set():
            with take:
                number = next(todo, None)
            if number is None:
                return
            try:
                rows[number] = sweep.run(number, watch, logs)
            except _Interrupted:
                return
            except BaseException as error:
                failures.append(error)
                stop.set()

    _compile_first(sweep, wanted)
    threads = [threading.Thread(target=work, name=f"sweep-{number}", daemon=True) for number in range(jobs)]
    saved = time.monotonic()
    try:
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            next(thread for thread in threads if thread.is_alive() or thread is threads[-1]).join(0.1)
            if progress:
                progress(len(rows), len(wanted))
            if time.monotonic() - saved > SAVE_EVERY:
                save(rows, folder)
                saved = time.monotonic()
    finally:
        stop.set()
        for thread in threads:
            thread.join()
        save(rows, folder)
    if failures:
        raise failures[0]
    if progress:
        progress(len(rows), len(wanted))
    return [rows[number] for number in sorted(rows)]


def save(rows: dict, folder: Path) -> None:
    """Write the table of these rows, by case number, in one step."""
    rows = [rows[number] for number in sorted(rows.copy())]
    columns = {
        "case": pyarrow.array([row.case for row in rows], pyarrow.int64()),
        "name": pyarrow.array([row.name for row in rows], pyarrow.string()),
        "seed": pyarrow.array([row.seed for row in rows], pyarrow.int64()),
        "status": pyarrow.array([row.status for row in rows], pyarrow.string()),
        "sentence": pyarrow.array([row.sentence for row in rows], pyarrow.string()),
    }
    for part in ("varied", "metrics"):
        for key in dict.fromkeys(key for row in rows for key in getattr(row, part)):
            if key not in columns:
                columns[key] = pyarrow.array(_alike([getattr(row, part).get(key) for row in rows]))
    draft = folder / f"{TABLE}.{os.getpid()}.tmp"
    pyarrow.parquet.write_table(pyarrow.table(columns), draft)
    with open(draft, "rb+") as file:
        os.fsync(file.fileno())
    os.replace(draft, folder / TABLE)


def _compile_first(sweep, wanted):
    """Make machine code of the first case that can be built, before threads wait for each other."""
    for number in wanted:
        try:
            CompiledRun(sweep.case(number)).compile()
            return
        except FlightError:
            continue


def _value(scenario, key):
    """The value that a key has in a scenario; a vector of equal numbers as one number."""
    name, _, parameter = key.partition(".")
    if not parameter:
        return getattr(scenario.file, key)
    if name == REPORT:
        return fault_file.value(scenario.file.faults, parameter)
    node = scenario.graph.nodes[name]
    value = {"rate_hz": node.rate_hz, "use": node.use}.get(parameter, node.values.get(parameter))
    if isinstance(value, list) and value and all(item == value[0] for item in value):
        return value[0]
    return value


def _alike(values):
    """Values of one column in one type: numbers become vectors where another row has a vector, or reals."""
    length = max((len(value) for value in values if isinstance(value, list)), default=None)
    if length is not None:
        return [value if value is None or isinstance(value, list) else [value] * length for value in values]
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    return values if len(kinds) < 2 else [None if value is None else str(value) for value in values]


def _describe(sweep, folder):
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"scenario": sweep.scenario.name, "fingerprint": sweep.fingerprint(),
                       "vary": sweep.scenario.file.vary, "overrides": sweep.overrides}, indent=1, default=str)
    (folder / DESCRIPTION).write_text(text + "\n", encoding="utf-8", newline="\n")


def _earlier(sweep, folder) -> dict:
    """The rows of an interrupted sweep by case number."""
    description = folder / DESCRIPTION
    if not os.path.isfile(description):
        raise FlightError(f"--resume: {folder} holds no sweep ({DESCRIPTION} is missing)")
    content = read_bytes(description, f"--resume: {description}")
    known = parse_json(content, f"--resume: {description}")
    if not isinstance(known, dict) or known.get("fingerprint") != sweep.fingerprint():
        raise FlightError(f"--resume: the sweep in {folder} is another one: scenario, vary block or --set differ")
    if not (folder / TABLE).is_file():
        return {}
    keys, rows = sweep.scenario.vary.keys(), {}
    own = ("case", "name", "seed", "status", "sentence")
    for found in pyarrow.parquet.read_table(folder / TABLE).to_pylist():
        varied = {key: found[key] for key in keys if key in found}
        judged = {} if found["status"] != "ok" else {
            key: value for key, value in found.items() if key not in own and key not in keys}
        rows[found["case"]] = Row(*(found[key] for key in own[:2]), varied, *(found[key] for key in own[2:]), judged)
    return rows
