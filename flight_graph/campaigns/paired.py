"""Comparisons case by case, of runs whose draws are the same: two campaigns, or two groups of one.

What the draws do to both sides drops out of the differences (`flight_graph.statistics.pairs`). Of one campaign the groups
are combinations of fixed values: case K is combination K mod C with draw K div C, so all of them meet the same draws.
"""

from dataclasses import asdict

import numpy as np

from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.report import Choices, kind_of
from flight_graph.campaigns.values import Values
from flight_graph.errors import FlightError, unknown
from flight_graph.statistics.pairs import differences, rate_difference

MOST_PAIRS = 1000  # of groups


def compare(campaign: Campaign, other: Campaign, choices: Choices = Choices()) -> dict:
    """Case by case: ``other`` less this one, of each group; ``not_compared``: metrics that are texts, or of one alone.

    Raises FlightError where their draws are not the same.
    """
    a, b = Values(campaign, choices.pool), Values(other, choices.pool)
    _check_draws(a, b)
    cases, in_a, in_b = np.intersect1d(a.cases, b.cases, assume_unique=True, return_indices=True)
    if not len(cases):
        raise FlightError(f"--compare {other.path}: the two campaigns have no case in common")
    common = [name for name in a.metrics if name in b.metrics]
    names = [a.checked(name, "--metric") for name in choices.metrics] or common
    groups = [{"group": group.label, "pairs": int(group.rows[in_a].sum()), "rates": [], "metrics": []}
              for group in a.groups]
    apart = sorted(set(a.metrics) ^ set(b.metrics)) if not choices.metrics else []
    for (name, one, _), (_, two, _) in zip(a.read(names), b.read([b.checked(name, "--metric") for name in names])):
        kinds = {kind_of(a, name), kind_of(b, name)}
        if "texts" in kinds:
            apart.append(name)
            continue
        kind = "rates" if kinds == {"rates"} else "metrics"
        for group, found in zip(a.groups, groups):
            rows = group.rows[in_a]
            found[kind].append({"metric": name, "unit": a.columns[name].unit,
                                **_compared(kind, one[in_a][rows], two[in_b][rows], choices)})
    return {"campaign": str(campaign.path), "other": str(other.path), "only_here": len(a.cases) - len(cases),
            "only_there": len(b.cases) - len(cases), "confidence": choices.confidence, "groups": groups,
            "not_compared": apart}


def between(campaign: Campaign, word: str, choices: Choices = Choices()) -> dict:
    """Groups of one campaign, draw by draw: each less the first of its like.

    word: a key of the grid (the groups that differ in it alone; the first has its first value), or the name of a group (all
    others less that one). Raises FlightError.
    """
    values = Values(campaign)
    pairs = _pairs(values, word)
    names = [values.checked(name, "--metric") for name in choices.metrics] or values.metrics
    count = len(values.combinations)
    draws, member = np.divmod(values.cases, count)
    if values.plan == "saltelli":
        member = np.where(draws % values.vary.sampler.rows < 2, member, -1)
    rows = [np.flatnonzero(member == number) for number in range(count)]
    found, matched, alone = [], [], 0
    for first, second in pairs:
        shared, in_first, in_second = np.intersect1d(draws[rows[first]], draws[rows[second]], assume_unique=True,
                                                     return_indices=True)
        alone += len(rows[first]) + len(rows[second]) - 2 * len(shared)
        if len(shared):
            matched.append((rows[first][in_first], rows[second][in_second]))
            found.append({"group": f"{values.combinations[second]} less {values.combinations[first]}", "pairs": len(shared),
                          "first": values.combinations[first], "second": values.combinations[second], "rates": [],
                          "metrics": []})
    if not found:
        raise FlightError(f"--between {word}: no two of these groups have a draw in common yet; flight sweep "
                          f"{campaign.path} --resume runs what is missing")
    apart = []
    for name, column, _ in values.read(names):
        kind = kind_of(values, name)
        if kind == "texts":
            apart.append(name)
            continue
        for (one, two), entry in zip(matched, found):
            entry[kind].append({"metric": name, "unit": values.columns[name].unit,
                                **_compared(kind, column[one], column[two], choices)})
    return {"campaign": str(campaign.path), "between": word, "without_partner": alone, "confidence": choices.confidence,
            "groups": found, "not_compared": apart}


def _pairs(values: Values, word: str) -> list[tuple[int, int]]:
    """The numbers of the combinations that are compared, (first, second)."""
    labels = values.combinations
    if len(labels) == 1:
        raise FlightError(f"--between {word}: this campaign has one group; --compare DIR compares it with another campaign")
    if word in labels:
        pairs = [(labels.index(word), number) for number in range(len(labels)) if labels[number] != word]
    else:
        first, pairs = {}, []
        for number, (name, fixed) in enumerate(values.vary.combinations):
            if word not in fixed:
                continue
            like = first.setdefault(repr((name, {key: value for key, value in fixed.items() if key != word})), number)
            if like != number:
                pairs.append((like, number))
        if not pairs:
            keys = list(values.vary.file.grid)
            raise unknown("group, or key that groups differ in alone,", word, [*keys, *labels], "--between")
    if len(pairs) > MOST_PAIRS:
        raise FlightError(f"--between {word}: {len(pairs)} pairs of groups; allowed: {MOST_PAIRS}")
    return pairs


def _compared(kind, left, right, choices) -> dict:
    """What is said of pairs of values (n,), NaN where there is none."""
    if kind == "rates":
        return asdict(rate_difference(left == 1, right == 1, choices.confidence)) | {
            "without_a": int(np.isnan(left).sum()), "without_b": int(np.isnan(right).sum())}
    return asdict(differences(_finite(left), _finite(right), choices.confidence))


def _check_draws(a, b):
    where = f"--compare {b.campaign.path}"
    for part in ("random", "correlated", "function", "seed", "sampling"):
        if getattr(a.vary.file, part) != getattr(b.vary.file, part):
            raise FlightError(f"{where}: its draws are others (vary.{part} differs), so its cases are not those of "
                              f"{a.campaign.path}")
    if len(a.combinations) != len(b.combinations):
        raise FlightError(f"{where}: it has {len(b.combinations)} combinations, {a.campaign.path} has "
                          f"{len(a.combinations)}; cases with the same number are not the same draw")


def _finite(column):
    return np.where(np.isfinite(column), column, np.nan)
