"""Quotations are word for word: they stand in the papers' texts, where those are there (PAPER_TEXTS, a folder of them)."""

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flight_graph.claims import claims_file, quotations
from flight_graph.cli.app import app
from flight_graph.graphs.papers import papers

TEXTS = os.environ.get("PAPER_TEXTS")


@pytest.mark.skipif(TEXTS is None, reason="the texts of the papers are not ours to ship; PAPER_TEXTS names a folder of them")
@pytest.mark.parametrize("paper", sorted(papers()))
def test_the_quotations_stand_in_the_text(paper):
    """Each in the one text of the folder that has most of them."""
    rows = claims_file.read(paper).claims
    assert any(claim.quotes for claim in rows)
    found = [quotations.missing(rows, path.read_text()) for path in Path(TEXTS).glob("*.txt")]
    assert min(found, key=len) == {}


def test_a_quotation_is_found_whatever_the_extraction_did_to_it():
    text = "The *control*\n per-\niod <span id='a'>is</span> [0.25\u00a0s](http://x.org/a), eﬃcient \u2013 and\nstable."
    assert quotations.squeezed("the control period is 0.25 s, efficient - and stable") in quotations.squeezed(text)
    assert quotations.squeezed("the control period was") not in quotations.squeezed(text)


def test_words_between_inequalities_are_no_tag():
    assert quotations.squeezed("- ρ <  e < ρ . They hold, l < 0 and ρ > 0") == quotations.squeezed("ρ e ρ they hold l 0 and ρ 0")


def test_the_command_says_which_are_missing(tmp_path):
    text = tmp_path / "paper.txt"
    rows = claims_file.read("appc").claims
    text.write_text(" ".join(quote for claim in rows for quote in claim.quotes))
    done = CliRunner().invoke(app, ["claims", "appc", "--text", str(text)])
    assert done.exit_code == 0 and "quotations of appc stand in" in done.output
    text.write_text("nothing of it")
    done = CliRunner().invoke(app, ["claims", "appc", "--text", str(text), "--json"])
    assert done.exit_code == 1 and '"missing": {"' in done.output
