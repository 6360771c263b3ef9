"""The figures of the papers, each beside the sentences that are judged on it and their verdicts, as a page of the handbook.

The verdicts are those of the claims files, which `flight claims` recomputes and its tests hold: the page cannot say others.
The figures and the numbers that they have in a paper are listed by its ``figures`` module (GALLERY).
"""

import re
from dataclasses import dataclass

from flight_graph.claims.claims import load_figures
from flight_graph.claims.claims_file import SAID, Claim, read
from flight_graph.errors import unknown
from flight_graph.graphs.papers import papers

FOLDER = "images/gallery"  # below docs/
MARKS = {"holds": "**holds**", "does not hold": "**does not hold**", "depends": "**depends**"}
MOST_IN_A_ROW = 3
_FIGURES = re.compile(r"\b(?:captions of )?Figs?\. ((?:\d+(?:-\d+)?(?:, (?=\d+(?:-\d+)?(?:[,;)\s]|$)))?)+)")
_NOTE = "<!-- Written by `python benchmarks/gallery.py`; do not edit. -->"


@dataclass(frozen=True)
class Shown:
    """A picture: its file, caption, and the claims that are judged on it."""

    file: str
    caption: str
    claims: tuple[Claim, ...]


def figure_numbers(where: str) -> set[int]:
    """The numbers of the figures that a claim's ``where`` names: "Figs. 5-7, 17" are 5, 6, 7, 17."""
    found = set()
    for block in _FIGURES.findall(where):
        for part in block.replace(" ", "").strip(",").split(","):
            first, _, last = part.partition("-")
            found |= set(range(int(first), int(last or first) + 1))
    return found


def shown(paper: str) -> list[Shown]:
    """The pictures of a paper with their claims. Raises FlightError where a picture names a claim that there is not."""
    claims = {claim.id: claim for claim in read(paper).claims}
    found = []
    for file, caption, numbers, ids in load_figures(paper).GALLERY:
        if odd := [name for name in ids if name not in claims]:
            raise unknown("claim", odd[0], claims, f"{paper}: {file}")
        mine = [claim for claim in claims.values() if claim.id in ids or figure_numbers(claim.where) & set(numbers)]
        found.append(Shown(file, caption, tuple(mine)))
    return found


def page() -> str:
    """The page as Markdown."""
    lines = [_NOTE, "# Gallery: the papers' figures, and what is judged on them", "",
             "Every figure is drawn from runs made here (`flight claims PAPER --figures FOLDER`; for this page "
             "`python benchmarks/gallery.py`). Beside it stand the rows of `flight claims PAPER` that are judged on it: "
             "whose sentence it is, the sentence, and the verdict of the recomputed runs."]
    for paper in papers():
        content = read(paper)
        lines += ["", f"## {_cell(content.title)}", "", f"{_cell(content.source)}: `flight claims {paper}`."]
        for block in _blocks(shown(paper)):
            lines += ["", *_pictures(block), "", *_table(block[0].claims)]
    return "\n".join(lines) + "\n"


def _blocks(pictures: list[Shown]) -> list[list[Shown]]:
    """Neighbours with the same claims together, as many as stand in a row."""
    blocks = []
    for picture in pictures:
        if blocks and blocks[-1][0].claims == picture.claims and len(blocks[-1]) < MOST_IN_A_ROW:
            blocks[-1].append(picture)
        else:
            blocks.append([picture])
    return blocks


def _pictures(block):
    width = "" if len(block) > 1 else ' width="620"'
    yield "| " + " | ".join(f'<img src="{FOLDER}/{one.file}" alt="{_cell(one.caption)}"{width}>' for one in block) + " |"
    yield "|" + "---|" * len(block)
    yield "| " + " | ".join(_cell(one.caption) for one in block) + " |"


def _table(claims):
    if not claims:
        yield "No row of the claims is about it alone."
        return
    yield "| row | whose | what is judged | verdict | reason |"
    yield "|---|---|---|---|---|"
    for claim in claims:
        quotes = "".join(f'<br>"{_cell(quote)}"' for quote in claim.quotes)
        verdict = MARKS[claim.expect] + (f"; with estimated state: {claim.estimated_expect or claim.expect}"
                                         if claim.estimated else "")
        yield (f"| `{claim.id}` | {SAID[claim.statement]} | {_cell(claim.says)}{quotes} | {verdict} | "
               f"{_cell(claim.because)} |")


def _cell(text) -> str:
    return str(text).replace("|", "\\|").replace("\n", " ").replace('"', "&quot;").strip()
