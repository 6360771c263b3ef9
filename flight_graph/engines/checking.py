"""Checking a component without a graph: read, compiled part by part, and run once on empty records."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from flight_graph.components import component_file, kernel_rules, registry
from flight_graph.components.component import Component
from flight_graph.components.findings import Finding
from flight_graph.errors import FlightError, unknown


@dataclass
class Report:
    """What a check found. parts: the parts that are right; sentences: one for each mistake."""

    name: str
    parts: list[str] = field(default_factory=list)
    mistakes: list[dict] = field(default_factory=list)

    def add(self, mistake: Finding | FlightError) -> None:
        """Note a mistake."""
        if isinstance(mistake, Finding):
            self.mistakes.append({"sentence": str(mistake), **mistake.plain()})
            return
        place = re.match(r"(?P<file>.+?):(?P<line>\d+): ", str(mistake))
        self.mistakes.append({"sentence": str(mistake), "file": place["file"] if place else "",
                              "line": int(place["line"]) if place else 0})


def check(target: str) -> list[Report]:
    """Check ``file.py``, ``file.py:Class`` or ``package/executable``: one report a component. Raises FlightError.

    FlightError says that there is no such file or component; what is wrong in it is in the reports.
    """
    path, _, name = target.rpartition(":") if ".py:" in target else (target, "", "")
    if not path.endswith(".py"):
        return [_checked(target, registry.find(target))]
    if not Path(path).is_file():
        raise FlightError(f"there is no file '{path}'")
    try:
        module = component_file.load(path)
    except FlightError as error:
        report = Report(target)
        report.add(error)
        return [report]
    known = component_file.classes(module)
    if name and name not in known:
        raise unknown("component", name, known, path)
    if not known:
        raise FlightError(f"{path}: there is no component in it (a subclass of Component, from "
                          "flight_graph.components.component)")
    return [_checked(f"{path}:{name}", getattr(module, name)) for name in ([name] if name else known)]


def _checked(use: str, component: type[Component]) -> Report:
    report = Report(use)
    for finding in kernel_rules.findings(component):
        report.add(finding)
    if not report.mistakes:
        report.parts = [part for part in ("start", "kernel", "output", "update") if getattr(component, part) is not None]
    return report
