"""Claims of a paper: rows that one command recomputes and judges.

``papers/<paper>/claims.yaml``:

    title: Adaptive prescribed performance control of a Cubli rover
    source: Aerospace 2022, 9(11), 728
    runs:                                  # named runs that several rows use, see `flight_graph.claims.claim_runs`
      printed: {scenario: cubli_asteroid_paper}
      hanging: {scenario: cubli_asteroid_paper, set: {plant.gravity_sign: -1, controller.gravity_sign: -1}}
    claims:
      - id: attitude-funnel
        where: Theorem 1, Figs. 17-19
        says: The attitude error stays inside its funnel.
        values: {standing: printed.xi_a_max, hanging: hanging.xi_a_max}     # or value: printed.xi_a_max
        relation: {below: 1.0}             # below, above, near: [number, tolerance], between: [low, high], is: value
        expect: holds                      # holds, does not hold, depends
        estimated: sensed.xi_a_max         # the same with estimated instead of true state (may be left out) ...
        estimated_expect: holds            # ... and what was found there (default: as above)
        because: One sentence.

A value is an expression over ``run.metric``, see `flight_graph.claims.claim_expressions`; null metrics are ``None``; a run
of several cases gives one value for each. A row holds when the relation holds for all values, does not hold when it holds
for none, and depends otherwise. ``expect`` is what was found when the row was written: a row whose verdict has changed
is marked, and the command's exit status says so. A row may name ``check: module:function`` instead of values and
relation, for what is no metric of a run: function() returns (holds, text of what was found).
"""

import importlib
import math
from dataclasses import dataclass, field
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from flight_graph import yaml_text
from flight_graph.claims.claim_expressions import Several, evaluate, names
from flight_graph.claims.claim_runs import RunEntry, run_all
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs import metrics
from flight_graph.graphs.papers import papers

HOLDS, FAILS, DEPENDS = "holds", "does not hold", "depends"
ESTIMATED = "with estimated state"


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Relation(_Strict):
    """Exactly one of these."""

    below: float | None = None
    above: float | None = None
    near: tuple[float, float] | None = None
    between: tuple[float, float] | None = None
    is_: Any = Field(default=None, alias="is")

    @model_validator(mode="after")
    def _one(self):
        if len(self.model_fields_set) != 1:
            raise ValueError("a relation has exactly one of below, above, near, between, is")
        return self

    def holds(self, value) -> bool:
        """Whether the relation holds; None (never, or not there) holds for ``is: null`` alone."""
        if "is_" in self.model_fields_set:
            return value == self.is_
        if value is None or not math.isfinite(value):
            return False
        if self.below is not None:
            return value < self.below
        if self.above is not None:
            return value > self.above
        if self.near is not None:
            return abs(value - self.near[0]) <= self.near[1]
        return self.between[0] <= value <= self.between[1]

    @property
    def text(self) -> str:
        if "is_" in self.model_fields_set:
            return f"is {self.is_}"
        if self.below is not None:
            return f"< {self.below:g}"
        if self.above is not None:
            return f"> {self.above:g}"
        if self.near is not None:
            return f"{self.near[0]:g} +- {self.near[1]:g}"
        return f"{self.between[0]:g} to {self.between[1]:g}"


class Claim(_Strict):
    """One row of the table."""

    id: str
    where: str
    says: str
    value: str | None = None
    values: dict[str, str] | None = None
    relation: Relation | None = None
    check: str | None = None
    expect: Literal["holds", "does not hold", "depends"]
    estimated: str | None = None
    estimated_expect: Literal["holds", "does not hold", "depends"] | None = None
    because: str

    @model_validator(mode="after")
    def _complete(self):
        given = [self.value is not None, self.values is not None, self.check is not None]
        if sum(given) != 1 or (self.check is None) != (self.relation is not None):
            raise ValueError("a claim has either value or values with a relation, or a check")
        if self.estimated and self.check is not None:
            raise ValueError("a check has no estimated value")
        return self

    @property
    def expressions(self) -> dict[str, str]:
        return self.values or ({"": self.value} if self.value else {})

    @property
    def runs(self) -> set[str]:
        """The runs that the row needs."""
        estimated = [self.estimated] if self.estimated else []
        return {name for expression in [*self.expressions.values(), *estimated] for name in names(expression)}


