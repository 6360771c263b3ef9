"""ROS parameter files (``--params-file`` of a node) as the overrides of a scenario.

    /**/controller:
      ros__parameters: {lambda_a: 0.03, rate_hz: 50.0}

A section's name is matched as rcl does it: ``*`` stands for one part of a node's full name, ``**`` for any number of them.
A node is meant by its name in the scenario or by the executable that it is; a section without a namespace means it in any,
also in that of a vehicle: ``/rover_a/controller`` is the controller of the vehicle ``rover_a``.
Sections may stand in each other, a namespace around its nodes. A section of wildcards alone sets each parameter where there
is one of that name.
"""

import re
from pathlib import Path
from typing import Any

from flight_graph import yaml_text
from flight_graph.components import registry
from flight_graph.components.names import joined, ros
from flight_graph.errors import FlightError, unknown

_ALSO = ("rate_hz",)  # keys of a component besides its parameters
_OF_EVERY_NODE = ("use_sim_time", "qos_overrides")  # what files for ROS set and a scenario has no need of


def overrides(path: Path, components: dict[str, tuple[str, Path | None]]) -> tuple[dict[str, Any], list[str]]:
    """Return ``component.parameter`` -> value, and sentences on what is left out. Raises FlightError.

    components: whole name -> (use, where a relative file of it starts), of the scenario's components.
    """
    sections = _read(path)
    found, remarks = {}, []
    for section, entry in sections.items():
        values = {key: value for key, value in _flat(entry["ros__parameters"]).items()
                  if key.partition(".")[0] not in _OF_EVERY_NODE}
        matched = _meant(section, components)
        if not matched:
            remarks.append(f"--params {path}: {unknown('component', section.rpartition('/')[2], components, section)}")
        known = {name: {*_entries(*components[name]), *_ALSO} for name in matched}
        for key, value in values.items():
            having = [name for name in matched if key in known[name]]
            if matched and not having:
                everywhere = sorted(set().union(*known.values()))
                raise unknown("parameter", key, everywhere, f"--params {path}: {section}")
            found.update({f"{name}.{key}": value for name in having})
    if not found:
        raise FlightError(f"--params {path}: none of its sections ({', '.join(sections)}) means a component of this "
                          f"scenario ({', '.join(components)})")
    return found, remarks


def _read(path):
    data = yaml_text.read(Path(path), f"--params {path}")
    sections = {}
    wrong = _gather(data, "", sections) if isinstance(data, dict) else ""
    if wrong or not sections:
        raise FlightError(f"--params {path}: this is no ROS parameter file (node name: ros__parameters: name: value)" +
                          (f"; {wrong} holds no ros__parameters" if wrong else ""))
    return sections


def _gather(data, prefix, sections):
    """Collect the sections with their whole names; return the first place where parameters are missing, or nothing."""
    for name, entry in data.items():
        whole = f"{prefix}{name}"
        if not isinstance(entry, dict) or not entry:
            return prefix.rstrip("/") or whole
        if isinstance(entry.get("ros__parameters"), dict):
            sections[whole] = entry
        elif wrong := _gather(entry, whole.rstrip("/") + "/", sections):
            return wrong
    return ""


def _flat(values, prefix=""):
    """Nested parameters by their dotted names."""
    found = {}
    for key, value in values.items():
        found.update(_flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value})
    return found


def _meant(section: str, components: dict) -> list[str]:
    """The components that a section means, by their names or by the executables that they are."""
    found = [name for name, (use, _) in components.items() if _means(section, name, use)]
    if "*" in section or section.strip("/").count("/") == 0:
        return found
    deepest = max((name.count(".") for name in found), default=0)  # /rover_a/law: that of the vehicle
    return [name for name in found if name.count(".") == deepest]


def _means(section, name, use) -> bool:
    parts = [part for part in section.split("/") if part]
    namespace, _, own = name.rpartition(".")
    for called in (own, use.rpartition("/")[2] or " "):
        whole = "/" + ros(joined(namespace, called))
        if "*" not in section:  # in whatever namespace the graph runs, and one part in whatever vehicle
            if parts == [called] or len(parts) > 1 and f"/{'/'.join(parts)}".endswith(whole):
                return True
        elif _matches(["**", *parts] if len(parts) == 1 else parts, whole):
            return True
    return False


def _matches(parts, whole) -> bool:
    pattern = "".join({"**": "(?:/[^/]+)*", "*": "/[^/]+"}.get(part, "/" + re.escape(part)) for part in parts)
    return re.fullmatch(pattern, whole) is not None


def _entries(use, folder):
    return registry.component(registry.absolute(use, folder)).parameters.entries
