"""Fingerprints of the code that decides a campaign's rows: machine codes, metrics, and what is drawn together.

They are of sources and layouts, not of processors: the same on every machine that has the same code.
"""

import ast
import hashlib
import importlib.util
from functools import cache
from pathlib import Path

from flight_graph.components import names, registry
from flight_graph.components.foreign import FUNCTIONS
from flight_graph.engines import driver
from flight_graph.engines.part_calls import parts, records
from flight_graph.graphs.scenario import Scenario
from flight_graph.graphs.vary import Vary
from flight_math.kernel import fingerprint, library

_DRAWS = tuple(f"flight_graph.sampling.{name}" for name in (
    "combinations", "correlated", "distributions", "normal", "plan", "sampler", "sources"))
_SCORES = "flight_graph.graphs.fault_scores"
_PACKAGES = (*FUNCTIONS, "flight_math", "msg_schemas")


def fingerprints(scenario: Scenario) -> dict[str, str]:
    """What decides the rows of a scenario's cases -> SHA-256 of its source: parts of components (``controller.kernel``),
    the driver, the mathematics, the metrics with all of ours that they import, the function that draws. Raises FlightError.
    """
    found = {"driver": _driver(), "mathematics": library(), "draws": _files(_DRAWS)}
    for name, node in scenario.graph.nodes.items():
        found |= {f"{name}.{part}": _part(node.component, part) for part in parts(node.component)}
    found |= _metrics(scenario, "")
    if scenario.has_measures:
        found["measures"] = _files(("flight_graph.graphs.measures",))
    if scenario.faults:
        found["fault scores"] = _files((_SCORES,))
    vary: Vary | None = scenario.vary
    if vary is not None and vary.file.function:
        found["vary.function"] = _function(vary.file.function, scenario.folder)
    for use in sorted(_varied_uses(vary)):
        component = registry.component(registry.absolute(use, scenario.folder))
        found |= {f"{use}.{part}": _part(component, part) for part in parts(component)}
    return found


def _metrics(scenario, vehicle) -> dict[str, str]:
    """Of the metrics functions of a scenario and its vehicles."""
    found = {}
    if scenario.file.metrics:
        found[names.joined(vehicle, "metrics")] = _function(scenario.file.metrics, scenario.folder)
    for name, inside in scenario.vehicles.items():
        found |= _metrics(inside, names.joined(vehicle, name))
    return found


def differences(here: dict[str, str], there: dict[str, str]) -> list[str]:
    """Names of what is not the same in two tables of fingerprints."""
    return [name for name in dict.fromkeys([*here, *there]) if here.get(name) != there.get(name)]


def _varied_uses(vary) -> set[str]:
    if vary is None:
        return set()
    fixed = [values for _, values in vary.combinations]
    drawn = [{key: choice} for key, one in vary.file.random.items() for choice in one.choice or []]
    return {str(value) for values in [*fixed, *drawn] for key, value in values.items() if key.endswith(".use")}


@cache
def _part(component, part) -> str:
    text = [fingerprint(getattr(component, part)), *map(repr, records(component, part))]
    return hashlib.sha256("\n".join(text).encode()).hexdigest()


def _function(name: str, folder: Path | None) -> str:
    source = name.rpartition(":")[0]
    path = Path(registry.absolute(name, folder).rpartition(":")[0]) if source.endswith(".py") else _path(source)
    return _digest_of(_reached({path} - {None}))


def _reached(paths: set[Path]) -> set[Path]:
    """These files, and those of our packages that they import, and so on; of flight_graph nothing."""
    reached, waiting = set(), list(paths)
    while waiting:
        path = waiting.pop()
        if path not in reached:
            reached.add(path)
            waiting += [found for name in _imported(path) if (found := _path(name)) is not None]
    return reached


@cache
def _driver() -> str:
    return _digest_of(driver.CODE.sources)


@cache
def _files(modules: tuple[str, ...]) -> str:
    return _digest_of({_path(module) for module in modules})


def _digest_of(paths) -> str:
    state = hashlib.sha256()
    for content in sorted(hashlib.sha256(path.read_bytes().replace(b"\r\n", b"\n")).digest() for path in paths):
        state.update(content)
    return state.hexdigest()


def _path(module: str) -> Path | None:
    try:
        found = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None
    return Path(found.origin) if found is not None and found.origin and found.origin.endswith(".py") else None


def _imported(path: Path) -> list[str]:
    """Modules of our packages that a file imports, at its top or in a function; a name of a package may be one."""
    found = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            found += [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found += [node.module, *(f"{node.module}.{one.name}" for one in node.names)]
    return [name for name in found if name.partition(".")[0] in _PACKAGES]
