"""The cases of a scenario's ``vary`` block, made from what they share: no file is read, no graph is wired again.

A case that changes parameters, seeds or faults alone gets the nodes, the wiring and the order of the others; only the nodes
whose values change are made anew, by the same code as those of a scenario. What changes the graph itself (a rate, a
component, the duration) makes a scenario of its own, which further cases share. A scenario with vehicles is made whole for
each case, but for the vehicles that stay as they are.
"""

import copy
from dataclasses import replace

from flight_graph.components import declared
from flight_graph.errors import FlightError
from flight_graph.faults import fault_file
from flight_graph.faults.fault_set import FaultSet
from flight_graph.faults.report import REPORT
from flight_graph.graphs import events, expressions
from flight_graph.graphs.scenario import Scenario
from flight_graph.graphs.setting import override
from flight_math.noise import stream_key

_KEPT = 8  # scenarios of other structure that are kept


class Variation:
    """Cases of a scenario. Raises FlightError when it has no ``vary`` block."""

    def __init__(self, scenario: Scenario):
        if scenario.vary is None:
            raise FlightError(f"{scenario.origin}: it has no 'vary' block, so it has no cases")
        self.scenario = scenario
        self._data = scenario.file.model_dump(by_alias=True, exclude={"vary"})
        self._bases = {}  # structure -> _Base, the latest last

    def case(self, number: int) -> tuple[Scenario, tuple]:
        """The scenario of a case, and its structure: cases of equal structure differ in values. Raises FlightError."""
        return self.of_values(self.scenario.vary.overrides(number), number)

    def of_values(self, values: dict, number: int) -> tuple[Scenario, tuple]:
        """The scenario with these values by key, for a case of this number. Raises FlightError."""
        structure = tuple(sorted((key, repr(value)) for key, value in values.items() if _is_structural(key)))
        if self.scenario.vehicles:
            return self._whole(values, number), structure
        try:
            base = self._base(structure, {key: values[key] for key, _ in structure})
            made = base.with_values({key: value for key, value in values.items() if not _is_structural(key)})
        except FlightError:
            made = None
        if made is None:  # the long way, which says what is wrong with the case
            return self._whole(values, number), (*structure, "alone", number)
        return made, structure

    def _whole(self, values, number) -> Scenario:
        data = override(self._data, values, f"vary, case {number}", self.scenario.folder)
        return Scenario(data, self.scenario.origin, self.scenario.folder, self.scenario)

    def _base(self, structure, values):
        if structure not in self._bases:
            if len(self._bases) == _KEPT:
                self._bases.pop(next(iter(self._bases)))
            data = override(self._data, values, "vary", self.scenario.folder)
            self._bases[structure] = _Base(Scenario(data, self.scenario.origin, self.scenario.folder))
        return self._bases[structure]


class _Base:
    """A scenario, and of each node what it is made from: the checked values before they are resolved, and whom it reads."""

    def __init__(self, scenario: Scenario):
        self.scenario, self._given, self._checked = scenario, {}, {}
        entries, nodes = scenario.file.components, scenario.graph.nodes
        self._reads = {name: scenario.maker.read_by(name, entry) for name, entry in entries.items()}
        self._order = []
        while len(self._order) < len(entries):
            self._order += [name for name, read in self._reads.items()
                            if name not in self._order and read <= set(self._order)]
        self._seeded = {name for name, entry in entries.items()
                        if "seed" in nodes[name].component.parameters.entries and "seed" not in entry.parameters}
        for name in self._order:
            self._given[name] = {key: value for key, value in entries[name].parameters.items()
                                 if expressions.is_expression(value)}
            self._checked[name] = self._values(name, entries[name].parameters, nodes, scenario.seed,
                                               nodes[name].component.parameters.defaults())

    def _values(self, name, given, nodes, seed, values) -> dict:
        """Checked values of a node: those that there are, updated by the given ones. Raises FlightError."""
        where = f"{self.scenario.origin}: components.{name}.parameters"
        given = {key: expressions.evaluate(value, {other: nodes[other].values for other in self._reads[name]}, where)
                 if expressions.is_expression(value) else value for key, value in given.items()}
        if name in self._seeded:
            values = {**values, "seed": stream_key(seed, name)}
        return values | nodes[name].component.parameters.validate(given, where)

    def with_values(self, values: dict) -> Scenario | None:
        """The scenario with parameters, seed and faults changed; None where it needs the long way. Raises FlightError."""
        base, components, faults, seed = self.scenario, {}, self.scenario.file.faults, self.scenario.seed
        for key, value in values.items():
            name, _, parameter = key.partition(".")
            if expressions.is_expression(value):
                return None
            if name == REPORT and parameter:
                faults = fault_file.override(faults, parameter, value, key)
            elif parameter and name in self._reads:
                components.setdefault(name, {})[parameter] = value
            elif key == "seed" and type(value) is int and -2**63 <= value < 2**63:
                seed = value
            else:
                return None
        return self._varied(base, components, faults, seed)

    def _varied(self, base, components, faults, seed):
        made = copy.copy(base)
        entries = {name: entry.model_copy(update={"parameters": {**entry.parameters, **components[name]}})
                   if name in components else entry for name, entry in base.file.components.items()}
        made.file = base.file.model_copy(update={"components": entries, "faults": faults, "seed": seed})
        made.graph = copy.copy(base.graph)
        made.graph.nodes = dict(base.graph.nodes)
        changed = set(components) | (self._seeded if seed != base.seed else set())
        for name in self._order:
            if name in changed or self._reads[name] & changed:
                changed.add(name)
                nodes, given = made.graph.nodes, self._given[name] | components.get(name, {})
                values = self._values(name, given, nodes, seed, self._checked[name])
                values = declared.resolved(nodes[name].component, values, f"{base.origin}: components.{name}.parameters",
                                           base.folder)
                if declared.call(nodes[name].component, "fitted", values) is not None:
                    return None
                nodes[name] = replace(nodes[name], values=values)
        if base.faults:
            made.faults = _faults(made, base)
        return made


def _faults(made, base):
    """Faults and events of a scenario whose values have changed; its monitors are those of the base."""
    entries, changes = base.faults.entries, base.faults.changes
    if changes:
        nodes = {name: made.graph.nodes[name] for name in made.file.components}
        changes = events.changes(made.file.events, nodes, f"{made.origin}: events", made.folder)
    if made.file.faults is not base.file.faults:
        entries = made._with_spares(fault_file.read(made.file.faults or [], f"{made.origin}: faults"))
    return FaultSet(entries, made.graph.nodes, made.seed, f"{made.origin}: faults", base.faults.monitors, made.epoch_ns,
                    bool(made.live_ids), changes, placements=base.faults.placements)


def _is_structural(key: str) -> bool:
    return key.endswith((".use", ".rate_hz")) or key == "duration_s"
