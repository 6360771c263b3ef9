"""The scene that docs/frames.md adds a mast to: found in a file of one's own, in its bag by consent alone."""

import re
from pathlib import Path

import pytest
import yaml

from flight_graph.bags.reader import read_bag
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_graph.recordings.recording import RunBag
from flight_graph.scenes.finding import scene_of, scene_of_bag
from flight_graph.scenes.urdf import urdf

PAGE = Path(__file__).resolve().parents[2] / "docs" / "frames.md"


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    """The rover with the plant of the page, in a folder of its own."""
    tmp_path = tmp_path_factory.mktemp("mast")
    code = next(block for block in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL) if "class " in block)
    (tmp_path / "mast.py").write_text(code)
    data = load("cubli_asteroid").file.model_dump(by_alias=True, exclude_none=True)
    data["components"]["plant"]["use"] = "mast.py:RoverWithMast"
    (tmp_path / "mast.yaml").write_text(yaml.safe_dump(data))
    return load(str(tmp_path / "mast.yaml"))


def test_the_page_s_mast_is_in_the_model(scenario):
    scene = scene_of(scenario)
    assert "mast" in scene.links and 'child link="mast"' in urdf(scene)
    assert scene.tree["mast"].pose.position == (0.0, 0.0, 0.1)


def test_a_bag_s_own_code_draws_with_consent_alone(scenario, tmp_path):
    RunBag(tmp_path / "bag", scenario, "compiled", "none").close({})
    bag = read_bag(tmp_path / "bag")
    with pytest.raises(FlightError, match="--trust"):
        scene_of_bag(bag)
    assert "mast" in scene_of_bag(bag, trust=True).links
