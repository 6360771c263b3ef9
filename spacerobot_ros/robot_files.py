"""Robots by name or by file."""

from importlib import resources
from pathlib import Path

from spacerobot_ros.inertial_parameters import ModelError
from spacerobot_ros.model import SpaceRobot, load_model
from spacerobot_ros.urdf import load_urdf


def find_model(name: str, folder: Path | None = None) -> SpaceRobot:
    """The robot ``name``: one that comes with the package ('mini_space_robot'), or a YAML or URDF file (relative to
    ``folder``). Raises `ModelError`."""
    if name.endswith((".yaml", ".yml")):
        return load_model((folder or Path()) / name)
    if name.endswith((".urdf", ".xml")):
        return load_urdf((folder or Path()) / name)
    shipped = {path.stem: path for path in Path(str(resources.files("spacerobot_ros") / "models")).glob("*.yaml")}
    if name not in shipped:
        raise ModelError(f"robot model '{name}' is unknown; there is {', '.join(sorted(shipped))}, or name a YAML or "
                         "URDF file")
    return load_model(shipped[name])
