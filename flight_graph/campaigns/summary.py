"""What a campaign's table says at a glance: of each number its ends and its middle, how often each word and truth value
comes, and in how many runs there is none.

The columns are read a few at a time, so the memory does not grow with the number of metrics.
"""

from collections import Counter

import numpy as np
import pyarrow
import pyarrow.compute

from flight_graph.campaigns.folder import Campaign

COLUMN_BYTES = 64 << 20  # [bytes] of numbers that are held at a time
MOST_WORDS = 20  # that are counted
FAILURES = 1000  # that are given by name
_WORDS = {True: "yes", False: "no"}


def summary(campaign: Campaign) -> dict[str, dict]:
    """Metric -> least, median and largest value, the cases of the ends; of words, and of yes and no, ``counts``;
    ``missing`` (runs that ended well and have none) and ``not_a_number`` (NaN or infinity). Runs that did not end well are
    counted nowhere here.
    """
    metrics = [column for column in campaign.columns() if column.kind == "metric"]
    at_once = max(1, COLUMN_BYTES // (8 * max(1, campaign.manifest.rows)))
    found = {}
    for first in range(0, len(metrics), at_once):
        found |= _of(campaign, metrics[first:first + at_once])
    return found


def _of(campaign, metrics):
    values, cases, missing = {column.name: [] for column in metrics}, [], dict.fromkeys((c.name for c in metrics), 0)
    counts = {column.name: Counter() for column in metrics if column.type in ("bool", "string")}
    for batch in campaign.batches(["case", "status", *values]):
        good = pyarrow.compute.equal(batch.column("status"), "ok")
        batch = batch.filter(good)
        cases.append(batch.column("case").to_numpy())
        for name in values:
            one = batch.column(name)
            missing[name] += one.null_count
            if name in counts:
                for found in pyarrow.compute.value_counts(one.drop_null()).to_pylist():
                    counts[name][_WORDS.get(found["values"], found["values"])] += found["counts"]
            elif not pyarrow.types.is_null(one.type):
                values[name].append(one.cast(pyarrow.float64(), safe=False).to_numpy().astype(float))
    numbers = np.concatenate(cases) if cases else np.zeros(0, int)
    return {name: {"counts": dict(counts[name].most_common(MOST_WORDS)), "missing": missing[name], "not_a_number": 0}
            if name in counts else _judged(values[name], numbers, missing[name]) for name in values}


def _judged(parts, cases, missing):
    column = np.concatenate(parts) if parts else np.zeros(0)
    finite = np.isfinite(column)
    found = {"missing": missing, "not_a_number": int(len(column) - finite.sum() - missing) if parts else 0}
    if not finite.any():
        return found
    column, cases = column[finite], cases[finite]
    least, largest = int(column.argmin()), int(column.argmax())
    return {"least": float(column[least]), "least_case": int(cases[least]), "median": float(np.median(column)),
            "largest": float(column[largest]), "largest_case": int(cases[largest]), **found}


def ends(campaign: Campaign) -> tuple[dict[str, int], list[dict]]:
    """How many runs ended how, and the first of those that did not end well: case, status, sentence."""
    counted, failed = {}, []
    for batch in campaign.batches(["case", "status", "sentence"]):
        for one in pyarrow.compute.value_counts(batch.column("status")).to_pylist():
            counted[one["values"]] = counted.get(one["values"], 0) + one["counts"]
        bad = batch.filter(pyarrow.compute.not_equal(batch.column("status"), "ok"))
        failed += bad.slice(0, max(0, FAILURES - len(failed))).to_pylist()
    return counted, failed
