"""The page of the lander's campaign: how long it takes, how large it is, and the picture of it in docs/reports.md.

    python benchmarks/report_page.py [--runs N] [--picture docs/images/report.png]
    python benchmarks/report_page.py --campaign DIR --picture FILE --shown Dispersion:2 Landing:1 [--metric M ...] [--size W H]

The second takes a campaign that is there: the pictures of docs/campaigns.md. A picture needs a browser (chromium), the rest
does not.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flight_graph.campaigns import opening
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.report import Choices
from flight_graph.components.foreign import agree
from flight_graph.graphs.scenario import load
from flight_graph.reports import campaign_page, page

SCENARIO = "lander_monte_carlo_perturbed"
SHOWN = {"Dispersion": 1, "Landing": 1, "Over time": 1}  # section -> how many of its figures are in the picture
SIZE = (1280, 2160)  # [px]
COLOURS = 64  # of a picture, which is a third as large with so few


def main() -> None:
    """Run the campaign, write the page, print what it took, and take the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--campaign", type=Path)
    parser.add_argument("--shown", nargs="+", default=[f"{name}:{count}" for name, count in SHOWN.items()])
    parser.add_argument("--metric", nargs="+", default=[])
    parser.add_argument("--size", nargs=2, type=int, default=SIZE, help="[px]")
    options = parser.parse_args()
    wanted, choices = dict(one.split(":") for one in options.shown), Choices(metrics=tuple(options.metric))
    with tempfile.TemporaryDirectory() as folder:
        if options.campaign:
            campaign, numbers = Campaign.at(options.campaign), (0,)
        else:
            campaign, numbers = opening.run_here(load(SCENARIO), Path(folder) / "study", options.runs), (0, 100)
        rows = []
        for flights in numbers:
            began = time.process_time()
            title, subtitle, sections = campaign_page.page(campaign, choices, agree, flights)
            path = page.write(Path(folder) / "page.html", title, subtitle, sections)
            rows.append((flights, time.process_time() - began, path.stat().st_size / 1e6))
        print(f"page of {campaign.manifest.rows} runs of {campaign.manifest.name}\n\n| runs flown again | CPU [s] | size [MB] |\n|---|---|---|")
        for row in rows:
            print(f"| {row[0]} | {row[1]:.1f} | {row[2]:.2f} |")
        if options.picture:
            figures = {one.title: [part for part in one.parts if isinstance(part, page.Figure)] for one in sections}
            shown = [page.Section(name, figures[name][:int(count)]) for name, count in wanted.items()]
            photograph(page.write(Path(folder) / "shown.html", title, subtitle, shown), options.picture, options.size)


def photograph(path: Path, picture: Path, size) -> None:
    """Open a page in a browser without a screen, and write what it shows."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        raise SystemExit("the picture needs a browser: apt-get install chromium brings one")
    subprocess.run([browser, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
                    f"--user-data-dir={path.parent / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND",
                    "--virtual-time-budget=30000", f"--window-size={size[0]},{size[1]}",
                    f"--screenshot={picture.resolve()}", f"file://{path}"], check=True, capture_output=True)
    Image.open(picture).convert("RGB").quantize(COLOURS).save(picture, optimize=True)
    print(picture)


if __name__ == "__main__":
    main()
