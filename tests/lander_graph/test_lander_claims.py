"""The claims table of the landing, without its batches of 200 runs; its rows by hand; and that its figures can be drawn."""

import math
from collections import Counter
from pathlib import Path

import pytest

from flight_graph.claims import claims
from flight_graph.claims.claims_file import read
from flight_graph.graphs.scenario import load
from papers.lander import figures

BATCHES = {"draws", "noisy", "noisy_low", "draws_free", "draws_pd"}

pytestmark = pytest.mark.xdist_group("claims of the lander")  # the rows are computed once


@pytest.fixture(scope="session")
def rows():
    single = [claim.id for claim in read("lander").claims if not claim.runs & BATCHES]
    return {row.claim.id: row for row in claims.judge("lander", only=single)}


def test_verdicts_are_as_found(rows):
    assert len(rows) > 35
    assert {name: (row.verdict, row.found) for name, row in rows.items() if not row.as_expected} == {}


def test_every_sentence_of_the_abstract_and_every_formula_has_a_row():
    content = read("lander")
    quoted = " ".join(quote for claim in content.claims for quote in claim.quotes)
    for words in ("subject to collision avoidance and line-of-sight (LOS) constraints", "touches down", "desired attitude",
                  "coupling effect", "6-DOF dynamics", "expressed as functions of the twistor", "encoded into",
                  "Lyapunov analysis", "effectiveness"):
        assert words in quoted
    where = " ".join(claim.where for claim in content.claims)
    for place in ("Appendix A (1)", "Appendix A (2)", "Appendix A (3)", "Appendix A (4)", "eq. (52)", "eq. (53)",
                  "Appendix B, V1'", "Appendix B, V2'"):
        assert place in where


def test_the_page_counts_the_rows_and_names_them():
    content, page = read("lander"), (Path(__file__).parents[2] / "docs/lander.md").read_text()
    counted = Counter(claim.statement for claim in content.claims)
    assert (f"{len(content.claims)} rows: {counted['paper']} statements of the paper (all hold), {counted['implied']} that follow "
            f"from it (5 hold), {counted['ours']} of ours.") in " ".join(page.split())
    assert {claim.expect for claim in content.claims if claim.statement == "paper"} == {"holds"}
    assert [claim.id for claim in content.claims if claim.statement == "implied" and claim.expect != "holds"] == ["eq-52"]
    missing = [claim.id for claim in content.claims if f"`{claim.id}`" not in page]
    assert set(missing) <= {"nominal-numbers", "navigation", "coriolis-baseline", "monte-carlo-perturbed",
                            "monte-carlo-low-trigger", "monte-carlo-free"}  # there as numbers


def test_reasons_are_short_sentences():
    for claim in read("lander").claims:
        assert 10 < len(claim.because) < 160 and claim.because.endswith("."), claim.id


def test_the_rate_row_is_of_first_order_in_the_sampling_period(rows):
    """The wrench is held: what is left of the balance falls with the period, to a fifth from 10 to 50 Hz."""
    found = rows["lyapunov-rate"].found
    assert found["nominal"] / found["50 Hz"] == pytest.approx(5.0, rel=0.05)


def test_the_thrusters_cannot_brake_what_the_guarantee_row_asks(rows):
    """v^2/(2 F/m) of the surplus speed, against the way that is clear; the three runs fail, the slower two land."""
    assert list(rows["guarantee"].met.values()) == [True, True, False, False, False]
    for name, clear in (("lander_nominal", 50.2), ("lander_stress_descent", 15.0)):
        limit = load(name).graph.nodes["plant"].values["force_limit"]
        speed = {"lander_nominal": 5.0, "lander_stress_descent": 1.96}[name]
        assert speed**2 / (2.0 * limit / 500.0) > clear


def test_offsets_of_a_wrong_feed_forward_by_hand(fly):
    """The spin left out: m w x (w x rho)/k_t = (0.537, 0.289, -0.356) m; gravity 10 % too strong: m dg/k_t = 0.251 m."""
    found, _ = fly("lander_nominal", plant__contact_height=-10.0, duration_s=3000, controller__site_spin=[0.0, 0.0, 0.0])
    assert found["lateral_m"] == pytest.approx(math.hypot(0.537, 0.289), abs=2e-3)
    assert found["height_m"] == pytest.approx(0.356, abs=2e-3)
    found, _ = fly("lander_gravity_error", plant__contact_height=0.1, duration_s=3000)
    assert math.hypot(found["lateral_m"], found["height_m"]) == pytest.approx(500.0 * 0.1 * 5.028428e-3, rel=5e-3)


def test_overview_is_drawn(fly, tmp_path):
    for name in ("lander_nominal", "lander_pd"):
        _, recording = fly(name)
        drawn = figures.overview(recording.scenario, recording, tmp_path / f"{name}.png")
        assert drawn.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and drawn.stat().st_size > 50_000


def test_constraints_are_drawn(fly, tmp_path):
    flown = {}
    for title in ("both terms", "PD law"):
        name, _ = figures.BESIDE[title]
        flown[title] = fly(name)[1].scenario, fly(name)[1]
    assert figures.constraints(flown, tmp_path / "constraints.png").stat().st_size > 50_000


def test_dispersion_is_drawn(fly, tmp_path):
    rows = [fly("lander_nominal")[0], fly("lander_gravity_error")[0]]
    assert figures.scatter({"two": rows}, tmp_path / "scatter.png").stat().st_size > 10_000
