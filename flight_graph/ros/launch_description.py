"""Launch files made from scenarios: the same table of nodes and parameters that ``flight run --engine ros`` uses.

A launch file holds two lines:

    from flight_graph.ros.launch_description import describe
    def generate_launch_description(): return describe("cubli_asteroid")

Its arguments are in `ARGUMENTS` (``ros2 launch ... --show-args`` lists them). A launch ends when the bag is closed, and
with a sentence and status 1 when any node ends before. Machine code that is missing is made before the nodes start.
"""

import json
import os
import tempfile
from pathlib import Path

import yaml

from flight_graph.components.foreign import agree, refuse
from flight_graph.components.names import ros
from flight_graph.engines import compilation
from flight_graph.engines.choice import check_engine, parse_pace
from flight_graph.errors import FlightError
from flight_graph.graphs import scenario as scenarios
from flight_graph.graphs.overrides import overrides
from flight_graph.graphs.scenario import Scenario
from flight_graph.ros.installed import not_live
from flight_graph.ros.launcher import STAND_IN, foreign_sentences, node_parameters
from flight_graph.ros.node_processes import RECORDER, how_it_ended
from flight_graph.ros.patience import patience_s
from flight_graph.ros.simulation_settings import NODE as SIMULATION
from flight_graph.ros.simulation_settings import Control

ARGUMENTS = {  # name -> (default, what it is); that of scenario is the launch file's own, that of out follows from it
    "scenario": ("", "a scenario's name, or the path of a scenario file (.yaml)"),
    "pace": ("realtime", "lockstep or realtime"),
    "factor": ("1.0", "in realtime: simulated seconds per wall second"),
    "out": ("", "folder of the bag (a new one); SCENARIO_bag when left out"),
    "seed": ("", "seed of all noise; the scenario's when left out"),
    "duration": ("", "simulated seconds; the scenario's when left out"),
    "set": ("", "parameters and rates: COMPONENT.PARAM=VALUE, several with a semicolon between them"),
    "params_file": ("", "a ROS parameter file; what is set comes on top"),
    "namespace": ("", "a namespace for all nodes and topics but /clock"),
    "control": ("false", "true: wait at the start for the services of the node 'simulation'"),
    "trust": ("false", "true: run the code that the scenario file names beyond the packages; read it first"),
}
_OPTIONS = {"--set ": "set:=", "--params ": "params_file:=", "--pace ": "pace:="}  # as the command line calls them
_kept = []  # folders that go when the launch has ended


def read(given: dict[str, str]) -> Scenario:
    """The scenario that arguments of a launch mean. Raises FlightError, which names the argument."""
    try:
        consent = agree if _is_true("trust", given["trust"]) else refuse
        settings = [text.strip() for text in given["set"].split(";") if text.strip()]
        params = [Path(given["params_file"])] if given["params_file"] else None
        found = overrides(given["scenario"], settings, params, _number(int, "seed", given["seed"]),
                          _number(float, "duration", given["duration"]), consent, print)
        made = scenarios.load(given["scenario"], found, consent=consent)
        check_engine(made, "ros")
        return made
    except FlightError as error:
        raise FlightError(_as_argument(str(error))) from None


def node_table(scenario: Scenario, pace: str, factor: float, out: str, origin: str = "", controlled=False) -> list[dict]:
    """One row a node: package, executable, name, namespace, arguments, parameters; the recorder is the last.

    origin: the file of the scenario for the nodes that read it (by default its name).
    """
    control = Control(rate=factor if pace == "realtime" else 0.0) if controlled else None
    rows = []
    for name, values in node_parameters(scenario, pace, factor, patience_s(), origin=origin, control=control).items():
        if control and name == SIMULATION:
            values = {**values, "resets": True, "out": out}
        elif control:
            values = {**values, "graph.again": True}
        if name == RECORDER:
            rows.append({"package": "sim_nodes", "executable": "recorder", "name": name, "namespace": "", "arguments": [],
                         "parameters": {**values, "scenario": origin or scenario.name, "out": out, "graph.linger": False}})
            continue
        if name not in scenario.graph.nodes:
            executable = name if name == SIMULATION else STAND_IN
            namespace, _, own = name.rpartition(".")
            rows.append({"package": "sim_nodes", "executable": executable, "name": own, "namespace": ros(namespace),
                         "arguments": [], "parameters": values})
            continue
        use, component = scenario.graph.nodes[name].use, scenario.graph.nodes[name].component
        if ":" in use or component.namespace:
            package, executable, arguments = "flight_graph", "flight", ["node", use]
        else:
            (package, executable), arguments = use.split("/"), []
        rows.append({"package": package, "executable": executable, "name": name.rpartition(".")[2], "arguments": arguments,
                     "namespace": ros(component.namespace), "parameters": values})
    return rows


