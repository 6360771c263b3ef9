"""What layouts are made from: the picture and the plots of a scenario's run."""

from dataclasses import dataclass

from flight_graph.bags.series import Series
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recording import column_units, recorded_topics
from flight_graph.scenes.scene import MAP, Scene
from flight_graph.viewers.opening import picture_of, series_of
from flight_graph.viewers.overview import Plot, by_topic, overview

MODEL, MARKERS = "robot_description", "scene"  # the topics of what it looks like


@dataclass(frozen=True)
class Vehicle:
    """scene: None where no component declares one. overview: the plots beside the picture; topics: of each topic.

    namespaces: of its models, ``rover_a`` or "" each: their topics and frames begin so, the names in their URDF do not.
    """

    name: str
    scene: Scene | None
    overview: list[Plot]
    topics: dict[str, list[Plot]]
    namespaces: tuple[str, ...] = ("",)

    @classmethod
    def of(cls, name: str, scene: Scene | None, series: list[Series], namespaces: tuple[str, ...] = ("",)) -> "Vehicle":
        """A vehicle of which these series can be plotted."""
        return cls(name, scene, overview(series), by_topic(series), namespaces)

    @property
    def still_frame(self) -> str:
        """The frame that stands still in the picture: the one that trails are seen in, so that no ground turns away."""
        return self.scene.trails[0].seen_in if self.scene is not None and self.scene.trails else MAP

    @property
    def extent(self) -> float:
        """How much is to be seen [m]."""
        return self.scene.extent if self.scene is not None else 5.0


def vehicle_of(scenario: Scenario) -> Vehicle:
    """What a scenario's layouts show."""
    recorded = recorded_topics(scenario)
    models = [topic.topic for topic in recorded if topic.topic.rpartition("/")[2] == MODEL]
    series = series_of(scenario, column_units(recorded))
    return Vehicle.of(scenario.name, picture_of(scenario)[0], series, tuple(
        dict.fromkeys(topic.rpartition("/")[0] for topic in models)) or ("",))
