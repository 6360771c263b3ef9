"""How runs end when something goes wrong: a sentence, a closed and valid bag, and no process left behind."""

import json
import os
import re
import signal

import pytest
import rclpy
import yaml
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from flight_graph.ros.patience import at_least
from tests.graph import toy
from tests.ros.processes import alive, children, finish, flight, running, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("endings")]

SHORT = f"{at_least(6.0):g}"  # [s] a patience that healthy nodes on a busy machine do not use up
NODES = {"plant", "sensor", "controller", "watcher", "recorder"}


@pytest.fixture
def run(tmp_path):
    """The command that runs the toy graph as nodes, for long."""
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(toy.scenario()))
    return "run", tmp_path / "toy.yaml", "--trust", "--engine", "ros", "--duration", 1000, "--out", tmp_path / "bag"


def nodes_of(process) -> dict[str, int]:
    """The nodes of a run by name, once all of them are there."""
    def found():
        assert process.poll() is None, process.stderr.read()
        return there if NODES <= (there := children(process.pid)).keys() else None
    return until(found, 60.0, what="the nodes")


def recorded(bag):
    """Wait until a run has written messages."""
    def size():
        return sum(path.stat().st_size for path in bag.glob("*.mcap")) > 100_000
    until(size, 60.0, what="messages in the bag")


def check_bag(bag) -> int:
    """The bag is closed: its summary and index are there, rosbags reads all; the topics end at about the same stamp."""
    with next(bag.glob("*.mcap")).open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
        outcome = next(record.metadata for record in make_reader(file).iter_metadata()
                       if record.name == "flight_graph.outcome")
    assert outcome["complete"] == "false"
    with AnyReader([bag]) as reader:
        count = sum(1 for _ in reader.messages())
        assert count == summary.statistics.message_count == reader.message_count > 100
    return count


def gone(pids):
    until(lambda: not any(map(alive, pids)), 60.0, "the processes to end")


def sentence(text, *parts):
    """The error is one sentence for a person, and names what it should."""
    assert "Traceback" not in text, text
    assert text.startswith("error: ") or "\nerror: " in text, text
    for part in parts:
        assert part in text, text


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_closes_the_bag(run, tmp_path, number):
    bag = tmp_path / "bag"
    with running(*run, cwd=tmp_path) as process:
        pids = nodes_of(process).values()
        recorded(bag)
        status, _, err = finish(process, number)
    assert status == 2
    sentence(err, "interrupted", str(bag))
    gone(pids)
    check_bag(bag)


def test_interrupt_before_the_first_message(run, tmp_path):
    """Ctrl-C while nodes are still starting: nothing is left running, and no traceback."""
    with running(*run, cwd=tmp_path) as process:
        pids = until(lambda: found if "python" in (found := children(process.pid)) else None, what="the spawner")
        status, _, err = finish(process)
    assert status == 2, err
    sentence(err, "interrupted")
    gone(pids.values())


@pytest.mark.parametrize("victim", ["sensor"])
def test_a_killed_node_is_named(run, tmp_path, victim):
    bag = tmp_path / "bag"
    with running(*run, cwd=tmp_path) as process:
        pids = nodes_of(process)
        recorded(bag)
        os.kill(pids[victim], signal.SIGKILL)
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 2
    sentence(err, f"the node {victim} ended by itself (signal SIGKILL)", str(bag))
    gone(pids.values())
    check_bag(bag)


@pytest.mark.parametrize("victim, number", [("sensor", signal.SIGTERM), ("plant", signal.SIGINT), ("recorder", signal.SIGTERM)])
def test_a_node_that_is_asked_to_end_is_named(run, tmp_path, victim, number):
    """No other node's patience runs out first: the sentence is that of the node itself."""
    bag = tmp_path / "bag"
    with running(*run, cwd=tmp_path) as process:
        pids = nodes_of(process)
        recorded(bag)
        os.kill(pids[victim], number)
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 2
    sentence(err, f"the node {victim} was asked to end before the run was over", str(bag))
    gone(pids.values())
    check_bag(bag)


def test_a_killed_recorder_is_named(run, tmp_path):
    bag = tmp_path / "bag"
    with running(*run, cwd=tmp_path) as process:
        pids = nodes_of(process)
        recorded(bag)
        os.kill(pids["recorder"], signal.SIGKILL)
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 2
    sentence(err, "the node recorder ended by itself (signal SIGKILL)", str(bag))
    gone(pids.values())


def test_a_killed_run_leaves_no_orphans_and_a_valid_bag(run, tmp_path):
    bag = tmp_path / "bag"
    with running(*run, cwd=tmp_path) as process:
        pids = children(process.pid) | nodes_of(process)
        recorded(bag)
        process.kill()
        process.wait()
    gone(pids.values())
    check_bag(bag)


def test_a_stopped_node_is_named(run, tmp_path):
    """A node that hangs: the clock master says which one it waits for, and the run does not hang with it."""
    bag = tmp_path / "bag"
    with running(*run, cwd=tmp_path, FLIGHT_TIMEOUT_S=SHORT) as process:
        pids = nodes_of(process)
        recorded(bag)
        os.kill(pids["watcher"], signal.SIGSTOP)
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 2
    sentence(err, f"waited {SHORT} s for the node watcher to reach t = ", "it has come to t = ")
    gone(pids.values())
    check_bag(bag)


