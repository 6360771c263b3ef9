"""Flips: what each row of a claims table says would make its verdict another one, run and judged.

A row whose verdict nothing could change states nothing. So each names a change of what it is about - another parameter, a
broken law, learning switched off, an entry of a printed formula - and the verdict that it has then.
"""

import inspect
from dataclasses import dataclass

from flight_graph.claims.claim_runs import RunEntry, run_all
from flight_graph.claims.claims import Row, chosen, row
from flight_graph.claims.claims_file import Claim, ClaimsFile, read
from flight_graph.errors import unknown
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario


@dataclass
class Flipped:
    """A row judged under its change. share: how much of the change was made, 1 for all of it."""

    claim: Claim
    judged: Row
    share: float = 1.0

    @property
    def as_said(self) -> bool:
        """Whether the verdict is the one that the row says it has then."""
        return self.judged.verdict == self.claim.flip.to

    def plain(self, paper: str) -> dict:
        """The result for a machine."""
        flip = self.claim.flip
        return {"paper": paper, "id": self.claim.id, "verdict": self.claim.expect, "change": flip.change,
                "verdict_then": self.judged.verdict, "expected_then": flip.to, "found_then": self.judged.found}


def flip(paper: str, only: list[str] | None = None, jobs: int = 2, progress=None) -> list[Flipped]:
    """Each row of a paper under its change. progress(done, total, name) is called after each run. Raises FlightError."""
    content = read(paper)
    return flip_rows(content, [(claim, 1.0) for claim in chosen(content, only, paper)], jobs, progress)


def flip_rows(content: ClaimsFile, rows: list[tuple[Claim, float]], jobs: int = 2, progress=None) -> list[Flipped]:
    """Rows under a share of their changes (see `between`), all runs made together."""
    entries = {}
    for number, (claim, share) in enumerate(rows):
        for name in claim.judged_runs:
            entries[f"{claim.id}/{number}/{name}"] = changed_run(content, claim, name, share)
    results = run_all(entries, jobs, progress)
    found = []
    for number, (claim, share) in enumerate(rows):
        mine = {name: results[f"{claim.id}/{number}/{name}"] for name in claim.judged_runs}
        bare = claim.model_copy(update={"estimated": None})
        found.append(Flipped(claim, row(bare, mine, changed_arguments(claim, share)), share))
    return found


def changed_run(content: ClaimsFile, claim: Claim, name: str, share: float = 1.0) -> RunEntry:
    """The run that stands for the row's run ``name`` under its change."""
    change = claim.flip
    if name in change.instead:
        return content.runs[change.instead[name]]
    entry = content.runs[name]
    if not change.set or (change.of and name not in change.of):
        return entry
    values = change.set
    if share < 1.0:
        nominal = next(iter(entry.scenarios().values()))
        values = {path: value if path.endswith(".rate_hz") else between(value_at(nominal, path), value, share)
                  for path, value in values.items()}  # few rates have a period of whole nanoseconds
    return entry.model_copy(update={"set": {**entry.set, **values}})


def changed_arguments(claim: Claim, share: float = 1.0) -> dict:
    """The arguments of the row's check under its change."""
    if claim.check is None:
        return {}
    defaults = {name: one.default for name, one in inspect.signature(metrics.load(claim.check)).parameters.items()}
    for name in claim.flip.arguments:
        if name not in defaults:
            raise unknown("argument", name, defaults, f"claims: the flip of {claim.id}")
    return {name: between(defaults[name], value, share) for name, value in claim.flip.arguments.items()}


def value_at(scenario: Scenario, path: str):
    """The value of what ``set`` names: ``node.parameter``, ``node.rate_hz``, or a key of the scenario."""
    scenario, path = scenario.reach(path)
    data = scenario.resolved()
    node, _, name = path.partition(".")
    if not name:
        return data.get(node)
    found = data["components"][node]
    return found["parameters"].get(name, found.get(name))


def between(nominal, changed, share: float):
    """``share`` of the way from one value to the other. What has no values between it and others is changed whole."""
    if share == 1.0:
        return changed
    if isinstance(nominal, (list, tuple)):
        several = changed if isinstance(changed, (list, tuple)) else [changed] * len(nominal)
        return [between(*pair, share) for pair in zip(nominal, several, strict=True)]
    return nominal + share * (changed - nominal) if is_between(nominal, changed) else changed


def is_between(nominal, changed) -> bool:
    """Whether there are values between the two: of real numbers, not of whole ones, switches and names."""
    return isinstance(nominal, float) and isinstance(changed, (int, float)) and not isinstance(changed, bool)


def is_gradual(content: ClaimsFile, claim: Claim) -> bool:
    """Whether a part of a row's change is a smaller change."""
    if claim.check is not None:
        whole, part = changed_arguments(claim), changed_arguments(claim, 0.5)
        return whole != part
    if claim.flip.instead:
        return False
    name = (claim.flip.of or sorted(claim.judged_runs))[0]
    return changed_run(content, claim, name) != changed_run(content, claim, name, 0.5)
