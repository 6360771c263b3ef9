"""What an installed copy contains: the six ament packages, their executables, the data files, the command line.

The copy is made with pip (and with colcon, where it is installed) from a clean copy of the source tree, and is compared
with the tree itself: a node, folder or data file that is added to the tree and not installed fails here.
"""

import importlib
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import xml.etree.ElementTree as ElementTree
import zipfile
from importlib.metadata import distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
AMENT_PACKAGES = {"flight_graph", "msg_schemas", "cubli_ros", "spacerobot_ros", "lander_ros", "sim_nodes"}
NODE_PACKAGES = AMENT_PACKAGES - {"flight_graph", "msg_schemas"}
SOURCES = ["setup.py", "package.xml", "pyproject.toml", "MANIFEST.in", "LICENSE"]
FOLDERS = ["launch", "config", "urdf"]


def python_packages():
    """Top-level folders of the tree that are Python packages."""
    return {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"tests", "benchmarks", "docs"}


def node_table(package):
    """``EXECUTABLES`` of a node package, by importing it: setup.py reads it in another way."""
    path = ROOT / package / "nodes.py"
    if not path.exists():
        return {}
    spec = importlib.util.spec_from_file_location(f"{package}_nodes_table", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.EXECUTABLES


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the sources without anything built, and with one more file of each kind of data, in a subfolder."""
    copy = tmp_path_factory.mktemp("tree")
    ignore = shutil.ignore_patterns("__pycache__", "*.pyc")
    for name in SOURCES:
        shutil.copy2(ROOT / name, copy / name)
    for name in sorted(python_packages()) + FOLDERS:
        if (ROOT / name).exists():
            shutil.copytree(ROOT / name, copy / name, ignore=ignore)
    for kind in FOLDERS:
        probe = copy / kind / "lander_ros" / "probe" / "probe.yaml"
        probe.parent.mkdir(parents=True, exist_ok=True)
        probe.write_text("{}\n")
    return copy


@pytest.fixture(scope="module")
def prefix(tree, tmp_path_factory):
    """An install prefix filled by pip, without network."""
    target = tmp_path_factory.mktemp("prefix")
    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--ignore-installed", "--no-compile"]
    pip(["install", *options, "--disable-pip-version-check", "--no-warn-script-location", "--prefix", target, tree])
    return target


def pip(arguments):
    result = subprocess.run([sys.executable, "-m", "pip", *arguments], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr


def site_packages(prefix):
    return Path(sysconfig.get_path("purelib", "venv", {"base": str(prefix), "platbase": str(prefix)}))


def check_ament_layout(prefix):
    """The layout that ``ros2 run``, ``ros2 launch`` and ``ros2 pkg`` look for, below an install prefix."""
    markers = {path.name for path in (prefix / "share/ament_index/resource_index/packages").iterdir()}
    assert markers == AMENT_PACKAGES
    for package in AMENT_PACKAGES:
        manifest = ElementTree.parse(prefix / "share" / package / "package.xml").getroot()
        assert manifest.findtext("name") == package
        assert manifest.get("format") == "3"
        assert manifest.findtext("license") == "Apache-2.0"
        expected = {"flight"} if package == "flight_graph" else set(node_table(package))
        folder = prefix / "lib" / package
        assert {path.name for path in folder.glob("*")} == expected
        assert all(os.access(path, os.X_OK) for path in folder.glob("*"))
    for kind in FOLDERS:
        assert (prefix / "share/lander_ros" / kind / "probe/probe.yaml").is_file()


def test_the_prefix_has_six_ament_packages(prefix):
    check_ament_layout(prefix)


def test_data_folders_are_named_after_ament_packages():
    """setup.py installs launch/<package>, config/<package> and urdf/<package>; another folder there would be left out."""
    for kind in FOLDERS:
        assert {path.name for path in (ROOT / kind).glob("*/")} - {"__pycache__"} <= AMENT_PACKAGES
        for package in AMENT_PACKAGES:
            assert not (ROOT / kind / package).is_file()


def test_only_node_packages_have_a_node_table():
    assert {path.parent.name for path in ROOT.glob("*/nodes.py")} <= NODE_PACKAGES


def test_every_python_module_and_data_file_is_installed(prefix):
    """Whatever lies in a package of the tree lies in the installed package."""
    installed = site_packages(prefix)
    for package in python_packages():
        for path in (ROOT / package).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc":
                assert (installed / path.relative_to(ROOT)).is_file(), f"not installed: {path.relative_to(ROOT)}"


def test_the_wheel_says_what_it_is(prefix):
    (distribution,) = distributions(path=[str(site_packages(prefix))])
    manifest = ElementTree.parse(ROOT / "package.xml").getroot()
    assert distribution.metadata["Name"].replace("-", "_") == manifest.findtext("name")
    assert distribution.version == manifest.findtext("version")
    licences = distribution.metadata.get_all("License-Expression", []) + distribution.metadata.get_all("License", [])
    assert licences == ["Apache-2.0"]
    licence = next(path for path in distribution.files if path.name == "LICENSE")
    assert licence.read_text() == (ROOT / "LICENSE").read_text()
    (script,) = (entry for entry in distribution.entry_points if entry.group == "console_scripts")
    assert (script.name, script.value) == ("flight", "flight_graph.cli:main")
    assert os.access(prefix / "bin/flight", os.X_OK)


def test_ros_comes_with_the_extra_only(prefix):
    (distribution,) = distributions(path=[str(site_packages(prefix))])
    ros = [requirement for requirement in distribution.requires if requirement.startswith("ros-")]
    assert len(ros) == 2
    assert all("extra ==" in requirement for requirement in ros)


def test_every_executable_names_something_that_exists():
    for package in NODE_PACKAGES:
        for name, target in node_table(package).items():
            module, _, attribute = target.partition(":")
            if module.startswith("flight_graph.ros") and not importlib.util.find_spec("rclpy"):
                continue
            found = importlib.import_module(module)
            assert hasattr(found, attribute), f"{package}/nodes.py: {name}: {module} has no {attribute}"


def test_an_executable_starts_the_node_it_is_named_after(tmp_path):
    """The executable finds the Python of its prefix, hands its names and arguments on, and returns the exit code."""
    tree, prefix = tmp_path / "tree", tmp_path / "a prefix"
    for folder in (tree / "flight_graph/ros", tree / "sim_nodes", prefix / "lib/sim_nodes", prefix / "bin"):
        folder.mkdir(parents=True)
    for name in SOURCES:
        shutil.copy2(ROOT / name, tree / name)
    (tree / "sim_nodes/nodes.py").write_text('EXECUTABLES: dict = {"plant": "sim_nodes.nowhere:Plant"}\n')
    (tree / "flight_graph/ros/entry.py").write_text(
        "import sys\ndef main(package, executable):\n    print(package, executable, sys.argv[1:])\n    return 7\n"
    )
    command = [sys.executable, "setup.py", "--quiet", "--version"]
    subprocess.run(command, cwd=tree, check=True, stdout=subprocess.DEVNULL)
    executable = shutil.copy2(tree / "build/ament/sim_nodes/lib/plant", prefix / "lib/sim_nodes/plant")
    (prefix / "bin/python3").write_text(f'#!/bin/sh\necho "its own Python"; exec {sys.executable} "$@"\n')
    (prefix / "bin/python3").chmod(0o755)
    command = [executable, "--ros-args", "-r", "__ns:=/a b"]
    environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(tree)}
    result = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert result.stdout == "its own Python\nsim_nodes plant ['--ros-args', '-r', '__ns:=/a b']\n", result.stderr
    assert result.returncode == 7


@pytest.mark.parametrize(
    "text, sentence",
    [
        ("EXECUTABLES = dict(plant=1)\n", "no dict literal EXECUTABLES"),
        ("NODES = {}\n", "no dict literal EXECUTABLES"),
        ('EXECUTABLES = {"a b": "module:Name"}\n', "is not 'executable_name': 'module:Name'"),
        ('EXECUTABLES = {"plant": "sim_nodes.plant"}\n', "is not 'executable_name': 'module:Name'"),
    ],
)
def test_a_wrong_node_table_stops_the_build_with_a_sentence(tmp_path, text, sentence):
    for name in SOURCES:
        shutil.copy2(ROOT / name, tmp_path / name)
    (tmp_path / "sim_nodes").mkdir()
    (tmp_path / "sim_nodes/nodes.py").write_text(text)
    result = subprocess.run([sys.executable, "setup.py", "--version"], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode != 0
    assert "sim_nodes/nodes.py: " in result.stderr and sentence in result.stderr
    assert "Traceback" not in result.stderr


def test_an_editable_install_has_the_ament_packages_too(tree, tmp_path):
    """``pip install -e`` leaves data files out unless the distribution asks for them."""
    build = "import sys; from setuptools import build_meta; print(build_meta.build_editable(sys.argv[1]))"
    result = subprocess.run([sys.executable, "-c", build, tmp_path], cwd=tree, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        for member in archive.infolist():
            _, data, path = member.filename.partition(".data/data/")
            if data:
                target = tmp_path / "prefix" / path
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(archive.read(member))
                target.chmod(member.external_attr >> 16 & 0o777)
    check_ament_layout(tmp_path / "prefix")


@pytest.mark.parametrize("options", [[], ["--symlink-install"]], ids=["plain", "symlink"])
def test_colcon_installs_the_same(tree, tmp_path, options):
    colcon = shutil.which("colcon")
    if colcon is None:
        pytest.skip("colcon is not installed")
    workspace = tmp_path / "workspace"
    shutil.copytree(tree, workspace / "src" / "flight_graph", ignore=shutil.ignore_patterns("build", "*.egg-info"))
    command = [colcon, "build", "--merge-install", *options]
    result = subprocess.run(command, cwd=workspace, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    check_ament_layout(workspace / "install")
