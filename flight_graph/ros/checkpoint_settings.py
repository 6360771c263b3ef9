"""What nodes know of checkpoints, and how a run that begins at one tells them: needs no ROS 2."""

import json
from dataclasses import dataclass
from pathlib import Path

from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.schedule import Schedule
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.beginning import Beginning


@dataclass(frozen=True)
class CheckpointSettings:
    """What a node knows of checkpoints.

    period_ns: between them; 0: none are told. base_ns: the tick of the graph. file: of the checkpoint that the run begins
    at, empty: none; inputs: input -> name of the array in it that the input reads.
    """

    period_ns: int = 0
    base_ns: int = 1
    file: str = ""
    inputs: dict | None = None


def period_ns(scenario: Scenario) -> int:
    """Time between checkpoints of nodes [ns]; 0: none are kept. What a fault remembers that is injected on the way has no
    place in the checkpoints before, and what a foreign node remembers is not known.
    """
    return 0 if scenario.live_ids or scenario.foreign else scenario.checkpoint_period_ns


def settings_of(scenario: Scenario, lockstep: bool, file: str = "") -> dict[str, str]:
    """node -> its settings of checkpoints, as JSON; nothing where there are none."""
    period = period_ns(scenario) if lockstep else 0
    if not (period or file):
        return {}
    schedule, found = Schedule.of(scenario.graph, {}, scenario.faults), {}
    for name, node in scenario.graph.nodes.items():
        inputs = {port: schedule.shown(edge.node, edge.port) for port, edge in node.inputs.items()}
        inputs |= {f"when {other}.{port}": schedule.shown(other, port) for other, port in scenario.faults.watched(name)}
        found[name] = json.dumps({"period_ns": period, "base_ns": scenario.graph.base_ns, "file": file,
                                  "inputs": inputs if file else {}})
    return found


def refuse_realtime(scenario: Scenario, pace: str, begin: Beginning | None, tell=None) -> None:
    """Refuse to begin at a checkpoint in realtime, or with a foreign node whose answers are not recorded; tell(sentence)
    where none are kept. Raises FlightError.
    """
    if scenario.foreign and begin is not None and not scenario.tapes:
        raise FlightError(f"--from: {' and '.join(scenario.foreign)} stands for a foreign node, whose memory is in no "
                          "checkpoint; --engine compiled goes on with what it said in the bag")
    if pace == "realtime" and begin is not None:
        raise FlightError("--from goes on in lockstep or in process; a realtime run begins at t = 0")
    if scenario.checkpoint_period_ns and tell and (pace == "realtime" or scenario.live_ids or scenario.foreign):
        tell("no checkpoints are kept: " + (
            "in realtime the nodes never stand between the same two ticks" if pace == "realtime" else
            "faults may be injected on the way" if scenario.live_ids else "what a foreign node remembers is not known"))


def write(folder: Path, begin: Beginning | None) -> str:
    """Write what a run begins with for its nodes; return the file's name, empty where it begins at t = 0."""
    if begin is None:
        return ""
    path = folder / "begin"
    path.write_bytes(begin.checkpoint.encode())
    path.with_suffix(".json").write_text(json.dumps(vars(begin) | {"checkpoint": None}), encoding="utf-8", newline="\n")
    return str(path)


def read(file: str) -> Beginning | None:
    """What a run begins with, as `write` left it."""
    if not file:
        return None
    said = json.loads(Path(file).with_suffix(".json").read_text(encoding="utf-8"))
    return Beginning(**said | {"checkpoint": Checkpoint.decode(Path(file).read_bytes(), file)})
