"""ROS parameter files (``--params-file`` of a node) as the overrides of a scenario.

    /**/controller:
      ros__parameters: {lambda_a: 0.03, rate_hz: 50.0}

The last part of a section's name is a component of the scenario, or the executable that a component is; ``/**`` alone
means every component that has the parameter.
"""

from pathlib import Path
from typing import Any

import yaml

from flight_graph.components import registry
from flight_graph.errors import FlightError


def overrides(path: Path, components: dict[str, dict], folder: Path | None = None) -> dict[str, Any]:
    """Return ``component.parameter`` -> value. components: the scenario's entries by name. Raises FlightError."""
    try:
        data = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise FlightError(f"--params {path}: {error.strerror.lower()}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise FlightError(f"--params {path}: this is no YAML: {' '.join(str(error).split())}") from None
    if not isinstance(data, dict) or not data or not all(
            isinstance(entry, dict) and isinstance(entry.get("ros__parameters"), dict) for entry in data.values()):
        raise FlightError(f"--params {path}: this is no ROS parameter file (node name: ros__parameters: name: value)")
    found = {}
    for section, entry in data.items():
        name = str(section).rpartition("/")[2]
        for component, declared in components.items():
            use = str((declared or {}).get("use", ""))
            if name not in (component, use.rpartition("/")[2], "**"):
                continue
            values = entry["ros__parameters"]
            if name == "**":
                known = registry.component(use, folder).parameters.entries
                values = {key: value for key, value in values.items() if key in known or key == "rate_hz"}
            found.update({f"{component}.{key}": value for key, value in values.items()})
    if not found:
        raise FlightError(f"--params {path}: none of its sections ({', '.join(map(str, data))}) means a component of "
                          f"this scenario ({', '.join(components)})")
    return found
