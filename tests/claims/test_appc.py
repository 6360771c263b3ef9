"""The claims of the Cubli paper: every row keeps its verdict, and rows stand for every figure and statement.

The rows that need many or long runs are left out here; `flight claims appc` recomputes all.
"""

import re

import pytest
import yaml

from flight_graph.claims import claims
from flight_graph.claims.claim_runs import RunEntry, run_all
from flight_graph.graphs.papers import papers

pytestmark = pytest.mark.xdist_group("claims of appc")  # the rows are computed once

LONG = {"rates_asteroid", "rates_explicit", "rates_explicit_ff", "rates_implicit", "rates_implicit_ff", "bennu45",
        "bennu_pole", "bennu_equator", "disturbances", "bss", "printed_10000", "printed_20000", "ideal_10000",
        "ideal_20000"}


@pytest.fixture(scope="session")
def rows():
    content = claims.read("appc")
    wanted = [claim.id for claim in content.claims if not claim.runs & LONG]
    return {row.claim.id: row for row in claims.judge("appc", only=wanted)}


def test_no_verdict_has_changed(rows):
    assert len(rows) > 100
    assert {name: (row.verdict, row.estimated_verdict) for name, row in rows.items() if not row.as_expected} == {}


def test_what_the_paper_claims_and_what_was_found(rows):
    """The few findings that must never flip without somebody noticing."""
    verdicts = {name: row.verdict for name, row in rows.items()}
    assert verdicts["rate-funnel"] == verdicts["jump-per-axis"] == "holds"
    assert verdicts["jump-norm"] == verdicts["contact-force"] == "does not hold"
    assert verdicts["any-eta"] == verdicts["inverted-pendulum"] == verdicts["physical-flight"] == "does not hold"
    assert verdicts["globally"] == verdicts["invertible"] == verdicts["proof-attitude-step"] == "does not hold"
    assert verdicts["lambda-overshoot"] == verdicts["adaptation-matters"] == verdicts["gravity-range"] == "depends"
    assert verdicts["ranking-effort"] == "holds"


@pytest.mark.parametrize(("row", "label", "value", "tolerance"), [
    ("gains-speed", "1 before 2", 9.072 - 7.431, 0.01), ("gains-speed", "3 before 1", 7.431 - 7.250, 0.01),
    ("bounds-overshoot", "2 above 1", 8.25 - 1.37, 0.02), ("slowed-contact", "slowed by 0.75", 0.002, 2e-3),
    ("slowed-contact", "slowed by 0.50", 0.501, 2e-3), ("ranking-effort", "PD", 3.513 / 1.242, 0.01),
    ("ranking-effort", "backstepping", 7.938 / 1.242, 0.04), ("infeasible-others", "backstepping in norm", 2.988, 0.01),
    ("infeasible-others", "PD in norm", 2.220, 0.01), ("bounds-per-axis", "hanging, case 3", 1.013, 1e-3),
    ("physical-scalar", "1 kHz", 0.978, 1e-3), ("physical-contact", "phased", -1.06, 5e-3),
    ("lambda-overshoot", "rho_u0 = 1, lambda_a 0.2 to 0.4", 36.7 - 35.5, 0.1),
    ("adaptation-matters", "60 s", 1.37, 0.01), ("adaptation-matters", "1000 s", 4.0, 0.05),
    ("no-jump-of-state", "", 2.0 * 0.01 * 0.055817, 0.01 * 2.0 * 0.01 * 0.055817),  # 2 k_a v_a(60 s)
])
def test_numbers_of_an_independent_implementation(rows, row, label, value, tolerance):
    assert rows[row].found[label] == pytest.approx(value, abs=tolerance)


