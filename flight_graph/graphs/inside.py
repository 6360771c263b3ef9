"""What the vehicles of a scenario bring into its graph, by whole names. vehicles: name -> `Scenario`."""

from flight_graph.components import names, namespaces
from flight_graph.graphs.graph import Edge, Node


def nodes(vehicles: dict) -> list[Node]:
    """Their nodes, with the same values and rates, in their namespaces."""
    return [Node(names.joined(vehicle, node.name), namespaces.use_within(node.use, vehicle),
                 namespaces.within(node.component, vehicle), node.values, node.rate_hz)
            for vehicle, scenario in vehicles.items() for node in scenario.graph.nodes.values()]


def edges(vehicles: dict) -> dict[tuple[str, str], Edge]:
    """(node, input) -> source, of the connections within them."""
    return {(names.joined(vehicle, node.name), port): Edge(names.joined(vehicle, edge.node), edge.port, edge.delay)
            for vehicle, scenario in vehicles.items()
            for node in scenario.graph.nodes.values() for port, edge in node.inputs.items()}


def events(vehicles: dict) -> list:
    """Their events."""
    return [one.model_copy(update={
        key: {names.joined(vehicle, name): value for name, value in found.items()}
        for key in ("set", "place") if (found := getattr(one, key)) is not None})
            for vehicle, scenario in vehicles.items() for one in scenario.events()]


def without_effect(vehicles: dict) -> dict[str, list[str]]:
    """name of a component -> sentences about its parameters that were given and change nothing."""
    return {names.joined(vehicle, name): said for vehicle, scenario in vehicles.items()
            for name, said in scenario.without_effect().items()}
