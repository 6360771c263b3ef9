"""Starts one component as the ROS node it is in the graph, and the replayer as everything else."""

import json
import tempfile
from pathlib import Path

import yaml

from flight_graph.bags.reader import Bag, read_bag
from flight_graph.components.names import ros
from flight_graph.graphs.scenario import Scenario
from flight_graph.ros import launcher
from flight_graph.ros.domain import Domain
from flight_graph.ros.node_processes import Launch, RosRun
from flight_graph.ros.patience import patience_s

REPLAYER = "replayer"


def run(bag_path, scenario: Scenario, component: str, answers: list, folder: Path,
        progress=None, check_bounds: bool = False) -> tuple[Bag, int, str]:
    """Replay one component of a recorded scenario over ROS topics. Raises FlightError.

    scenario: with changed parameters, ended where the inputs end. answers: the recorded topics to collect.
    Returns (bag of the answers, firings, "").
    """
    launcher.refuse(scenario)
    timeout_s = patience_s()
    resolved = folder / "scenario.json"
    resolved.write_text(json.dumps(scenario.resolved()), encoding="utf-8", newline="\n")
    values = launcher.node_parameters(scenario, "lockstep", 1.0, timeout_s, check_bounds, str(resolved))[component]
    plain = {topic.port for topic in answers if topic.formatted is None}
    values.pop("graph.checkpoints", None)  # nobody here puts them together
    node, own = scenario.graph.nodes[component], scenario.faults.watched(component)
    values |= {"graph.clock_master": False, "graph.wait_for": [""],
               **{f"graph.outputs.{port}.subscribers": (port in plain) + ((component, port) in own)
                  for port in node.component.outputs}}
    out = folder / "again"
    settings = {"bag": str(Path(bag_path).absolute()), "component": component, "end_ns": scenario.duration_ns,
                "window_ns": values["graph.window_ns"], "timeout_s": timeout_s, "out": str(out)}
    launcher.compile_nodes([node], check_bounds)
    topics = [signal.topic for signal in node.component.outputs.values()]
    topics += [scenario.graph.signal(edge.node, edge.port).topic for edge in node.inputs.values()]
    with tempfile.TemporaryDirectory(prefix="flight_") as work, Domain(topics) as domain:
        specs = [_spec(Path(work), component, node.use, values), _spec(Path(work), REPLAYER, REPLAYER, settings)]
        result = Launch(specs, RosRun(out), True, progress, domain).run()
    return read_bag(out), result.outcome["firings"], ""


def _spec(work, name, use, values):
    path = work / f"{name}.yaml"
    path.write_text(yaml.safe_dump({f"/**/{ros(name)}": {"ros__parameters": values}}), encoding="utf-8", newline="\n")
    return {"name": name, "use": use,
            "arguments": ["--ros-args", "-r", f"__node:={name.rpartition('.')[2]}", "--params-file", str(path)]}
