"""Claims of a paper: rows that one command recomputes and judges.

``papers/<paper>/claims.yaml``:

    title: Adaptive prescribed performance control of a Cubli rover
    source: Aerospace 2022, 9(11), 728
    runs:                                  # named runs that several rows use
      printed: {scenario: cubli_asteroid_paper}
      hanging: {scenario: cubli_asteroid_paper, set: {plant.gravity_sign: -1, controller.gravity_sign: -1}}
    claims:
      - id: attitude-funnel
        where: Theorem 1, Figs. 17-19
        says: The attitude error stays inside its funnel.
        values: {standing: printed.xi_a_max, hanging: hanging.xi_a_max}     # or value: printed.xi_a_max
        relation: {below: 1.0}             # below, above, near: [number, tolerance], between: [low, high], is: value
        expect: holds                      # holds, does not hold, depends
        because: One sentence.

A value is an arithmetic expression over ``run.metric`` (numbers, + - * /, comparisons, and/or/not, abs, min, max); null
metrics are ``None``. A row holds when the relation holds for all values, does not hold when it holds for none, and
depends otherwise. ``expect`` is what was found when the row was written: a row whose verdict has changed is marked, and
the command's exit status says so. A row may name ``check: module:function`` instead of values and relation, for what
is no metric of a run: function() returns (holds, text of what was found).
"""

import ast
import importlib
import math
import operator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from flight_graph import metrics
from flight_graph.errors import FlightError, unknown
from flight_graph.scenario import load

HOLDS, FAILS, DEPENDS = "holds", "does not hold", "depends"


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class RunEntry(_Strict):
    """A run that rows refer to."""

    scenario: str
    set: dict[str, Any] = Field(default_factory=dict)


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
    because: str

    @model_validator(mode="after")
    def _complete(self):
        given = [self.value is not None, self.values is not None, self.check is not None]
        if sum(given) != 1 or (self.check is None) != (self.relation is not None):
            raise ValueError("a claim has either value or values with a relation, or a check")
        return self

    @property
    def expressions(self) -> dict[str, str]:
        return self.values or ({"": self.value} if self.value else {})


class ClaimsFile(_Strict):
    """The file's keys."""

    title: str
    source: str
    note: str = ""
    runs: dict[str, RunEntry] = Field(default_factory=dict)
    claims: list[Claim]


@dataclass
class Row:
    """A judged claim. found: label -> value."""

    claim: Claim
    verdict: str
    found: dict = field(default_factory=dict)

    @property
    def as_expected(self) -> bool:
        return self.verdict == self.claim.expect

    def plain(self, paper: str) -> dict:
        """The row for a machine."""
        claim = self.claim
        return {"paper": paper, "id": claim.id, "where": claim.where, "says": claim.says,
                "relation": claim.relation.text if claim.relation else "check", "found": self.found,
                "verdict": self.verdict, "expected": claim.expect, "because": claim.because}


def papers() -> dict[str, Path]:
    """The papers that have claims, and the files."""
    root = Path(str(resources.files("papers")))
    return {path.parent.name: path for path in sorted(root.glob("*/claims.yaml"))}


def read(paper: str) -> ClaimsFile:
    """Read and check the claims of a paper. Raises FlightError."""
    known = papers()
    if paper not in known:
        raise unknown("paper", paper, known)
    try:
        found = ClaimsFile.model_validate(yaml.safe_load(known[paper].read_text()))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise FlightError(f"{known[paper].name} of {paper}: {where}: {first['msg'].lower()}") from None
    identifiers = [claim.id for claim in found.claims]
    twice = sorted({name for name in identifiers if identifiers.count(name) > 1})
    if twice:
        raise FlightError(f"claims of {paper}: the id {twice[0]} stands twice")
    for claim in found.claims:
        for expression in claim.expressions.values():
            for name in names(expression):
                if name not in found.runs:
                    raise unknown("run", name, found.runs, f"claims of {paper}: {claim.id}")
    return found


def judge(paper: str, jobs: int = 2, only: list[str] | None = None, progress=None) -> list[Row]:
    """Recompute the claims of a paper and judge them. progress(done, total, name) is called after each run."""
    content = read(paper)
    claims = [claim for claim in content.claims if not only or claim.id in only]
    for name in only or []:
        if name not in [claim.id for claim in content.claims]:
            raise unknown("claim", name, [claim.id for claim in content.claims], paper)
    needed = {name for claim in claims for expression in claim.expressions.values() for name in names(expression)}
    results = run_all({name: entry for name, entry in content.runs.items() if name in needed}, jobs, progress)
    return [_row(claim, results) for claim in claims]


