"""What a person names to be shown: a bag, or a scenario that is flown."""

from pathlib import Path

from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import Bag
from flight_graph.bags.series import Series, series_of_bag, series_of_signal
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.scenes.finding import scene_of, scene_of_bag
from flight_graph.scenes.scene import Scene

MOST_LINES = 12  # of a plot
_POSES = "tf2_msgs/msg/TFMessage"  # these are the picture
_ENDINGS = (".mcap", ".db3", ".zstd")


def is_bag(name: str) -> bool:
    """Whether a name is that of a bag, and not of a scenario."""
    path = Path(name)
    return path.is_dir() or path.suffix in _ENDINGS


def picture_of_bag(bag: Bag, trust) -> tuple[Scene | None, list[str]]:
    """The scene of a bag, and what is missing of it. trust: as for `flight_graph.scenes.finding.scene_of_bag`."""
    try:
        scene = scene_of_bag(bag, trust)
    except FlightError as error:
        return None, [f"no picture, plots alone: {error}"]
    return scene, [] if scene.shapes else [
        f"no model, the axes of its frames alone: bag '{bag.path}' carries no scenario whose components declare a scene"]


def picture_of(scenario: Scenario) -> tuple[Scene | None, list[str]]:
    """The scene of a scenario, and why there is none."""
    try:
        return scene_of(scenario), []
    except FlightError as error:
        return None, [f"no picture, plots alone: {error}"]


def series_of(scenario: Scenario, units: dict[str, str]) -> list[Series]:
    """What can be plotted of a scenario's run, without values. units: see `flight_graph.viewers.messages.in_memory`."""
    return [one for node, port in scenario.recorded()
            for signal in [scenario.graph.signal(node, port)]
            for one in _shown(series_of_signal(f"/{signal.topic}", signal, units))]


def all_series(bag: Bag, begin_ns: int) -> tuple[list[Series], dict[str, str]]:
    """All that can be plotted of a bag, and topic -> sentence of what cannot be read. begin_ns: log time of t = 0."""
    found, problems = [], {}
    for topic, info in bag.topics.items():
        if info.count and info.type_name != _POSES:
            try:
                found += _shown(series_of_bag(bag, topic, begin_ns))
            except BagError as error:
                problems[topic] = str(error)
    return found, problems


def _shown(series: list[Series]) -> list[Series]:
    """Those that a plot can show: of matrices a person picks single numbers."""
    return [one for one in series if len(one.lines) <= MOST_LINES and "covariance" not in one.name]
