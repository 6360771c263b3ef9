"""Which engine runs a scenario, and at which pace."""

from flight_graph.errors import FlightError, unknown
from flight_graph.graphs.scenario import Scenario

ENGINES = ("compiled", "python", "ros")


def check_engine(scenario: Scenario, engine: str) -> None:
    """Refuse an engine that does not exist or that the scenario cannot run in."""
    if engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    if engine != "ros":
        refuse_foreign(scenario)
    _check_only(scenario, engine)


def _check_only(scenario, engine):
    only = scenario.file.only
    if only and (engine == "ros") != (only.engine == "ros"):
        raise FlightError(f"{scenario.name} runs in the {only.engine} engine only: {only.because}")
    for vehicle in scenario.vehicles.values():
        _check_only(vehicle, engine)


def refuse_foreign(scenario: Scenario) -> None:
    """Refuse a run in process with a foreign node, unless what it said is recorded. Raises FlightError."""
    if scenario.foreign and not scenario.tapes:
        raise FlightError(
            f"{scenario.name}: {' and '.join(scenario.foreign)} stands for a foreign node, so only --engine ros can fly "
            "it, with that node running; from the bag of such a run, any engine verifies, replays and steps through it")


def parse_pace(text: str) -> tuple[str, float]:
    """``lockstep``, ``realtime`` or ``realtime:FACTOR`` as (pace, factor). Raises FlightError."""
    pace, _, factor = text.partition(":")
    if pace not in ("lockstep", "realtime") or (factor and pace == "lockstep"):
        raise FlightError(f"--pace {text}: allowed: lockstep, realtime or realtime:FACTOR")
    try:
        number = float(factor) if factor else 1.0
    except ValueError:
        number = 0.0
    if not 0.0 < number < float("inf"):
        raise FlightError(f"--pace {text}: the factor must be a number greater than 0")
    return pace, number


def pace_text(pace: str, factor: float) -> str:
    """The pace as `parse_pace` reads it: ``lockstep`` or ``realtime:FACTOR``."""
    return pace if pace == "lockstep" else f"{pace}:{factor:g}"
