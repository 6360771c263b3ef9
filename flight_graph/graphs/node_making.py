"""The nodes of a scenario's components: checked parameters, some of them taken from other components, streams of noise."""

import os
from pathlib import Path

from flight_graph.components import declared, registry
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs import expressions, foreign_nodes
from flight_graph.graphs.graph import Node
from flight_graph.graphs.scenario_file import FOREIGN
from flight_math.noise import stream_key


class NodeMaker:
    """Makes the nodes of a scenario's own components. Raises FlightError.

    entries: of its file, by name; vehicles: whole name -> node, of those whose parameters the components may read as well.
    without_effect: name -> sentences about parameters that were given and change nothing.
    """

    def __init__(self, entries: dict, seed: int, origin: str, folder: Path | None, vehicles: dict[str, Node]):
        self._entries, self._seed, self._origin, self._folder = entries, seed, origin, folder
        self._vehicles, self._outside = list(vehicles.values()), {name: node.values for name, node in vehicles.items()}
        self.without_effect = {}

    def nodes(self) -> list[Node]:
        """The nodes in the order of the file; one that reads another's parameters is made after it."""
        made, waiting = {}, {name: entry for name, entry in self._entries.items() if entry.use != FOREIGN}
        while waiting:
            known = {**self._outside, **{name: node.values for name, node in made.items()}}
            ready = [name for name, entry in waiting.items() if not self.read_by(name, entry) & waiting.keys()]
            if not ready:
                raise FlightError(f"{self._origin}: components: {' and '.join(waiting)} take parameters from each other "
                                  "(or from themselves) in a circle")
            for name in ready:
                made[name] = self._node(name, waiting.pop(name), known)
        others = [*made.values(), *self._vehicles]
        made |= {name: foreign_nodes.node(name, entry, others, f"{self._origin}: components.{name}")
                 for name, entry in self._entries.items() if entry.use == FOREIGN}
        return [made[name] for name in self._entries]

    def read_by(self, name: str, entry) -> set[str]:
        """Names of the components whose parameters an entry reads."""
        read, known = set(), [*self._entries, *self._outside]
        for key, value in entry.parameters.items():
            if expressions.is_expression(value):
                where = f"{self._origin}: components.{name}.parameters.{key}"
                for other in expressions.references(value, known, where):
                    if other not in known:
                        raise unknown("component", other, known, where)
                    if other in self._entries and self._entries[other].use == FOREIGN:
                        raise FlightError(f"{where}: {other} is a foreign node, whose parameters are its own")
                    read.add(other)
        return read

    def _node(self, name, entry, known):
        where = f"{self._origin}: components.{name}"
        given = {key: expressions.evaluate(value, known, f"{where}.parameters.{key}")
                 if expressions.is_expression(value) else value for key, value in entry.parameters.items()}
        foreign_nodes.refuse_keys(entry, where)
        try:
            use = registry.absolute(entry.use, self._folder)
            component = registry.component(use)
        except FlightError as error:
            raise FlightError(f"{where}.use: {error}") from None
        values = component.parameters.defaults()
        if "seed" in component.parameters.entries:
            values["seed"] = stream_key(self._seed, name)
        given = component.parameters.validate(given, f"{where}.parameters")
        values.update(given)
        values = declared.resolved(component, values, f"{where}.parameters", self._folder)
        if (fitted := declared.call(component, "fitted", values)) is not None:
            use, component = fitted, registry.component(fitted)
        self.without_effect[name] = list(_without_effect(component.parameters, given, values))
        rate = component.rate_hz if entry.rate_hz is None else entry.rate_hz
        return Node(name, use, component, values, rate)


def _without_effect(parameters, given, values):
    """Sentences about given parameters that change nothing: others decide them, or the chosen form does not use them."""
    defaults = parameters.defaults()
    for name, value in given.items():
        if values[name] != value and not _is_found_file(value, values[name]):
            yield f"{name} is given and has no effect: it follows from other parameters"
            continue
        for choice, words in parameters.entries[name].used_if:
            if value != defaults[name] and values[choice] not in words:
                yield (f"{name} is given and has no effect with {choice} {values[choice]}; it is used with "
                       f"{' and '.join(words)}")


def _is_found_file(given, found) -> bool:
    """Whether a value is the name of a file, and what became of it the place where that file lies."""
    return isinstance(given, str) and isinstance(found, str) and os.path.isabs(found) and (
        os.path.basename(found) == os.path.basename(given))
