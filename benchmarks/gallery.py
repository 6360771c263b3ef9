"""The pictures of the handbook, drawn from runs: docs/images/gallery, those that other pages show, and docs/gallery.md.

    python benchmarks/gallery.py [--page]

--page writes the page alone, and runs nothing.
"""

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from PIL import Image

from flight_graph.claims import gallery
from flight_graph.claims.claims import load_figures
from flight_graph.graphs.papers import papers
from flight_graph.graphs.scenario import load
from flight_graph.recordings.figure import draw_overview
from flight_graph.runs import simulate

DOCS = Path(__file__).resolve().parents[1] / "docs"
WIDTH = 620  # [px] of a picture of the gallery
DEMO = "cubli_asteroid"  # what `make demo` flies: compiled, the bag has the same messages
COPIES = {"appc": "appc_{}"}  # how other pages' pictures of a paper are called, where it is not the name of the file


def main() -> None:
    """Draw all of them and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", action="store_true")
    if not parser.parse_args().page:
        (DOCS / gallery.FOLDER).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            for paper in papers():
                _draw(paper, Path(folder) / paper)
            scenario = load(DEMO)
            path = draw_overview(scenario, simulate(scenario), Path(folder) / "demo.png")
            _small(path, DOCS / "images" / f"{DEMO}.png", None)
    (DOCS / "gallery.md").write_text(gallery.page(), encoding="utf-8", newline="\n")
    print(DOCS / "gallery.md")


def _draw(paper, folder):
    folder.mkdir()
    load_figures(paper).draw(folder, lambda done, total, what: print(f"{paper}: {done} of {total}", end="\r", flush=True))
    print()
    for one in gallery.shown(paper):
        _small(folder / one.file, DOCS / gallery.FOLDER / one.file, WIDTH)
        copy = DOCS / "images" / COPIES.get(paper, "{}").format(one.file)
        if copy.exists():
            _small(folder / one.file, copy, None)


def _small(source, target, width):
    """A picture of at most this width, in few colours."""
    with Image.open(source) as picture:
        made = picture.convert("RGB")
    if width and made.width > width:
        made = made.resize((width, round(made.height * width / made.width)), Image.Resampling.LANCZOS)
    made.quantize(64).save(target, optimize=True)


if __name__ == "__main__":
    main()
