"""Where scenarios come from: those of the packages by their names, others by their files."""

import os
from importlib import resources
from pathlib import Path

from flight_graph import yaml_text
from flight_graph.errors import FlightError, unknown
from flight_graph.text_files import short


def available() -> dict[str, Path]:
    """Names of the scenarios that come with the packages, and their files."""
    folder = Path(str(resources.files("scenarios")))
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def read_file(name_or_path: str, folder: Path | None = None) -> tuple[dict, Path]:
    """A scenario's data as its file has it, and the file. Nothing that it names is imported. Raises FlightError.

    name_or_path: the name of one that comes with the packages, or a YAML file; folder: where a relative path starts.
    """
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        known = available()
        if name_or_path not in known:
            raise unknown("scenario", name_or_path, known)
        path = known[name_or_path]
    elif not os.path.exists(path := (folder or Path()) / path):
        raise FlightError(f"there is no scenario file '{short(str(path))}'")
    data = yaml_text.read(path)
    if not isinstance(data, dict):
        raise FlightError(f"{path}: a scenario is a mapping of keys (name, title, duration_s, components, ...)")
    return data, path
