"""What runs say of requirements and of papers, judged on the metrics of their bags, and nothing run for it."""

from pathlib import Path

from flight_graph.claims import claims as judging
from flight_graph.claims.claims_file import SAID
from flight_graph.graphs.metric_entry import MetricEntry
from flight_graph.graphs.papers import papers
from flight_graph.recordings.what_ran import what_ran
from flight_graph.reports.page import Table
from flight_graph.requirements import requirements_file

MET, MISSED = "met", "not met"


def number(value, entry: MetricEntry | None = None) -> str:
    """A metric for a person, with its unit where an entry is given."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = f"{value:.5g}" if isinstance(value, float) else str(value)
    return f"{text} {entry.unit}" if entry and entry.unit not in ("", "1") else text


def requirements(runs) -> list:
    """The requirements that are asked of the scenarios of these runs, judged on these runs alone."""
    rows, odd = [], []
    for requirement in _requirements():
        cells = [_judged(requirement, run) for run in runs]
        if any(cells):
            rows.append([requirement.id, requirement.text, f"{requirement.metric} {requirement.limit.text}",
                         *(cell or "-" for cell in cells),
                         f"waived: {requirement.waived}" if requirement.waived else ""])
    for run in runs:
        if run.scenario is not None and (words := _changed(run)):
            odd.append(f"{run.name} is not the scenario as it stands ({words}): a requirement is asked of that one.")
    if not rows:
        return []
    head = ["requirement", "what it says", "limit", *(run.name for run in runs), ""]
    return [Table("Of this run" if len(runs) == 1 else "Of these runs", head, rows, (
        "Judged on the numbers of this page; flight check runs what a requirement is shown by, campaigns too.")), *odd]


def _requirements() -> list:
    return [one for name in requirements_file.available() for one in requirements_file.read(name)[0].requirements]


def _judged(requirement, run) -> str:
    """The verdict of a run, "" where the requirement is not asked of its scenario."""
    asked = {Path(showing.scenario).stem for showing in requirement.shown_by}
    if run.scenario is None or run.scenario.name not in asked or requirement.metric not in run.metrics:
        return ""
    value = run.metrics[requirement.metric]
    verdict = MET if requirement.limit.holds(value) else MISSED
    return f"{verdict}: {number(value, run.glossary.entry(requirement.metric))}"


def claims(runs) -> list:
    """The rows of a paper that these runs can judge."""
    parts = []
    for run in runs:
        paper = run.scenario.file.paper if run.scenario is not None else None
        if paper not in papers() or not run.metrics:
            continue
        ran = what_ran(run.scenario)
        given = {key: value for key, value in ran.given.items()}
        found = judging.judge_run(paper, run.scenario.name, run.metrics, given, ran.case_name or None)
        if not found:
            if words := _changed(run):
                parts.append(f"{run.name}: no row of the paper is about this scenario with {words}.")
            continue
        rows = [[row.claim.id, SAID[row.claim.statement], row.claim.where, row.claim.says,
                 "; ".join(f"{label}: {number(value)}" if label else number(value) for label, value in row.found.items()),
                 row.claim.relation.text if row.claim.relation else "", row.verdict, row.claim.because] for row in found]
        title = judging.read(paper).title + (f": {run.name}" if len(runs) > 1 else "")
        parts.append(Table(title, ["row", "whose it is", "where", "says", "found", "wanted", "verdict", "reason"], rows, (
            f"{len(rows)} rows that this run alone can judge; flight claims {paper} judges all.")))
    return parts


def _changed(run) -> str:
    """What was set, in words; "" of a scenario as it stands."""
    ran = what_ran(run.scenario)
    return ran.words(run.scenario.seed) if ran.known and (ran.given or ran.case >= 0) else ""
