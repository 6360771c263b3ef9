"""Runs a scenario as ROS 2 nodes: starts them, watches them, ends them, and leaves the bag."""

import contextlib
import importlib.util
import json
import tempfile
from functools import partial
from pathlib import Path

import yaml

from flight_graph.components.entries import flat
from flight_graph.components.names import ros
from flight_graph.engines import compilation
from flight_graph.engines.choice import check_engine
from flight_graph.errors import FlightError
from flight_graph.extras import install
from flight_graph.graphs.foreign_nodes import stand_in_of
from flight_graph.graphs.scenario import Scenario
from flight_graph.recordings.beginning import Beginning
from flight_graph.ros import checkpoint_settings, shared_memory, tapes
from flight_graph.ros.domain import Domain
from flight_graph.ros.installed import is_installed, not_live
from flight_graph.ros.node_processes import RECORDER, Launch, RosRun
from flight_graph.ros.patience import patience_s
from flight_graph.ros.segments import Segments
from flight_graph.ros.simulation_settings import NODE as SIMULATION
from flight_graph.ros.simulation_settings import Control
from flight_graph.ros.supervisor import Supervisor
from flight_graph.timebase import SECOND
from msg_schemas.qos import WINDOW, WINDOW_FOREIGN, WINDOW_LIVE

STAND_IN = "stand_in"
_FIRST = 0.8  # [1] of the patience: who meets a foreign node speaks before the others
EVENTS = "events.jsonl"  # what was done to processes, for the bag


def node_parameters(scenario: Scenario, pace: str, factor: float, timeout_s: float,
                    check_bounds: bool = False, origin: str = "", begin: str = "",
                    control: Control | None = None) -> dict[str, dict]:
    """node name -> its ROS parameters: those of the component, and its place in the graph. Launch files use it too.

    Foreign nodes have none; in lockstep their stand-ins do. Of a recorded run (`Scenario.tapes`) the stand-ins publish what
    the foreign nodes said, and no foreign node is there.

    origin: the name or the file of the scenario, for nodes with faults (by default its name); begin: the file of the
    checkpoint that the run begins at; control: of a run that may be paused.
    """
    graph, faults = scenario.graph, scenario.faults
    master = graph.clock_master
    lockstep = pace == "lockstep"
    ros_names = {name: stand_in_of(name) if node.is_foreign else name for name, node in graph.nodes.items()
                 if lockstep or not node.is_foreign}
    names = [ros_name for name, ros_name in ros_names.items() if name != master] + [RECORDER]
    window_ns = _window(graph, faults.is_live) * min(node.period_ns for node in graph.nodes.values())
    recorded, is_played = set(scenario.recorded()), bool(scenario.tapes)

    def is_slotted(name, port):
        return scenario.is_irregular(name, port) and (lockstep or not graph.nodes[name].is_foreign)

    common = {"pace": pace, "factor": float(factor), "window_ns": window_ns, "timeout_s": float(timeout_s),
              "supervised": True, "linger": True} | ({"control": control.text()} if control else {})
    parameters, memories = {}, checkpoint_settings.settings_of(scenario, lockstep, begin)
    for name, ros_name in ros_names.items():
        node = graph.nodes[name]
        patience = timeout_s if name == master else 2.0 * timeout_s  # the clock master sees who is behind: it speaks first
        settings = {**common, "timeout_s": float(patience), "check_bounds": check_bounds, "epoch_ns": scenario.epoch_ns,
                    "duration_s": scenario.duration_ns / SECOND,
                    "clock_master": name == master, "wait_for": names if name == master else [""]}
        if scenario.file.watchdog and pace == "realtime":
            settings["beats_often"] = True
            if name == master:
                gap_ns = round(scenario.file.watchdog.gap_s * SECOND)
                settings["beats"] = json.dumps({other: gap_ns + round(graph.nodes[other].period_ns / factor)
                                                for other in names[:-1]})
        for port, edge in node.inputs.items():
            source = graph.nodes[edge.node]
            settings[f"inputs.{port}.topic"] = graph.signal(edge.node, edge.port).topic
            settings[f"inputs.{port}.period_ns"] = source.output_period_ns(edge.port)
            settings[f"inputs.{port}.delay"] = edge.delay
            settings[f"inputs.{port}.slotted"] = is_slotted(edge.node, edge.port)
            if source.is_foreign:
                settings[f"inputs.{port}.foreign"] = edge.node
        if control and lockstep and name != master and not node.is_foreign and (
                node.component.update is not None or not node.inputs):  # nothing else holds it where the run stands
            settings["clock_period_ns"] = graph.nodes[master].period_ns
        if faults.concerns(name):
            settings["scenario"] = origin or scenario.name
        if _meets_foreign(graph, name):
            settings["match_s"] = _FIRST * timeout_s
        if name in memories:
            settings["checkpoints"] = memories[name]
        for port in node.component.outputs:
            readers = {consumer.name + "." + target for consumer, target, _ in graph.consumers(name, port)}
            readers |= {f"{other}.when {name}.{port}" for other in graph.nodes if (name, port) in faults.watched(other)}
            settings[f"outputs.{port}.slotted"] = is_slotted(name, port)
            foreign = [consumer.name for consumer, _, _ in graph.consumers(name, port) if consumer.is_foreign]
            if foreign and not is_played:  # where they are played, their stand-ins read in their place
                settings[f"outputs.{port}.foreign"] = " and ".join(foreign)
                readers |= {f"{one} {port}" for one in foreign if lockstep}  # its stand-in reads, too
            heard = (name, port) in recorded or is_installed(graph.signal(name, port).type_name)  # the recorder has ears
            apart = len(foreign) if node.is_foreign and not is_played else 0
            settings[f"outputs.{port}.subscribers"] = len(readers) + heard - apart
        values = {key: flat(value) for key, value in node.values.items()}
        if node.is_foreign:
            values, settings["scenario"] = {"stands_for": name}, origin or scenario.name
        parameters[ros_name] = {**values, "rate_hz": float(node.rate_hz),
                            **{f"graph.{key}": value for key, value in settings.items()}}
    common["timeout_s"] = 2.0 * timeout_s
    if control and not control.segment:
        parameters[SIMULATION] = {"scenario": origin or scenario.name, "graph.pace": pace, "graph.factor": control.rate}
    parameters[RECORDER] = {f"graph.{key}": value for key, value in common.items()}
    return parameters


