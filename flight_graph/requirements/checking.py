"""Checking requirements: what they need is run once each, and judged.

Into the folder of a check go ``bags/`` (each run, and the worst case of each campaign), ``campaigns/``, and what
`flight_graph.requirements.papers` writes.
"""

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pyarrow.compute

from flight_graph.campaigns import opening
from flight_graph.campaigns.coordinator import folder_of
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.manifest import Manifest
from flight_graph.campaigns.workers import Threads
from flight_graph.claims.claim_expressions import Several
from flight_graph.claims.claim_runs import run_scenarios
from flight_graph.claims.kept_runs import KeptRuns
from flight_graph.components.foreign import Consent
from flight_graph.errors import FlightError, RunStopped, unknown
from flight_graph.graphs import glossary
from flight_graph.graphs.metric_entry import FLAG, NUMBER, WORD
from flight_graph.graphs.named_code import foreign_code
from flight_graph.graphs.scenario import Scenario, read, vary_case
from flight_graph.requirements.evidence import Evidence, Judged, of_campaign, of_run
from flight_graph.requirements.requirements_file import CampaignEntry, Requirement, Showing

BAGS, CAMPAIGNS = "bags", "campaigns"


@dataclass
class Need:
    """A showing of a requirement with the scenarios that it needs: those to run, or the one that a campaign varies."""

    requirement: Requirement
    showing: Showing
    runs: dict[str, Scenario]
    varied: Scenario | None
    unit: str


def needs(requirements: list[Requirement], consent: Consent) -> list[Need]:
    """What has to be run, everything checked that can be checked before. Raises FlightError."""
    found = []
    for requirement in requirements:
        for showing in requirement.shown_by:
            where = f"{requirement.id}: shown_by {showing.scenario}"
            try:
                found.append(_need(requirement, showing, consent))
            except FlightError as error:
                raise FlightError(f"{where}: {error}") from None
    return found


def new_folder(out: Path | None, name: str) -> Path:
    """``out`` (refused when it exists), or the next free runs/<name>-check-<n>. Raises FlightError."""
    folder, count = out, 1
    while folder is None or (out is None and folder.exists()):
        folder, count = Path("runs") / f"{name}-check-{count}", count + 1
    if out is not None and out.exists():
        raise FlightError(f"--out {out}: it exists already; name a new folder")
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise FlightError(f"{folder}: this folder cannot be made ({(error.strerror or str(error)).lower()})") from None
    return folder


def check(wanted: list[Need], folder: Path, jobs: int, text: Callable, progress=None,
          tell=lambda sentence: None) -> list[Judged]:
    """Run and judge. folder: a new one; text(value): a value for a person; progress(done, total, name); tell(sentence).

    Raises FlightError.
    """
    kept = KeptRuns(folder / BAGS, trust=True)
    evidence = [None] * len(wanted)
    single = {str(number): need.runs for number, need in enumerate(wanted) if need.runs}
    results = run_scenarios(single, jobs, progress, kept) if single else {}
    for name, found in results.items():
        need = wanted[int(name)]
        labelled = found if isinstance(found, Several) else {"": found}
        for metrics in labelled.values():
            _require_metric(need.requirement, metrics)
        bags = {label: kept.path(scenario) for label, scenario in need.runs.items()}
        evidence[int(name)] = of_run(need.requirement, need.showing, labelled, bags, _with_unit(text, need.unit))
    for numbers in _campaigns(wanted):
        campaign = _flown(wanted[numbers[0]].varied, [wanted[number].showing.campaign for number in numbers], folder, jobs,
                          progress, tell)
        for number in numbers:
            evidence[number] = _judged_campaign(wanted[number], campaign, kept, text)
    judged = {}
    for need, one in zip(wanted, evidence):
        judged.setdefault(need.requirement.id, Judged(need.requirement, need.unit, [])).evidence.append(one)
    return list(judged.values())


def _need(requirement, showing, consent):
    if showing.run is not None:
        runs, varied = showing.run.scenarios(consent), None
        scenario = next(iter(runs.values()))
    else:
        scenario, runs = _varied(showing.campaign, consent), {}
        varied = scenario
        if scenario.vary is None or not scenario.vary.is_random:
            raise FlightError("a campaign draws at random, and this scenario has no 'vary' block that does; a run with "
                              "cases: all shows what is true in each of its cases")
        if scenario.vary.file.sampling.plan != "independent":
            raise FlightError(f"a share with a confidence needs independent draws, and vary.sampling is "
                              f"{scenario.vary.file.sampling.plan}")
    return Need(requirement, showing, runs, varied, _unit(requirement, scenario))