def test_a_missing_input_names_node_port_and_stamp(run, tmp_path):
    """The controller stops answering: the plant says which input of which stamp it waits for."""
    with running(*run, cwd=tmp_path, FLIGHT_TIMEOUT_S=SHORT) as process:
        pids = nodes_of(process)
        recorded(tmp_path / "bag")
        os.kill(pids["controller"], signal.SIGSTOP)
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 2
    sentence(err)
    named = rf"error: plant: waited {SHORT} s for its input command on /toy/command"
    assert re.search(named + r" from controller, stamp t = \d+\.\d{9} s", err), err
    gone(pids.values())


def test_a_node_that_never_appears_is_named(run, tmp_path):
    with running(*run, cwd=tmp_path, FLIGHT_TIMEOUT_S=SHORT) as process:
        pid = until(lambda: children(process.pid).get("sensor"), what="the sensor's process")
        os.kill(pid, signal.SIGSTOP)
        pids = children(process.pid).values()
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 2
    assert re.search(r"waited \d+ s for .*sensor", err), err
    sentence(err)
    gone(pids)


def test_what_a_node_no_longer_sends_in_realtime_is_counted(tmp_path):
    """A node that hangs in a realtime run does not end it; what its topic lacks at the end stands in the bag as lost."""
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(toy.scenario()))
    with running("run", tmp_path / "toy.yaml", "--trust", "--engine", "ros", "--pace", "realtime:2", "--duration", 20, "--out",
                 tmp_path / "bag", "--json", cwd=tmp_path) as process:
        pids, open_chunk = nodes_of(process), tmp_path / "bag" / "RECORDING"
        until(lambda: open_chunk.exists() and open_chunk.stat().st_size > 4000, 60.0, "messages in the bag")
        os.kill(pids["watcher"], signal.SIGSTOP)
        out, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 0, err
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as file:
        reader = make_reader(file)
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        recorded = sum(channel.topic == "/toy/watch" for _, channel, _ in reader.iter_messages())
    assert metadata["flight_graph"]["pace"] == "realtime:2"
    outcome = metadata["flight_graph.outcome"]
    expected = 20 * 10  # it sends at 10 Hz
    assert int(outcome["lost /toy/watch"]) == expected - recorded > 0
    assert outcome["complete"] == "false" and int(outcome["lost"]) == json.loads(out)["lost"] >= expected - recorded


def test_a_fault_of_a_component_ends_the_run_with_its_sentence(tmp_path):
    data = toy.scenario(duration_s=50.0)
    data["components"]["controller"]["parameters"] = {"angle_limit": 0.25}
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(data))
    texts = []
    for engine in ("compiled", "ros"):
        done = flight("run", tmp_path / "toy.yaml", "--trust", "--engine", engine, "--out", tmp_path / engine, cwd=tmp_path)
        assert done.returncode == 2
        sentence(done.stderr, "controller stopped at t = 0 s: the angle left the limit of 0.25 rad")
        texts.append(next(line for line in done.stderr.splitlines() if line.startswith("error: ")).partition(";")[0])
    assert texts[0] == texts[1]


def test_the_initial_error_outside_the_funnel_is_refused_or_rearmed(tmp_path):
    start = ("--set", "plant.initial_angles=[-0.5,0.3,0.3]", "--duration", "1")
    for engine in ("compiled", "ros"):
        done = flight("run", "cubli_asteroid", "--engine", engine, "--out", tmp_path / engine, *start, cwd=tmp_path)
        assert done.returncode == 2
        sentence(done.stderr, "controller stopped at t = 0 s: the initial attitude error", "outside the funnel",
                 "rho_a0 = [0.4, 0.4, 0.4] rad", "-0.50", "-1.25", "rearm")
    done = flight("run", "cubli_asteroid", "--out", tmp_path / "rearmed", *start, "--set", "controller.rearm=true",
                  "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert '"rearmed": 1.0' in done.stdout


def test_every_topic_of_a_run_has_both_ends(tmp_path):
    """What `ros2 doctor` warns of: a topic without a subscriber, or without a publisher (an input that is left open)."""
    run = ("run", "cubli_asteroid", "--engine", "ros", "--duration", 10_000, "--out", tmp_path / "bag")
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("doctor", context=context)
    with running(*run, cwd=tmp_path) as process:
        recorded(tmp_path / "bag")
        wanted = {"/clock", "/plant/transition_event", "/cubli/truth", "/imu/_progress"}

        def whole():
            """Whether all of the graph has been discovered, and each topic has both ends."""
            topics = {name for name, _ in node.get_topic_names_and_types()} - {"/parameter_events", "/rosout"}
            return wanted <= topics and all(node.count_publishers(name) and node.count_subscribers(name) for name in topics)
        until(whole, 60.0, "both ends of every topic")
        finish(process)
    node.destroy_node()
    context.try_shutdown()
