"""What a run's bag holds, the same for every engine: topics in the order of the schedule, attachments, metadata."""

import json
import platform
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np

from flight_graph.bags.reader import read_bag
from flight_graph.bags.writer import BagWriter
from flight_graph.components.component import Formatted
from flight_graph.components.foreign import consent
from flight_graph.engines.checkpoint import MEDIA_TYPE, Checkpoint
from flight_graph.engines.compiled import Recording
from flight_graph.graphs.papers import papers
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.bag_scenario import SCENARIO, read_scenario
from flight_graph.recordings.beginning import BEGINS, Beginning
from msg_schemas.definitions import TYPESTORE
from msg_schemas.qos import Role
from msg_schemas.signal import Signal


@dataclass(frozen=True)
class RecordedTopic:
    """One topic of a run's bag. formatted: None for a signal's own messages; period_ns: time between recorded ones."""

    topic: str
    type_name: str
    role: Role
    node: str
    port: str
    signal: Signal
    source_period_ns: int
    period_ns: int
    formatted: Formatted | None = None


def recorded_topics(scenario: Scenario) -> list[RecordedTopic]:
    """The topics of a scenario's bag, in the order in which messages of one stamp are written."""
    topics = []
    for (name, port), every in scenario.recorded().items():
        node, signal = scenario.graph.nodes[name], scenario.graph.signal(name, port)
        period = node.output_period_ns(port)
        topics.append(RecordedTopic(
            signal.topic, signal.type_name, signal.role, name, port, signal, period, period * every))
        for made in node.component.said(node.values):
            if made.port == port:
                topics.append(RecordedTopic(
                    made.topic, made.type_name, made.role, name, port, signal, period, period * every, made))
    return topics


def formatted_payload(made: Formatted, record: np.ndarray) -> bytes:
    """The serialised form of a formatted message, from a (1,) record array; the same in every engine."""
    return bytes(TYPESTORE.serialize_cdr(made.function(record.view(np.recarray)[0]), made.type_name))


def versions() -> dict[str, str]:
    """Versions of everything that can change a bit of a run."""
    packages = {name: _version(name) for name in ("flight_graph", "numpy", "numba", "llvmlite", "scipy")}
    return {"python": platform.python_version(), **packages, "commit": _commit(), "machine": platform.machine(),
            "cpu": processor(), "libc": " ".join(platform.libc_ver()), "platform": sys.platform}


class RunBag:
    """The bag of one run, open for writing. begin: where the run begins, if not at t = 0."""

    def __init__(self, folder, scenario: Scenario, engine: str, pace: str, overwrite: bool = False,
                 begin: Beginning | None = None):
        self.topics = recorded_topics(scenario)
        self.writer = BagWriter(
            folder, flush_period_s=scenario.file.record.flush_period_s, overwrite=overwrite)
        self._handles, self._scenario = {}, scenario
        for topic in self.topics:
            name = "/" + topic.topic
            if name not in self._handles:
                self._handles[name] = self.writer.add_topic(name, topic.type_name, topic.role.qos)
        self.writer.attach(SCENARIO, "application/json", json.dumps(scenario.resolved(), indent=1).encode())
        for node in scenario.graph.nodes.values():
            source = node.use.rpartition(":")[0]
            if source.endswith(".py"):
                self.writer.attach(f"component/{node.name}.py", "text/x-python", Path(source).read_bytes())
        self.writer.metadata("units", column_units(self.topics))
        if scenario.file.paper in (known := papers()):
            self.writer.attach("claims.yaml", "application/yaml", known[scenario.file.paper].read_bytes())
        self.writer.metadata("flight_graph", {"scenario": scenario.name, "engine": engine, "pace": pace,
                                              "seed": str(scenario.seed), **versions()})
        if found := scenario.warnings():
            self.writer.metadata("flight_graph.warnings", {str(number): text for number, text in enumerate(found)})
        if begin:
            self.writer.metadata(BEGINS, begin.metadata())
            self.keep(begin.checkpoint)

    def keep(self, checkpoint: Checkpoint) -> None:
        """Append a checkpoint."""
        self.writer.attach(checkpoint.name, MEDIA_TYPE, checkpoint.encode())

    def write(self, topic: RecordedTopic, t_ns: int, payload: bytes) -> None:
        """Append a message; t_ns counts from the start of the run."""
        self.writer.write(self._handles["/" + topic.topic], self._scenario.epoch_ns + t_ns, payload)

    def write_all(self, blocks) -> None:
        """Append whole topics, merged by stamp: (topic, stamps since the start of the run (n,), n payloads) each."""
        write_blocks(self.writer, [(self._handles["/" + topic.topic], self._scenario.epoch_ns + stamps, payloads)
                                   for topic, stamps, payloads in blocks])

    def close(self, outcome: dict[str, str]) -> None:
        """Write how the run ended, and close."""
        self.writer.metadata("flight_graph.outcome", outcome)
        self.writer.close()


