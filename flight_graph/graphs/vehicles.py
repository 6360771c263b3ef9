"""The vehicles in a scenario's data: scenarios inside a scenario, each under a name, as `flight_graph.graphs.include` puts
them there.

What is one for all is decided by the scenario that includes (`OUTSIDE`); what an included one says about it is left out.
Its seed follows from that of the whole and its name, unless one is set.
"""

from collections.abc import Iterator
from pathlib import Path

from flight_graph.components import names
from flight_graph.errors import FlightError, unknown
from flight_math.noise import stream_key

DEEPEST = 5  # scenarios in each other
OUTSIDE = ("duration_s", "epoch_ns", "base_rate_hz", "record", "live_faults", "watchdog", "vary")


def seed_of(seed: int, name: str) -> int:
    """The seed of a vehicle, from that of the scenario that includes it."""
    return stream_key(seed, f"vehicle {name}")


def named(scenario, path: str):
    """The scenario of a vehicle, ``rover_a`` or ``fleet.rover_a``. Raises FlightError."""
    for name in path.split("."):
        if name not in scenario.vehicles:
            raise unknown("vehicle", name, scenario.vehicles, scenario.name)
        scenario = scenario.vehicles[name]
    return scenario


def refuse_too_deep(data, where: str) -> None:
    """Refuse scenarios that are more than `DEEPEST` deep in each other. Raises FlightError."""
    level = [data]
    for _ in range(DEEPEST + 1):
        level = [found for one in level for _, _, found in inside(one)]
    if level:
        raise FlightError(f"{where}: scenarios include each other more than {DEEPEST} deep")


def own(data: dict) -> dict:
    """What of a scenario's data is its own where it is included."""
    return {key: value for key, value in data.items() if key not in OUTSIDE}


def mapping(value) -> dict:
    """The value where it is a mapping, else an empty one: what is wrong is said by the validation."""
    return value if isinstance(value, dict) else {}


def folder_of(entry: dict) -> Path | None:
    """Where relative names of an included scenario start."""
    found = entry.get("folder")
    return Path(found) if isinstance(found, str) else None


def inside(data) -> Iterator[tuple[str, dict, dict]]:
    """Yield (name, entry, data) of each vehicle of a scenario's gathered data, as far as they have that form."""
    for name, entry in mapping(mapping(data).get("include")).items():
        if isinstance(entry, dict) and isinstance(entry.get("scenario"), dict):
            yield str(name), entry, entry["scenario"]


def values_of(data, key: str) -> Iterator[str]:
    """Yield the texts that a key has in a scenario's gathered data and in those of its vehicles."""
    if isinstance(mapping(data).get(key), str):
        yield data[key]
    for _, _, found in inside(data):
        yield from values_of(found, key)


def components(data, namespace: str = "", folder: Path | None = None) -> Iterator[tuple[str, dict, Path | None]]:
    """Yield (whole name, entry, folder) of the components of a scenario's gathered data, those of its vehicles too."""
    for name, entry in mapping(mapping(data).get("components")).items():
        yield names.joined(namespace, str(name)), entry, folder
    for name, entry, found in inside(data):
        yield from components(found, names.joined(namespace, name), folder_of(entry))
