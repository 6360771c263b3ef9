"""The recorder by itself, fed by this process over DDS: what it does about messages that never come."""

import pytest
import rclpy
import yaml
from mcap.reader import make_reader

from flight_graph.ros.patience import at_least
from flight_graph.ros.ports import RawPublisher
from flight_graph.timebase import J2000, SECOND
from tests.graph import toy
from tests.ros.processes import finish, running, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("recorder")]

PERIOD_NS = 5_000_000  # 200 Hz
TICKS = 100


@pytest.fixture
def feeder():
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("feeder", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


@pytest.fixture
def publishers(feeder):
    return {signal.topic: (signal, RawPublisher(feeder, signal.topic, signal.type_name, signal.role.qos))
            for signal in (toy.TRUTH, toy.SENSED)}


def feed(publishers, left_out=(), ticks=TICKS):
    """Publish so many messages on each topic, but not those whose (topic, tick) is left out."""
    for tick in range(ticks):
        for topic, (signal, publisher) in publishers.items():
            payload, record = signal.new()
            stamp = record["header"]["stamp"]
            stamp["sec"], stamp["nanosec"] = divmod(J2000 + tick * PERIOD_NS, SECOND)
            if (topic, tick) not in left_out:
                publisher.publish(payload.tobytes())


@pytest.mark.parametrize("left_out, status, lost", [
    ((), 0, {}),
    ((("toy/imu", 40), ("toy/imu", 41), ("toy/truth", 70)), 1, {"/toy/imu": 2, "/toy/truth": 1}),
])
def test_a_gap_in_lockstep_is_an_error(publishers, tmp_path, left_out, status, lost):
    scenario = toy.scenario(duration_s=TICKS * PERIOD_NS / SECOND, record={"topics": ["toy/truth", "toy/imu"]})
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(scenario))
    with running("node", "sim_nodes", "recorder", "--ros-args", "-p", f"scenario:={tmp_path / 'toy.yaml'}", "-p",
                 f"out:={tmp_path / 'bag'}", "-p", "graph.pace:=lockstep", cwd=tmp_path) as process:
        until(lambda: all(publisher.subscribers() for _, publisher in publishers.values()), 60.0, "the recorder")
        feed(publishers, left_out)
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == status, err
    if lost:
        assert "messages were lost in lockstep: " in err
        assert all(f"{count} on {topic}" in err for topic, count in lost.items()), err
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        outcome = next(record.metadata for record in reader.iter_metadata() if record.name == "flight_graph.outcome")
        count = sum(1 for _ in reader.iter_messages())
    assert count == 2 * TICKS - len(left_out)
    assert outcome["complete"] == str(not lost).lower() and int(outcome["lost"]) == sum(lost.values())
    assert {key.removeprefix("lost "): int(value) for key, value in outcome.items() if key.startswith("lost ")} == lost


def test_an_interruption_near_the_end_loses_nothing(publishers, tmp_path):
    """A slow topic has sent its last message when the run is interrupted: what the others had still to send is no loss."""
    slow = 20  # ticks between two messages of the slow topic
    scenario = toy.scenario(duration_s=TICKS * PERIOD_NS / SECOND, record={"topics": ["toy/truth", "toy/imu"]})
    scenario["components"]["sensor"]["rate_hz"] = 200 / slow
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(scenario))
    with running("node", "sim_nodes", "recorder", "--ros-args", "-p", f"scenario:={tmp_path / 'toy.yaml'}", "-p",
                 f"out:={tmp_path / 'bag'}", "-p", "graph.pace:=realtime", cwd=tmp_path) as process:
        until(lambda: all(publisher.subscribers() for _, publisher in publishers.values()), 60.0, "the recorder")
        feed(publishers, [("toy/imu", tick) for tick in range(TICKS) if tick % slow], TICKS - slow // 2)
        open_chunk = tmp_path / "bag" / "RECORDING"
        until(lambda: open_chunk.exists() and open_chunk.stat().st_size > 4000, 30.0, "messages in the bag")
        status, _, err = finish(process)
    assert status == 0, err
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as file:
        outcome = next(r.metadata for r in make_reader(file).iter_metadata() if r.name == "flight_graph.outcome")
    assert outcome == {"complete": "false", "lost": "0"}


@pytest.mark.parametrize("gone", [True, False], ids=["gone", "silent"])
def test_what_will_never_come_is_not_waited_for(feeder, publishers, tmp_path, gone):
    """The node of a topic ends before the run is over, or all nodes fall silent: a sentence, and the bag is closed."""
    half = TICKS // 2
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(toy.scenario(
        duration_s=TICKS * PERIOD_NS / SECOND, record={"topics": ["toy/truth", "toy/imu"]})))
    with running("node", "sim_nodes", "recorder", "--ros-args", "-p", f"scenario:={tmp_path / 'toy.yaml'}", "-p",
                 f"out:={tmp_path / 'bag'}", "-p", f"graph.timeout_s:={60.0 if gone else at_least(5.0)}", cwd=tmp_path) as process:
        until(lambda: all(publisher.subscribers() for _, publisher in publishers.values()), 60.0, "the recorder")
        feed(publishers, ticks=half)
        if gone:
            assert publishers["toy/imu"][1].wait_for_all_acked(at_least(5.0))
            feeder.destroy_publisher(publishers["toy/imu"][1]._publisher)
        _, err = process.communicate(timeout=at_least(60.0))
    assert process.returncode == 1 and "Traceback" not in err, err
    assert ("the node sensor has ended before the run was over" if gone else "nothing has come for ") in err, err
    assert f"has come to t = {(half - 1) * PERIOD_NS / SECOND:.9f} s of 0.5 s" in err, err
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as file:
        assert sum(1 for _ in make_reader(file, validate_crcs=True).iter_messages()) == 2 * half
