"""What was set in a run, and which case of a sweep it is: found by comparing it with the installed scenario of its name."""

import os
from dataclasses import dataclass, field

from flight_graph.components import declared
from flight_graph.components.foreign import refuse
from flight_graph.errors import FlightError
from flight_graph.faults.report import MONITORS, REPORT
from flight_graph.graphs import expressions
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.graphs.source import available
from flight_math.noise import stream_key

MOST_CASES = 1000  # that are looked through
SHOWN = 4  # settings in a title


@dataclass(frozen=True)
class WhatRan:
    """given: key -> value of what differs from the scenario as it is installed, those of the case not among them;
    case: number of the case of its sweep, -1: none; case_name: "" where it has none; known: whether there is a scenario to
    compare with."""

    given: dict = field(default_factory=dict)
    case: int = -1
    case_name: str = ""
    known: bool = False

    def words(self, seed: int, most: int = SHOWN) -> str:
        """Case, seed and settings in a few words."""
        parts = []
        if self.case >= 0:
            parts.append(f"case {self.case}" + (f" ({self.case_name})" if self.case_name else ""))
        parts.append(f"seed {seed}")
        settings = [f"{key} = {_word(value)}" for key, value in self.given.items() if key != "seed"]
        if len(settings) > most:
            settings = [*settings[:most], f"{len(settings) - most} more settings"]
        return ", ".join(parts + settings)


def what_ran(scenario: Scenario) -> WhatRan:
    """What was set by hand or by a sweep in a scenario that has run."""
    if scenario.name not in available():
        return WhatRan()
    try:
        plain = load(scenario.name, consent=refuse)
    except FlightError:
        return WhatRan()
    differing = _differences(scenario, plain)
    if plain.vary is None or not differing:
        return WhatRan(differing, known=True)
    mine = _values(scenario)
    for number in range(min(plain.vary.count, MOST_CASES)):
        values = {key: value for key, value in plain.vary.overrides(number).items() if value is not None}
        if values and all(same(mine.get(key), value) for key, value in values.items()):
            rest = {key: value for key, value in differing.items() if key not in values}
            return WhatRan(rest, number, plain.vary.name(number) or "", True)
    return WhatRan(differing, known=True)


def title(scenario: Scenario) -> str:
    """The heading of a picture: what the scenario is, its name, case, seed, and what was set."""
    return f"{scenario.file.title}\n{scenario.name}: {what_ran(scenario).words(scenario.seed)}"


def _values(scenario) -> dict:
    """Every setting of a scenario by its key, noise keys that follow from the seed left out."""
    found = {"seed": scenario.seed, "duration_s": scenario.file.duration_s}
    for fault in scenario.file.faults or []:
        found |= {f"faults.{fault.get('id')}.{key}": value for key, value in fault.items() if key != "id"}
    for name, node in scenario.graph.nodes.items():
        if name.rpartition(".")[2] in (REPORT, MONITORS):  # which follow from the faults and monitors
            continue
        found |= {f"{name}.use": node.use, f"{name}.rate_hz": node.rate_hz}
        found |= {f"{name}.{key}": value for key, value in node.values.items()
                  if not (key == "seed" and value == stream_key(scenario.seed, name))}
    return found


def _differences(scenario, plain) -> dict:
    """What has another value, without what follows from it: other parameters of the component, and those of others."""
    values, before = _values(scenario), _values(plain)
    found = {key: value for key, value in values.items() if not same(before.get(key), value)}
    replaced = {key.rpartition(".")[0] for key in found if key.endswith(".use")}
    return {key: value for key, value in found.items() if not (
        (key.rpartition(".")[0] in replaced and not key.endswith(".use")) or _follows(scenario, plain, key, before))}


def _follows(scenario, plain, key, before) -> bool:
    """Whether a parameter is what it is because of others."""
    name, _, parameter = key.rpartition(".")
    node, entry = scenario.graph.nodes.get(name), plain.file.components.get(name)
    if entry is None or parameter not in node.values or key not in before:
        return False
    if expressions.is_expression(entry.parameters.get(parameter)):
        return True
    other = {**node.values, parameter: before[key]}
    try:
        return same(declared.resolved(node.component, other, key, None)[parameter], node.values[parameter])
    except FlightError:
        return False


def same(a, b) -> bool:
    """Whether two settings are equal; a number stands for a list of it."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(value, b[key]) for key, value in a.items())
    lists = [isinstance(value, (list, tuple)) for value in (a, b)]
    if all(lists):
        return len(a) == len(b) and all(map(same, a, b))
    if any(lists):
        many, one = (a, b) if lists[0] else (b, a)
        return bool(many) and all(same(entry, one) for entry in many)
    return a == b


def _word(value) -> str:
    if isinstance(value, (list, tuple)):
        if len(value) > 1 and all(same(entry, value[0]) for entry in value):
            return _word(value[0])
        return "[" + ", ".join(_word(entry) for entry in value) + "]"
    if isinstance(value, str) and os.path.isabs(value):  # of a file, which lies elsewhere for who reads this
        return os.path.basename(value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)
