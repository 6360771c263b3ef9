"""The page of the lander's campaign: how long it takes and how large it is; and the pictures of docs/reports.md, of it and
of the page of the rover's run.

    python benchmarks/report_page.py [--runs N] [--pictures docs/images]

Pictures need a browser (chromium). How fast a page opens: benchmarks/report_opening.py.
"""

import argparse
import os
import sys
import tempfile
import time
from base64 import b64decode
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flight_graph import runs
from flight_graph.campaigns import opening
from flight_graph.campaigns.report import Choices
from flight_graph.components.foreign import agree
from flight_graph.graphs.scenario import load
from flight_graph.reports import bag_page, campaign_page, page
from tests.reports.browser import Browser

SCENARIO = "lander_monte_carlo_perturbed"
SHOWN = {"Dispersion": 1, "Landing": 1, "Over time": 1}  # section -> how many of its figures are in the picture
SIZE, BAG_SIZE = (1280, 2160), (1280, 1330)  # [px]
RUN = "cubli_asteroid"


def main() -> None:
    """Run the campaign, write the page, print what it took, and take the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    pictures = options.pictures and options.pictures.resolve()
    with tempfile.TemporaryDirectory() as folder:
        if pictures:
            _of_a_bag(Path(folder), pictures)
        campaign = opening.run_here(load(SCENARIO), Path(folder) / "study", options.runs)
        rows = []
        for flights in (0, 100):
            began = time.process_time()
            title, subtitle, sections = campaign_page.page(campaign, Choices(), agree, flights)
            path = page.write(Path(folder) / "page.html", title, subtitle, sections)
            rows.append((flights, time.process_time() - began, path.stat().st_size / 1e6))
        print(f"page of {options.runs} runs of {SCENARIO}\n\n| runs flown again | CPU [s] | size [MB] |\n|---|---|---|")
        for row in rows:
            print(f"| {row[0]} | {row[1]:.1f} | {row[2]:.2f} |")
        if pictures:
            figures = {one.title: [part for part in one.parts if isinstance(part, page.Figure)] for one in sections}
            shown = [page.Section(name, figures[name][:count]) for name, count in SHOWN.items()]
            path = page.write(Path(folder) / "shown.html", title, subtitle, shown)
            photograph(path, pictures / "report.png", SIZE)


def _of_a_bag(folder: Path, pictures: Path) -> None:
    """The picture of the page of a run of 60 s."""
    bag = runs.execute(load(RUN), out=folder / RUN).bag
    os.chdir(folder)  # the page shows the bag's path as it is given
    run = bag_page.read_run(bag.name, bag.name, agree)
    path = page.write(folder / "bag.html", *bag_page.page([run]))
    photograph(path, pictures / "bag_report.png", BAG_SIZE)


def photograph(path: Path, picture: Path, size: tuple[int, int]) -> None:
    """Open a page in a browser without a screen, and write what it shows."""
    with Browser(path, size) as browser:
        browser.wait("document.querySelector('[data-drawn=yes]') !== null")
        browser.run("window.openSpaces && openSpaces()")
        browser.run("new Promise(done => setTimeout(done, 3000))")
        picture.write_bytes(b64decode(browser.say("Page.captureScreenshot")["data"]))
    print(picture)


if __name__ == "__main__":
    main()
