"""What a notebook takes, under the names of the commands: run, sweep, report, plot, step.

    from flight_graph import notebook as flight

    flown = flight.run("cubli_asteroid", {"controller.lambda_a": 0.03}, duration_s=20)
    flown.signals["cubli/truth"]["angles"]                   # (n, 3) [rad]; flown.t("cubli/truth") are its times [s]
    flown.table("cubli/truth")                               # the same as a table, pandas where that is installed
    flight.plot(flown, "/cubli/truth.angles")                # a picture in the notebook
    starts = flight.sweep("cubli_asteroid", ["plant.initial_angles=3xuniform:-0.3,0.3"], runs=100)
    flight.report(starts, "settling_time_s")                 # percentiles with their intervals
    run = flight.step("cubli_asteroid")                      # a Stepper: until, state, back, branch

Bags and campaigns go where the commands put them: runs/ in the working folder. All of it raises FlightError.
"""

import os
import tempfile
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numba import config

from flight_graph import runs
from flight_graph.bags.reader import Bag, read_bag
from flight_graph.campaigns import opening, paired
from flight_graph.campaigns import report as reports
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.workers import Threads
from flight_graph.components.foreign import agree
from flight_graph.engines import checking as components
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs import glossary, metrics
from flight_graph.graphs import scenario as scenarios
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.plots import picture
from flight_graph.plots.bag_lines import BagLines
from flight_graph.recordings.recording import BagSignals, open_run
from flight_graph.reports import over_cases
from flight_graph.reports.verdicts import number
from flight_graph.requirements import checking, papers, requirements_file
from flight_graph.sampling.specifications import Besides
from flight_graph.stepping.stepper import Stepper
from flight_graph.tables import table
from flight_graph.timebase import SECOND

__all__ = ["Bag", "Campaign", "FlightError", "Flown", "Picture", "Scenario", "Stepper", "check", "compare", "load",
           "opened", "plot", "read_bag", "report", "run", "step", "sweep", "table", "worst"]
step = Stepper


@dataclass(frozen=True)
class Flown:
    """A run that is recorded. folder: of its bag; metrics: by name; alarms: sentences, what of it makes wary.

    signals: topic -> structured array, one row a message, with the quantities by their names.
    """

    folder: Path
    bag: Bag
    scenario: Scenario
    signals: BagSignals
    metrics: dict
    alarms: tuple[str, ...] = ()

    def t(self, topic: str) -> np.ndarray:
        """(n,) [s] since the start of the run, of the messages of a topic."""
        return (self.bag.stamps_ns(self.bag.spelled(topic)) - self.scenario.epoch_ns) / SECOND

    def table(self, topic: str):
        """All numbers of a topic as a table, a row a message, columns with units; the index is the time."""
        columns = {"t [s]": self.t(topic)}
        for series in self.lines.series(self.bag.spelled(topic)):
            unit = f" [{series.unit}]" if series.unit else ""
            columns |= {f"{series.name}{line.entry}{unit}": line.values for line in series.lines}
        return table(columns, index="t [s]")

    @cached_property
    def lines(self) -> BagLines:
        """The series of the bag."""
        return BagLines(self.bag)

    def summary(self, *names: str):
        """The metrics, all or some, as a table: value, unit, meaning."""
        known, names = glossary.of(self.scenario), names or tuple(self.metrics)
        for name in names:
            if name not in self.metrics:
                raise unknown("metric", name, self.metrics, str(self.folder))
        entries = [known.entry(name) for name in names]
        return table({"metric": list(names), "value": [self.metrics[name] for name in names],
                      "unit": [entry.unit for entry in entries], "meaning": [entry.meaning for entry in entries]}, "metric")


class Picture:
    """A picture that a notebook shows. path: where it was written, None where it was not."""

    def __init__(self, content: bytes, path: Path | None):
        self.content, self.path = content, path

    def _repr_png_(self) -> bytes:
        return self.content


def run(scenario: str | Scenario, settings: dict | None = None, *, duration_s: float | None = None, seed: int | None = None,
        case: int | None = None, out=None) -> Flown:
    """Run a scenario in process and record it. settings: ``component.parameter`` -> value; case: of what it varies; a
    campaign in place of the scenario is run from its manifest. out: a new folder; by itself runs/SCENARIO-ENGINE-N.
    """
    loaded = _loaded(scenario, settings, duration_s, seed, case)
    engine = "python" if config.DISABLE_JIT else "compiled"
    outcome = runs.execute(loaded, engine, out=None if out is None else Path(out))
    bag, _, signals = open_run(outcome.bag, trust=True)
    return Flown(outcome.bag, bag, loaded, signals, outcome.metrics, tuple(outcome.alarms))


def opened(folder, trust: bool = False) -> Flown:
    """A run that is recorded already. trust: whether code that its bag brings may run."""
    bag, scenario, signals = open_run(folder, trust, ("metrics",))
    return Flown(Path(folder), bag, scenario, signals, metrics.compute(scenario, signals))


def _loaded(scenario, settings, duration_s, seed, case) -> Scenario:
    given = {**(settings or {})} | {key: value for key, value in (("duration_s", duration_s), ("seed", seed))
                                    if value is not None}
    if isinstance(scenario, Campaign):
        if given or case is None:
            raise FlightError(f"{scenario.path}: of a campaign one case is run, as it is: case=NUMBER and nothing else")
        return scenarios.vary_case(scenario.manifest.load(agree), case)
    if isinstance(scenario, Scenario):
        if given:
            raise FlightError("settings go with the name or the file of a scenario; this one is loaded already")
        return scenario if case is None else scenarios.vary_case(scenario, case)
    return load(str(scenario), given, case)


