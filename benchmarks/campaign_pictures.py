"""The pictures of docs/campaigns.md, from the figures of a campaign's report. Needs a browser (chromium).

    flight sweep examples/campaigns/lander_landings.yaml --workers 1 --out landings           # CPU: half an hour
    flight sweep examples/campaigns/rover_first_seconds.yaml --workers 1 --out seconds --chunk-size 10000
    python benchmarks/campaign_pictures.py landings docs/images/landings.png --metric lateral_m \\
        --shown Dispersion:1 Landing:1
    python benchmarks/campaign_pictures.py seconds docs/images/first_seconds.png --metric normal_force_least \\
        ground_lost_s --shown Dispersion:2
"""

import argparse
import sys
import tempfile
from pathlib import Path

from PIL import Image

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parent)]

from report_page import photograph

from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.report import Choices
from flight_graph.components.foreign import agree
from flight_graph.reports import campaign_page, page

COLOURS = 64  # of a picture, which is a third as large with so few


def main() -> None:
    """Make the page of some figures of a campaign, and take its picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("campaign", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--shown", nargs="+", default=["Dispersion:1"], help="section:how many of its figures")
    parser.add_argument("--metric", nargs="+", default=[])
    parser.add_argument("--size", nargs=2, type=int, default=(1000, 1330), help="[px]")
    options = parser.parse_args()
    title, subtitle, sections = campaign_page.page(
        Campaign.at(options.campaign), Choices(metrics=tuple(options.metric)), agree, flights=0)
    figures = {one.title: [part for part in one.parts if isinstance(part, page.Figure)] for one in sections}
    shown = [page.Section(name, figures[name][:int(count)]) for name, _, count in (
        one.partition(":") for one in options.shown)]
    with tempfile.TemporaryDirectory() as folder:
        photograph(page.write(Path(folder) / "shown.html", title, subtitle, shown), options.picture, tuple(options.size))
    Image.open(options.picture).convert("RGB").quantize(COLOURS).save(options.picture, optimize=True)


if __name__ == "__main__":
    main()
