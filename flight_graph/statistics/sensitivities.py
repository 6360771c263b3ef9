"""What of the draws decides a metric: Sobol indices of a design of Saltelli, and rank correlations of any campaign.

Sobol indices: share of a metric's variance that a factor explains alone (first order), and with all others (total); A.
Saltelli and others, Computer Physics Communications 181 (2010) 259-270, table 2 (b) and (f). Intervals: delta method, of
independent base samples; those of a Sobol sequence lie closer than they say.

Rank correlations: C. Spearman (1904), and partial ones, which take out what the other inputs explain linearly in ranks
(R. L. Iman and W. J. Conover, 1982). Intervals: Fisher's transformation, with the variance of what each row adds to the
correlation (its influence, A. W. van der Vaart, Asymptotic Statistics, chapter 20): no distribution is assumed.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import special, stats

LEAST_SAMPLES = 10  # [-] rows of an interval, beside the inputs that are taken out
MOST_INPUTS = 60  # [-] of partial correlations
MOST_ROWS = 20_000  # [-] of which the variance is taken
WORST_CONDITION = 1e10  # [-] of the correlations: beyond it inputs follow from each other


@dataclass(frozen=True)
class Index:
    """First order and total index of a factor, each with the ends of its interval."""

    factor: str
    first: float
    first_low: float
    first_high: float
    total: float
    total_low: float
    total_high: float


@dataclass(frozen=True)
class Indices:
    """samples: base samples used; left_out: those with a missing or infinite value or a missing row.

    factors: [] where the metric does not vary, or nothing is left.
    """

    samples: int
    left_out: int
    confidence: float
    factors: tuple[Index, ...]


@dataclass(frozen=True)
class Correlation:
    """Rank correlation of an input with a metric. partial: without what the other inputs explain; None: too few rows
    or too many inputs, or one of the two does not vary."""

    key: str
    value: float | None
    low: float | None
    high: float | None
    partial: float | None
    partial_low: float | None
    partial_high: float | None
    rows: int
    left_out: int


def sobol_indices(values, factors: list[str], confidence: float = 0.95) -> Indices:
    """Indices from the metric's values (n,) in the order of the draws 0 to n - 1; NaN: the draw has none.

    factors: names, in the sampler's order; a base sample is len(factors) + 2 draws: A, B, A with each factor from B.
    """
    width = len(factors) + 2
    values = np.asarray(values, dtype=float)
    begun = -(-len(values) // width)
    rows = values[:len(values) // width * width].reshape(-1, width)
    kept = rows[np.isfinite(rows).all(axis=1)]
    n, left_out = len(kept), begun - int(np.isfinite(rows).all(axis=1).sum())
    if n < 2 or np.ptp(kept[:, :2]) == 0.0:
        return Indices(n, left_out, confidence, ())
    a, b, ab = kept[:, :1] - kept[:, :2].mean(), kept[:, 1:2] - kept[:, :2].mean(), kept[:, 2:] - kept[:, :2].mean()
    squares = 0.5 * (a * a + b * b)
    variance, z = squares.mean(), float(special.ndtri(0.5 + 0.5 * confidence))
    ends = []
    for parts in (b * (ab - a), 0.5 * (a - ab) ** 2):
        share = parts.mean(axis=0) / variance
        reach = z * np.std((parts - share * squares) / variance, axis=0, ddof=1) / math.sqrt(n)
        ends.append(np.stack([share, share - reach, share + reach]))
    found = [Index(name, *map(float, (*ends[0][:, j], *ends[1][:, j]))) for j, name in enumerate(factors)]
    return Indices(n, left_out, confidence, tuple(found))


def rank_correlations(inputs: dict, values, confidence: float = 0.95) -> list[Correlation]:
    """Spearman's and partial rank correlation of each input (n,) with the metric's values (n,).

    Rows in which any of them is NaN are left out, and counted.
    """
    names, values = list(inputs), np.asarray(values, dtype=float)
    table = np.column_stack([*(np.asarray(inputs[name], dtype=float) for name in names), values])
    kept = table[~np.isnan(table).any(axis=1)]
    n, left_out = len(kept), len(table) - len(kept)
    ranked = stats.rankdata(kept, axis=0) if n else kept
    varies = np.array([np.ptp(column) > 0.0 if n else False for column in ranked.T])
    used = [j for j in range(len(names)) if varies[j]]
    if n < 3 or not varies[-1] or not used:
        return [Correlation(name, *[None] * 6, n, left_out) for name in names]
    matrix = np.corrcoef(ranked[:, [*used, -1]].T)
    whole = n >= LEAST_SAMPLES + len(used) and len(used) <= MOST_INPUTS and np.linalg.cond(matrix) < WORST_CONDITION
    partial, slopes = _partial(matrix) if whole else (None, [])
    own, joint = _influences(ranked[:MOST_ROWS, [*used, -1]] / n, slopes)
    found = []
    for j, name in enumerate(names):
        if j not in used:
            found.append(Correlation(name, *[None] * 6, n, left_out))
            continue
        i = used.index(j)
        ends = _ends(matrix[-1, i], own[i], n, confidence)
        rest = (None, None, None) if partial is None else (
            float(partial[i]), *_ends(partial[i], joint[i], n - len(used) + 1, confidence))
        found.append(Correlation(name, float(matrix[-1, i]), *ends, *rest, n, left_out))
    return found


def _partial(matrix):
    """Partial correlations of the last variable with each other one, and the slopes of each over all correlations."""
    inverse = np.linalg.inv(matrix)
    last, found, slopes = inverse[-1], [], []
    for j, row in enumerate(inverse[:-1]):
        scale = math.sqrt(row[j] * last[-1])
        found.append(-last[j] / scale)
        slopes.append(np.outer(row, last) / scale + 0.5 * found[-1] * (np.outer(row, row) / row[j]
                                                                      + np.outer(last, last) / last[-1]))
    return np.array(found), slopes


def _influences(shares, slopes):
    """Standard deviation of what a row adds to the rank correlation of each variable with the last one, and to each
    partial correlation. shares: ranks of some rows among all, as parts of 1."""
    u = shares - shares.mean(axis=0)
    order = np.argsort(u, axis=0, kind="stable")
    own, joint = [], np.zeros((len(slopes), len(u)))
    last = u.shape[1] - 1
    for b in range(0 if slopes else last, last + 1):
        for a in range(b):
            part = u[:, a] * u[:, b] + _above(u, order, a, b) + _above(u, order, b, a)
            part = 12.0 * (part - part.mean())
            if b == last:
                own.append(float(part.std()))
            for row, slope in zip(joint, slopes):
                row += (slope[a, b] + slope[b, a]) * part
    return own, joint.std(axis=1)


def _above(u, order, a, b):
    """Of each row i the mean of u_b over the rows j with u_aj >= u_ai, of all."""
    found = np.empty(len(u))
    found[order[:, a]] = np.cumsum(u[order[::-1, a], b])[::-1] / len(u)
    return found


def _ends(value, deviation, n, confidence):
    """Fisher's z, whose derivative is 1 / (1 - value^2)."""
    if n < LEAST_SAMPLES or abs(value) >= 1.0 - 1e-12:
        return None, None
    reach = float(special.ndtri(0.5 + 0.5 * confidence)) * deviation / (1.0 - value * value) / math.sqrt(n - 3)
    return math.tanh(math.atanh(value) - reach), math.tanh(math.atanh(value) + reach)
