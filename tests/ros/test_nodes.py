"""Nodes as a ROS user meets them: started alone, set, asked, remapped, fed by a stranger, run in realtime."""

import re
import signal
import time

import numpy as np
import pytest
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from mcap.reader import make_reader
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from flight_graph.timebase import J2000
from tests.ros.processes import finish, flight, running, until

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("nodes")]


class Client:
    """A plain rclpy node that calls services and listens."""

    def __init__(self):
        rclpy.init()
        self.node = rclpy.create_node("tester")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self._made = []

    def spin_until(self, condition, timeout=60.0, what="it"):
        def step():
            self.executor.spin_once(timeout_sec=0.02)
            return condition()
        return until(step, timeout, what)

    def call(self, type_, name, request, timeout=60.0):
        client = self.node.create_client(type_, name)
        self.spin_until(client.service_is_ready, timeout, f"the service {name}")
        future = client.call_async(request)
        self.spin_until(future.done, timeout, f"an answer of {name}")
        self.node.destroy_client(client)
        return future.result()

    def listen(self, type_, topic, qos=100):
        heard = []
        self._made.append(self.node.create_subscription(type_, topic, heard.append, qos))
        return heard

    def set(self, node, name, value):
        kinds = {float: (ParameterType.PARAMETER_DOUBLE, "double_value"), int: (ParameterType.PARAMETER_INTEGER, "integer_value"),
                 str: (ParameterType.PARAMETER_STRING, "string_value"), list: (ParameterType.PARAMETER_DOUBLE_ARRAY, "double_array_value")}
        kind, field = kinds[type(value)]
        request = SetParameters.Request(
            parameters=[Parameter(name=name, value=ParameterValue(type=kind, **{field: value}))])
        return self.call(SetParameters, f"{node}/set_parameters", request).results[0]

    def get(self, node, name):
        found = self.call(GetParameters, f"{node}/get_parameters", GetParameters.Request(names=[name])).values[0]
        return {ParameterType.PARAMETER_DOUBLE: found.double_value, ParameterType.PARAMETER_STRING: found.string_value,
                ParameterType.PARAMETER_DOUBLE_ARRAY: list(found.double_array_value)}[found.type]

    def state(self, node):
        return self.call(GetState, f"{node}/get_state", GetState.Request()).current_state.label

    def change(self, node, transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        return self.call(ChangeState, f"{node}/change_state", request).success

    def clear(self):
        for subscription in self._made:
            self.node.destroy_subscription(subscription)
        self._made.clear()

    def close(self):
        self.clear()
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown()


@pytest.fixture(scope="module")
def session():
    client = Client()
    yield client
    client.close()


@pytest.fixture
def client(session):
    yield session
    session.clear()


PLANT = ("node", "sim_nodes", "cubli_plant")
CONTROLLER = ("node", "cubli_ros", "appc_controller")
TO_PLANT = ("-r", "cubli/attitude:=cubli/truth/attitude")


def stopped_cleanly(process, number=signal.SIGINT):
    status, _, err = finish(process, number)
    assert status == 0 and "Traceback" not in err, err
    return err


def test_plant_and_controller_from_two_terminals(client, tmp_path):
    """Realtime at 100 Hz: commands follow the truth, /clock runs at the wall's pace, parameters and lifecycle work."""
    clock = client.listen(Clock, "/clock")
    truth, commands = client.listen(Imu, "/cubli/truth/attitude"), client.listen(JointState, "/cubli/wheel_command")
    with running(*PLANT, "--ros-args", "-p", "mass:=2.5", cwd=tmp_path) as plant, \
            running(*CONTROLLER, "--ros-args", *TO_PLANT, "-p", "lambda_a:=0.03", cwd=tmp_path) as controller:
        client.spin_until(lambda: len(commands) > 20 and len(truth) > 20, 60.0, "commands and truth")
        stamp = commands[-1].header.stamp
        assert commands[-1].name == ["wheel_x", "wheel_y", "wheel_z"] and len(commands[-1].effort) == 3
        assert any(np.abs(message.effort).max() > 1e-5 for message in commands)
        assert stamp.sec >= J2000 // 10**9

        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # whoever comes now is told as well
        models, scenes = client.listen(String, "/robot_description", latched), client.listen(MarkerArray, "/scene", latched)
        joints = client.listen(JointState, "/joint_states")
        client.spin_until(lambda: models and scenes and joints, 60.0, "the model, the ground and the wheels")
        masses = [float(mass) for mass in re.findall('mass value="([^"]*)"', models[0].data)]
        assert sum(masses) == pytest.approx(2.5, rel=1e-12) and [marker.ns for marker in scenes[0].markers] == ["ground"]
        assert joints[0].name == ["wheel_x", "wheel_y", "wheel_z"] and len(joints[0].position) == 3

        seen, began = len(clock), time.monotonic()
        start = clock[-1].clock
        client.spin_until(lambda: time.monotonic() - began > 1.5)
        passed = (clock[-1].clock.sec - start.sec) + (clock[-1].clock.nanosec - start.nanosec) / 1e9
        assert len(clock) > seen and 1.0 < passed < 2.0, passed  # 1.5 s of wall time, loosely: the machine may be busy

        assert client.get("/appc_controller", "lambda_a") == [0.03] * 3  # a scalar fills the array, which stays one
        assert client.set("/appc_controller", "lambda_a", 0.04).successful
        assert client.get("/appc_controller", "lambda_a") == [0.04] * 3
        assert client.set("/appc_controller", "feed_forward", 1).successful
        assert client.get("/appc_controller", "feed_forward") == 1.0  # a whole number is a number
        assert client.get("/appc_controller", "rho_a0") == [0.4] * 3
        assert client.set("/appc_controller", "lambda_a", [0.02, 0.03, 0.04]).successful
        assert client.get("/appc_controller", "lambda_a") == [0.02, 0.03, 0.04]
        refused = client.set("/appc_controller", "lambda_a", -1.0)
        assert not refused.successful
        assert re.search(r"lambda_a: \[-1\.0, -1\.0, -1\.0\] is not allowed .*allowed: 3 numbers, > 0 \[rad/s\]", refused.reason), refused
        assert not client.set("/appc_controller", "lambda_a", float("nan")).successful
        assert not client.set("/appc_controller", "lambda_a", [0.1, 0.2]).successful
        assert not client.set("/appc_controller", "law", "implict").successful
        ranged = client.set("/appc_controller", "feed_forward", 1.6)
        assert not ranged.successful and "1.5" in ranged.reason, ranged
        crossed = client.set("/appc_controller", "rho_a0", 0.001)
        assert not crossed.successful and "a funnel narrows" in crossed.reason
        fixed = client.set("/appc_controller", "rate_hz", 50.0)
        assert not fixed.successful and fixed.reason
        described = client.call(DescribeParameters, "/appc_controller/describe_parameters",
                                DescribeParameters.Request(names=["lambda_a", "feed_forward"])).descriptors
        assert "[rad/s]" in described[0].description and "Table 2" in described[0].description
        assert described[1].floating_point_range[0].to_value == 1.5

        assert client.state("/appc_controller") == "active"
        assert client.change("/appc_controller", Transition.TRANSITION_DEACTIVATE)
        assert client.state("/appc_controller") == "inactive"
        client.spin_until(lambda: silent(client, commands), 60.0, "silence of the deactivated controller")
        assert client.change("/appc_controller", Transition.TRANSITION_ACTIVATE)
        count = len(commands)
        client.spin_until(lambda: len(commands) > count + 10, 60.0, "commands after activation")
        newest = truth[-1].header.stamp
        assert abs(commands[-1].header.stamp.sec - newest.sec) <= 1, "the controller must not work off what it slept through"
        stopped_cleanly(controller, signal.SIGTERM)
        stopped_cleanly(plant, signal.SIGINT)


def silent(client, heard):
    count, began = len(heard), time.monotonic()
    while time.monotonic() - began < 0.4:
        client.executor.spin_once(timeout_sec=0.02)
    return len(heard) == count


def test_a_node_that_is_not_started_waits_to_be_configured(client, tmp_path):
    """Without autostart there are no ports and parameters before; what cannot be configured says why, and can be mended."""
    with running(*CONTROLLER, "--ros-args", "-p", "autostart:=false", "-p", "rho_a0:=0.001", cwd=tmp_path) as node:
        assert client.state("/appc_controller") == "unconfigured"
        assert "/cubli/attitude" not in dict(client.node.get_topic_names_and_types())
        assert not client.change("/appc_controller", Transition.TRANSITION_CONFIGURE)
        assert client.state("/appc_controller") == "unconfigured"
        assert client.set("/appc_controller", "rho_a0", 0.4).successful
        assert client.change("/appc_controller", Transition.TRANSITION_CONFIGURE)
        client.spin_until(lambda: client.node.count_subscribers("/cubli/attitude") == 1, 60.0, "the input")
        assert client.get("/appc_controller", "rho_a0") == [0.4] * 3
        assert not client.change("/appc_controller", Transition.TRANSITION_CLEANUP)
        assert client.state("/appc_controller") == "inactive"
        assert client.change("/appc_controller", Transition.TRANSITION_ACTIVATE)
        err = stopped_cleanly(node)
        assert "a funnel narrows" in err and "cannot be begun anew" in err


def test_parameter_file_namespace_and_remapping(client, tmp_path):
    (tmp_path / "p.yaml").write_text(yaml.safe_dump(
        {"/**": {"ros__parameters": {"gravity": 0.005, "initial_angles": [0.1, 0.0, -0.1]}}}))
    moved = client.listen(Imu, "/rover_7/where_it_is")
    with running(*PLANT, "--ros-args", "--params-file", tmp_path / "p.yaml", "-r", "__ns:=/rover_7", "-r",
                 "__node:=truth", "-r", "cubli/truth/attitude:=where_it_is", "-p", "rate_hz:=50.0", cwd=tmp_path) as plant:
        client.spin_until(lambda: len(moved) > 10, 60.0, "the remapped topic")
        assert client.get("/rover_7/truth", "gravity") == 0.005
        assert client.get("/rover_7/truth", "initial_angles") == [0.1, 0.0, -0.1]
        gaps = np.diff([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in moved])
        assert np.gcd.reduce(gaps) == 20_000_000  # 50 Hz
        stopped_cleanly(plant)


SECTIONS = {"/**": {"kp": 1.5, "kd": 2.5}, "/*/controller": {"kp": 3.5}, "/*": {"kd": 9.0}, "/**/other": {"kp": 9.0},
            "/rover_7/*": {"mass": 1.25}, "/*/*/controller": {"mass": 9.0}, "controller": {"mass": 9.0}}


def test_sections_with_wildcards_are_those_of_rclpy(client, tmp_path):
    """What a node takes from each section of a parameter file is what a plain rclpy node of that name takes."""
    (tmp_path / "p.yaml").write_text(yaml.safe_dump(
        {section: {"ros__parameters": values} for section, values in SECTIONS.items()}, sort_keys=False))
    file = ["--ros-args", "--params-file", str(tmp_path / "p.yaml")]
    plain = rclpy.create_node("controller", namespace="/rover_7", cli_args=file,
                              automatically_declare_parameters_from_overrides=True)
    wanted = {name: plain.get_parameter(name).value for name in ("kp", "kd", "mass")}
    plain.destroy_node()
    assert wanted == {"kp": 3.5, "kd": 2.5, "mass": 1.25}
    with running("node", "cubli_ros", "pd_controller", *file, "-r", "__ns:=/rover_7", "-r", "__node:=controller",
                 cwd=tmp_path) as node:
        found = {name: client.get("/rover_7/controller", name) for name in wanted}
        stopped_cleanly(node)
    assert {name: value[0] if isinstance(value, list) else value for name, value in found.items()} == wanted


def test_a_stranger_as_controller(client, tmp_path):
    """A plain rclpy node may send commands; rclpy's own form of empty arrays, other frames and names are dealt with."""
    wheels = client.listen(JointState, "/cubli/wheel_state")
    publisher = client.node.create_publisher(JointState, "/cubli/wheel_command", 10)
    with running(*PLANT, "--ros-args", "-p", "graph.stale_after_s:=1000.0", cwd=tmp_path) as plant:
        client.spin_until(lambda: wheels, 60.0, "the plant")

        def send(effort, frame="cubli_base", names=("wheel_x", "wheel_y", "wheel_z")):
            message = JointState(name=list(names), effort=[effort] * 3)
            message.header.frame_id, message.header.stamp = frame, wheels[-1].header.stamp
            publisher.publish(message)

        def answered(effort):
            send(effort)
            return abs(wheels[-1].effort[0] - effort) < 1e-12
        client.spin_until(lambda: answered(1.25e-3), 60.0, "the commanded torque")
        for wrong in ({"frame": "moon"}, {"names": ("a", "b", "c")}):
            for _ in range(5):
                send(3e-3, **wrong)
                seen = len(wheels)  # the plant takes the newest command alone: it fires before the next one is sent
                client.spin_until(lambda seen=seen: len(wheels) > seen + 1, 60.0, "the plant to take it")
        assert not silent(client, wheels)
        assert abs(wheels[-1].effort[0] - 1.25e-3) < 1e-12
        err = stopped_cleanly(plant)
    client.node.destroy_publisher(publisher)
    assert "header.frame_id is 'moon', this signal has 'cubli_base'" in err
    assert "name is ['a', 'b', 'c']" in err


def test_a_wrong_type_on_a_topic_is_named(client, tmp_path):
    publisher = client.node.create_publisher(Clock, "/cubli/attitude", 10)
    done = flight(*CONTROLLER, "--ros-args", "-p", "graph.inputs.attitude.period_ns:=10000000", "-p",
                  "graph.timeout_s:=1.0", cwd=tmp_path)
    client.node.destroy_publisher(publisher)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert ("error: appc_controller: waited 1 s for its input attitude: /cubli/attitude carries rosgraph_msgs/msg/Clock, "
            "this input takes sensor_msgs/msg/Imu") in done.stderr


def test_an_input_that_never_appears_is_named(tmp_path):
    done = flight(*CONTROLLER, "--ros-args", "-p", "graph.inputs.attitude.period_ns:=10000000", "-p",
                  "graph.timeout_s:=1.0", cwd=tmp_path)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert "waited 1 s for its input attitude on /cubli/attitude: no publisher has appeared" in done.stderr


def test_a_second_plant_on_the_same_topics_is_refused(client, tmp_path):
    heard = client.listen(Imu, "/cubli/truth/attitude")
    with running(*PLANT, cwd=tmp_path) as first:
        client.spin_until(lambda: heard, 60.0, "the first plant")
        for name in ("second", "cubli_plant"):  # a name of its own, or the same name
            done = flight(*PLANT, "--ros-args", "-r", f"__node:={name}", "-p", "graph.duration_s:=20.0", cwd=tmp_path)
            assert done.returncode == 1 and "Traceback" not in done.stderr, (name, done.stderr)
            assert "has a source already (node /cubli_plant); one topic has one source" in done.stderr
        stopped_cleanly(first)


@pytest.mark.parametrize("setting, parts", [
    ("lambda_a:=-0.041", ("lambda_a", "> 0", "rad/s")),
    ("lambda_a:=[0.1,0.2]", ("lambda_a", "3 numbers")),
    ("law:=fast", ("law", "explicit, implicit")),
    ("rate_hz:=30.0", ("30", "25 or 32")),
    ("graph.pace:=warp", ("pace", "lockstep or realtime")),
    ("feed_forward:=.nan", ("feed_forward", "finite")),
    ("qos_overrides./cubli/attitude.subscription.reliability:=good", ("reliability", "good")),
    ("qos_overrides./cubli/attitude.subscription.depth:=deep", ("qos_overrides./cubli/attitude.subscription.depth",)),
])
def test_wrong_settings_of_a_node_read_as_sentences(tmp_path, setting, parts):
    done = flight(*CONTROLLER, "--ros-args", "-p", setting, cwd=tmp_path)
    assert done.returncode in (1, 2) and "Traceback" not in done.stderr, done.stderr
    for part in parts:
        assert part in done.stderr, done.stderr


def test_realtime_run_counts_and_ends(client, tmp_path):
    """3 s at 100 Hz on the wall clock; /diagnostics on the air equals the one in the bag; a stranger's messages of the
    right length with another frame are not recorded, and counted."""
    live = client.listen(DiagnosticArray, "/diagnostics")
    strangers, sent = [], []

    def step():
        if live and not strangers:  # one that came earlier would be refused as a second source
            strangers.append(client.node.create_publisher(Imu, "/cubli/imu", 10))
        if len(sent) < 5 and strangers and strangers[0].get_subscription_count() >= 2:
            message = Imu()
            message.header.frame_id = "imu_kink"
            strangers[0].publish(message)
            sent.append(message)
        return process.poll() is not None

    with running("run", "cubli_asteroid", "--engine", "ros", "--pace", "realtime", "--duration", 3, "--out",
                 tmp_path / "bag", "--json", cwd=tmp_path) as process:
        client.spin_until(step, 90.0, "the end of the run")
        out, err = process.communicate()
    client.node.destroy_publisher(*strangers)
    assert process.returncode == 0, err
    made = yaml.safe_load(out)
    assert made["pace"] == "realtime:1" and made["wall_s"] > 2.9
    plant = made["statistics"]["plant"]
    assert plant["ticks"] == 300 and plant["refused_messages"] == 0
    assert {"deadline_misses", "late_inputs", "stale_commands", "latency_us_p50", "latency_us_p99"} <= plant.keys()
    assert plant["latency_us_p50"] <= plant["latency_us_p99"]
    recorded = {}
    counts = {}
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as file:
        reader = make_reader(file)
        outcome = next(r.metadata for r in reader.iter_metadata() if r.name == "flight_graph.outcome")
        for _, channel, message in reader.iter_messages():
            if channel.topic == "/cubli/imu":
                assert deserialize_message(message.data, Imu).header.frame_id == "imu_link"
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            if channel.topic == "/diagnostics":
                found = deserialize_message(message.data, DiagnosticArray)
                recorded[found.header.stamp.sec, found.header.stamp.nanosec] = found
    assert counts["/cubli/truth"] == 300
    assert int(outcome["refused /cubli/imu"]) == len(sent) == 5
    assert len(live) >= 10
    for message in live:
        assert recorded[message.header.stamp.sec, message.header.stamp.nanosec] == message
