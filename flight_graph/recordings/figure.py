"""The figure that a scenario names for its runs, drawn from recorded signals."""

from pathlib import Path

from flight_graph.errors import FlightError
from flight_graph.graphs.metrics import figure, told
from flight_graph.graphs.scenario import Scenario


def draw_overview(scenario: Scenario, signals, path: Path) -> Path:
    """Draw it. Raises FlightError where the scenario names none, or it cannot be written."""
    draw = figure(scenario)
    try:
        with told(f"{scenario.origin}: figure: '{scenario.file.figure}'"):
            return draw(scenario, signals, path)
    except OSError as error:
        raise FlightError(f"'{path}' cannot be written: {(error.strerror or str(error)).lower()}") from None
