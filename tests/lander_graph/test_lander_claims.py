"""The claims table of the landing, without its batches of 200 runs; and that its figures can be drawn."""

from flight_graph.claims import claims
from papers.lander import figures

BATCHES = {"draws", "noisy", "noisy_low", "draws_free", "draws_pd"}


def test_verdicts_are_as_found():
    content = claims.read("lander")
    single = [claim.id for claim in content.claims
              if not any(run in BATCHES for text in claim.expressions.values() for run in claims.names(text))]
    assert len(single) > 20
    rows = claims.judge("lander", only=single)
    changed = [f"{row.claim.id}: {row.verdict}, {row.found}" for row in rows if not row.as_expected]
    assert not changed, changed


def test_overview_is_drawn(fly, tmp_path):
    for name in ("lander_nominal", "lander_pd"):
        _, recording = fly(name)
        drawn = figures.overview(recording.scenario, recording, tmp_path / f"{name}.png")
        assert drawn.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and drawn.stat().st_size > 50_000


def test_dispersion_is_drawn(fly, tmp_path):
    rows = [fly("lander_nominal")[0], fly("lander_gravity_error")[0]]
    assert figures.scatter({"two": rows}, tmp_path / "scatter.png").stat().st_size > 10_000
