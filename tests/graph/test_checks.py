"""Graphs and scenario files that are wrong: refused before anything runs, with file, key, and what is allowed."""

import copy

import pytest
import yaml

from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs import scenario as scenarios
from flight_graph.graphs.scenario import Scenario
from tests.graph import toy


def refused(change, tmp_path=None) -> str:
    """The sentence for the toy scenario after ``change(data)``."""
    data = copy.deepcopy(toy.scenario())
    change(data)
    with pytest.raises(FlightError) as error:
        Scenario(data, "toy.yaml")
    text = str(error.value)
    assert text.startswith("toy.yaml: ") and "\n" not in text and "Traceback" not in text, text
    return text


def put(path, value):
    """A change that sets data[a][b][c] for path 'a.b.c'; None removes it."""
    def change(data):
        *parents, last = path.split("/")
        for part in parents:
            data = data.setdefault(part, {})
        if value is None:
            del data[last]
        else:
            data[last] = value
    return change


CASES = {
    "unconnected port": (put("components/controller", None), "plant.command is unconnected: no component publishes "
                         "'toy/command'"),
    "unconnected, nobody publishes": (put("components/sensor", None), "watcher.imu is unconnected: no component publishes "
                                      "'toy/imu'"),
    "wrong signal": (put("connect/controller.imu", "plant.truth"), "connect: controller.imu: plant.truth is the wrong signal: "
                     "it carries toy/truth (sensor_msgs/msg/JointState)", "the type is sensor_msgs/msg/JointState there, "
                     "sensor_msgs/msg/Imu here"),
    "wrong names": (put("connect/watcher.command", "plant.truth"), "name is 6 long there, 3 long here",
                    "effort is 0 long there, 3 long here"),
    "unknown component": (put("connect/controller.imu", "sensr.imu"), "no component called 'sensr'; did you mean 'sensor'?"),
    "unknown output": (put("connect/controller.imu", "sensor.im"), "no output called 'im'; did you mean 'imu'?"),
    "unknown input": (put("connect/controller.im", "sensor.imu"), "no input called 'im'; did you mean 'imu'?"),
    "delay of two": (put("connect/watcher.command/delay", 2), "a delay of 2 ticks is not allowed; allowed: 0 or 1"),
    "edge without a dot": (put("connect/controller.imu", "sensor"), "'sensor' is not of the form component.port"),
    "rate without whole period": (put("components/plant/rate_hz", 30), "plant.rate_hz: 30", "25 or 32"),
    "rate of zero": (put("components/plant/rate_hz", 0), "plant.rate_hz: 0", "greater than 0"),
    "negative rate": (put("components/plant/rate_hz", -5), "plant.rate_hz: -5", "greater than 0"),
    "rate NaN": (put("components/plant/rate_hz", float("nan")), "plant.rate_hz: nan", "finite number > 0"),
    "no multiple of the base tick": (put("base_rate_hz", 160), "period of 5000000 ns is no multiple of the base tick of "
                                     "6250000 ns"),
    "slow output": (put("components/watcher/rate_hz", 4), ""),
    "two sources": (lambda data: data["components"].update(second=dict(data["components"]["sensor"])),
                    "second.imu and sensor.imu both publish 'toy/imu'; one topic has one source"),
    "duration zero": (put("duration_s", 0), "duration_s: 0", "greater than 0"),
    "duration negative": (put("duration_s", -1), "duration_s: -1", "greater than 0"),
    "duration NaN": (put("duration_s", float("nan")), "duration_s: nan", "finite"),
    "duration infinite": (put("duration_s", float("inf")), "duration_s: inf", "finite"),
    "duration text": (put("duration_s", "long"), "duration_s: ", "number", "'long'"),
    "no duration": (put("duration_s", None), "duration_s: field required"),
    "unknown key": (put("durations", 1), "durations: there is no such key; allowed here: name, title"),
    "unknown key of a component": (put("components/plant/rate", 1), "components.plant.rate: there is no such key; allowed "
                                   "here: use, rate_hz, parameters"),
    "unknown key of record": (put("record/topic", []), "record.topic: there is no such key; allowed here: topics"),
    "recorded topic": (put("record/topics", ["toy/im"]), "record.topics: no topic called 'toy/im'; did you mean 'toy/imu'"),
    "unknown parameter": (put("components/plant/parameters/stifness", 1.0), "components.plant.parameters: no parameter called "
                          "'stifness'; did you mean 'stiffness'?"),
    "out of range": (put("components/controller/parameters/kd", 11), "components.controller.parameters.kd: 11 is not allowed",
                     "<= 10 [N m s/rad]"),
    "wrong shape": (put("components/plant/parameters/angle", [1, 2]), "components.plant.parameters.angle: [1, 2]", "3 numbers"),
    "wrong type": (put("components/plant/parameters/inertia", "2 kg m^2"), "inertia: '2 kg m^2' is not allowed", "[kg m^2]"),
    "NaN": (put("components/plant/parameters/inertia", float("nan")), "inertia: nan is not allowed", "finite"),
    "unknown package": (put("components/plant/use", "sim_node/cubli_plant"), "components.plant.use: no package called "
                        "'sim_node'; did you mean 'sim_nodes'?"),
    "unknown executable": (put("components/plant/use", "sim_nodes/cubli_plan"), "did you mean 'cubli_plant'"),
    "unknown file": (put("components/plant/use", "nowhere.py:Plant"), "components.plant.use: there is no file '", "nowhere.py"),
    "unknown class": (put("components/plant/use", f"{toy.__file__}:Plan"), "no component called 'Plan'; did you mean 'Plant'?"),
    "a file without a class": (put("components/plant/use", "my_plant.py"), "'my_plant.py' is a file; name the component in it: "
                               "my_plant.py:Class"),
    "a path": (put("components/plant/use", "/tmp"), "'/tmp' names no component; write package/executable"),
    "a program": (put("components/plant/use", "sim_nodes/recorder"), "is not a component"),
    "epoch zero": (put("epoch_ns", 0), "epoch_ns: 0 is not allowed"),
    "epoch too late": (put("epoch_ns", 2**31 * 10**9), "epoch_ns: ", "31 bits"),
    "name that is no name": (lambda data: data["components"].update({"my plant": data["components"].pop("plant")}),
                             "components.my plant: this is no name of a node; allowed: a letter, then"),
    "name of the recorder": (lambda data: data["components"].update(recorder=data["components"].pop("plant")),
                             "components.recorder"),
}
CASES.pop("slow output")