def judge_run(paper: str, scenario: str, found: dict) -> list[Row]:
    """The rows that one run of an unchanged scenario can judge, from its metrics ``found``."""
    content = read(paper)
    results = {name: found for name, entry in content.runs.items() if entry.scenario == scenario and not entry.set}
    rows = []
    for claim in content.claims:
        mine = {label: text for label, text in claim.expressions.items() if names(text) and names(text) <= set(results)}
        if mine:
            rows.append(_row(claim.model_copy(update={"value": None, "values": mine}), results))
    return rows


def run_all(entries: dict[str, RunEntry], jobs: int, progress=None) -> dict[str, dict]:
    """Metrics of each named run; runs that are the same are made once."""
    from flight_graph.runs import simulate
    scenarios = {name: load(entry.scenario, entry.set) for name, entry in entries.items()}
    same = {}
    for name, entry in entries.items():
        same.setdefault((entry.scenario, repr(sorted(entry.set.items()))), []).append(name)
    results, done = {}, 0
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        def one(group):
            scenario = scenarios[group[0]]
            return group, metrics.compute(scenario, simulate(scenario))
        for future in as_completed([pool.submit(one, group) for group in same.values()]):
            group, found = future.result()
            results.update(dict.fromkeys(group, found))
            done += 1
            if progress:
                progress(done, len(same), group[0])
    return results


def _row(claim: Claim, results) -> Row:
    if claim.check is not None:
        held, text = metrics.load(claim.check)()
        return Row(claim, HOLDS if held else FAILS, {"": text})
    found = {label: evaluate(expression, results) for label, expression in claim.expressions.items()}
    held = [claim.relation.holds(value) for value in found.values()]
    return Row(claim, HOLDS if all(held) else DEPENDS if any(held) else FAILS, found)


_BINARY = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
_COMPARE = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
            ast.NotEq: operator.ne}
_FUNCTIONS = {"abs": abs, "min": min, "max": max}


def names(expression: str) -> set[str]:
    """The runs that an expression names."""
    return {node.value.id for node in ast.walk(_parse(expression))
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)}


def evaluate(expression: str, results: dict[str, dict]):
    """The value of an expression over run.metric; None where a metric that it needs is None."""
    try:
        return _value(_parse(expression).body, results, expression)
    except TypeError:
        return None  # arithmetic with "never"


def _parse(expression):
    try:
        return ast.parse(expression, mode="eval")
    except SyntaxError:
        raise FlightError(f"claims: '{expression}' is no expression") from None


def _value(node, results, text):
    match node:
        case ast.Constant(value=bool() | int() | float() | None):
            return node.value
        case ast.Attribute(value=ast.Name(id=run), attr=metric):
            if metric not in results[run]:
                raise unknown("metric", metric, results[run], f"claims: {text}")
            return results[run][metric]
        case ast.BinOp() if type(node.op) in _BINARY:
            return _BINARY[type(node.op)](_value(node.left, results, text), _value(node.right, results, text))
        case ast.UnaryOp(op=ast.USub()):
            return -_value(node.operand, results, text)
        case ast.UnaryOp(op=ast.Not()):
            return not _value(node.operand, results, text)
        case ast.BoolOp():
            parts = [_value(part, results, text) for part in node.values]
            return all(parts) if isinstance(node.op, ast.And) else any(parts)
        case ast.Compare():
            sides = [_value(part, results, text) for part in [node.left, *node.comparators]]
            return all(_COMPARE[type(op)](a, b) for op, a, b in zip(node.ops, sides, sides[1:]))
        case ast.Call(func=ast.Name(id=name)) if name in _FUNCTIONS:
            return _FUNCTIONS[name](*[_value(part, results, text) for part in node.args])
    raise FlightError(f"claims: '{text}': allowed are numbers, run.metric, + - * /, comparisons, and, or, not, abs, min, "
                      "max")


def load_figures(paper: str):
    """The module papers.<paper>.figures."""
    try:
        return importlib.import_module(f"papers.{paper}.figures")
    except ModuleNotFoundError:
        raise FlightError(f"the paper {paper} has no figures") from None
