"""What shows a requirement: a run in each of its cases, or the share of a campaign's runs that keeps the limit.

Of n runs of a campaign k keep the limit; one that was stopped, or has no such metric, does not. With the one-sided bounds
of Clopper and Pearson (`flight_graph.statistics.rates`) at the confidence C that is asked for,

    met         the true share is above the wanted one with confidence C: its lower bound is
    not met     it is below with confidence C: its upper bound is
    not shown   the runs do not tell
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

from flight_graph.requirements.requirements_file import Requirement, Showing
from flight_graph.statistics.percentiles import runs_needed
from flight_graph.statistics.rates import clopper_pearson

MET, NOT_MET, NOT_SHOWN = "met", "not met", "not shown"


@dataclass
class Evidence:
    """One entry of ``shown_by``, judged. found: text; values: label of the case -> value; bags: label -> bag (of a campaign
    that of its worst case); campaign: its folder; worst: label of the value with the least margin."""

    showing: Showing
    verdict: str
    found: str
    values: dict = field(default_factory=dict)
    bags: dict[str, Path] = field(default_factory=dict)
    campaign: Path | None = None
    worst: str = ""

    @property
    def kind(self) -> str:
        """``run`` or ``campaign``."""
        return "run" if self.showing.run else "campaign"

    def plain(self) -> dict:
        """The evidence for a machine."""
        return {"kind": self.kind, "scenario": self.showing.scenario, "verdict": self.verdict, "found": self.found,
                "values": self.values, "worst": self.worst, "bags": {label: str(path) for label, path in self.bags.items()},
                "campaign": str(self.campaign) if self.campaign else None}


@dataclass
class Judged:
    """A requirement and its evidence."""

    requirement: Requirement
    unit: str
    evidence: list[Evidence]

    @property
    def verdict(self) -> str:
        """The worst of the evidence: all of it has to hold together."""
        verdicts = {one.verdict for one in self.evidence}
        return next(name for name in (NOT_MET, NOT_SHOWN, MET) if name in verdicts)

    @property
    def passes(self) -> bool:
        """Whether it is as the file says: met, or waived and not met."""
        return (self.verdict == MET) == (self.requirement.waived is None)

    @property
    def verdict_text(self) -> str:
        """The verdict, and what a waiver makes of it."""
        if self.requirement.waived is None:
            return self.verdict
        return f"{self.verdict} (waived)" if self.verdict != MET else f"{self.verdict} (waived for nothing)"

    @property
    def limit_text(self) -> str:
        """Metric, relation and unit."""
        unit = f" {self.unit}" if self.unit and self.unit != "1" and not self.requirement.limit.is_equality else ""
        return f"{self.requirement.metric} {self.requirement.limit.text}{unit}"

    def plain(self) -> dict:
        """The row for a machine."""
        one = self.requirement
        return {"id": one.id, "text": one.text, "because": one.because, "metric": one.metric, "limit": one.limit.text,
                "unit": self.unit, "verdict": self.verdict, "waived": one.waived, "passes": self.passes,
                "shown_by": [evidence.plain() for evidence in self.evidence]}


def of_run(requirement: Requirement, showing: Showing, found: dict, bags: dict[str, Path], text) -> Evidence:
    """Judge runs. found: label of the case -> metrics ('' of a single run); text(value): a value for a person."""
    limit, values, stops = requirement.limit, {}, {}
    for label, metrics in found.items():
        values[label] = metrics.get(requirement.metric)
        if metrics.get("stopped"):
            stops[label] = metrics["sentence"]
    bad = [label for label, value in values.items() if label in stops or not limit.holds(value)]
    worst = min(values, key=lambda label: -math.inf if label in stops else limit.margin(values[label]))
    said = f"the run was stopped: {stops[worst]}" if worst in stops else text(values[worst])
    if len(values) > 1:
        kept = f"{len(values) - len(bad)} of {len(values)} cases keep it"
        said = kept if limit.is_equality and not bad else f"{kept}; worst: {worst}: {said}"
    return Evidence(showing, NOT_MET if bad else MET, said, values, bags, worst=worst)


def of_campaign(requirement: Requirement, showing: Showing, runs_found: list[tuple], variants: int, text) -> Evidence:
    """Judge the runs of a campaign. runs_found: (case, whether it ended well, value or None) of each; variants: how many of
    them are drawn together."""
    limit, entry = requirement.limit, showing.campaign
    kept, runs = sum(good and limit.holds(value) for _, good, value in runs_found), len(runs_found)
    low, high = clopper_pearson(kept, runs, 2.0 * entry.confidence - 1.0)
    verdict = MET if low >= entry.share else NOT_MET if high < entry.share else NOT_SHOWN
    bad, missing = sum(not good for _, good, _ in runs_found), sum(good and value is None for _, good, value in runs_found)
    case, good, value = min(runs_found, key=lambda one: limit.margin(one[2]) if one[1] else -math.inf)
    parts = [f"{kept} of {runs} runs keep it{f' ({variants} variants together)' if variants > 1 else ''}",
             f"at least {_percent(low)} of all do, with {_percent(entry.confidence)} confidence, and "
             f"{_percent(entry.share)} are wanted"]
    if bad:
        parts.append(f"{bad} did not end well")
    if missing:
        parts.append(f"{missing} have no {requirement.metric}")
    if verdict == NOT_SHOWN:
        parts.append(f"{runs_needed(entry.share, entry.confidence)} runs do if all of them keep it")
    parts.append(f"worst: case {case}: {text(value) if good else 'it did not end well'}")
    return Evidence(showing, verdict, "; ".join(parts), {str(case): value}, worst=str(case))


def _percent(share) -> str:
    return f"{100.0 * float(share):.4g} %"
