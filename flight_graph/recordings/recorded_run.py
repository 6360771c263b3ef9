"""A recorded run, opened to be run again: its scenario with the code it carries, how it was made and how it ended."""

from dataclasses import dataclass

import numpy as np

from flight_graph.bags.reader import Bag, read_bag
from flight_graph.components.foreign import consent
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings import beginning
from flight_graph.recordings.bag_scenario import SET_PARAMETERS, read_scenario
from flight_graph.recordings.beginning import Beginning
from flight_graph.recordings.recording import BagSignals, RecordedTopic, recorded_topics, versions

CODE = ("flight_graph", "commit")  # versions of this project; all others are of what it stands on


@dataclass(frozen=True)
class RecordedRun:
    """changed: version -> (in the bag, here), of those that differ. recovered: the bag was made by `flight recover`.

    begin: where the run began, if not at t = 0.
    """

    bag: Bag
    scenario: Scenario
    engine: str
    pace: str
    complete: bool
    recovered: bool
    changed: dict[str, tuple[str, str]]
    begin: Beginning | None = None

    @property
    def first(self) -> Checkpoint | None:
        """The memory that the run began with; None: that of t = 0."""
        return self.begin.checkpoint if self.begin else None

    @property
    def begin_ns(self) -> int:
        """Time of its first tick [ns]."""
        return self.first.t_ns if self.first else 0

    def checkpoint_before(self, tick: int) -> Checkpoint | None:
        """The newest checkpoint not behind a tick; None: the start at t = 0. Raises FlightError where it is damaged."""
        known = [one for one in beginning.ticks(self.bag) if one <= tick]
        if not known or (self.first and known[-1] == self.first.tick):
            return self.first
        return beginning.checkpoint(self.bag, known[-1])

    @property
    def signals(self) -> BagSignals:
        """The messages as a metrics function gets them: topic -> structured array (n,)."""
        return BagSignals(self.bag, self.scenario)

    @property
    def is_realtime(self) -> bool:
        """Whether the run kept the wall clock, so that it cannot be repeated to the bit."""
        return self.pace.startswith("realtime")

    @property
    def same_machine(self) -> bool:
        """Whether everything but this project's own code is what the bag was made with."""
        return not self.changed.keys() - set(CODE)

    @property
    def recorded_until_ns(self) -> int:
        """End [ns since the start of the run] of what the bag holds: one tick behind its last message."""
        if not any(topic.count for topic in self.bag.topics.values()):
            return 0
        return min(self.bag.end_ns - self.scenario.epoch_ns + self.scenario.graph.base_ns, self.scenario.duration_ns)

    def topics(self, node: str | None = None) -> list[RecordedTopic]:
        """The recorded topics (of one node), in the order of the schedule."""
        return [topic for topic in recorded_topics(self.scenario) if node in (None, topic.node)]

    def changes_sentence(self) -> str:
        """What differs between the machine that made the bag and this one."""
        return "versions differ: " + ", ".join(
            f"{name} {then} in the bag, {now} here" for name, (then, now) in self.changed.items())


def shortened(scenario: Scenario, duration_ns: int) -> Scenario:
    """The scenario, ended earlier."""
    data = scenario.file.model_dump(by_alias=True, exclude_none=True)
    made = Scenario({**data, "duration_s": duration_ns / 1e9}, scenario.origin)
    made.tapes = scenario.tapes
    return made


def open_recorded(path, trust=False, set_before_ns: int | None = None) -> RecordedRun:
    """Open the bag of a run. Raises FlightError.

    trust: whether code may run that does not come with the packages (component files that the bag carries, modules that
    it names), or a consent that is asked (`flight_graph.components.foreign`). set_before_ns: see
    `flight_graph.recordings.bag_scenario.read_scenario`.
    """
    bag = read_bag(path)
    scenario = read_scenario(bag, consent(trust), set_before_ns=set_before_ns)
    scenario.tapes = tapes(bag, scenario)
    made, ended, here = bag.metadata.get("flight_graph", {}), bag.metadata.get("flight_graph.outcome", {}), versions()
    changed = {name: (made.get(name, "unknown"), now) for name, now in here.items() if made.get(name) != now}
    begin = beginning.read_beginning(bag)
    if begin and SET_PARAMETERS in bag.metadata:
        begin = beginning.with_what_was_set(begin, scenario)
    return RecordedRun(bag, scenario, made.get("engine", "unknown"), made.get("pace", "unknown"),
                       ended.get("complete") == "true", "recovered" in bag.metadata, changed, begin)


def tapes(bag: Bag, scenario: Scenario) -> dict:
    """(node, port) -> (ticks, records): what the foreign nodes of a run said. Raises FlightError."""
    signals, found, base_ns = BagSignals(bag, scenario), {}, scenario.graph.base_ns
    for name in scenario.foreign:
        for port, signal in scenario.graph.nodes[name].component.outputs.items():
            stamps, records = np.empty(0, np.int64), signal.zeros(0)
            if signal.topic in signals:
                stamps, records = bag.stamps_ns(f"/{signal.topic}") - scenario.epoch_ns, signals[signal.topic]
            found[name, port] = stamps // base_ns, records
    return found