def end_of(name: str, code: int) -> str | None:
    """Why a launch is over when a process has ended: None where the run is complete, or was ended by who controls it."""
    if name in (RECORDER, SIMULATION) and code == 0:
        return None
    how = "it was asked to" if code == 0 else how_it_ended(code)
    told = "; its own words stand above" if code > 0 else ""
    return f"the node {name} ended before the run was over ({how}), so the whole launch ends{told}"


def describe(scenario_name: str):
    """The LaunchDescription of a scenario."""
    from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
    from launch.substitutions import LaunchConfiguration

    from launch import LaunchDescription

    def start(context):
        given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
        scenario = read(given)
        factor = given["factor"] if given["pace"] == "realtime" else ""
        pace, number = _pace(given["pace"], factor)
        out = given["out"] or f"{scenario.name}_bag"
        if Path(out).exists():
            raise FlightError(f"out:={out}: it exists already; name a new folder")
        file = _written(scenario)
        controlled = _is_true("control", given["control"])
        nodes = _nodes(node_table(scenario, pace, number, out, str(file), controlled), given["namespace"])
        components = {node.use: node.component for node in scenario.graph.nodes.values() if not node.is_foreign}
        domain = int(os.environ.get("ROS_DOMAIN_ID") or 0)
        nodes += [LogInfo(msg=sentence) for sentence in foreign_sentences(scenario, pace, domain)]
        nodes += [LogInfo(msg=sentence)] if (sentence := not_live(components.values())) else []
        return nodes if compilation.is_ready(components) else _compiled_first(file, nodes)

    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=scenario_name if name == "scenario" else default, description=text)
          for name, (default, text) in ARGUMENTS.items()),
        OpaqueFunction(function=start)])


def _nodes(rows, namespace):
    from launch.actions import Shutdown
    from launch_ros.actions import Node

    def on_end(name):
        def ended(event, context):
            if context.is_shutdown:
                return None
            if sentence := end_of(name, event.returncode):
                raise FlightError(sentence)  # the launch shuts down, and its status is 1
            return Shutdown(reason="the bag is closed")
        return ended

    return [Node(package=row["package"], executable=row["executable"], name=row["name"],
                 namespace="/".join(filter(None, (namespace.rstrip("/"), row["namespace"]))) or None,
                 arguments=row["arguments"], parameters=[row["parameters"]], output="screen",
                 on_exit=on_end("/".join(filter(None, (row["namespace"], row["name"])))))
            for row in rows]


def _compiled_first(file, nodes):
    from launch.actions import ExecuteProcess, LogInfo
    from launch_ros.substitutions import ExecutableInPackage

    def compiled(event, context):
        if context.is_shutdown:
            return None
        if event.returncode:
            raise FlightError(f"the components could not be compiled ({how_it_ended(event.returncode)})")
        return nodes

    command = [ExecutableInPackage("flight", "flight_graph"), "compile", str(file), "--trust"]
    return [LogInfo(msg="the machine code of this graph is made now, once; the nodes start then"),
            ExecuteProcess(cmd=command, output="screen", on_exit=compiled)]


def _written(scenario) -> Path:
    """A file of the resolved scenario, there as long as this process."""
    _kept.append(tempfile.TemporaryDirectory(prefix="flight_launch_"))
    file = Path(_kept[-1].name) / "scenario.yaml"
    plain = json.loads(json.dumps(scenario.resolved()))
    file.write_text(yaml.safe_dump(plain, sort_keys=False), encoding="utf-8", newline="\n")
    return file


def _pace(pace, factor):
    try:
        return parse_pace(f"{pace}:{factor}" if factor else pace)
    except FlightError:
        raise FlightError(f"pace:={pace} factor:={factor or '1.0'}: allowed: lockstep, or realtime with a factor greater "
                          "than 0") from None


def _number(kind, name, text):
    if not text:
        return None
    try:
        return kind(text)
    except ValueError:
        raise FlightError(f"{name}:={text}: allowed: a {'whole ' if kind is int else ''}number") from None


def _is_true(name, text):
    if text.lower() not in ("true", "false"):
        raise FlightError(f"{name}:={text}: allowed: true or false")
    return text.lower() == "true"


def _as_argument(sentence):
    for option, argument in _OPTIONS.items():
        sentence = sentence.replace(option, argument, 1) if sentence.startswith(option) else sentence
    return sentence.replace("add --trust to run it", "add trust:=true to run it")
