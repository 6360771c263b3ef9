"""The models below share/ are those of the scenarios."""

from pathlib import Path

import pytest

from flight_graph.graphs.scenario import load
from flight_graph.scenes.finding import scene_of
from flight_graph.scenes.urdf import urdf

ROOT = Path(__file__).resolve().parents[2] / "urdf"
MODELS = {"cubli_ros/cubli_rover.urdf": "cubli_asteroid", "spacerobot_ros/mini_space_robot.urdf": "spacerobot_harmonic",
          "lander_ros/lander.urdf": "lander_nominal"}


@pytest.mark.parametrize("path", MODELS)
def test_installed_models_are_those_of_the_scenarios(path):
    assert (ROOT / path).read_text(encoding="utf-8") == urdf(scene_of(load(MODELS[path]))), (
        f"run: flight urdf {MODELS[path]} --out urdf/{path} (remove the old one first)")


def test_every_installed_model_is_tested():
    assert {path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.urdf")} == MODELS.keys()
