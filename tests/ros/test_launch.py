"""Launch files: their data are the scenario's, and the real launch runs them where it is installed."""

import importlib.util
import os
import re
import signal
from pathlib import Path

import pytest
import yaml
from rosbags.highlevel import AnyReader

from flight_graph.components import registry
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_graph.ros.launch_description import ARGUMENTS, end_of, node_table, read
from tests.graph import toy
from tests.ros.processes import alive, children, finish, running, start, until

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


def given(**arguments) -> dict:
    """The arguments of a launch of the rover, all of them."""
    return {**{name: default for name, (default, _) in ARGUMENTS.items()}, "scenario": "cubli_asteroid", **arguments}


def test_the_arguments_of_a_launch_change_the_scenario(tmp_path):
    file = tmp_path / "gains.yaml"
    file.write_text("/**/appc_controller: {ros__parameters: {lambda_a: 0.05, rate_hz: 50.0}}\n")
    made = read(given(seed="7", duration="2.5", params_file=str(file), set="controller.lambda_a=[0.01, 0.02, 0.03]; imu.rate_hz=50"))
    assert (made.seed, made.duration_ns) == (7, 2_500_000_000)
    assert list(made.graph.nodes["controller"].values["lambda_a"]) == [0.01, 0.02, 0.03]  # what is set comes on top
    assert made.graph.nodes["controller"].rate_hz == 50.0 and made.graph.nodes["imu"].rate_hz == 50.0
    own = tmp_path / "own.yaml"
    own.write_text(yaml.safe_dump(toy.scenario()))
    assert read(given(scenario=str(own), trust="true")).graph.nodes.keys() == load(str(own)).graph.nodes.keys()


@pytest.mark.parametrize("wrong, sentence", [
    ({"seed": "1.5"}, "seed:=1.5: allowed: a whole number"),
    ({"duration": "long"}, "duration:=long: allowed: a number"),
    ({"duration": "inf"}, "duration_s"),
    ({"set": "controller.lambda=1"}, "did you mean 'lambda_u' or 'lambda_a'?"),
    ({"set": "controller"}, "set:=controller: write COMPONENT.PARAM=VALUE"),
    ({"params_file": "nowhere.yaml"}, "params_file:=nowhere.yaml: cannot be read"),
    ({"scenario": "cubli"}, "scenario"),
    ({"trust": "yes"}, "trust:=yes: allowed: true or false"),
])
def test_a_wrong_argument_is_named(wrong, sentence):
    with pytest.raises(FlightError, match=re.escape(sentence)):
        read(given(**wrong))


def test_code_beyond_the_packages_needs_an_argument(tmp_path):
    (tmp_path / "scenarios").mkdir()
    data = toy.scenario()
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(data))
    with pytest.raises(FlightError, match="trust:=true"):
        read(given(scenario=str(tmp_path / "own.yaml")))


def test_a_launch_is_over_when_any_node_ends():
    assert end_of("recorder", 0) is None
    assert "recorder ended before the run was over (signal SIGKILL)" in end_of("recorder", -9)
    assert "controller ended before the run was over (exit status 1), so the whole launch ends" in end_of("controller", 1)
    assert "monitor ended before the run was over (it was asked to)" in end_of("monitor", 0)


@pytest.mark.ros
def test_a_node_that_compiles_says_so_and_can_be_asked_to_end(tmp_path):
    """With an empty cache; neither the node nor its compilers go on, and nothing is said of the interruption."""
    with running("node", "cubli_ros", "jump_monitor", cwd=tmp_path, FLIGHT_CACHE_DIR=str(tmp_path / "cache")) as process:
        assert process.stderr.readline() == "cubli_ros/jump_monitor: its machine code is made now, once; the node starts then\n"
        compilers = until(lambda: children(process.pid), 60.0, "its compilers")
        status, _, err = finish(process, signal.SIGTERM, 10.0)
    assert (status, err) == (0, "")
    until(lambda: not any(map(alive, compilers.values())), 10.0, "the end of its compilers")


@pytest.mark.ros
def test_an_interrupt_of_the_group_ends_every_node_by_itself(tmp_path):
    """As Ctrl-C on ros2 launch does: SIGINT to all at once, here with the graph in a namespace.

    `ros2 launch` waits five seconds before SIGTERM; on a busy machine what counts is how little each node still computes (an
    ordinary end of the interpreter took a second).
    """
    nodes, group = {}, 0
    try:
        for row in node_table(load("cubli_asteroid", {"duration_s": 1e5}), "lockstep", 1.0, str(tmp_path / "bag")):
            path = tmp_path / f"{row['name']}.yaml"
            path.write_text(yaml.safe_dump({f"/**/{row['name']}": {"ros__parameters": row["parameters"]}}))
            with (tmp_path / f"{row['name']}.err").open("w") as file:
                nodes[row["name"]] = start("node", row["package"], row["executable"], *row["arguments"], "--ros-args", "-r",
                                           f"__node:={row['name']}", "-r", "__ns:=/one/rover", "--params-file", path,
                                           cwd=tmp_path, stderr=file, process_group=group)
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
