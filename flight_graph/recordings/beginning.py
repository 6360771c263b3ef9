"""Checkpoints in a bag: those that a run left on its way, and the one that it began at, if not at t = 0."""

import json
from dataclasses import dataclass, field, replace

from flight_graph.bags.errors import quoted
from flight_graph.bags.reader import Bag
from flight_graph.engines.checkpoint import FOLDER, Checkpoint, is_kept, shape
from flight_graph.engines.schedule import Schedule
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.bag_scenario import INJECTED_FAULTS, SET_PARAMETERS
from flight_graph.text_files import parse_json
from flight_graph.timebase import SECOND

BEGINS = "flight_graph.begins"  # metadata of a run that did not begin at t = 0
_LONGEST = 100_000  # [characters] of the changes


@dataclass(frozen=True)
class Beginning:
    """Where a run begins that goes on where another one stood.

    checkpoint: what it begins with, changes included; parent: name of the other one's bag; parent_digest: of its memory at
    this tick; changes: what was set, by key; none: it is the same run, continued.
    """

    checkpoint: Checkpoint
    parent: str
    parent_digest: str
    changes: dict = field(default_factory=dict)

    def metadata(self) -> dict[str, str]:
        """As a bag carries it."""
        return {"tick": str(self.checkpoint.tick), "t_s": f"{self.checkpoint.t_ns / SECOND:.9f}", "parent": self.parent,
                "parent_digest": self.parent_digest, "changes": json.dumps(self.changes)}

    def sentence(self) -> str:
        """What it is, for a person."""
        what = "continues" if not self.changes else "branches off"
        changes = ", ".join(f"{key}={value}" for key, value in self.changes.items())
        return (f"{what} {self.parent} at t = {self.checkpoint.t_ns / SECOND:.9g} s (tick {self.checkpoint.tick})"
                + (f" with {changes}" if changes else ""))


def ticks(bag: Bag) -> list[int]:
    """The ticks of a bag's checkpoints, that of its beginning included.

    Where something was set or injected while the graph ran, the bag is run again from a scenario that knows it from the
    start; checkpoints on the way are not of that one.
    """
    found = sorted(int(name.removeprefix(FOLDER)) for name in bag.attachments
                   if name.startswith(FOLDER) and name.removeprefix(FOLDER).isdecimal())
    if bag.metadata.keys() & {INJECTED_FAULTS, SET_PARAMETERS}:
        return [tick for tick in found if str(tick) == bag.metadata.get(BEGINS, {}).get("tick")]
    return found


def checkpoint(bag: Bag, tick: int) -> Checkpoint:
    """A checkpoint of a bag. Raises FlightError where there is none, or it is damaged."""
    name = f"{FOLDER}{tick:012d}"
    if name not in bag.attachments:
        known = ticks(bag)
        raise FlightError(f"bag {quoted(bag.path)}: it has no checkpoint of tick {tick}; "
                          + (f"it has those of {_some(known)}" if known else "it has none at all"))
    where = f"bag {quoted(bag.path)}: its attachment {name}"
    found = Checkpoint.decode(bytes(bag.attachments[name].data), where)
    if found.tick != tick:
        raise FlightError(f"{where}: it is damaged: it is of tick {found.tick}")
    return found


def with_what_was_set(begin: Beginning, scenario: Scenario) -> Beginning:
    """A beginning for its scenario with the parameters that were set later, during the run: they are events, whose memory
    is empty before they come.
    """
    memory, found = Schedule.of(scenario.graph, {}, scenario.faults).memory(0), dict(begin.checkpoint.arrays)
    for name in sorted(memory.keys() - found.keys()):
        if name.startswith("N_"):
            found[name] = found[f"P_{name[2:]}"]
        elif name.startswith("A_") and ".set " in name:
            found[name] = bytes(memory[name].nbytes)
    layouts = shape(scenario.graph, memory, scenario.epoch_ns)["records"]
    made = {**begin.checkpoint.shape, "records": {**layouts, **begin.checkpoint.shape["records"]}}
    if found.keys() != {name for name in memory if is_kept(name)}:
        return begin  # of another graph: who takes it up says so
    return replace(begin, checkpoint=Checkpoint(begin.checkpoint.tick, made, {name: found[name] for name in sorted(found)}))


def _some(known: list[int]) -> str:
    shown = [str(tick) for tick in known]
    return ", ".join(shown if len(shown) <= 6 else [*shown[:3], "...", *shown[-2:]])


def read_beginning(bag: Bag) -> Beginning | None:
    """Where a bag's run began; None: at t = 0. Raises FlightError."""
    said = bag.metadata.get(BEGINS)
    if said is None:
        return None
    where = f"bag {quoted(bag.path)}: its metadata {BEGINS}"
    changes = parse_json(said.get("changes", "{}"), where, _LONGEST)
    tick = said.get("tick", "")
    if not (tick.isdecimal() and len(tick) < 19 and isinstance(changes, dict)):
        raise FlightError(f"{where}: it does not say where the run began")
    return Beginning(checkpoint(bag, int(tick)), said.get("parent", "unknown"), said.get("parent_digest", ""), changes)
