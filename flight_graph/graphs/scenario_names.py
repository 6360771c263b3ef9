"""The names in a scenario's file: of components, vehicles and functions."""

from flight_graph.components import functions, names
from flight_graph.errors import FlightError
from flight_graph.faults import report
from flight_graph.graphs.scenario_file import ScenarioFile
from flight_graph.text_files import short

_TAKEN = ("recorder", "replayer", report.REPORT, report.MONITORS)


def check_names(file: ScenarioFile, origin: str) -> None:
    """Refuse names that are none, are taken, or mean two things. Functions are loaded when they are called for.

    Raises FlightError.
    """
    included = file.include or {}
    if not file.components and not included:
        raise FlightError(f"{origin}: components: there is none; a graph has at least one")
    for key, found in (("components", file.components), ("include", included)):
        for name in found:
            if not names.is_word(name):
                raise FlightError(f"{origin}: {key}.{short(name)}: this is no name of a node; allowed: {names.ALLOWED}")
            if name in _TAKEN:
                raise FlightError(f"{origin}: {key}.{name}: this name is taken by a node of every run; take another")
    for name in included:
        if name in file.components:
            raise FlightError(f"{origin}: include.{name}: a component has this name; take another")
    for key in ("metrics", "figure"):
        if name := getattr(file, key):
            functions.check_name(name, f"{origin}: {key}")
