"""The page of the lander's campaign: how long it takes, how large it is, and the picture of it in docs/reports.md.

    python benchmarks/report_page.py [--runs N] [--picture docs/images/report.png]

The picture needs a browser (chromium), the rest does not.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flight_graph.campaigns import opening
from flight_graph.campaigns.report import Choices
from flight_graph.components.foreign import agree
from flight_graph.graphs.scenario import load
from flight_graph.reports import campaign_page, page

SCENARIO = "lander_monte_carlo_perturbed"
SHOWN = {"Dispersion": 1, "Landing": 1, "Over time": 1}  # section -> how many of its figures are in the picture
SIZE = (1280, 2160)  # [px]


def main() -> None:
    """Run the campaign, write the page, print what it took, and take the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
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
        if options.picture:
            figures = {one.title: [part for part in one.parts if isinstance(part, page.Figure)] for one in sections}
            shown = [page.Section(name, figures[name][:count]) for name, count in SHOWN.items()]
            photograph(page.write(Path(folder) / "shown.html", title, subtitle, shown), options.picture)


def photograph(path: Path, picture: Path) -> None:
    """Open a page in a browser without a screen, and write what it shows."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        raise SystemExit("the picture needs a browser: apt-get install chromium brings one")
    subprocess.run([browser, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
                    f"--user-data-dir={path.parent / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND",
                    "--virtual-time-budget=30000", f"--window-size={SIZE[0]},{SIZE[1]}",
                    f"--screenshot={picture.resolve()}", f"file://{path}"], check=True, capture_output=True)
    print(picture)


if __name__ == "__main__":
    main()
