"""Values put into a scenario's data by their paths, before it is validated: ``component.parameter``, ``faults.ID.key``."""

from pathlib import Path
from typing import Any

from flight_graph.components import registry
from flight_graph.errors import FlightError, unknown
from flight_graph.faults import fault_file, report
from flight_graph.graphs import vehicles
from flight_graph.graphs.scenario_file import FOREIGN, FOREIGN_KEYS, ScenarioFile


def override(data: dict, overrides: dict[str, Any], origin: str = "--set", folder: Path | None = None,
             inside: str | None = None) -> dict:
    """Return a copy of a scenario's data with ``component.parameter`` (or ``.rate_hz``), ``faults.ID.key`` and top-level
    keys replaced; of a vehicle's, with its name in front: ``rover_a.controller.lambda_a``, ``rover_a.seed``.

    ``component.use`` puts another component in the place: it keeps those of the file's parameters that it has itself
    (the file wrote them for the one that left), and everything else that is overridden.
    origin: where the overrides come from, for error texts. folder: where a relative component file starts. inside: the
    path of the vehicle whose data these are, with a dot behind, as far as error texts need it; None: of no vehicle.
    """
    components = data.get("components") or {}
    if not isinstance(components, dict) or not all(isinstance(entry or {}, dict) for entry in components.values()):
        return data  # the validation names the key
    data = {**data, "components": {name: dict(entry or {}) for name, entry in components.items()}}
    included = {name: entry for name, entry, _ in vehicles.inside(data)}
    if included:
        data["include"] = dict(data["include"])
    for key in sorted(overrides, key=lambda key: not key.endswith(".use")):
        value = with_whole_use(key, overrides[key], folder)
        first, _, rest = key.partition(".")
        if rest and first in included and first not in data["components"]:
            entry = data["include"][first]
            made = override(entry["scenario"], {rest: value}, origin, vehicles.folder_of(entry), f"{inside or ''}{first}.")
            data["include"][first] = {**entry, "scenario": made}
        else:
            _put(data, key, value, f"{origin} {inside or ''}{key}", inside is not None, [*data["components"], *included])
    return data


def with_whole_use(key: str, value, folder: Path | None):
    """The value of a key; that of a ``.use`` with the whole path of a component's file."""
    return registry.absolute(str(value), folder) if key.endswith(".use") else value


def _put(data, key, value, where, is_inside, known):
    component, _, parameter = key.partition(".")
    if component == report.REPORT and parameter:
        data["faults"] = fault_file.override(data.get("faults"), parameter, value, where)
        return
    if not parameter:
        if is_inside and key in vehicles.OUTSIDE:
            raise FlightError(f"{where}: the scenario that includes decides {', '.join(vehicles.OUTSIDE)} for all in it")
        if key not in ScenarioFile.model_fields or key in ("components", "connect", "include"):
            raise FlightError(f"{where}: write component.parameter=value")
        data[key] = value
        return
    if component not in data["components"]:
        raise unknown("component", component, known, where)
    entry = data["components"][component]
    if parameter == "use":
        for port in FOREIGN_KEYS:
            entry.pop(port, None)
        try:
            entries = registry.component(str(value)).parameters.entries
        except FlightError as error:
            raise FlightError(f"{where}: {error}") from None
        kept = {name: given for name, given in (entry.get("parameters") or {}).items() if name in entries}
        entry.update(use=value, parameters=kept)
    elif parameter == "rate_hz" or entry.get("use") == FOREIGN and parameter in FOREIGN_KEYS:
        entry[parameter] = value
    else:
        entry["parameters"] = {**(entry.get("parameters") or {}), parameter: value}
