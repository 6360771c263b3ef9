"""Launch files made from scenarios: the same table of nodes and parameters that ``flight run --engine ros`` uses.

A launch file holds two lines:

    from flight_graph.ros.launch_description import describe
    def generate_launch_description(): return describe("cubli_asteroid")

Arguments of the launch: ``pace`` (lockstep or realtime), ``factor``, ``out`` (the bag's folder).
"""

from flight_graph.graphs.scenario import Scenario, load
from flight_graph.ros.launcher import RECORDER, node_parameters
from flight_graph.ros.patience import patience_s


def node_table(scenario: Scenario, pace: str, factor: float, out: str) -> list[dict]:
    """One row a node: package, executable, name, arguments, parameters; the recorder is the last."""
    rows = []
    for name, values in node_parameters(scenario, pace, factor, patience_s()).items():
        if name == RECORDER:
            rows.append({"package": "sim_nodes", "executable": "recorder", "name": name, "arguments": [],
                         "parameters": {**values, "scenario": scenario.name, "out": out, "graph.linger": False}})
            continue
        use = scenario.graph.nodes[name].use
        if ":" in use:
            package, executable, arguments = "flight_graph", "flight", ["node", use]
        else:
            (package, executable), arguments = use.split("/"), []
        rows.append({"package": package, "executable": executable, "name": name, "arguments": arguments,
                     "parameters": values})
    return rows


def describe(scenario_name: str):
    """The LaunchDescription of a scenario; it ends when the recorder has closed the bag."""
    from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
    from launch.substitutions import LaunchConfiguration
    from launch_ros.actions import Node

    from launch import LaunchDescription

    def nodes(context):
        pace, factor, out = (LaunchConfiguration(name).perform(context) for name in ("pace", "factor", "out"))
        return [Node(**row_, parameters=[parameters], output="screen",
                     on_exit=Shutdown() if row_["name"] == RECORDER else None)
                for row in node_table(load(scenario_name), pace, float(factor), out)
                for row_, parameters in [({key: row[key] for key in row if key != "parameters"}, row["parameters"])]]

    return LaunchDescription([
        DeclareLaunchArgument("pace", default_value="realtime", description="lockstep or realtime"),
        DeclareLaunchArgument("factor", default_value="1.0", description="simulated seconds per wall second"),
        DeclareLaunchArgument("out", default_value=f"{scenario_name}_bag", description="folder of the bag (a new one)"),
        OpaqueFunction(function=nodes),
    ])