@pytest.mark.parametrize("case", CASES)
def test_refused_with_a_sentence(case):
    change, *parts = CASES[case]
    text = refused(change)
    for part in parts:
        assert part in text, text


def test_a_loop_without_delay_is_named():
    """sensor -> controller -> ... with the plant's truth replaced by a component in a circle."""
    data = toy.scenario()
    data["components"]["second"] = {"use": f"{__file__}:Echo"}
    data["connect"]["sensor.truth"] = "second.truth"
    with pytest.raises(FlightError) as error:
        Scenario(data, "toy.yaml")
    text = str(error.value)
    assert "loop without delay: " in text and "connect: {" in text
    names = text.partition("delay: ")[2].partition(";")[0].split(" -> ")
    assert names[0] == names[-1] and set(names) == {"sensor", "controller", "second"}
    edges = {("sensor", "controller"), ("controller", "second"), ("second", "sensor")}
    assert set(zip(names, names[1:])) == edges, "the arrows follow the messages"
    data["connect"]["sensor.truth"] = {"from": "second.truth", "delay": 1}
    Scenario(data, "toy.yaml")


def test_a_slow_output_must_fit_its_component():
    text = refused(put("components/watcher/rate_hz", 25))
    assert "watcher.seen: its period of 100000000 ns is no multiple of the component's 40000000 ns" in text
    assert "set watcher.rate_hz to a multiple of 10" in text


@pytest.mark.parametrize("content, part", [
    ("a: [1", "this is no YAML"), ("- a\n- b\n", "a scenario is a mapping"), ("", "a scenario is a mapping"),
    ("name: x\n", "title: field required"), ("name: x\ntitle: y\nduration_s: 1\ncomponents: {}\n", "component"),
    ("name: x\ntitle: y\nduration_s: 1\ncomponents: [1]\n", "components"),
    ("name: x\ntitle: y\nduration_s: 1\ncomponents: {a: 3}\n", "components.a"),
])
def test_broken_files(tmp_path, content, part):
    path = tmp_path / "broken.yaml"
    path.write_text(content)
    with pytest.raises(FlightError) as error:
        scenarios.load(str(path))
    assert "broken.yaml" in str(error.value) and part in str(error.value), error.value


@pytest.mark.parametrize("overrides, part", [
    ({"plan.angle": 1}, "--set plan.angle: no component called 'plan'; did you mean 'plant'?"),
    ({"plant.angel": 1}, "no parameter called 'angel'; did you mean 'angle'?"),
    ({"components": {}}, "write component.parameter=value"), ({"speed": 1}, "write component.parameter=value"),
    ({"seed": "x"}, "seed"), ({"plant.rate_hz": "fast"}, "rate_hz"),
])
def test_overrides(tmp_path, overrides, part):
    path = tmp_path / "toy.yaml"
    path.write_text(yaml.safe_dump(toy.scenario()))
    with pytest.raises(FlightError) as error:
        scenarios.load(str(path), overrides)
    assert part in str(error.value), error.value


def test_unknown_scenario():
    with pytest.raises(FlightError, match="no scenario called 'cubli_astroid'; did you mean 'cubli_asteroid'"):
        scenarios.load("cubli_astroid")
    with pytest.raises(FlightError, match="there is no scenario file 'nowhere.yaml'"):
        scenarios.load("nowhere.yaml")


@toy.kernel
def echo(t_ns, p, x, command, truth):
    truth.angle = command.effort


class Echo(toy.Component):
    """Command in, truth out: closes a circle without a plant."""

    inputs, outputs = {"command": toy.COMMAND}, {"truth": toy.named_vector(
        "toy/echo", "toy", {"angle": toy.Quantity(3, "rad"), "rate": toy.Quantity(3, "rad/s")}, toy.Role.TRUTH)}
    kernel = echo


def test_what_a_function_of_metrics_raises_is_a_sentence(tmp_path):
    (tmp_path / "judge.py").write_text("def compute(scenario, signals):\n    return {'a': signals['nowhere']}\n\n\n"
                                       "def listed(scenario, signals):\n    return {'a': [1.0]}\n")
    for name, sentence in (("compute", "judge.py:compute' raises KeyError: 'nowhere'.*line"),
                           ("listed", "listed' gives a: list is not allowed; allowed: a number")):
        data = {**toy.scenario(), "metrics": f"{tmp_path / 'judge.py'}:{name}"}
        with pytest.raises(FlightError, match=sentence):
            metrics.compute(Scenario(data, "toy.yaml"), {})