def write_recording(recording: Recording, folder, engine: str, overwrite: bool = False,
                    begin: Beginning | None = None, complete: bool = True, happened: dict | None = None) -> None:
    """Write an in-process run as a bag: messages by stamp, then in the order of the schedule. begin: as for `RunBag`.

    complete: whether it came to its end, where no component stopped it; happened: name of a metadata record -> texts of
    what was done to it while it ran (see `flight_graph.recordings.bag_scenario`).
    """
    bag = RunBag(folder, recording.scenario, engine, "none", overwrite, begin)
    for checkpoint in recording.checkpoints:
        bag.keep(checkpoint)
    tracks = {(track.node, track.port): track for track in recording.tracks}
    found = [(topic, tracks[topic.node, topic.port]) for topic in bag.topics]
    bag.write_all([(topic, *messages(topic, track.stamps_ns, track.records)) for topic, track in found])
    for name, texts in (happened or {}).items():
        if texts:
            bag.writer.metadata(name, {str(number): text for number, text in enumerate(texts)})
    outcome = {"complete": str(complete and not recording.stopped).lower(), "lost": "0"}
    bag.close({**outcome, "stopped": recording.stopped} if recording.stopped else outcome)


def column_units(topics: list[RecordedTopic]) -> dict[str, str]:
    """Units of the named quantities, as `flight_graph.bags.export` reads them: "topic:column" -> unit."""
    units = {}
    for topic in topics:
        for path, quantities in topic.signal.groups.items() if topic.formatted is None else ():
            labels = iter(topic.signal.fixed["name"])
            for quantity in quantities.values():
                for _ in range(quantity.count):
                    units[f"/{topic.topic}:{path}[{next(labels)}]"] = quantity.unit
        if topic.formatted is None:
            units |= {f"/{topic.topic}:{field}[{name}]": unit for field, unit in topic.signal.units.items()
                      if field in topic.signal.fixed for name in topic.signal.fixed["name"]}
    return units


def messages(topic: RecordedTopic, stamps_ns: np.ndarray, records: np.ndarray) -> tuple:
    """(stamps, wire form) of a topic's records: (n, size) uint8, or a list of bytes of messages formatted from them.

    stamps_ns: (n,) since the start of the run. What is said once is said at the start.
    """
    if topic.formatted is None:
        return stamps_ns, topic.signal.payloads(records)
    said = np.flatnonzero(stamps_ns == 0) if topic.formatted.once else np.arange(len(records))
    return stamps_ns[said], [formatted_payload(topic.formatted, records[i:i + 1]) for i in said]


def write_blocks(writer: BagWriter, blocks) -> None:
    """Append whole topics, merged by stamp: (topic of the writer, stamps [ns] (n,), n payloads) each."""
    blocks = [block for block in blocks if len(block[1])]
    if not blocks:
        return
    if all(isinstance(rows, np.ndarray) or len(set(map(len, rows))) == 1 for _, _, rows in blocks):
        writer.write_many([(topic, stamps, _table(rows)) for topic, stamps, rows in blocks])
        return
    stamps = np.concatenate([stamps for _, stamps, _ in blocks])
    owners = np.repeat(np.arange(len(blocks)), [len(stamps) for _, stamps, _ in blocks])
    taken = [0] * len(blocks)
    for row in np.lexsort((owners, stamps)):
        topic, _, rows = blocks[owners[row]]
        writer.write(topic, int(stamps[row]), bytes(rows[taken[owners[row]]]))
        taken[owners[row]] += 1


def _table(payloads):
    if isinstance(payloads, np.ndarray):
        return payloads
    return np.frombuffer(b"".join(payloads), "u1").reshape(len(payloads), -1)


def _version(name):
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def _commit():
    folder = Path(__file__).resolve().parent
    try:
        done = subprocess.run(["git", "-C", folder, "describe", "--always", "--dirty", "--abbrev=12"],
                              capture_output=True, encoding="utf-8", timeout=5)
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return done.stdout.strip() if done.returncode == 0 else "unknown"


def processor() -> str:
    """The name of this machine's processor, where it can be read."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")


class BagSignals:
    """The recorded signals of a run's bag: topic -> structured array of the signal's own dtype."""

    def __init__(self, bag, scenario: Scenario):
        self._bag, self._scenario = bag, scenario
        self._signals = {topic.topic: topic.signal for topic in recorded_topics(scenario) if topic.formatted is None}

    def __getitem__(self, topic: str) -> np.ndarray:
        signal = self._signals[topic]
        payloads = self._bag.payloads("/" + topic)
        records = np.zeros((len(payloads), signal.dtype.itemsize), "u1")
        if len(payloads):
            records[:, :signal.size] = np.asarray(payloads)[:, 4:4 + signal.size]
        return records.reshape(-1).view(signal.dtype)

    def __contains__(self, topic: str) -> bool:
        return topic in self._signals and "/" + topic in self._bag


def open_run(path, trust=False, functions: tuple[str, ...] = ()) -> tuple:
    """(bag, scenario, signals) of a recorded run. Raises FlightError where the bag carries no scenario.

    trust: as for `flight_graph.recordings.recorded_run.open_recorded`; functions: as for
    `flight_graph.recordings.bag_scenario.read_scenario`.
    """
    bag = read_bag(path)
    scenario = read_scenario(bag, consent(trust), functions)
    return bag, scenario, BagSignals(bag, scenario)
