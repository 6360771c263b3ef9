"""A recorded run, opened to be run again: its scenario with the code it carries, how it was made and how it ended."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from flight_graph.bags.reader import Bag, read_bag
from flight_graph.engines.cache import cache_folder
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.recording import SCENARIO, BagSignals, RecordedTopic, recorded_topics, versions

CODE = ("flight_graph", "commit")  # versions of this project; all others are of what it stands on


@dataclass(frozen=True)
class RecordedRun:
    """changed: version -> (in the bag, here), of those that differ. recovered: the bag was made by `flight recover`."""

    bag: Bag
    scenario: Scenario
    engine: str
    pace: str
    complete: bool
    recovered: bool
    changed: dict[str, tuple[str, str]]

    @property
    def signals(self) -> BagSignals:
        return BagSignals(self.bag, self.scenario)

    @property
    def is_realtime(self) -> bool:
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
    return Scenario({**data, "duration_s": duration_ns / 1e9}, scenario.origin)


def open_recorded(path, trust: bool = False) -> RecordedRun:
    """Open the bag of a run. Raises FlightError.

    trust: run component files that the bag carries even where this machine has no file of the same content.
    """
    bag = read_bag(path)
    if SCENARIO not in bag.attachments:
        raise FlightError(f"{path}: this bag carries no scenario; it was not recorded by a run of this project")
    try:
        data = json.loads(bag.attachments[SCENARIO].data)
        for name, entry in data["components"].items():
            entry["use"] = _runnable(bag, name, entry["use"], trust)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, FlightError):
            raise
        raise FlightError(f"{path}: its attachment {SCENARIO} is no scenario") from None
    made, ended, here = bag.metadata.get("flight_graph", {}), bag.metadata.get("flight_graph.outcome", {}), versions()
    changed = {name: (made.get(name, "unknown"), now) for name, now in here.items() if made.get(name) != now}
    return RecordedRun(bag, Scenario(data, f"{path} ({SCENARIO})"), made.get("engine", "unknown"),
                       made.get("pace", "unknown"), ended.get("complete") == "true",
                       "recovered" in bag.metadata, changed)


def _runnable(bag, name: str, use: str, trust: bool) -> str:
    """``use`` of a component; one in a user's own file is taken from the bag, with the user's consent."""
    source, _, attribute = use.rpartition(":")
    if not source.endswith(".py"):
        return use
    attachment = bag.attachments.get(f"component/{name}.py")
    if attachment is None:
        raise FlightError(f"{bag.path}: component {name} is '{use}', and the bag does not carry this file")
    original = Path(source)
    if original.is_file() and original.read_bytes() == attachment.data:
        return use
    if not trust:
        raise FlightError(
            f"{bag.path}: component {name} is code that the bag carries ({original.name}); read it (flight info "
            f"{bag.path} --attachment component/{name}.py), then add --trust to run it")
    folder = cache_folder("components")
    stem = "".join(letter if letter.isalnum() else "_" for letter in original.stem)
    path = folder / f"{stem}_{hashlib.sha256(attachment.data).hexdigest()[:16]}.py"
    path.write_bytes(attachment.data)
    return f"{path}:{attribute}"
