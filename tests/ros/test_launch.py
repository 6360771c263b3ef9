"""Launch files: their data are the scenario's, and the real launch runs them where it is installed."""

import importlib.util
import os
import signal
from pathlib import Path

import pytest
import yaml
from rosbags.highlevel import AnyReader

from flight_graph.components import registry
from flight_graph.graphs.scenario import load
from flight_graph.ros.launch_description import node_table
from tests.ros.processes import start, until

FILES = sorted((Path(__file__).parents[2] / "launch").glob("*/*.launch.py"))


def described(path: Path) -> str:
    """The scenario that a launch file names."""
    return path.name.removesuffix(".launch.py")


@pytest.mark.parametrize("path", FILES, ids=described)
def test_the_table_of_a_launch_file_holds_every_node_of_its_scenario(path):
    assert f'describe("{described(path)}")' in path.read_text()
    scenario = load(described(path))
    rows = node_table(scenario, "lockstep", 1.0, "out")
    assert [row["name"] for row in rows] == [*scenario.graph.nodes, "recorder"]
    for row in rows:
        assert row["executable"] in registry.executables(row["package"])
        node = scenario.graph.nodes.get(row["name"])
        if node is not None:
            assert registry.component(f"{row['package']}/{row['executable']}") is node.component
            assert row["parameters"]["rate_hz"] == node.rate_hz
    assert sum(row["parameters"].get("graph.clock_master", False) for row in rows) == 1
    assert rows[-1]["parameters"]["scenario"] == scenario.name and rows[-1]["parameters"]["out"] == "out"


@pytest.mark.skipif(importlib.util.find_spec("launch_ros") is None, reason="launch_ros is not installed here")
@pytest.mark.parametrize("path", FILES, ids=described)
def test_the_real_launch_accepts_the_file(path):
    from launch import LaunchDescription
    spec = importlib.util.spec_from_file_location("launch_file", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert isinstance(module.generate_launch_description(), LaunchDescription)


@pytest.mark.ros
def test_an_interrupt_of_the_group_ends_every_node_by_itself(tmp_path):
    """As Ctrl-C on ros2 launch does: SIGINT to all at once. `ros2 launch` waits five seconds before SIGTERM; on a busy
    machine what counts is how little each node still computes (an ordinary end of the interpreter took a second)."""
    nodes, group = {}, 0
    try:
        for row in node_table(load("cubli_asteroid"), "realtime", 1.0, str(tmp_path / "bag")):
            path = tmp_path / f"{row['name']}.yaml"
            path.write_text(yaml.safe_dump({f"/**/{row['name']}": {"ros__parameters": row["parameters"]}}))
            with (tmp_path / f"{row['name']}.err").open("w") as file:
                nodes[row["name"]] = start("node", row["package"], row["executable"], *row["arguments"], "--ros-args", "-r",
                                           f"__node:={row['name']}", "--params-file", path, cwd=tmp_path, stderr=file,
                                           process_group=group)
            group = group or nodes[row["name"]].pid
        until(lambda: sum(path.stat().st_size for path in tmp_path.glob("bag/*.mcap")) > 200_000, 180.0, "messages in the bag")
        before = {name: computed_s(process.pid) for name, process in nodes.items()}
        os.killpg(group, signal.SIGINT)
        for name, process in nodes.items():
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            err = (tmp_path / f"{name}.err").read_text()
            assert process.returncode == 0 and "Traceback" not in err, (name, err)
            assert used.ru_utime + used.ru_stime - before[name] < 0.7, name
    finally:
        for process in nodes.values():
            if process.returncode is None:
                process.kill()
                process.wait()
    with AnyReader([tmp_path / "bag"]) as reader:
        assert reader.message_count > 100


def computed_s(pid: int) -> float:
    """Time [s] that a process has spent on the processor."""
    fields = Path("/proc", str(pid), "stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
