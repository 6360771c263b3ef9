"""Subset simulation against probabilities in closed form."""

import math

import numpy as np
import pytest
from scipy import stats

from flight_graph.statistics.subset_simulation import Stuck, subset_simulation


@pytest.mark.parametrize(("name", "g", "dimensions", "threshold", "truth"), [
    ("linear, 100 dimensions", lambda z: z.sum(axis=1) / 10.0, 100, 4.7534, stats.norm.sf(4.7534)),
    ("distance, 10 dimensions", lambda z: (z * z).sum(axis=1), 10, 40.0, stats.chi2.sf(40.0, 10)),
    ("two sides", lambda z: abs(z[:, 0]), 3, 4.0, 2.0 * stats.norm.sf(4.0)),
    ("not rare", lambda z: z[:, 1], 2, 0.5, stats.norm.sf(0.5)),
])
def test_known_probabilities(name, g, dimensions, threshold, truth):
    found = [subset_simulation(g, dimensions, threshold, 1000, seed=seed) for seed in range(20)]
    mean = np.mean([one.probability for one in found])
    scatter = np.std([one.probability for one in found], ddof=1)
    assert abs(mean - truth) <= 3.5 * scatter / math.sqrt(20), name
    said = np.mean([one.variation for one in found])
    assert scatter / truth == pytest.approx(said, rel=0.6), "the coefficient of variation says how it scatters"
    assert sum(one.low <= truth <= one.high for one in found) >= 16
    assert all((g(one.samples) >= threshold).all() and len(one.samples) == len(one.values) for one in found)
    again = subset_simulation(g, dimensions, threshold, 1000, seed=3)
    assert again.probability == found[3].probability and again.runs == found[3].runs <= 1000 * len(again.levels)


def test_what_gives_no_number_counts_as_the_event():
    def sometimes(z):
        return np.where(z[:, 0] > 2.0, np.nan, z[:, 1])
    found = subset_simulation(sometimes, 2, 1e6, 2000, seed=1)
    assert found.missing > 0 and found.probability == pytest.approx(stats.norm.sf(2.0), rel=0.5)


def test_what_it_refuses_and_where_it_gives_up():
    with pytest.raises(Stuck, match="a metric of few values"):
        subset_simulation(lambda z: (z[:, 0] > 0.0).astype(float), 1, 2.0, 500)
    far = subset_simulation(lambda z: z[:, 0], 1, 50.0, 500, most_levels=3)
    assert far.bound and far.low == 0.0 and far.probability == pytest.approx(1e-3, rel=0.2)
    for wrong, words in (({"dimensions": 0}, "nothing to draw"), ({"runs": 5}, "5 runs a level"),
                         ({"threshold": math.nan}, "a finite number"), ({"share": 0.7}, "a share up to 0.5")):
        given = {"dimensions": 2, "threshold": 3.0, **wrong}
        with pytest.raises(ValueError, match=words):
            subset_simulation(lambda z: z[:, 0], **given)
