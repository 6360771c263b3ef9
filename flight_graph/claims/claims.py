"""Claims of a paper: the rows of its table (`flight_graph.claims.claims_file`), recomputed from runs and judged."""

import importlib
from dataclasses import dataclass, field
from typing import Any

from flight_graph.claims.claim_expressions import Several, evaluate, names
from flight_graph.claims.claim_runs import run_all
from flight_graph.claims.claims_file import DEPENDS, FAILS, HOLDS, Claim, ClaimsFile, read
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs import metrics
from flight_graph.recordings.what_ran import same

ESTIMATED = "with estimated state"


@dataclass
class Row:
    """A judged claim. found: label -> value; met: label -> whether the relation holds there.

    estimated, estimated_verdict: value and verdict with estimated state, None where the row does not ask.
    """

    claim: Claim
    verdict: str
    found: dict = field(default_factory=dict)
    met: dict = field(default_factory=dict)
    estimated: Any = None
    estimated_verdict: str | None = None

    @property
    def as_expected(self) -> bool:
        """Whether the verdict is the one that the claims file has, that on estimated state too."""
        claim = self.claim
        return self.verdict == claim.expect and (
            self.estimated_verdict is None or self.estimated_verdict == (claim.estimated_expect or claim.expect))

    def plain(self, paper: str) -> dict:
        """The row for a machine."""
        claim = self.claim
        return {"paper": paper, "id": claim.id, "statement": claim.statement, "quotes": claim.quotes,
                "where": claim.where, "says": claim.says,
                "relation": claim.relation.text if claim.relation else "check", "found": self.found,
                "verdict": self.verdict, "expected": claim.expect, "estimated": self.estimated,
                "estimated_verdict": self.estimated_verdict, "because": claim.because, "flips_with": claim.flip.change}


def judge(paper: str, jobs: int = 2, only: list[str] | None = None, progress=None, kept=None) -> list[Row]:
    """Recompute the claims of a paper and judge them. progress(done, total, name) is called after each run.

    kept(scenario) gives the signals of a run from its bag (`flight_graph.claims.kept_runs`); without it nothing is kept.
    """
    content = read(paper)
    claims = chosen(content, only, paper)
    needed = set().union(*(claim.runs for claim in claims))
    results = run_all({name: entry for name, entry in content.runs.items() if name in needed}, jobs, progress, kept)
    return [row(claim, results) for claim in claims]


def chosen(content: ClaimsFile, only: list[str] | None, paper: str) -> list[Claim]:
    """The rows with these ids, all when there are none. Raises FlightError."""
    known = [claim.id for claim in content.claims]
    for name in only or []:
        if name not in known:
            raise unknown("claim", name, known, paper)
    return [claim for claim in content.claims if not only or claim.id in only]


def judge_run(paper: str, scenario: str, found: dict, given: dict | None = None, case: str | None = None) -> list[Row]:
    """The rows that one run can judge, from its metrics ``found``. given: what was set in the scenario; case: the name of
    its case; rows whose run has neither, or exactly these, are judged."""
    content = read(paper)
    results = {name: found for name, entry in content.runs.items() if entry.scenario == scenario and entry.cases is None
               and entry.case == case and same(entry.set, given or {})}
    parts = [_part(claim, set(results)) for claim in content.claims]
    return [row(claim, results) for claim in parts if claim is not None]


def _part(claim: Claim, runs: set[str]) -> Claim | None:
    """What of a claim can be judged from these runs; None when nothing can."""
    mine = {label: text for label, text in claim.expressions.items() if names(text) and names(text) <= runs}
    asked = claim.estimated_expressions
    estimated = claim.estimated if asked and set().union(*map(names, asked.values())) <= runs else None
    if mine:
        return claim.model_copy(update={"value": None, "values": mine, "estimated": estimated})
    if estimated is None:
        return None
    values = {f"{ESTIMATED}, {label}" if label else ESTIMATED: text for label, text in asked.items()}
    return claim.model_copy(update={"value": None, "values": values, "estimated": None,
                                    "expect": claim.estimated_expect or claim.expect})


def row(claim: Claim, results: dict, arguments: dict | None = None) -> Row:
    """A claim judged from the metrics of its runs, or by its check with these arguments. Raises FlightError."""
    if claim.check is not None:
        answer = metrics.load(claim.check)(**(arguments or {}))
        answers = answer if isinstance(answer, dict) else {"": answer}
        if not answers:
            raise FlightError(f"claims: {claim.id}: its check answers nothing")
        met = {label: bool(held) for label, (held, _) in answers.items()}
        return Row(claim, _verdict(met), {label: text for label, (_, text) in answers.items()}, met)
    found = _values(claim.expressions, results)
    met = {label: claim.relation.holds(value) for label, value in found.items()}
    judged = Row(claim, _verdict(met), found, met)
    if claim.estimated:
        estimated = _values(claim.estimated_expressions, results)
        judged.estimated = estimated[""] if list(estimated) == [""] else Several(estimated)
        judged.estimated_verdict = _verdict({label: claim.relation.holds(value) for label, value in estimated.items()})
    return judged


def _values(expressions, results) -> dict:
    """Label, and case where a run has several -> value."""
    found = {}
    for label, expression in expressions.items():
        found.update(_labelled(label, evaluate(expression, results)))
    return found


def _labelled(label, value) -> dict:
    if isinstance(value, Several):
        return {f"{label}, {case}" if label and case else label or case: one for case, one in value.items()}
    return {label: value}


def _verdict(met):
    return HOLDS if all(met.values()) else DEPENDS if any(met.values()) else FAILS


def load_figures(paper: str):
    """The module papers.<paper>.figures. Raises FlightError where there is none."""
    try:
        return importlib.import_module(f"papers.{paper}.figures")
    except ModuleNotFoundError:
        raise FlightError(f"the paper {paper} has no figures") from None
