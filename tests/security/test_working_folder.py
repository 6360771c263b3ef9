"""The folder in which a command is typed may be a stranger's: no Python file in it is taken for a module."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NAMES = ("json", "yaml", "numpy", "numba", "typer", "rich", "logging", "random", "rclpy", "sim_nodes", "flight_math", "sitecustomize")


def trapped(folder):
    for name in NAMES:
        (folder / f"{name}.py").write_text(f"open({str(folder / 'it_ran')!r}, 'w').write({name!r})\n")
    return folder


def flight(*arguments, cwd):
    """The command as it is installed: its folder, not the working folder, is where modules are looked for first."""
    code = "import sys; from flight_graph.cli import main; sys.exit(main())"
    return subprocess.run([sys.executable, "-P", "-c", code, *map(str, arguments)], cwd=cwd, capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=300)


@pytest.mark.parametrize("command", [
    ("run", "cubli_earth", "--duration", 0.05), ("doctor", "--json"), ("list",), ("check", ROOT / "examples/sliding_controller.py"),
    pytest.param(("run", "cubli_earth", "--duration", 0.05, "--engine", "ros"), marks=pytest.mark.ros)],
    ids=lambda command: " ".join(map(str, command))[:30])
def test_files_in_the_working_folder_are_no_modules(tmp_path, command):
    if "ros" in command:
        pytest.importorskip("rclpy")
    done = flight(*command, cwd=trapped(tmp_path))
    assert done.returncode == 0 and not (tmp_path / "it_ran").exists(), done.stderr


def test_every_process_of_python_is_started_so():
    """With -P, the folder of the process is not among those that modules are looked for in."""
    found = []
    for package in ("flight_graph", "papers", "sim_nodes", "cubli_ros", "lander_ros", "spacerobot_ros"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.List) and node.elts and ast.unparse(node.elts[0]) == "sys.executable":
                    found.append((path.name, ast.unparse(node.elts[1])))
    assert found and all(second == "'-P'" for _, second in found), found
