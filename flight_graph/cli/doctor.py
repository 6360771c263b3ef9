"""flight doctor: what is installed, which ROS and middleware, whether two processes can talk, whether the cache is warm."""

import importlib.util
import json
import os
import platform
import subprocess
import sys
from importlib import metadata
from typing import Annotated

import typer

from flight_graph.cli.show import add, console

_PACKAGES = ("flight_graph", "numpy", "numba", "scipy", "mcap", "rosbags", "pydantic", "matplotlib",
             "rerun-sdk", "foxglove-sdk")
_TALK = '''
import sys, time
from flight_graph.ros.environment import prepare_environment
prepare_environment()
import rclpy
from rosgraph_msgs.msg import Clock
rclpy.init()
node = rclpy.create_node("doctor_" + sys.argv[1])
heard, deadline = [], time.monotonic() + 15
publisher = node.create_publisher(Clock, "/flight_doctor_" + sys.argv[1], 10)
node.create_subscription(Clock, "/flight_doctor_" + ("b" if sys.argv[1] == "a" else "a"), heard.append, 10)
extra = 20
while time.monotonic() < deadline and extra:
    publisher.publish(Clock())
    rclpy.spin_once(node, timeout_sec=0.05)
    extra -= bool(heard)
node.destroy_node()
rclpy.shutdown()
sys.exit(0 if heard else 1)
'''


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight doctor --json")(doctor)


def doctor(as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False) -> None:
    """Say what is installed and whether everything that this project needs works here."""
    report = {"python": platform.python_version(), "machine": platform.machine(),
              **{name: _version(name) for name in _PACKAGES}, **_ros(), **_cache()}
    if as_json:
        print(json.dumps(report))
    else:
        from rich.table import Table
        table = Table("what", "found")
        for name, value in report.items():
            add(table, name, _words(value))
        console.print(table)
    if report["ros"] and not report["two processes can talk"]:
        raise typer.Exit(1)


def _words(value) -> str:
    """What was found, for a person."""
    if isinstance(value, dict):
        value = [f"{name}: {why}" for name, why in value.items()]
    if isinstance(value, list):
        return ", ".join(value) or "none"
    return {None: "not installed", True: "yes", False: "no"}.get(value, value)


def _version(name):
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _ros():
    if importlib.util.find_spec("rclpy") is None:
        return {"ros": None}
    origin = os.environ.get("ROS_DISTRO") or f"wheel {_version('ros-jazzy-rclpy')}"
    probe = subprocess.run([sys.executable, "-P", "-c", "from flight_graph.ros.environment import prepare_environment\n"
                            "prepare_environment()\nimport rclpy\nprint(rclpy.get_rmw_implementation_identifier())"],
                           capture_output=True, encoding="utf-8")
    talkers = [subprocess.Popen([sys.executable, "-P", "-c", _TALK, side]) for side in "ab"]
    codes = [talker.wait() for talker in talkers]
    return {"ros": origin, "middleware": probe.stdout.strip() or probe.stderr.strip().splitlines()[-1:],
            "discovery": os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
            "domain": os.environ.get("ROS_DOMAIN_ID", "0"), "two processes can talk": codes == [0, 0]}


def _cache():
    from flight_graph.engines.cache import cache_folder
    from flight_graph.engines.compiled import CompiledRun
    from flight_graph.errors import FlightError
    from flight_graph.graphs import scenario
    from flight_graph.graphs.source import available
    warm = {}
    for name in available():
        try:
            warm[name] = CompiledRun(scenario.load(name)).is_compiled()
        except FlightError as error:
            warm[name] = str(error)
    return {"cache": str(cache_folder()), "compiled": [name for name, found in warm.items() if found is True],
            "not compiled yet": [name for name, found in warm.items() if found is False],
            "broken": {name: found for name, found in warm.items() if isinstance(found, str)}}
