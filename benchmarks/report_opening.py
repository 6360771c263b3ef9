"""How large the page of a run of 60 s is, and how fast it opens in a browser without a screen.

    python benchmarks/report_opening.py [SCENARIO] [--times 5]

Each time a new browser opens the page. Told are the times since the navigation began: when its tables can be read, when the
first figure is drawn, when the vehicle stands in space and has followed its slider; then the CPU of the page's own thread,
which other work on the machine does not lengthen. Space is drawn by WebGL with a processor in the place of a graphics card.
Needs a browser (chromium).
"""

import argparse
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flight_graph import runs
from flight_graph.components.foreign import agree
from flight_graph.graphs.scenario import load
from flight_graph.reports import bag_page, page
from tests.reports.browser import Browser

SIZE = (1280, 800)  # [px]
READABLE = "performance.getEntriesByType('navigation')[0].domInteractive"
MOVED = """openSpaces().then(() => new Promise(done => {
  const place = document.querySelector('.space'), slider = document.querySelector('figure.view input');
  const look = () => Number(place.dataset.time) > 0 ? done(performance.now()) : requestAnimationFrame(look);
  slider.value = slider.max;
  slider.dispatchEvent(new Event('input'));
  look();
}))"""


def main() -> None:
    """Fly, write the page, open it some times, print what it took."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", nargs="?", default="cubli_asteroid")
    parser.add_argument("--times", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        bag = runs.execute(load(options.scenario), out=Path(folder) / options.scenario).bag
        began = time.process_time()
        run = bag_page.read_run(bag, bag.name, agree)
        path = page.write(Path(folder) / "bag.html", *bag_page.page([run]))
        size = path.stat().st_size / 1e6
        print(f"page of {options.scenario} ({(run.bag.end_ns - run.bag.start_ns) / 1e9:g} s): {size:.2f} MB, made in "
              f"{time.process_time() - began:.1f} s of CPU")
        rows = [opened(path) for _ in range(options.times)]
    print(f"opened {options.times} times on {os.cpu_count()} cores with a load of {os.getloadavg()[0]:.1f}\n\n"
          "| | median [s] | least | most |\n|---|---|---|---|")
    for name, values in zip(("tables can be read", "first figure drawn", "the vehicle moves by its slider",
                             "CPU of the page's thread till the first figure", "till the vehicle moves"), zip(*rows)):
        print(f"| {name} | {statistics.median(values):.2f} | {min(values):.2f} | {max(values):.2f} |")


def opened(path: Path) -> tuple[float, ...]:
    """Open the page in a new browser; the times and CPU times [s] that are printed."""
    with Browser(path, SIZE) as browser:
        browser.wait("document.querySelector('[data-drawn=yes]') !== null")
        readable, drawn, own = browser.run(READABLE), browser.run("drawnAt"), browser.busy_s
        moved = browser.run(MOVED)
        return readable / 1e3, drawn / 1e3, moved / 1e3, own, browser.busy_s


if __name__ == "__main__":
    main()
