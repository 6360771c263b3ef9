"""The paper's figures: complete, drawn from runs without a display."""

import pytest

from papers.appc.figure_list import FEASIBILITY, FIGURES
from papers.appc.figures import draw


def test_every_figure_of_the_paper_is_there_once():
    assert [entry.number for entry in FIGURES] == list(range(5, 47))
    assert all(entry.look and entry.title for entry in FIGURES)


@pytest.mark.parametrize("numbers", [{17, 23}, {32, 34}, {37, 43, 44}])
def test_figures_are_drawn(tmp_path, numbers):
    steps = []
    files = draw(tmp_path / "new", lambda done, total, what: steps.append((done, total)), numbers)
    assert [file.name for file in files] == [f"fig_{number:02d}.png" for number in sorted(numbers)]
    assert all(file.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and file.stat().st_size > 10000 for file in files)
    assert steps[-1][0] == steps[-1][1] == len(steps)


def test_feasibility_shows_each_of_the_three_laws():
    shown = [list(entry.runs) for entry in FIGURES if entry.quantity == FEASIBILITY]
    assert shown == [["APPC"], ["Backstepping"], ["PD"]]
