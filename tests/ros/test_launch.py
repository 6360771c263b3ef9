"""Launch files: their data are the scenario's, and the real launch runs them where it is installed."""

import importlib.util
from pathlib import Path

import pytest

from flight_graph.components import registry
from flight_graph.graphs.scenario import load
from flight_graph.ros.launch_description import node_table

FILES = sorted((Path(__file__).parents[2] / "launch").glob("*/*.launch.py"))


def described(path: Path) -> str:
    """The scenario that a launch file names."""
    return path.name.removesuffix(".launch.py")


@pytest.mark.parametrize("path", FILES, ids=described)
def test_the_table_of_a_launch_file_holds_every_node_of_its_scenario(path):
    assert f'describe("{described(path)}")' in path.read_text()
    scenario = load(described(path))
    rows = node_table(scenario, "lockstep", 1.0, "out")
    assert [row["name"] for row in rows] == [*scenario.graph.nodes, "recorder"]
    for row in rows:
        assert row["executable"] in registry.executables(row["package"])
        node = scenario.graph.nodes.get(row["name"])
        if node is not None:
            assert registry.component(f"{row['package']}/{row['executable']}") is node.component
            assert row["parameters"]["rate_hz"] == node.rate_hz
    assert sum(row["parameters"].get("graph.clock_master", False) for row in rows) == 1
    assert rows[-1]["parameters"]["scenario"] == scenario.name and rows[-1]["parameters"]["out"] == "out"


@pytest.mark.skipif(importlib.util.find_spec("launch_ros") is None, reason="launch_ros is not installed here")
@pytest.mark.parametrize("path", FILES, ids=described)
def test_the_real_launch_accepts_the_file(path):
    from launch import LaunchDescription
    spec = importlib.util.spec_from_file_location("launch_file", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert isinstance(module.generate_launch_description(), LaunchDescription)
