"""Finding the scene of a scenario or of a bag: its components declare it."""

from functools import reduce

from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import Bag
from flight_graph.components import declared
from flight_graph.components.findings import ComponentMistake
from flight_graph.components.foreign import consent
from flight_graph.errors import FlightError
from flight_graph.graphs import vehicles
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.bag_scenario import SCENARIO, read_scenario
from flight_graph.scenes.motion import frames_of
from flight_graph.scenes.scene import Scene


def scene_of(scenario: Scenario) -> Scene:
    """What the components of a scenario declare, as one scene. Raises FlightError where none declares any."""
    found = [scene for node in scenario.graph.nodes.values() if (scene := component_scene(node.component, node.values))]
    if not found:
        raise FlightError(f"{scenario.origin}: none of its components declares a scene; a component does so by a "
                          "classmethod scene(values)")
    return reduce(Scene.joined, found)


def component_scene(component, values: dict) -> Scene | None:
    """The scene that a component declares for these resolved parameters, or None. Raises FlightError."""
    found = declared.call(component, "scene", values)
    if found is not None and not isinstance(found, Scene):
        raise ComponentMistake(f"{component.__name__}.scene: it returns {type(found).__name__}; needed is a Scene")
    return found.within(component.namespace) if found is not None and component.namespace else found


def scene_of_bag(bag: Bag, trust=False, vehicle: str | None = None) -> Scene:
    """The scene of a bag: that of the scenario that it carries, else the bare frames of its ``/tf``. Raises FlightError.

    vehicle: the one of several that is meant, by itself. trust: whether code may run that does not come with the
    packages, or a consent that is asked, as for `flight_graph.recordings.recorded_run.open_recorded`.
    """
    if SCENARIO in bag.attachments:
        scenario = read_scenario(bag, consent(trust))
        if vehicle:
            return scene_of(vehicles.named(scenario, vehicle))
        if any(component_scene(node.component, node.values) for node in scenario.graph.nodes.values()):
            return scene_of(scenario)
    if vehicle:
        raise BagError(f"bag '{bag.path}': it carries no scenario, so there is no vehicle '{vehicle}' in it")
    frames = frames_of(bag)
    if not frames:
        raise BagError(f"bag '{bag.path}': there is nothing to see in it: it carries no scenario whose components declare "
                       "a scene, and no transforms on /tf or /tf_static")
    return Scene(bag.path.name, frames[0].name, tuple(frames))
