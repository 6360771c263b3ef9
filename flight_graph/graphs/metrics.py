"""The numbers a run is judged by: the scenario's metrics function over the recorded signals."""

import math
import traceback
from contextlib import contextmanager
from functools import reduce
from pathlib import Path

import numpy as np

from flight_graph.components import functions, names, namespaces
from flight_graph.errors import FlightError
from flight_graph.graphs import fault_scores, measures, vehicles
from flight_graph.graphs.scenario import Scenario


def compute(scenario: Scenario, signals, finite: bool = True, reduced: dict | None = None,
            from_above: list | None = None) -> dict:
    """Return the metrics of a run by name, in plain types: those of the scenario's function, if it names one, its
    measures, and the scores of its faults and monitors (`flight_graph.graphs.fault_scores`).

    Those of a vehicle have its name in front: ``rover_a.settling_time_s``.

    signals: a mapping topic -> structured array (a Recording, or a bag's signals). A metric that this run does not have is
    None; units and meanings: `flight_graph.graphs.glossary`. finite: NaN and infinity, which are no numbers either, become
    None, as JSON has neither. reduced: the measures by name, where they were taken while the run flew. from_above: of a
    vehicle, as for `flight_graph.graphs.fault_scores.scores`.
    """
    found = _own(scenario, signals, finite, reduced, from_above)
    for name, vehicle in scenario.vehicles.items():
        struck = fault_scores.in_vehicle(scenario, signals, name, from_above)
        inside = compute(vehicle, Inside(signals, name), finite, None, struck)
        found |= {names.joined(name, key): value for key, value in inside.items()}
    return found


class Inside:
    """The signals of a vehicle, by the names that they have in its own scenario."""

    def __init__(self, signals, vehicle: str):
        self._signals, self._vehicle = signals, vehicle

    def __contains__(self, topic: str) -> bool:
        return self._whole(topic) in self._signals

    def __getitem__(self, topic: str):
        return self._signals[self._whole(topic)]

    def get(self, topic: str, default=None):
        """The records of a topic, or the default where there are none."""
        return self[topic] if topic in self else default

    def _whole(self, topic):
        return namespaces.topic_within(topic.lstrip("/"), self._vehicle)


def vehicle_of(scenario: Scenario, signals, path: str) -> tuple[Scenario, Inside]:
    """The scenario of a vehicle, ``rover_a`` or ``fleet.rover_a``, and its signals. Raises FlightError."""
    return vehicles.named(scenario, path), reduce(Inside, path.split("."), signals)


def _own(scenario, signals, finite, reduced, from_above):
    """Of a scenario without its vehicles."""
    function = of(scenario)
    measured = {name: _plain(value, f"{scenario.origin}: measures.{name}", finite)
                for name, value in _measured(scenario, signals, reduced).items()}
    scored = fault_scores.scores(scenario, signals, from_above) | measured
    if function is None:
        return scored
    with told(f"{scenario.origin}: metrics: '{scenario.file.metrics}'"), np.errstate(all="ignore"):  # told by the numbers
        found = _found(scenario, function, signals)
    if not isinstance(found, dict):
        raise FlightError(f"{scenario.origin}: metrics: '{scenario.file.metrics}' gives {type(found).__name__}; needed is "
                          "a dictionary: name -> number")
    if twice := sorted(set(map(str, found)) & set(measured)):
        raise FlightError(f"{scenario.origin}: measures.{twice[0]}: '{scenario.file.metrics}' gives a number of this name "
                          "too")
    return scored | {str(name): _plain(value, f"{scenario.origin}: metrics: '{scenario.file.metrics}' gives {name}", finite)
                     for name, value in found.items()}


def _found(scenario, function, signals):
    """What a function of metrics gives. Raises FlightError where it asks for a topic that the run did not record."""
    try:
        return function(scenario, signals)
    except KeyError as error:
        topics = {signal.topic for _, _, signal in scenario.graph.outputs()}
        if (topic := str(error.args[0]) if error.args else "") in topics and topic not in signals:
            raise FlightError(f"{scenario.origin}: metrics: '{scenario.file.metrics}' needs /{topic}, which this run does "
                              "not record (record.topics)") from None
        raise


def _measured(scenario, signals, reduced):
    if reduced is None:
        return measures.compute(scenario.measures, scenario, signals)
    return {one.name: reduced.get(one.name) for one in scenario.measures}


@contextmanager
def told(where: str):
    """What a user's function raises, as one sentence with its file and line. Raises FlightError."""
    try:
        yield
    except (FlightError, OSError):
        raise
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)[1:]
        place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
        raise FlightError(f"{where} raises {type(error).__name__}: {error}{place}") from None


def of(scenario: Scenario):
    """The metrics function of a scenario; None when it names none. Raises FlightError."""
    return load(scenario.file.metrics, f"{scenario.origin}: metrics", scenario.folder) if scenario.file.metrics else None


def check(scenario: Scenario) -> None:
    """Load the metrics functions of a scenario and its vehicles. Raises FlightError: call it before a run."""
    of(scenario)
    for vehicle in scenario.vehicles.values():
        check(vehicle)


def figure(scenario: Scenario):
    """The function that draws a scenario's figure. Raises FlightError when it names none."""
    if not scenario.file.figure:
        drawn = [name for name, vehicle in scenario.vehicles.items() if vehicle.file.figure]
        raise FlightError(f"{scenario.name} names no figure" + (
            f"; its vehicles {', '.join(drawn)} do: --vehicle {drawn[0]}" if drawn else ""))
    return load(scenario.file.figure, f"{scenario.origin}: figure", scenario.folder)


def load(name: str, where: str = "metrics", folder=None):
    """The function ``module:function`` or ``file.py:function``. Raises FlightError."""
    return functions.load(name, where, folder)


def _plain(value, where, finite):
    value = value.item() if hasattr(value, "item") and getattr(value, "size", 1) == 1 else value
    if value is not None and not isinstance(value, (bool, int, float, str)):
        raise FlightError(f"{where}: {type(value).__name__} is not allowed; allowed: a number, a text, true or false, None")
    if finite and isinstance(value, float) and not math.isfinite(value):
        return None
    return value
