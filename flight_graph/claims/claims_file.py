"""The claims file of a paper: what it states, row by row, where the words stand, and what would make a verdict another.

``papers/<paper>/claims.yaml``:

    title: Adaptive prescribed performance control of a Cubli rover
    source: Aerospace 2022, 9(11), 728
    runs:                                  # named runs that several rows use, see `flight_graph.claims.claim_runs`
      printed: {scenario: cubli_asteroid_paper}
      wild: {scenario: cubli_asteroid_paper, set: {controller.eta_a: 5.3}}
    claims:
      - id: attitude-funnel
        statement: paper                   # whose it is: paper (its words), implied (by its words or figures), ours
        quote: the tracking error is always kept within the prescribed bounds      # word for word, one or several
        where: Theorem 1, Figs. 17-19
        says: The attitude error stays inside its funnel.
        values: {60 s: printed.xi_a_max}   # or value: printed.xi_a_max
        relation: {below: 1.0}             # or another of `flight_graph.claims.relation`
        expect: holds                      # holds, does not hold, depends
        estimated: sensed.xi_a_max         # the same with estimated instead of true state (or left out, or labelled) ...
        estimated_expect: holds            # ... and what was found there (default: as above)
        because: One sentence.
        flip:                              # what would make the verdict another one (`flight_graph.claims.flips`)
          change: eta_a times 1000
          to: does not hold
          set: {controller.eta_a: 5.3}     # of all runs of the row, or of those in ``of``
          instead: {printed: wild}         # or another run in the place of one
          arguments: {factor: 1.01}        # or, where the row has a check, arguments of its function

A value is an expression over ``run.metric``, see `flight_graph.claims.claim_expressions`; null metrics are ``None``; a run
of several cases gives one value for each. A row holds when the relation holds for all values, does not hold when it holds
for none, and depends otherwise. ``expect`` is what was found when the row was written: a row whose verdict has changed
is marked, and the command's exit status says so. A row may name ``check: module:function`` instead of values and
relation, for what is no metric of a run: function() returns (holds, text of what was found), or several of them by label.
"""

import re
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from flight_graph import yaml_text
from flight_graph.claims.claim_expressions import names
from flight_graph.claims.claim_runs import RunEntry
from flight_graph.claims.relation import Relation
from flight_graph.errors import FlightError, sentence_of, unknown
from flight_graph.graphs.papers import papers

HOLDS, FAILS, DEPENDS = "holds", "does not hold", "depends"
VERDICTS = (HOLDS, FAILS, DEPENDS)
Verdict = Literal[VERDICTS]
PAPER, IMPLIED, OURS = "paper", "implied", "ours"
STATEMENTS = (PAPER, IMPLIED, OURS)
SAID = {PAPER: "of the paper, quoted", IMPLIED: "implied by the paper", OURS: "ours"}  # whose a statement is, for people


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Flip(_Strict):
    """What would make the verdict of a row another one."""

    change: str = Field(min_length=1)
    to: Verdict
    set: dict[str, Any] = Field(default_factory=dict)
    of: list[str] | None = Field(default=None, min_length=1)
    instead: dict[str, str] = Field(default_factory=dict)
    arguments: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _changes(self):
        if not (self.set or self.instead or self.arguments):
            raise ValueError("a flip has at least one of set, instead, arguments")
        if self.of and not self.set:
            raise ValueError("'of' names the runs that 'set' is for")
        return self


class Claim(_Strict):
    """One row of the table."""

    id: str
    statement: Literal[STATEMENTS]
    quote: str | list[str] | None = None
    where: str
    says: str
    value: str | None = None
    values: dict[str, str] | None = None
    relation: Relation | None = None
    check: str | None = None
    expect: Verdict
    estimated: str | dict[str, str] | None = None
    estimated_expect: Verdict | None = None
    because: str
    flip: Flip

    @model_validator(mode="after")
    def _complete(self):
        given = [self.value is not None, self.values is not None, self.check is not None]
        if sum(given) != 1 or (self.check is None) != (self.relation is not None):
            raise ValueError("a claim has either value or values with a relation, or a check")
        expressions = self.expressions.values()
        if self.check is None and not (expressions and all(map(names, expressions))):
            raise ValueError("every value of a claim is over 'run.metric', and there is one at least")
        if self.estimated and self.check is not None:
            raise ValueError("a check has no estimated value")
        if (self.statement == PAPER and not self.quotes) or (self.statement == OURS and self.quotes):
            raise ValueError("a statement of the paper is quoted word for word ('quote'), and one of ours is not")
        if any(not re.search(r"[^\W_]", quote) for quote in self.quotes):
            raise ValueError("a quotation has words")
        self._flips()
        return self

    def _flips(self):
        flip = self.flip
        if flip.to == self.expect:
            raise ValueError(f"the flip changes nothing: its verdict is '{flip.to}' like the row's")
        if (self.check is None) == bool(flip.arguments):
            raise ValueError("the flip of a check has arguments, and that of values has set or instead")
        strangers = {*(flip.of or ()), *flip.instead} - self.judged_runs
        if strangers:
            raise ValueError(f"the flip is of the run {min(strangers)}, which the row's values do not need")

    @property
    def quotes(self) -> list[str]:
        """The quotations, word for word; none where the statement is ours."""
        return [self.quote] if isinstance(self.quote, str) else self.quote or []

    @property
    def expressions(self) -> dict[str, str]:
        """Label -> expression over ``run.metric``; one value alone has the label ""."""
        return self.values or ({"": self.value} if self.value else {})

    @property
    def estimated_expressions(self) -> dict[str, str]:
        """The same with estimated state; empty where the row does not ask."""
        return self.estimated if isinstance(self.estimated, dict) else {"": self.estimated} if self.estimated else {}

    @property
    def judged_runs(self) -> set[str]:
        """The runs that the verdict hangs on."""
        return {name for expression in self.expressions.values() for name in names(expression)}

    @property
    def runs(self) -> set[str]:
        """The runs that the row needs, that of the estimated state too."""
        return self.judged_runs.union(*map(names, self.estimated_expressions.values()))


class ClaimsFile(_Strict):
    """The file's keys."""

    title: str
    source: str
    note: str = ""
    runs: dict[str, RunEntry] = Field(default_factory=dict)
    claims: list[Claim]


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
        raise FlightError(f"{known[paper].name} of {paper}: {where}: {sentence_of(first)}") from None
    identifiers = [claim.id for claim in found.claims]
    twice = sorted({name for name in identifiers if identifiers.count(name) > 1})
    if twice:
        raise FlightError(f"claims of {paper}: the id {twice[0]} stands twice")
    for claim in found.claims:
        for name in sorted({*claim.runs, *claim.flip.instead.values()}):
            if name not in found.runs:
                raise unknown("run", name, found.runs, f"claims of {paper}: {claim.id}")
    return found
