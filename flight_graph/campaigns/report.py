"""What a campaign says, as data: rates and percentiles with their intervals, sensitivities, worst cases.

Everything is by group (`flight_graph.campaigns.values`), and everything that is missing is counted beside what is there:
``without`` (a run that ended badly, or has no such metric) and ``not_a_number`` (NaN or infinity). A rate counts both as no
success; a percentile is of the runs that have a finite value.
"""

from collections import Counter
from dataclasses import asdict, dataclass

import numpy as np

from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.values import Values
from flight_graph.errors import FlightError
from flight_graph.statistics.percentiles import bound, percentile
from flight_graph.statistics.rates import rate
from flight_graph.statistics.sensitivities import rank_correlations, sobol_indices

SHARES = (0.05, 0.5, 0.95)  # of the percentiles that are shown
MOST_TEXTS = 20  # values of a text that are counted
DEPENDENT = {
    "latin_hypercube": "draws of a Latin hypercube are not independent; the intervals are those of independent draws, "
                       "mostly too wide",
    "sobol": "points of a Sobol sequence are not independent; the intervals are those of independent draws, mostly too "
             "wide",
    "saltelli": "rates, percentiles and rank correlations are of the rows A and B of the design; the rows in which factors "
                "are exchanged serve the Sobol indices alone",
}


@dataclass(frozen=True)
class Choices:
    """What is asked for. share, share_confidence: of the one-sided bound; metrics: names, all when empty."""

    confidence: float = 0.95
    share: float = 0.9973
    share_confidence: float = 0.9
    metrics: tuple[str, ...] = ()
    pool: bool = False

    def __post_init__(self):
        for option, value in (("--confidence", self.confidence), ("--share", self.share),
                              ("--share-confidence", self.share_confidence)):
            if not 0.0 < value < 1.0:
                raise FlightError(f"{option} {value}: allowed: between 0 and 1 (0.9973 is 99.73 %)")


def report(campaign: Campaign, choices: Choices = Choices()) -> dict:
    """Of each group its rates, percentiles and texts. Raises FlightError.

    ``groups``: a list of {group, rows, ok, rates, metrics, texts}; ``missing_chunks``: of the campaign; ``notes``:
    sentences about what the numbers are not.
    """
    values = Values(campaign, choices.pool)
    names = [values.checked(name, "--metric") for name in choices.metrics] or values.metrics
    groups = [{"group": group.label, "rows": int(group.rows.sum()), "ok": int((group.rows & values.ok).sum()), "rates": [],
               "metrics": [], "texts": []} for group in values.groups]
    for name, column, empty in values.read(names):
        kind = kind_of(values, name)
        for group, found in zip(values.groups, groups):
            entry = {"metric": name, "unit": values.columns[name].unit, "without": int(empty[group.rows].sum()),
                     **_JUDGED[kind](values, column, group.rows, choices)}
            if kind == "metrics":
                entry["not_a_number"] = found["rows"] - entry["values"] - entry["without"]
            found[kind].append(entry)
    manifest, missing = campaign.manifest, campaign.missing()
    return {"campaign": str(campaign.path), "scenario": manifest.name, "plan": values.plan, "rows": len(values.cases),
            "wanted": manifest.rows, "missing_chunks": len(missing), "statuses": values.statuses,
            "confidence": choices.confidence, "share": choices.share, "share_confidence": choices.share_confidence,
            "until": manifest.vary.get("until"), "ended": manifest.ended, "groups": groups,
            "notes": _notes(values, missing, choices)}


def sensitivities(campaign: Campaign, metric: str, choices: Choices = Choices()) -> list[dict]:
    """Of each group the rank correlations of what is drawn with a metric, and of a design of Saltelli its Sobol indices.

    Raises FlightError.
    """
    values = Values(campaign, choices.pool)
    column = _numeric(values, values.checked(metric, "--sensitivity"), "--sensitivity")
    if values.pool and len(values.combinations) > 1:
        raise FlightError("--sensitivity: what combinations differ in is not drawn, so they are not put together; leave "
                          "out --pool")
    inputs, others = values.inputs()
    if not inputs:
        raise FlightError(f"--sensitivity {metric}: nothing that is drawn is a number, so there is nothing to rank")
    found = []
    for group in values.groups:
        ranked = rank_correlations({key: one[group.rows] for key, one in inputs.items()}, column[group.rows],
                                   choices.confidence)
        entry = {"group": group.label, "metric": metric, "rank_correlations": [asdict(one) for one in ranked],
                 "not_ranked": others, "sobol": None}
        if values.plan == "saltelli":
            entry["sobol"] = asdict(_indices(values, column, group, choices))
        found.append(entry)
    return found


