"""Nodes among strangers: stamps off the grid or of another clock, other quality of service, the commands of the handbook."""

import re
import shlex
import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState

from flight_graph.ros.ticks import Ticks, epoch_of
from flight_graph.timebase import J2000, SECOND
from tests.ros.processes import ROOT, finish, running, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("strangers")]

MS = 1_000_000
CONTROLLER = ("node", "cubli_ros/pd_controller")
PLANT = ("node", "sim_nodes", "cubli_plant")


# -- the rule itself -------------------------------------------------------------------------------------------------
def answered(period_ms, stamps_ms):
    told = []
    ticks = Ticks(period_ms * MS, "/topic", told.append)
    found = [ticks.of(round(stamp * MS)) for stamp in stamps_ms]
    return [None if tick is None else tick / MS for tick in found], told


def test_stamps_on_the_grid_are_answered_at_their_stamps():
    assert answered(10, range(0, 100, 10)) == ([*range(0, 100, 10)], [])


def test_a_faster_sender_on_the_grid_is_answered_at_the_ticks():
    assert answered(40, range(0, 130, 10)) == ([t if t % 40 == 0 else None for t in range(0, 130, 10)], [])


def test_each_stamp_off_the_grid_is_answered_and_ticks_go_up():
    stamps = [3.217, 13.5, 19.9, 30.01, 39.99, 50.4, 60.4, 95.1, 100.2, 110.3]
    ticks, told = answered(10, stamps)
    assert None not in ticks and all(b - a >= 10 and b % 10 == 0 for a, b in zip(ticks, ticks[1:]))
    assert all(0 <= tick - stamp <= 20 for tick, stamp in zip(ticks, stamps))
    assert len(told) == 1 and "not on this node's grid of 10 ms" in told[0]


def test_stamps_half_a_period_beside_the_grid():
    assert answered(10, range(5, 105, 10))[0] == [*range(10, 110, 10)]


def test_a_faster_sender_off_the_grid_is_answered_at_the_rate_of_the_node():
    ticks, told = answered(10, [1.0371 * i + 0.0213 for i in range(1000)])
    fired = [tick for tick in ticks if tick is not None]
    assert len(fired) == pytest.approx(1037.1 / 10, abs=3) and len(set(fired)) == len(fired)
    assert len(told) == 2 and "comes faster than this node's 100 Hz" in told[1]


def test_a_clock_that_is_set_back_begins_again():
    ticks, _ = answered(10, [5000.1, 5010.2, 5020.3, 1.1, 11.2])
    assert ticks[3:] == [10, 20]


def test_time_zero_is_that_of_our_plants_or_the_first_stamp():
    assert epoch_of(J2000) == epoch_of(J2000 + 60 * SECOND) == J2000
    for stamp in (0, 5, J2000 - 1, 1_795_745_563 * SECOND + 17):
        assert epoch_of(stamp) == stamp


# -- with processes ---------------------------------------------------------------------------------------------------
class Stranger:
    """A plain rclpy node with an attitude to give and commands to hear."""

    def __init__(self, publisher_qos=10, subscription_qos=1000):
        self.node, self.commands = rclpy.create_node("my_estimator"), []
        self.publisher = self.node.create_publisher(Imu, "/cubli/attitude", publisher_qos)
        self.node.create_subscription(JointState, "/cubli/wheel_command", self.commands.append, subscription_qos)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)

    def spin_until(self, condition, what):
        def step():
            self.executor.spin_once(timeout_sec=0.01)
            return condition()
        return until(step, 60.0, what)

    def meet(self):
        self.spin_until(lambda: self.publisher.get_subscription_count() and self.node.count_publishers("/cubli/wheel_command")
                        and self.node.get_publishers_info_by_topic("/cubli/wheel_command"), "the controller")

    def send(self, stamp_ns):
        message = Imu()
        message.header.frame_id, message.orientation.w = "cubli_base", 1.0
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, SECOND)
        self.publisher.publish(message)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture(autouse=True)
def context():
    rclpy.init()
    yield
    rclpy.shutdown()


@pytest.fixture
def stranger():
    found = Stranger()
    yield found
    found.close()


def stamp_of(message) -> int:
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def stop(process) -> str:
    status, _, err = finish(process)
    assert status == 0 and "Traceback" not in err, err
    return err


@pytest.mark.parametrize("kind", ["clock", "grid", "half"])
def test_every_attitude_of_a_stranger_is_answered_with_its_stamp(stranger, tmp_path, kind):
    """One attitude at a time: the next is sent when the command for the one before has come."""
    start = time.time_ns() // (10 * MS) * (10 * MS)
    with running(*CONTROLLER, cwd=tmp_path) as process:
        stranger.meet()
        sent = []
        for i in range(100):
            while sent and time.time_ns() < sent[-1] + 10 * MS:  # as its timer has it
                stranger.executor.spin_once(timeout_sec=0.002)
            stamp = {"clock": time.time_ns(), "grid": start + 10 * MS * i, "half": start + 10 * MS * i + 5 * MS}[kind]
            sent.append(stamp)
            stranger.send(stamp)
            if i == 0:  # the reader of commands may have been found after the first
                time_to_resend = time.monotonic() + 1.0
                stranger.spin_until(lambda: stranger.commands or time.monotonic() > time_to_resend, "an answer")
                continue
            stranger.spin_until(lambda sent=sent: stranger.commands and stamp_of(stranger.commands[-1]) == sent[-1],
                                f"the answer to attitude {i}")
        err = stop(process)
    assert [stamp_of(command) for command in stranger.commands][-99:] == sent[1:]
    assert err.count("not on this node's grid") == (kind == "clock"), err


