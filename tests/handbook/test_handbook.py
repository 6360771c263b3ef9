"""The handbook holds: its reference page is current, its links lead somewhere, its example runs in both engines."""

import re
from pathlib import Path

import pytest
import yaml

from flight_graph import runs
from flight_graph.bags.diff import diff
from flight_graph.claims import gallery
from flight_graph.cli import handbook
from flight_graph.graphs.scenario import load

ROOT = Path(__file__).parents[2]


def test_the_reference_page_is_what_the_declarations_say():
    page = (ROOT / "docs/reference.md").read_text()
    assert page == handbook.reference(), "run: python -m flight_graph.cli.handbook docs/reference.md"


def test_the_gallery_says_what_the_claims_say():
    """The page is the one that is made of the claims' files, whose verdicts their own tests hold; each picture is there."""
    page = (ROOT / "docs/gallery.md").read_text()
    assert page == gallery.page(), "run: python benchmarks/gallery.py --page"
    pictures = re.findall(r'<img src="([^"]+)"', page)
    assert len(pictures) > 50 and all((ROOT / "docs" / name).is_file() for name in pictures)
    verdicts = dict(re.findall(r"^\| `([\w-]+)` \|.*\| \*\*(holds|does not hold|depends)\*\*", page, re.M))
    data = [yaml.safe_load((ROOT / f"papers/{name}/claims.yaml").read_text()) for name in ("appc", "spacerobot", "lander")]
    said = {claim["id"]: claim["expect"] for one in data for claim in one["claims"]}
    assert len(verdicts) > 60 and verdicts.items() <= said.items()
    assert gallery.figure_numbers("section 5.2, eq. (9), captions of Figs. 5-7, 17, 44, section 6") == {5, 6, 7, 17, 44}


@pytest.mark.parametrize("page", sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")]), ids=lambda path: path.name)
def test_links_lead_to_files(page):
    for target in re.findall(r"\]\(([^)#]+)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name} links to {target}, which is not there"


@pytest.mark.ros
def test_the_example_controller_gives_the_same_bag_in_both_engines(tmp_path):
    scenario = load(str(ROOT / "examples/cubli_sliding.yaml"), {"duration_s": 5})
    compiled = runs.execute(scenario, "compiled", out=tmp_path / "compiled")
    nodes = runs.execute(scenario, "ros", out=tmp_path / "ros")
    results = diff(compiled.bag, nodes.bag)
    assert results and all(result.equal for result in results), "\n".join(map(str, results))


def test_the_example_controller_settles():
    scenario = load(str(ROOT / "examples/cubli_sliding.yaml"))
    from flight_graph.graphs import metrics
    found = metrics.compute(scenario, runs.simulate(scenario))
    assert found["settling_time_s"] < 20.0  # [s] 5 / c would be 17 s for the linear sliding motion
