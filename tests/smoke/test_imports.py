"""The build is whole: every module imports without ROS 2, and dependencies between the packages point one way.

papers -> sim_nodes -> cubli_ros, spacerobot_ros, lander_ros -> flight_graph -> msg_schemas, flight_math

The truth may read the flight software's models; flight software never reads the truth.
"""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MAY_IMPORT = {
    "msg_schemas": set(),
    "flight_math": set(),
    "flight_graph": {"msg_schemas", "flight_math"},
    "cubli_ros": {"flight_graph", "flight_math", "msg_schemas"},
    "spacerobot_ros": {"flight_graph", "flight_math", "msg_schemas"},
    "lander_ros": {"flight_graph", "flight_math", "msg_schemas"},
    "sim_nodes": {"flight_graph", "flight_math", "msg_schemas", "cubli_ros", "spacerobot_ros", "lander_ros"},
    "papers": {"flight_graph", "flight_math", "msg_schemas", "cubli_ros", "spacerobot_ros", "lander_ros", "sim_nodes", "scenarios"},
}
WITH_ROS = "flight_graph.ros"  # the one package whose modules may need rclpy to be imported

IMPORT_ALL_WITHOUT_ROS = """
import importlib, json, sys
sys.modules["rclpy"] = None  # makes `import rclpy` raise ImportError
errors = {}
for name in json.loads(sys.argv[1]):
    try:
        importlib.import_module(name)
    except BaseException as error:
        errors[name] = f"{type(error).__name__}: {error}"
print(json.dumps(errors))
"""


def modules(package):
    """(module name, path) of every Python file of a package of the tree."""
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def imported_packages(path):
    """Top-level names of the absolute imports of a file, those inside functions too, with their lines."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [node.module]
        else:
            continue
        for name in names:
            yield name.partition(".")[0], node.lineno


def test_everything_but_the_ros_executor_imports_without_rclpy():
    names = [name for package in MAY_IMPORT for name, _ in modules(package)]
    without_ros = [name for name in names if name != WITH_ROS and not name.startswith(WITH_ROS + ".")]
    command = [sys.executable, "-c", IMPORT_ALL_WITHOUT_ROS, json.dumps(without_ros)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    errors = json.loads(result.stdout.splitlines()[-1])
    assert not errors, "\n".join(f"{name}: {error}" for name, error in errors.items())


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_dependencies_point_one_way(package):
    own = {package, *MAY_IMPORT[package]}
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for _, path in modules(package)
        for name, line in imported_packages(path)
        if name in {*MAY_IMPORT, "scenarios", "tests", "benchmarks"} and name not in own
    ]
    assert not wrong, f"{package} may import {sorted(MAY_IMPORT[package])} only:\n" + "\n".join(wrong)