def test_commands_of_another_clock_reach_a_plant(tmp_path):
    """A controller that stamps its commands with now() or not at all: the plant says so once and takes the newest."""
    node = rclpy.create_node("my_controller")
    wheels, executor = [], SingleThreadedExecutor()
    node.create_subscription(JointState, "/cubli/wheel_state", wheels.append, 100)
    publisher = node.create_publisher(JointState, "/cubli/wheel_command", 10)
    executor.add_node(node)
    with running(*PLANT, cwd=tmp_path) as process:
        for effort, stamp in ((1.25e-3, time.time_ns()), (-2.5e-3, 0)):
            def held(effort=effort, stamp=stamp):
                executor.spin_once(timeout_sec=0.02)
                message = JointState(name=["wheel_x", "wheel_y", "wheel_z"], effort=[effort] * 3)
                message.header.frame_id = "cubli_base"
                message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
                publisher.publish(message)
                return wheels and abs(wheels[-1].effort[0] - effort) < 1e-12
            until(held, 60.0, "the commanded torque")
        err = stop(process)
    executor.shutdown()
    node.destroy_node()
    assert err.count("they are of another clock") == 1 and "/cubli/wheel_command" in err, err


BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


ASKS_RELIABLE = "qos_overrides./cubli/attitude.subscription.reliability:=reliable"


@pytest.mark.parametrize("publisher_qos, subscription_qos, setting, parts, cure", [
    (BEST_EFFORT, 1000, ASKS_RELIABLE,
     ("/cubli/attitude: nothing is received from the node /my_estimator. It offers best_effort, volatile",
      "this node asks for reliable, volatile", "what does not fit is reliability"),
     "qos_overrides./cubli/attitude.subscription.reliability:=best_effort"),
    (BEST_EFFORT, LATCHED, "lambda_a:=0.041",  # a driver's best effort fits as it is
     ("/cubli/wheel_command: the node /my_estimator hears nothing. It asks for reliable, transient_local",
      "this node offers reliable, volatile", "what does not fit is durability"),
     "qos_overrides./cubli/wheel_command.publisher.durability:=transient_local"),
])
def test_quality_of_service_that_does_not_fit_is_named_and_can_be_mended(
        tmp_path, publisher_qos, subscription_qos, setting, parts, cure):
    stranger = Stranger(publisher_qos, subscription_qos)
    with (tmp_path / "err").open("w") as file, running(*CONTROLLER, "--ros-args", "-p", setting, cwd=tmp_path,
                                                       stderr=file) as process:
        text = until(lambda: found if "what does not fit" in (found := (tmp_path / "err").read_text()) else None, 60.0,
                     "the sentence")
        finish(process)
    assert all(part in text for part in parts), text
    assert f"-p {cure}" in text, text
    assert text.count("what does not fit") == 1, text
    with running(*CONTROLLER, "--ros-args", "-p", cure, cwd=tmp_path) as process:
        def heard():
            stranger.send(time.time_ns())
            return stranger.commands
        stranger.spin_until(heard, "a command")
        assert "what does not fit" not in stop(process)
    stranger.close()


def typed_commands() -> list[list[str]]:
    """The commands of section 5 of docs/extend.md, as typed there."""
    section = (ROOT / "docs" / "extend.md").read_text().partition("## 5.")[2].partition("\n## ")[0]
    lines = re.search(r"```\n(.*?)```", section, re.S)[1].strip().splitlines()
    return [shlex.split(line, comments=True) for line in lines]


def test_the_commands_of_the_handbook_close_the_loop():
    """The rover comes to rest near its balance attitude, which it leaves within some seconds without a controller."""
    plant, controller = typed_commands()
    assert plant[:2] == controller[:2] == ["flight", "node"]
    node = rclpy.create_node("observer")
    truth, commands, executor = [], [], SingleThreadedExecutor()
    node.create_subscription(Imu, "/cubli/truth/attitude", truth.append, 1000)
    node.create_subscription(JointState, "/cubli/wheel_command", commands.append, 1000)
    executor.add_node(node)

    def angle(message):
        return 2.0 * (1.0 - min(1.0, message.orientation.w ** 2)) ** 0.5  # [rad]

    def came_closer():
        for _ in range(50):
            executor.spin_once(timeout_sec=0.0)
        return len(commands) > 100 and len(truth) > 100 and angle(truth[-1]) < 0.5 * max(map(angle, truth))
    with running(*plant[1:], cwd=ROOT) as first, running(*controller[1:], cwd=ROOT) as second:
        until(came_closer, 120.0, "the rover to come nearer to its balance attitude")
        answered = {stamp_of(message) for message in commands} & {stamp_of(message) for message in truth}
        stop(second)
        stop(first)
    executor.shutdown()
    node.destroy_node()
    assert len(answered) > 50
