"""One Python distribution that is six ament packages to ROS 2.

Every name in ``AMENT_PACKAGES`` gets what a ROS 2 package has: a marker in the ament index,
``share/<name>/package.xml``, ``share/<name>/launch``, ``share/<name>/config``, ``share/<name>/urdf`` and its executables
in ``lib/<name>``.
They reach the install prefix as data files: pip, ``pip -e`` and colcon (linked or not) put them in the same places.
"""

import ast
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from setuptools import Distribution, find_packages, setup

MANIFEST = ElementTree.parse("package.xml").getroot()
NAME = MANIFEST.findtext("name")  # colcon builds by this name: it must be the distribution's as well
AMENT_PACKAGES = (NAME, "msg_schemas", "cubli_ros", "spacerobot_ros", "lander_ros", "sim_nodes")
PYTHON_PACKAGES = (*AMENT_PACKAGES, "flight_math", "papers", "scenarios")
COMMAND_LINE = "flight_graph.cli:main"
DATA_SUFFIXES = ("yaml", "json", "xml", "csv", "md", "js", "css")
GENERATED = Path("build/ament")  # below the source tree, because colcon links data files by relative path

EXECUTABLE = '''\
#!/bin/sh
""":"
python="$(dirname "$0")/../../bin/python3"
[ -x "$python" ] || python=python3
exec "$python" "$0" "$@"
"""
import sys
{first}
from {module} import {function}

sys.exit({function}({arguments}))
'''
END_AT_ONCE = """import os
import signal

for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda *_: os._exit(0))  # until there is a node that ends in its own way

"""