class ClaimsFile(_Strict):
    """The file's keys."""

    title: str
    source: str
    note: str = ""
    runs: dict[str, RunEntry] = Field(default_factory=dict)
    claims: list[Claim]


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
        claim = self.claim
        return self.verdict == claim.expect and (
            self.estimated_verdict is None or self.estimated_verdict == (claim.estimated_expect or claim.expect))

    def plain(self, paper: str) -> dict:
        """The row for a machine."""
        claim = self.claim
        return {"paper": paper, "id": claim.id, "where": claim.where, "says": claim.says,
                "relation": claim.relation.text if claim.relation else "check", "found": self.found,
                "verdict": self.verdict, "expected": claim.expect, "estimated": self.estimated,
                "estimated_verdict": self.estimated_verdict, "because": claim.because}


def read(paper: str) -> ClaimsFile:
    """Read and check the claims of a paper. Raises FlightError."""
    known = papers()
    if paper not in known:
        raise unknown("paper", paper, known)
    try:
        found = ClaimsFile.model_validate(yaml_text.read(known[paper]))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise FlightError(f"{known[paper].name} of {paper}: {where}: {first['msg'].lower()}") from None
    identifiers = [claim.id for claim in found.claims]
    twice = sorted({name for name in identifiers if identifiers.count(name) > 1})
    if twice:
        raise FlightError(f"claims of {paper}: the id {twice[0]} stands twice")
    for claim in found.claims:
        for name in claim.runs:
            if name not in found.runs:
                raise unknown("run", name, found.runs, f"claims of {paper}: {claim.id}")
    return found


def judge(paper: str, jobs: int = 2, only: list[str] | None = None, progress=None, kept=None) -> list[Row]:
    """Recompute the claims of a paper and judge them. progress(done, total, name) is called after each run.

    kept(scenario) gives the signals of a run from its bag (`flight_graph.claims.kept_runs`); without it nothing is kept.
    """
    content = read(paper)
    claims = [claim for claim in content.claims if not only or claim.id in only]
    for name in only or []:
        if name not in [claim.id for claim in content.claims]:
            raise unknown("claim", name, [claim.id for claim in content.claims], paper)
    needed = set().union(*(claim.runs for claim in claims))
    results = run_all({name: entry for name, entry in content.runs.items() if name in needed}, jobs, progress, kept)
    return [_row(claim, results) for claim in claims]


def judge_run(paper: str, scenario: str, found: dict) -> list[Row]:
    """The rows that one run of an unchanged scenario can judge, from its metrics ``found``."""
    content = read(paper)
    results = {name: found for name, entry in content.runs.items() if entry.scenario == scenario and entry.is_plain}
    parts = [_part(claim, set(results)) for claim in content.claims]
    return [_row(claim, results) for claim in parts if claim is not None]


def _part(claim: Claim, runs: set[str]) -> Claim | None:
    """What of a claim can be judged from these runs; None when nothing can."""
    mine = {label: text for label, text in claim.expressions.items() if names(text) and names(text) <= runs}
    estimated = claim.estimated if claim.estimated and names(claim.estimated) <= runs else None
    if mine:
        return claim.model_copy(update={"value": None, "values": mine, "estimated": estimated})
    if estimated is None:
        return None
    return claim.model_copy(update={"value": None, "values": {ESTIMATED: estimated}, "estimated": None,
                                    "expect": claim.estimated_expect or claim.expect})


def _row(claim: Claim, results) -> Row:
    if claim.check is not None:
        held, text = metrics.load(claim.check)()
        return Row(claim, HOLDS if bool(held) else FAILS, {"": text})
    found = {}
    for label, expression in claim.expressions.items():
        found.update(_labelled(label, evaluate(expression, results)))
    met = {label: claim.relation.holds(value) for label, value in found.items()}
    row = Row(claim, _verdict(met), found, met)
    if claim.estimated:
        row.estimated = evaluate(claim.estimated, results)
        row.estimated_verdict = _verdict({label: claim.relation.holds(value)
                                          for label, value in _labelled("", row.estimated).items()})
    return row


def _labelled(label, value) -> dict:
    if isinstance(value, Several):
        return {f"{label}, {case}" if label and case else label or case: one for case, one in value.items()}
    return {label: value}


def _verdict(met):
    return HOLDS if all(met.values()) else DEPENDS if any(met.values()) else FAILS


def load_figures(paper: str):
    """The module papers.<paper>.figures."""
    try:
        return importlib.import_module(f"papers.{paper}.figures")
    except ModuleNotFoundError:
        raise FlightError(f"the paper {paper} has no figures") from None
