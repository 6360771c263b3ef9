"""The numbers a run is judged by: the scenario's metrics function over the recorded signals."""

import importlib
import math

from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario


def compute(scenario: Scenario, signals) -> dict:
    """Return the metrics of a run by name, in plain types; {} when the scenario names no function.

    signals: a mapping topic -> structured array (a Recording, or a bag's signals).
    """
    if not scenario.file.metrics:
        return {}
    function = load(scenario.file.metrics)
    found = function(scenario, signals)
    return {name: _plain(value) for name, value in found.items()}


def load(name: str):
    """The function ``module:attribute``."""
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ModuleNotFoundError, AttributeError) as error:
        raise FlightError(f"metrics: '{name}' cannot be loaded: {error}") from None


def _plain(value):
    value = value.item() if hasattr(value, "item") else value
    if isinstance(value, float) and not math.isfinite(value):
        return None  # "never": JSON has no NaN
    return value