def node_table(package: str) -> dict[str, str]:
    """Return ``EXECUTABLES`` of ``<package>/nodes.py``; read, not imported: dependencies are not there yet."""
    path = Path(package, "nodes.py")
    if not path.exists():
        return {}
    for statement in ast.parse(path.read_text(encoding="utf-8"), str(path)).body:
        targets = getattr(statement, "targets", None) or [getattr(statement, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == "EXECUTABLES" for target in targets):
            try:
                table = ast.literal_eval(statement.value)
            except ValueError:
                break
            for name, target in table.items():
                if not re.fullmatch(r"[a-z][a-z0-9_]* = [\w.]+:\w+", f"{name} = {target}"):
                    raise SystemExit(f"{path}: {name!r}: {target!r} is not 'executable_name': 'module:Name'")
            return table
    raise SystemExit(f"{path}: no dict literal EXECUTABLES = {{'executable_name': 'module:Name', ...}}")


def executables(package: str) -> dict[str, str]:
    """Return the text of each executable of an ament package, by name."""
    if package == NAME:
        module, function = COMMAND_LINE.split(":")
        return {"flight": EXECUTABLE.format(first="", module=module, function=function, arguments="")}
    return {
        name: EXECUTABLE.format(first=END_AT_ONCE, module="flight_graph.ros.entry", function="main",
                                arguments=f'"{package}", "{name}"')
        for name in node_table(package)
    }


def write(path: Path, text: str, mode: int = 0o644) -> str:
    """Write a generated file if it is not there yet as it should be, and return its relative path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8", newline="\n")
    path.chmod(mode)
    return path.as_posix()


def data_files() -> list[tuple[str, list[str]]]:
    """List what goes below the install prefix: (folder, files), sources relative to this file."""
    manifest = Path("package.xml").read_text(encoding="utf-8")
    files = []
    for package in AMENT_PACKAGES:
        files.append(("share/ament_index/resource_index/packages", [write(GENERATED / "index" / package, "")]))
        renamed = manifest.replace(f"<name>{NAME}</name>", f"<name>{package}</name>")
        own = "package.xml" if package == NAME else write(GENERATED / package / "package.xml", renamed)
        files.append((f"share/{package}", [own]))
        for kind in ("launch", "config", "urdf"):
            root = Path(kind, package)
            for path in sorted(p for p in root.rglob("*") if p.is_file() and "__pycache__" not in p.parts):
                folder = Path("share", package, kind, path.parent.relative_to(root))
                files.append((folder.as_posix(), [path.as_posix()]))
        for name, text in executables(package).items():
            files.append((f"lib/{package}", [write(GENERATED / package / "lib" / name, text, 0o755)]))
    return files


class AmentDistribution(Distribution):
    """A distribution whose editable install carries its data files as well.

    setuptools' ``editable_wheel`` installs them if ``has_data()`` says so, and defines no such method itself.
    """

    def has_data(self) -> bool:
        return self.has_data_files()


setup(
    distclass=AmentDistribution,
    name=NAME,
    version=MANIFEST.findtext("version"),
    description=MANIFEST.findtext("description"),
    maintainer=MANIFEST.findtext("maintainer"),
    maintainer_email=MANIFEST.find("maintainer").get("email"),
    license=MANIFEST.findtext("license"),
    python_requires=">=3.11,<3.13",
    packages=find_packages(include=[pattern for name in PYTHON_PACKAGES for pattern in (name, f"{name}.*")]),
    package_data={"": [pattern for suffix in DATA_SUFFIXES for pattern in (f"*.{suffix}", f"**/*.{suffix}")]},
    data_files=data_files(),
    entry_points={"console_scripts": [f"flight = {COMMAND_LINE}"]},
    install_requires=[
        "numpy>=1.26,<3",
        "scipy>=1.11",
        "numba>=0.60; sys_platform != 'darwin' or platform_machine != 'x86_64'",
        "numba>=0.60,<0.63; sys_platform == 'darwin' and platform_machine == 'x86_64'",  # the last with wheels for it
        "PyYAML>=6",
        "pydantic>=2.6,<3",
        "rich>=13",
        "typer>=0.12",
        "matplotlib>=3.6",
        "mcap>=1.6",
        "rosbags>=0.10,<0.12",
        "pyarrow>=15",
        "plotly>=6",
        "prompt_toolkit>=3",
    ],
    extras_require={
        # ROS 2 Jazzy as wheels (x86_64 Linux). Leave it out where a ROS 2 Jazzy is sourced.
        "ros": ["ros-jazzy-rclpy[fastrtps]==7.1.6", "ros-jazzy-common-interfaces==5.3.6"],
        # Campaigns on many machines (docs/campaigns.md).
        "dask": ["dask>=2024.8", "distributed>=2024.8"],
        # Campaigns on a graphics processor (docs/campaigns.md): what speaks to its driver, which comes with the machine.
        "cuda": ["cuda-bindings>=12.8"],
        # Viewers (docs/seeing.md): Foxglove and Lichtblick live, 20 MB; Rerun with its window and its page, 170 MB.
        "foxglove": ["foxglove-sdk>=0.30"],
        "view": ["rerun-sdk>=0.41,<0.42"],
        # Notebooks (docs/notebooks): what runs them in an editor or in Jupyter, and tables as pandas.
        "notebooks": ["ipykernel>=6.29", "pandas>=2.2"],
        # The handbook as a site (make docs).
        "docs": ["sphinx>=8.1", "myst-nb>=1.3", "pydata-sphinx-theme>=0.16", "pandas>=2.2"],
        "test": [
            "pytest>=8,<9.2",  # 9.2 does not take the names of groups that pytest-xdist 3.8 gives to tests
            "pytest-xdist>=3.5",
            "pytest-timeout>=2.3",
            "hypothesis>=6.100",
            "mcap-ros2-support>=0.5",
            "sympy>=1.12",
            "mpmath>=1.3",
            "psutil>=5.9",
            "dask>=2024.8",  # the extra [dask], tested with a real cluster
            "distributed>=2024.8",
            "foxglove-sdk>=0.30",  # the extra [foxglove], tested by a client of its protocol
            "websockets>=15",
            "sphinx>=8.1",  # the extra [docs], with which the site is built
            "myst-nb>=1.3",
            "pydata-sphinx-theme>=0.16",
            "pandas>=2.2",
        ],
        # A reference of the space robot's tests, 380 MB; they are skipped without it. No wheels for Windows.
        "pinocchio": ["pin>=3; sys_platform != 'win32'"],
    },
    zip_safe=False,
)
