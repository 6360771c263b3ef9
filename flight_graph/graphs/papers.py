"""The papers that come with the packages."""

from importlib import resources
from pathlib import Path


def papers() -> dict[str, Path]:
    """The papers that have claims, and the files."""
    root = Path(str(resources.files("papers")))
    return {path.parent.name: path for path in sorted(root.glob("*/claims.yaml"))}