def test_the_sampled_law_leaves_the_rate_funnel_as_far_as_it_should():
    """Earth, implicit, without feed-forward: 4.5 at 50 Hz, 2.5 at 100 Hz, 1.13 at 1 kHz."""
    entry = RunEntry(scenario="cubli_rates", cases=[6, 14, 26])
    found = run_all({"rates": entry}, 2)["rates"]
    assert [one["xi_u_max"] for one in found.values()] == pytest.approx([4.5, 2.5, 1.13], rel=5e-3)


def test_the_ideal_law_learns_the_disturbance():
    """v_u ends at d / k = 2 and takes the error with it; with ten times eta_u a tenth of the 10000 s does."""
    entry = RunEntry(scenario="cubli_long", set={"controller.law": "implicit", "controller.smoothing": 0.0,
                                                 "controller.eta_u": 0.05, "duration_s": 1000})
    found = run_all({"ideal": entry}, 1)["ideal"]
    assert found["adaptive_u_x"] == pytest.approx(1.911, rel=5e-3) and found["adaptive_u_x"] < 2.0
    assert found["tail_rad"] == pytest.approx(3.5e-6, rel=0.05)


def test_whose_statements_they_are():
    content = claims.read("appc")
    kinds = [claim.statement for claim in content.claims]
    assert kinds.count("paper") > 50 and kinds.count("paper") > 2 * kinds.count("ours")
    for claim in content.claims:
        assert claim.statement != "paper" or not claim.where.startswith("("), claim.id


def test_every_figure_and_section_has_a_row():
    where = " ".join(claim.where for claim in claims.read("appc").claims)
    named = set()
    for first, last in re.findall(r"(\d+)-(\d+)", where):
        named |= set(range(int(first), int(last) + 1))
    named |= {int(number) for number in re.findall(r"(?<![\d.(])(\d\d)(?![\d.)])", where)}
    assert set(range(5, 47)) <= named
    for section in ("3.1", "3.2", "4.2", "4.3", "5.1", "5.2", "5.3", "5.4"):
        assert f"section {section}" in where


def test_reasons_are_one_or_two_sentences():
    for claim in claims.read("appc").claims:
        assert 10 < len(claim.because) < 160 and claim.because.endswith("."), claim.id


def test_the_gain_scans_name_every_case():
    """A case that is added to the scan is judged."""
    from flight_graph.graphs.scenario import load
    content = claims.read("appc")
    names = {name for name, _ in load("cubli_controllers").vary.combinations}
    assert {name for name in names if name.startswith("PD") and "hang" not in name} == set(content.runs["pds"].cases)
    assert {name for name in names if name.startswith("BS") and "hang" not in name} == set(content.runs["bss"].cases)
    rates = yaml.safe_load(open(papers()["appc"]))["runs"]
    numbers = [case for key in ("explicit", "explicit_ff", "implicit", "implicit_ff")
               for case in rates[f"rates_{key}"]["cases"]]
    assert sorted(numbers) == list(range(load("cubli_rates").vary.count))


def test_the_page_counts_and_names_the_rows():
    """docs/appc.md: its table of verdicts is that of the rows, and every row that it names is there."""
    from collections import Counter
    from fnmatch import filter as matching
    from pathlib import Path
    page = (Path(__file__).parents[2] / "docs/appc.md").read_text()
    content = claims.read("appc")
    counts = Counter((claim.statement, claim.expect) for claim in content.claims)
    for kind, words in (("paper", "the paper's words, quoted"), ("implied", "implied by its words, equations or figures"),
                        ("ours", "ours")):
        found = [counts[kind, verdict] for verdict in ("holds", "does not hold", "depends")]
        assert f"| {words} ({sum(found)}) | {found[0]} | {found[1]} | {found[2]} |" in page
    assert f"| {len(content.claims)} rows |" in page
    names = {claim.id for claim in content.claims}
    rows = [cell for line in page.split("\n") if line.startswith("|") for cell in re.findall(r"`([^`]+)`", line)
            if "/" not in cell and "_" not in cell and ":" not in cell]
    assert len(rows) > 40 and [name for name in rows if not matching(names, name)] == []