def _window(graph, is_live) -> int:
    """How far the clock master may run ahead [ticks]: foreign nodes that it does not wait for may have short queues."""
    waited, found = {graph.clock_master}, True
    while found:
        found = {edge.node for name in waited for edge in graph.nodes[name].inputs.values()} - waited
        waited |= found
    if any(node.is_foreign and name not in waited for name, node in graph.nodes.items()):
        return WINDOW_FOREIGN
    return WINDOW_LIVE if is_live else WINDOW


def _meets_foreign(graph, name) -> bool:
    """Whether a node is foreign, or reads from one, or is read by one: it knows best who is missing, and speaks first."""
    node = graph.nodes[name]
    return node.is_foreign or any(graph.nodes[edge.node].is_foreign for edge in node.inputs.values()) or any(
        consumer.is_foreign for consumer, _, _ in graph.consumers(name))


def run(scenario: Scenario, folder: Path, pace: str = "lockstep", factor: float = 1.0, progress=None, compiling=None,
        check_bounds: bool = False, tell=None, begin: Beginning | None = None, controlled: bool = False,
        around=None) -> RosRun:
    """Run a scenario as ROS 2 nodes and record it into ``folder``. Raises FlightError with the first node's sentence.

    pace: lockstep (as fast as the graph answers) or realtime (``factor`` simulated seconds per wall second).
    progress(seconds simulated) is called about once a simulated second; compiling: see `flight_graph.engines.compilation`;
    check_bounds: with checked indices; tell(sentence): of what a person should know before it starts. begin: where the run
    begins, if not at t = 0. controlled: it stands at its start, and is let go by the services of the node ``simulation``.
    around(domain id): a context in which it runs.
    KeyboardInterrupt ends the nodes, closes the bag, and goes on to the caller.
    """
    refuse(scenario)
    if controlled and SIMULATION in scenario.graph.nodes:
        raise FlightError(f"--control: the scenario has a component '{SIMULATION}', the name of the node that offers the "
                          "services; give it another one")
    checkpoint_settings.refuse_realtime(scenario, pace, begin, tell)
    timeout_s = patience_s()
    compile_nodes(scenario.graph.nodes.values(), check_bounds, compiling)
    shared_memory.clean()
    with tempfile.TemporaryDirectory(prefix="flight_") as work, Domain(published(scenario.graph)) as domain:
        segments, begins = None, partial(node_specs, Path(work), pace, timeout_s, check_bounds)
        if controlled:
            segments = Segments(scenario, Path(folder), begin, begins, factor if pace == "realtime" else 0.0)
        specs = segments.specs() if segments else begins(scenario, Path(folder), begin, None, factor)
        if tell and domain.is_own:
            tell(domain.sentence())
        for sentence in foreign_sentences(scenario, pace, domain.number) if tell and not scenario.tapes else ():
            tell(sentence)
        if tell and (sentence := not_live(node.component for node in scenario.graph.nodes.values())):
            tell(sentence)
        launch = Launch(specs, RosRun(Path(folder)), pace == "lockstep", progress, domain)
        if pace == "realtime":
            launch.supervise = partial(_supervisor, scenario, launch, Path(work) / EVENTS)
            launch.supervise(specs)
        launch.segments, launch.tell = segments, tell or str
        with around(domain.number) if around else contextlib.nullcontext():
            result = launch.run()
        result.notes += _late_notes(result.statistics)
        return result


