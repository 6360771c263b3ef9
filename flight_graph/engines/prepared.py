"""A graph made ready once for many runs that differ in values alone: parameters go straight into records that are there.

Schedule, machine codes, memory and tables are made for the first run; a further one finds them as they were before it, with
its own parameters and states. Where faults or monitors stand in the schedule, tables are made anew for each run.
"""

import numpy as np

from flight_graph.components.component import Component
from flight_graph.engines.addresses import same
from flight_graph.engines.compiled import CompiledRun
from flight_graph.engines.flight import Flight
from flight_graph.graphs.graph import Node
from flight_graph.graphs.scenario import Scenario


class PreparedRun:
    """The runs of scenarios of one structure: of the first one, and of those that a `graphs.variation.Variation` makes.

    plan: (node, port) -> every how manieth message is logged; as the scenario says when left out. The scenario's measures
    are taken while a run flies, and need no log.
    """

    def __init__(self, scenario: Scenario, plan: dict | None = None):
        self._run = CompiledRun(scenario, plan=plan, reducing=True)
        self._run.refuse_too_long_a_run(self._run.ticks)
        self._run.compile()
        self.plan, self.ticks = self._run.schedule.plan, self._run.ticks
        self._nodes = dict(scenario.graph.nodes)
        self._slots: list[_Slot] = []

    def flight(self, scenario: Scenario, slot: int = 0) -> Flight:
        """A flight of a scenario at its first tick, with every component started. It lasts until the same slot is taken
        again; slots are numbered from 0.
        """
        while len(self._slots) <= slot:
            self._slots.append(_Slot())
        mine = self._slots[slot]
        if scenario.faults:
            run = CompiledRun(scenario, plan=self.plan, like=self._run, reducing=True)
            return mine.fresh(run, self.ticks)
        if mine.flight is None:
            mine.fresh(self._run, self.ticks)
        mine.flight.begin_again(mine.contents(self._nodes, scenario.graph.nodes))
        return mine.flight


class _Slot:
    """The memory of one flight, and what it holds before the start, by name."""

    def __init__(self):
        self.flight, self._logs, self._first = None, {}, {}

    def fresh(self, run, ticks) -> Flight:
        """A flight in memory of its own, but for the logs."""
        arrays = run.schedule.memory(ticks, self._logs)
        self._logs.update((name, array) for name, array in arrays.items() if name.startswith("L_"))
        self._first = {name: same(array) for name, array in arrays.items() if not name.startswith(("L_", "T_"))}
        self.flight = run.flight(arrays)
        return self.flight

    def contents(self, first: dict[str, Node], nodes: dict[str, Node]) -> dict[str, np.ndarray]:
        """What the arrays hold before the start of a run with these nodes. first: those that the slot was made with."""
        found = dict(self._first)
        for name, node in nodes.items():
            if node is not first[name]:
                found[f"P_{name}"] = _parameters(self._first[f"P_{name}"], first[name], node)
                if node.component.tables.__func__ is not Component.tables.__func__:
                    found[f"X_{name}"] = node.component.initial_state(node.values)
        return found


def _parameters(record: np.ndarray, first: Node, node: Node) -> np.ndarray:
    """The parameters of a node in the record of another one with the same component."""
    made = same(record)
    for name, entry in node.component.parameters.entries.items():
        value = node.values[name]
        if entry.kind != "text" and value != first.values[name]:
            made[name] = entry.words.index(value) if entry.kind == "choice" else value
    return made
