"""Imports go one way: packages, rooms of flight_graph, no circle of modules; imports inside of functions count too."""

import sys

from tests.architecture.imports import ROOT, circles, imports, modules, outside

PACKAGES = {  # package -> the packages it may import
    "msg_schemas": set(),
    "flight_math": set(),
    "scenarios": set(),
    "flight_graph": {"msg_schemas", "flight_math"},
    "cubli_ros": {"msg_schemas", "flight_math", "flight_graph"},
    "spacerobot_ros": {"msg_schemas", "flight_math", "flight_graph"},
    "lander_ros": {"msg_schemas", "flight_math", "flight_graph"},
    "sim_nodes": {"msg_schemas", "flight_math", "flight_graph", "cubli_ros", "spacerobot_ros", "lander_ros"},
    "papers": {"msg_schemas", "flight_math", "flight_graph", "cubli_ros", "spacerobot_ros", "lander_ros", "sim_nodes"},
}
FLOORS = (  # of flight_graph, from the ground: a module imports its own room and the floors below
    {"errors", "syntax"}, {"text_files", "extras"}, {"timebase", "yaml_text", "xml_text", "tables"}, {"sampling", "statistics"}, {"components"},
    {"bags"},
    {"faults"}, {"monitors"}, {"graphs"}, {"engines"}, {"lanes"}, {"cuda"}, {"recordings"},
    {"scenes", "plots"}, {"replays", "campaigns", "claims", "stepping"}, {"requirements", "c_export"}, {"reports"}, {"viewers"},
    {"ros"},
    {"runs"}, {"notebook"}, {"cli"})

KNOWN = modules()
GRAPH = imports(KNOWN)


def room(module: str) -> str:
    """The room of flight_graph that a module is in."""
    return (module.split(".") + [""])[1]


def floor(module: str) -> int:
    """The number of a module's floor in flight_graph."""
    return next((number for number, rooms in enumerate(FLOORS) if room(module) in rooms), -1)


def test_no_circle_of_modules():
    assert circles(GRAPH) == []


def test_packages_import_the_ones_below():
    wrong = [f"{name} -> {other}" for name, others in GRAPH.items() for other in sorted(others)
             if (package := name.partition(".")[0]) != (below := other.partition(".")[0]) and below not in PACKAGES[package]]
    assert wrong == []


def test_rooms_of_flight_graph_import_the_floors_below():
    inside = {name: others for name, others in GRAPH.items() if name.startswith("flight_graph.")}
    assert {room(name) for name in inside} <= set().union(*FLOORS)
    wrong = [f"{name} -> {other}" for name, others in inside.items() for other in sorted(others)
             if other.startswith("flight_graph.") and room(name) != room(other) and floor(other) >= floor(name)]
    assert wrong == []


def test_flight_math_needs_numba_and_numpy_only():
    allowed = {"flight_math", "numba", "numpy", "llvmlite", *sys.stdlib_module_names}
    assert {name: more for name, path in KNOWN.items() if name.startswith("flight_math")
            if (more := outside(path) - allowed)} == {}


def test_only_the_room_of_ros_imports_rclpy():
    ros = {"rclpy", "rcl_interfaces", "rosgraph_msgs", "lifecycle_msgs"}
    found = [name for name, path in KNOWN.items() if outside(path) & ros]
    assert [name for name in found if not name.startswith("flight_graph.ros")] == []


def test_the_walker_sees_imports_in_functions_and_finds_circles():
    assert "flight_graph.ros.launcher" in GRAPH["flight_graph.runs"]
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]
    assert (ROOT / "flight_graph").is_dir()
