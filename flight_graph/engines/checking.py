"""Checking a component without a graph: read, compiled part by part, and run once on empty records."""

import os
import re
import threading
import time
from dataclasses import dataclass, field

from flight_graph.components import component_file, declared, kernel_rules, placement, registry
from flight_graph.components.component import Component
from flight_graph.components.findings import ComponentMistake, Finding
from flight_graph.components.sources import source
from flight_graph.engines import compilation
from flight_graph.engines.part_calls import parts
from flight_graph.engines.single import SingleComponent
from flight_graph.engines.stops import is_raised
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs.graph import Node
from flight_graph.timebase import J2000, SECOND

_ANYWHERE = placement.record_of({name: [0.0] * (count - 1) + [1.0] for name, count in placement.NUMBERS.items()})
PATIENCE_S = 3.0  # of CPU, for one firing that takes microseconds: a busy machine does not count


@dataclass
class Report:
    """What a check found. parts: those that are right; remark: why they were not run; mistakes: one sentence each."""

    name: str
    parts: list[str] = field(default_factory=list)
    remark: str = ""
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
    if not os.path.isfile(path):
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
        try:
            report.parts, report.remark = _run_once(use, component)
        except FlightError as error:
            report.add(error)
    return report


def _run_once(use, component):
    """Compile all parts and run each once; return them, and why they did not run. Raises FlightError."""
    remark, values = "", None
    try:
        values = declared.resolved(component, component.parameters.defaults(), component.__name__, None)
        state = component.initial_state(values)
    except ComponentMistake:
        raise
    except FlightError as error:
        remark = f"not run, for its parameters have no defaults that it takes: {error}"
    compilation.compile_missing({use: component}, check_bounds=True)
    if not remark:
        single = _single(use, component, values, state)
        for part in parts(component):
            _run(single, component, part, state)
    return parts(component), remark


def _single(use, component, values, state):
    """The component over empty records of its own."""
    node = Node(component.__name__, use, component, values, component.rate_hz)
    parameters = component.parameters.record(values, component.__name__)
    parameters["period"] = node.period_ns / SECOND
    inputs = {port: signal.new()[1] for port, signal in component.inputs.items()}
    outputs = {port: signal.new()[1] for port, signal in component.outputs.items()}
    return SingleComponent(node.name, use, component, parameters, state, inputs, outputs,
                           {port: node.output_period_ns(port) for port in outputs}, J2000, check_bounds=True)


def _run(single, component, part, state):
    """Run one part at t = 0. Raises FlightError when an index is outside, or when it does not end."""
    said = []
    call = (lambda: single.place(_ANYWHERE, 0)) if part == "place" else (lambda: single.call(part, 0))
    running = threading.Thread(target=lambda: said.append(call()), daemon=True)
    began = time.process_time()
    running.start()
    while running.is_alive() and time.process_time() - began < PATIENCE_S:
        running.join(0.05)
    name = f"{component.__name__}.{part}"
    if not said:
        place = source(getattr(component, part))
        raise FlightError(str(Finding(place.path, place.tree.lineno, name, "it does not come to its end on empty inputs, "
                                      "which is what it gets until the first messages arrive")))
    place = re.search(r" raised (?P<what>.+) \((?P<file>.+), line (?P<line>\d+)\)$", said[0] or "")
    if place and is_raised(int(state["fault"][0])):
        what = re.sub("^IndexError: .*", "an index is outside of its array or value", place["what"])
        raise FlightError(str(Finding(place["file"], int(place["line"]), name, f"{what} (found in a run on empty inputs)")))
    code = int(state["fault"][0])
    if code and code not in component.faults:
        place = source(getattr(component, part))
        known = ", ".join(map(str, component.faults)) or "none"
        raise FlightError(str(Finding(place.path, place.tree.lineno, name, f"it sets the fault {code}, for which the "
                                      f"class's faults have no sentence; they have {known}")))
    state["fault"] = 0  # what a kernel finds wrong with empty inputs is no mistake
