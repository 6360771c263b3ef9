"""The drawings' own mathematics: bands, ellipses, percentiles; and that a page holds what it was given, and runs nothing."""

import csv
import io
import json
import re

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from flight_graph.campaigns.fault_table import FaultRow
from flight_graph.reports import campaign_figures, distributions, histories, page, relations

EVIL = '</script><script>document.title = "no"</script><img src=x onerror=alert(1)>'


def test_the_band_holds_the_whole_distribution():
    """Of uniform values, whose distribution function is known: at least 95 % of 2000 bands hold all of it."""
    draws = np.sort(np.random.default_rng(5).random((2000, 40)), axis=1)
    ranks = np.arange(40)
    apart = np.maximum((ranks + 1) / 40.0 - draws, draws - ranks / 40.0).max(axis=1)
    assert 0.94 < (apart <= distributions.band(40, 0.95)).mean()
    x, share, low, high = distributions.distribution(draws[0], 0.95)
    assert (x == draws[0]).all() and share[-1] == 1.0 and (low <= share).all() and (share <= high).all()
    assert len(distributions.distribution(np.arange(10_000.0), 0.95)[0]) <= distributions.MOST_STEPS


@pytest.mark.parametrize("share", relations.SHARES)
def test_an_ellipse_holds_the_next_point_as_often_as_it_says(share):
    random = np.random.default_rng(7)
    skew = np.array([[2.0, 0.0], [1.5, 0.3]])
    held = 0
    for _ in range(1500):
        *points, new = random.standard_normal((13, 2)) @ skew.T + [3.0, -1.0]
        held += Outline(relations.ellipse(np.array(points), share)).contains_point(new)
    assert abs(held / 1500 - share) < 3.5 * np.sqrt(share * (1.0 - share) / 1500) + 0.003


def test_landings_say_how_many_points_their_ellipses_hold():
    points = np.random.default_rng(1).standard_normal((400, 2)) @ np.diag([3.0, 1.0])
    figure = relations.landing("Landing", points, np.arange(400), points[:, 0] < 4.0, ("x [m]", "y [m]"), lambda x, y: x + y)
    assert abs(relations.share_inside(points, 0.5) - 0.5) < 0.08 and "in that of 99 %" in figure.text
    assert figure.columns["x [m]"] == points[:, 0].tolist()
    assert [trace.type for trace in figure.drawing.data].count("contour") == 1
    on_a_line = relations.landing("Landing", np.outer(np.arange(9.0), [1.0, 2.0]), np.arange(9), np.full(9, True), ("x", "y"))
    assert "the points lie on a line" in on_a_line.text


def test_histograms_count_every_value_of_any_kind_of_column():
    random = np.random.default_rng(2)
    for values in (random.normal(size=500), np.zeros(7), np.full(3, 1e9), random.integers(0, 3, 90).astype(float),
                   np.append(random.normal(size=99), 1e8), np.zeros(0)):
        figure = distributions.dispersion("m", "m [m]", {"all": values}, 0.95)
        assert sum(figure.columns["runs"]) == len(values) and len(figure.columns["runs"]) <= distributions.MOST_BINS


@pytest.mark.parametrize("step, offset", [(0.1, 0.0), (0.02, 17.3), (1.0, -4.0), (0.01, 1.7e9)])
def test_bins_hold_equally_many_points_of_the_grid_that_values_lie_on(step, offset):
    """Once every point of a grid: a flat histogram, whatever number of points there is."""
    for points in (3, 61, 97, 260, 1009):
        edges = distributions.bins(offset + step * np.arange(points))
        counts = np.histogram(offset + step * np.arange(points), edges)[0]
        assert len(counts) <= distributions.MOST_BINS and counts.sum() == points
        assert (counts[:-1] == counts[0]).all() and counts[-1] <= counts[0], (points, counts)
    continuous = np.random.default_rng(5).normal(size=400)
    assert distributions.bins(continuous)[[0, -1]].tolist() == [continuous.min(), continuous.max()]


def test_a_funnel_is_the_percentiles_of_the_runs_that_fly():
    t, values = np.arange(5.0), np.arange(505.0).reshape(101, 5)
    values[50:, 3] = np.nan
    values[:, 4] = np.nan
    columns = histories.funnel("f", "m", t, values).columns
    assert columns["t [s]"] == [0.0, 1.0, 2.0, 3.0] and columns["runs"] == [101, 101, 101, 50]
    assert columns["5 %"][0] == np.percentile(values[:, 0], 5) and columns["median"][3] == np.median(values[:50, 3])


def test_faults_as_shares_of_their_runs():
    rows = [FaultRow("gyro stuck", 10, 10, 8, 6, 1, 0), FaultRow(EVIL, 4, 0, 0, 0, 0, 1)]
    rows[0].by.update({"watch": 8})
    figure, table = campaign_figures.faults(rows)
    assert figure.columns["watch"] == [0.8, 0.0] and figure.columns["missed"] == [0.2, 0.0]
    assert figure.columns["false alarm"] == [0.0, 0.25] and len(table.rows) == 2


def test_a_page_holds_its_data_and_nothing_of_a_stranger_s_text_runs():
    names = {"plain, with a comma": np.array([1.5, np.nan, 3.0]), EVIL: np.array([1.0, 2.0, np.inf])}
    figure = histories.lines(EVIL, EVIL, np.arange(3.0), names, EVIL)
    text = page.rendered(EVIL, EVIL, [page.Section(EVIL, [figure, page.Table(EVIL, [EVIL], [[EVIL]], EVIL), EVIL])])
    assert len(re.findall("<script", text)) == 2 + 3 and "<img" not in text and "NaN" not in text.split('id="template"')[0]
    stored = json.loads(re.search(r'id="data1">(.*?)</script>', text)[1])
    assert stored["title"] == EVIL and stored["columns"]["plain, with a comma"] == [1.5, None, 3.0]
    assert stored["columns"][EVIL] == [1.0, 2.0, None]
    read = list(csv.reader(io.StringIO(page.as_csv(stored["columns"]))))
    assert read == [["t [s]", "plain, with a comma", EVIL], ["0.0", "1.5", "1.0"], ["1.0", "", "2.0"], ["2.0", "3.0", ""]]
    assert "Content-Security-Policy" in text and "default-src 'none'" in text
    figure.columns["short"] = [1.0]
    with pytest.raises(ValueError, match="several lengths"):
        page.rendered("t", "s", [page.Section("s", [figure])])