def _varied(entry: CampaignEntry, consent: Consent) -> Scenario:
    """The scenario that a campaign varies. Raises FlightError."""
    data, origin, folder = read(entry.scenario, entry.set, consent)
    if entry.vary is not None:
        data = {**data, "vary": entry.vary}
        if found := foreign_code(data, folder, folder):
            consent(origin, found)
    return Scenario(data, origin, folder)


def _unit(requirement, scenario) -> str:
    """The unit of a requirement's metric. Raises FlightError where metric, limit and unit do not go together."""
    known, metric = glossary.of(scenario), requirement.metric
    if metric not in known.metrics:
        if known.is_declared:
            raise unknown("metric", metric, known.metrics)
        return requirement.unit or ""
    entry, limit = known.metrics[metric], requirement.limit
    kinds = {NUMBER: "a number", FLAG: "true or false", WORD: "a word"}
    if limit.is_equality:
        given = FLAG if isinstance(limit.is_, bool) else WORD if isinstance(limit.is_, str) else NUMBER
    else:
        given = NUMBER
    if given != entry.kind and not (limit.is_equality and limit.is_ is None):
        raise FlightError(f"limit: '{metric}' is {kinds[entry.kind]}, so '{limit.text}' cannot hold of it; allowed: " + (
            "below, above, at_most, at_least, near, between, is" if entry.kind == NUMBER else f"is: {kinds[entry.kind]}"))
    if requirement.unit is not None and requirement.unit != entry.unit:
        raise FlightError(f"unit: '{metric}' is in {entry.unit or 'no unit'}, not in {requirement.unit}")
    return entry.unit


def _require_metric(requirement, metrics):
    if requirement.metric not in metrics and not metrics.get("stopped"):
        raise FlightError(f"{requirement.id}: {unknown('metric', requirement.metric, metrics)}")


def _with_unit(text, unit) -> Callable:
    """text(value) with the unit behind numbers."""
    has_unit = unit not in ("", "1")
    return lambda value: text(value) + (f" {unit}" if has_unit and isinstance(value, int | float) else "")


def _campaigns(wanted) -> list[list[int]]:
    """The numbers of needs that one campaign serves together."""
    groups = {}
    for number, need in enumerate(wanted):
        if entry := need.showing.campaign:
            groups.setdefault(_key(entry), []).append(number)
    return list(groups.values())


def _key(entry: CampaignEntry) -> str:
    return json.dumps([entry.scenario, entry.set, entry.vary], sort_keys=True, default=str)


def _flown(scenario, entries, folder, jobs, progress, tell) -> Campaign:
    """The campaign with as many runs as the most that an entry asks for; a stopping rule of the scenario's ends it not."""
    key, runs = hashlib.sha256(_key(entries[0]).encode()).hexdigest()[:8], max(entry.runs for entry in entries)
    manifest = Manifest.of(scenario, runs, None, entries[0].set)
    manifest = replace(manifest, vary={name: value for name, value in manifest.vary.items() if name != "until"})
    path = folder_of(folder / CAMPAIGNS / f"{scenario.name}-{key}")
    manifest.save(path)
    campaign = Campaign(path, manifest)

    def advance(done, total):
        if progress:
            progress(done, total, f"campaign of {scenario.name}")
    return opening.fill(campaign, scenario, lambda made, loaded: Threads(made, loaded, jobs), advance, tell)


def _judged_campaign(need: Need, campaign: Campaign, kept, text) -> Evidence:
    metric = need.requirement.metric
    if metric not in campaign.schema().names:
        known = [one.name for one in campaign.columns() if one.kind == "metric"]
        raise FlightError(f"{need.requirement.id}: {unknown('metric', metric, known)}")
    table = campaign.read(["case", "status", metric]).slice(0, need.showing.campaign.runs)
    good = pyarrow.compute.equal(table.column("status"), "ok").to_pylist()
    values = [None if isinstance(value, float) and not math.isfinite(value) else value
              for value in table.column(metric).to_pylist()]
    found = of_campaign(need.requirement, need.showing, list(zip(table.column("case").to_pylist(), good, values)),
                        len(need.varied.vary.combinations), _with_unit(text, need.unit))
    found.campaign = campaign.path
    worst = vary_case(need.varied, int(found.worst))
    try:
        kept(worst)
    except RunStopped:
        pass
    except FlightError:  # a case that is refused has no bag
        return found
    found.bags = {f"case {found.worst}": kept.path(worst)}
    return found