def worst(campaign: Campaign, metric: str, count: int, smallest: bool = False, choices: Choices = Choices()) -> dict:
    """The cases with the largest (or smallest) values of a metric, by group, and the first of those that have none."""
    values = Values(campaign, choices.pool)
    column = _numeric(values, values.checked(metric, "--worst"), "--worst")
    there = np.isfinite(column)
    groups = []
    for group in values.groups:
        rows = np.flatnonzero(group.rows & there)
        rows = rows[np.lexsort((values.cases[rows], column[rows] if smallest else -column[rows]))][:count]
        empty = np.flatnonzero(group.rows & ~there)
        cases = [{"case": int(values.cases[i]), "value": float(column[i])} for i in rows]
        groups.append({"group": group.label, "cases": cases, "without": len(empty),
                       "first_without": values.cases[empty[:count]].tolist()})
    return {"metric": metric, "unit": values.columns[metric].unit, "smallest": smallest, "groups": groups}


def kind_of(values: Values, name: str) -> str:
    """rates: what is true or false; texts; else metrics, whole numbers among them: a count that was 0 or 1 is no rate."""
    kind = values.columns[name].type
    return "rates" if kind == "bool" else "texts" if "string" in kind else "metrics"


def _rate(values, column, rows, choices):
    seen = column[rows]
    found = rate(int((seen == 1).sum()), len(seen), choices.confidence)
    return {**asdict(found), "rate": found.value}


def _metric(values, column, rows, choices):
    where = np.flatnonzero(rows & np.isfinite(column))
    seen, cases = column[where], values.cases[where]
    ordered = np.sort(seen)
    found = {"values": len(seen), "percentiles": [
        asdict(percentile(ordered, share, choices.confidence)) for share in SHARES]}
    for side, upper in (("upper", True), ("lower", False)):
        limit = bound(ordered, choices.share, choices.share_confidence, upper)
        found[side] = asdict(limit) | {"sentence": limit.sentence()}
    if len(seen):
        least, largest = int(seen.argmin()), int(seen.argmax())
        found |= {"mean": float(seen.mean()), "deviation": float(seen.std(ddof=1)) if len(seen) > 1 else None,
                  "least": float(seen[least]), "least_case": int(cases[least]), "largest": float(seen[largest]),
                  "largest_case": int(cases[largest])}
    return found


def _text(values, column, rows, choices):
    seen = Counter(column[i] for i in np.flatnonzero(rows) if column[i] is not None)
    return {"values": len(seen), "counts": dict(seen.most_common(MOST_TEXTS))}


_JUDGED = {"rates": _rate, "metrics": _metric, "texts": _text}


def _numeric(values, name, option):
    _, column, _ = next(values.read([name]))
    if isinstance(column, list):
        raise FlightError(f"{option} {name}: this is a text, no number")
    return column


def _indices(values, column, group, choices):
    """Sobol indices of the group's rows in the order of the draws; a row that is not there is NaN."""
    count = len(values.combinations)
    member = values.combinations.index(group.label) if count > 1 else 0
    mine = values.cases % count == member
    draws = values.cases[mine] // count
    ordered = np.full(int(draws.max()) + 1, np.nan)
    ordered[draws] = column[mine]
    return sobol_indices(ordered, ["+".join(keys) for keys in values.vary.sampler.factors], choices.confidence)


def _notes(values, missing, choices):
    notes = [DEPENDENT[values.plan]] if values.plan in DEPENDENT else []
    if missing:
        notes.append(f"{len(missing)} chunks are not there yet; flight sweep {values.campaign.path} runs them")
    if values.pool and len(values.combinations) > 1:
        notes.append(f"{len(values.combinations)} combinations are put together (--pool); they meet the same draws, so "
                     "their runs are not independent")
    if values.campaign.manifest.ended:
        notes.append(f"the stopping rule ended this campaign, so the interval of {values.vary.file.until.metric} is "
                     "the one that the rule gave; the one in the table is of a number of runs that was fixed before")
    bad = len(values.cases) - int(values.ok.sum())
    if bad:
        notes.append(f"{bad} of {len(values.cases)} runs did not end well; they are no success of any rate, and in no "
                     "percentile")
    return notes