def sweep(scenario: str, vary: str | list[str] | tuple[str, ...] = (), *, runs: int | None = None,  # noqa: A002
          settings: dict | None = None, duration_s: float | None = None, seed: int | None = None,
          workers: int | None = None, out=None) -> Campaign:
    """Run all cases of what a scenario varies, and of the words that ``flight sweep --vary`` takes; seed: of the draws.

    out: a folder. One that holds the same campaign is gone on with, so that a cell may be run again; any other one is
    refused. By itself a new one, runs/SCENARIO-sweep-N.
    """
    from flight_graph.runs import new_folder
    given = {**(settings or {})} | ({} if duration_s is None else {"duration_s": duration_s})
    vary = (vary,) if isinstance(vary, str) else tuple(vary)
    resume = out is not None and opening.is_folder(str(out))
    folder = None if out is None else Path(out)
    campaign, loaded = opening.of_scenario(
        str(scenario), given, Besides(vary, seed, None), runs, None,
        lambda checked: folder if resume else new_folder(folder, checked, "sweep"), resume, agree)
    pool = workers or os.cpu_count() or 1
    return opening.fill(campaign, loaded, lambda manifest, of: Threads(manifest, of, pool))


def report(campaign: Campaign, *names: str, confidence: float = 0.95, share: float = 0.9973, share_confidence: float = 0.9):
    """Rates and percentiles with their intervals as a table, of each group; the bound holds for a share of all runs."""
    found = reports.report(campaign, reports.Choices(confidence, share, share_confidence, tuple(names)))
    rows = []
    for group in found["groups"]:
        head = {"group": group["group"]} if group["group"] else {}
        rows += [{**head, "metric": one["metric"], "runs": one["runs"], "rate": one["rate"], "from": one["low"],
                  "to": one["high"]} for one in group["rates"]]
        for one in group["metrics"]:
            median = one["percentiles"][1]
            rows.append({**head, "metric": one["metric"], "runs": one["values"], "least": one.get("least"),
                         "median": median["value"], "from": median["low"], "to": median["high"],
                         "largest": one.get("largest"), "its case": one.get("largest_case"),
                         f"bound of {100 * share:g} %": one["upper"]["value"], "without": one["without"]})
    return table(rows)


def worst(campaign: Campaign, metric: str, count: int = 5, smallest: bool = False):
    """The cases with the largest (smallest) values of a metric: case, value, and the group where there are several."""
    found = reports.worst(campaign, metric, count, smallest)
    return table([{**({"group": group["group"]} if group["group"] else {}), "case": one["case"], metric: one["value"]}
                  for group in found["groups"] for one in group["cases"]])


def compare(campaign: Campaign, between: str, *names: str, confidence: float = 0.95):
    """Groups of a campaign on the same draws, each less the first: mean and median differences with their intervals.

    between: the key in which they differ, or the name of a group.
    """
    found = paired.between(campaign, between, reports.Choices(confidence, metrics=tuple(names)))
    return table([{"group": group["group"], "metric": one["metric"], "pairs": one["pairs"], "mean": one.get("mean"),
                   "from": one.get("mean_low"), "to": one.get("mean_high"), "median": one.get("median"),
                   "larger": one.get("larger"), "smaller": one.get("smaller")}
                  for group in found["groups"] for one in group["metrics"]])


def check(what, *ids: str, out=None, jobs: int = 2):
    """Check a component, or requirements, as ``flight check`` does: a table of mistakes, or of verdicts.

    what: FILE[:CLASS] or package/executable; or a file of requirements, or those of a vehicle. ids: of requirements, those
    alone; out: a new folder for their bags and papers, by itself runs/NAME-check-N.
    """
    if not requirements_file.is_requirements(str(what)):
        return table([{"component": one.name, "parts": ", ".join(one.parts), "verdict": "; ".join(
            mistake["sentence"] for mistake in one.mistakes) or "correct"} for one in components.check(str(what))])
    content, path = requirements_file.read(str(what))
    wanted = checking.needs(requirements_file.chosen(content, list(ids) or None, str(path)), agree)
    folder, began = checking.new_folder(None if out is None else Path(out), path.stem), time.perf_counter()
    judged = checking.check(wanted, folder, jobs, number)
    papers.write(folder, content.title, path.stem, judged, time.perf_counter() - began)
    return table([{"requirement": one.requirement.id, "limit": one.limit_text, "shown by": evidence.kind,
                   "found": evidence.found, "verdict": evidence.verdict} for one in judged for evidence in one.evidence])


def plot(what, *fields: str, over: str | None = None, begin: float | None = None, end: float | None = None,
         out=None) -> Picture:
    """A picture, as ``flight plot`` draws it. what: a `Flown`, a bag's folder or a campaign; or several of one kind, as a
    list, or as a dictionary by the names that they have in it; fields: ``TOPIC.FIELD`` (or ``A - B``), of campaigns
    metrics. out: a file, .png, where it is to be kept.
    """
    names = [str(name) for name in what] if isinstance(what, dict) else None
    found = list(what.values()) if isinstance(what, dict) else list(what) if isinstance(what, (list, tuple)) else [what]
    are_campaigns = [isinstance(one, Campaign) for one in found]
    if not found or any(are_campaigns) != all(are_campaigns):
        raise FlightError("a picture is of runs, or of campaigns: name one or more of one kind")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png" if out is None else Path(out)
        if path.suffix != ".png":
            raise FlightError(f"'{path}': a notebook shows .png; flight plot writes .svg and .pdf as well")
        if all(are_campaigns):
            over_cases.draw(found, names or [one.path.name for one in found], list(fields), over, path)
        else:
            lines = picture.read([one.folder if isinstance(one, Flown) else one for one in found], names)
            picture.draw(lines, list(fields), path, over, begin, end)
        return Picture(path.read_bytes(), None if out is None else path)
