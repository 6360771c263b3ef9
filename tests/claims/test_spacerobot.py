"""The claims of the space robot's paper: every row keeps its verdict, and rows stand for every equation and figure."""

import re
from pathlib import Path

import pytest

from flight_graph.claims import claims, claims_file

pytestmark = pytest.mark.xdist_group("claims of spacerobot")  # the rows are computed once


@pytest.fixture(scope="session")
def rows():
    return {row.claim.id: row for row in claims.judge("spacerobot")}


def test_no_verdict_has_changed(rows):
    assert len(rows) >= 80
    assert {name: row.verdict for name, row in rows.items() if not row.as_expected} == {}


def test_what_the_paper_claims_and_what_was_found(rows):
    """The few findings that must never flip without somebody noticing."""
    verdicts = {name: row.verdict for name, row in rows.items()}
    assert verdicts["fig8-converges"] == verdicts["fig13-rls"] == verdicts["fig12-estimates"] == "holds"
    assert verdicts["fig9-diverges"] == verdicts["fig10-speed"] == verdicts["fig10-overshoot"] == "does not hold"
    assert verdicts["fig9-variance"] == verdicts["fig12-unexcited-rls"] == verdicts["lyapunov-5-10"] == "depends"
    assert verdicts["table2-cost"] == verdicts["rank"] == "holds"


@pytest.mark.parametrize(("row", "label", "value", "tolerance"), [
    ("seven-rows", "", 0.00650 / 0.00260, 0.02), ("accuracy-impact", "harmonics, rms", 0.00712 / 0.00260, 0.02),
    ("fig9-slow", "seed 3", 5.94 / 5.66, 2e-3), ("fig10-influence", "", 10.90 / 4.42, 2e-3),
    ("fig11-lyapunov", "from rest", 0.01095 / 0.00260, 0.02), ("fig13-lyapunov", "", 0.0976 / 0.0362, 0.02),
    ("fig13-small", "from rest, K_D / 4", 0.0362 / 0.0095, 0.03), ("fig13-rls", "", 1.0, 0.01),
    ("fig9-variance", "seed 103, eta 22 %", 0.320, 2e-3), ("fig9-variance", "seed 104, eta 28 %", 0.466, 2e-3),
    ("fig12-unexcited-rls", "Iyy, from the harmonics' velocity, seven rows, G0 uniform", 1.0258 / 1.0280, 2e-4),
    ("fig12-unexcited-rls", "Izz, from the harmonics' velocity, seven rows, G0 uniform", 1.0068 / 1.0073, 2e-4),
    ("lyapunov-5-10", "5 %, from rest", 0.0132 / 0.0089, 0.01), ("control-period", "K_D / 10", 0.209, 1e-3),
])
def test_numbers_of_an_independent_implementation(rows, row, label, value, tolerance):
    assert rows[row].found[label] == pytest.approx(value, abs=tolerance)


def test_every_equation_figure_and_section_has_a_row():
    where = " ".join(claim.where for claim in claims_file.read("spacerobot").claims)
    named = set()
    for first, last in re.findall(r"\((\d+)\)-\((\d+)\)", where):
        named |= set(range(int(first), int(last) + 1))
    named |= {int(number) for number in re.findall(r"\((\d+)\)", where)}
    without = {31}  # the law that (34) judges
    assert set(range(1, 47)) - without <= named
    assert {f"A{k}" for k in range(1, 12)} <= set(re.findall(r"\((A\d+)\)", where))
    for place in (*(f"Fig. {number}" for number in range(8, 14)), "Table 2", "section 4.1", "section 4.2"):
        assert place in where


def test_the_page_counts_the_rows(rows):
    page = (Path(__file__).parents[2] / "docs/spacerobot.md").read_text()
    verdicts = ("holds", "does not hold", "depends")
    for statement, words in (("paper", "of the paper"), ("implied", "implied"), ("ours", "ours")):
        found = [row.verdict for row in rows.values() if row.claim.statement == statement]
        assert f"| {words} | " + " | ".join(str(found.count(one)) for one in verdicts) + " |" in page
    assert f"has {len(rows)} rows" in page


def test_reasons_are_one_or_two_sentences():
    for claim in claims_file.read("spacerobot").claims:
        assert 10 < len(claim.because) < 160 and claim.because.endswith("."), claim.id