def _supervisor(scenario, launch, events, specs):
    """Have the nodes of a launch watched."""
    apart = (RECORDER, SIMULATION, scenario.graph.clock_master)
    own = {spec["name"]: spec for spec in specs if spec["name"] not in apart}
    events.unlink(missing_ok=True)
    launch.supervisor = Supervisor(scenario, launch, own, events)
    launch.result.notes = launch.supervisor.notes


def foreign_sentences(scenario: Scenario, pace: str, domain: int) -> list[str]:
    """What a person has to know to start the foreign nodes of a graph."""
    found = []
    for name in scenario.foreign:
        component, does = scenario.graph.nodes[name].component, []
        for verb, ports in (("reads", component.inputs), ("publishes", component.outputs)):
            if ports:
                does.append(f"{verb} {', '.join(f'/{one.topic} ({one.type_name})' for one in ports.values())}")
        answers = component.outputs and component.inputs and pace == "lockstep"
        stamp = ", with the stamp of what it answers" if answers else ""
        frames = f"; its frames begin with {ros(component.namespace)}/" if component.namespace else ""
        found.append(f"{name} is a foreign node, which is waited for: it {' and '.join(does)}{stamp}{frames}; start it "
                     f"with ROS_DOMAIN_ID={domain}")
    return found


def _late_notes(statistics) -> list[str]:
    """What stand-ins counted, in words."""
    found = []
    for name, counts in statistics.items():
        if counts.get("late"):
            found.append(f"{name}: {counts['late']} answers were late; readers held the last message")
        if counts.get("refused_messages") and "late" in counts:
            found.append(f"{name}: {counts['refused_messages']} messages were refused: {'; '.join(counts['reasons'])}")
    return found


def published(graph) -> list[str]:
    """The topics of a graph."""
    return [graph.signal(name, port).topic for name, node in graph.nodes.items() for port in node.component.outputs]


def compile_nodes(nodes, check_bounds: bool = False, compiling=None) -> None:
    """Make the machine code of nodes before they start: no node's timeout runs meanwhile. Raises FlightError."""
    compilation.load({node.use: node.component for node in nodes if not node.is_foreign}, check_bounds, compiling)


def node_specs(work: Path, pace: str, timeout_s: float, check_bounds: bool, scenario: Scenario, folder: Path,
               begin: Beginning | None, control: Control | None, factor: float | None = None) -> list[dict]:
    """What the spawner starts: each node with its parameters, in files in ``work``. For the rest see `node_parameters`."""
    factor = factor or control.rate or 1.0
    start = checkpoint_settings.write(work, begin)
    resolved = work / "scenario.json"
    resolved.write_text(json.dumps(scenario.resolved()), encoding="utf-8", newline="\n")
    specs = []
    for name, values in node_parameters(scenario, pace, factor, timeout_s, check_bounds, str(resolved),
                                        start, control).items():
        if name == RECORDER:
            values = {**values, "scenario": str(resolved), "out": str(folder.absolute()), "events": str(work / EVENTS),
                      "begin": start}
        elif name == SIMULATION:
            values = {**values, "begin_ns": begin.checkpoint.t_ns if begin else 0, "resets": True}
        elif "stands_for" in values and scenario.tapes:
            values = {**values, "tape": tapes.write(work / f"{name}.npz", scenario, values["stands_for"])}
        path = work / f"{name}.yaml"
        path.write_text(yaml.safe_dump({f"/**/{ros(name)}": {"ros__parameters": values}}), encoding="utf-8", newline="\n")
        use = scenario.graph.nodes[name].use if name in scenario.graph.nodes else (
            name if name in (RECORDER, SIMULATION) else STAND_IN)
        specs.append({"name": name, "use": use, "check_bounds": check_bounds,
                      "arguments": ["--ros-args", "-r", f"__node:={name.rpartition('.')[2]}", "--params-file", str(path)]})
    return specs


def refuse(scenario: Scenario) -> None:
    """Refuse a scenario or a machine that the ros engine cannot serve."""
    check_engine(scenario, "ros")
    if importlib.util.find_spec("rclpy") is None:
        raise FlightError("the ros engine needs rclpy; source a ROS 2 Jazzy, or install its wheels: "
                          f"{install('ros')}")
