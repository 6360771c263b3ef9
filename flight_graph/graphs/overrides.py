"""What a person sets in a scenario from outside: parameters, rates, seed, duration, parameter files."""

from pathlib import Path

from flight_graph import yaml_text
from flight_graph.components import parameter_file
from flight_graph.components.foreign import Consent, agree
from flight_graph.errors import FlightError
from flight_graph.graphs import scenario as scenarios
from flight_graph.graphs import vehicles
from flight_graph.text_files import short


def parse_settings(settings) -> dict:
    """``KEY=VALUE`` texts as a dictionary; values are YAML. Raises FlightError."""
    parsed = {}
    for text in settings or []:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise FlightError(f"--set {text}: write COMPONENT.PARAM=VALUE")
        try:
            parsed[key] = yaml_text.parse(value, "")
        except FlightError:
            raise FlightError(f"--set {short(text)}: '{short(value)}' is no value") from None
    return parsed


def overrides(scenario: str, settings=None, params: list[Path] | None = None, seed: int | None = None,
              duration: float | None = None, consent: Consent | None = None, tell=None) -> dict:
    """What options set in a scenario, by key; settings come on top of parameter files. Raises FlightError.

    consent: as for `scenario.load`; None: to everything. tell(sentence) is called for what of a parameter file is left out.
    """
    found = {}
    if params:
        data, _, folder = scenarios.read(scenario, consent=consent or agree)
        components = {name: (str(vehicles.mapping(entry).get("use", "")), start)
                      for name, entry, start in vehicles.components(data, folder=folder)}
        for path in params:
            values, remarks = parameter_file.overrides(path, components)
            found.update(values)
            for remark in remarks if tell else ():
                tell(f"warning: {remark}; this section is left out")
    found.update(parse_settings(settings))
    if seed is not None:
        found["seed"] = seed
    if duration is not None:
        found["duration_s"] = duration
    return found
