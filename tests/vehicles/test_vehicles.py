"""Several vehicles in one graph: each flies as alone with its seed, in all engines; paths reach into it; what is refused."""

import copy

import numpy as np
import pytest
import yaml

from flight_graph import runs
from flight_graph.campaigns.cases import Cases
from flight_graph.components import namespaces
from flight_graph.components.component import Component
from flight_graph.components.foreign import Untrusted, refuse
from flight_graph.components.parameter_file import overrides
from flight_graph.engines import moved, part_calls, parts
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.graphs.variation import Variation
from flight_graph.graphs.vehicles import seed_of
from flight_graph.scenes.finding import scene_of
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector
from tests.faults import chain
from tests.faults.engines import fly, plainly
from tests.faults.everything import FAULTS, MONITORS
from tests.ros.test_lockstep import assert_equal

pytestmark = pytest.mark.xdist_group("vehicles")
EVENTS = [{"at_s": 0.3, "set": {"gauge.offset": [0.1, 0.0, 0.0]}}]


def inside(faults=FAULTS, **changes) -> dict:
    return {**chain.data(copy.deepcopy(faults), monitors=copy.deepcopy(MONITORS), events=EVENTS), **changes}


def whole(include, duration_s=1.0, **changes) -> dict:
    return {"name": "whole", "title": "several chains", "duration_s": duration_s, "seed": 5, **changes,
            "include": {name: {"scenario": {key: value for key, value in data.items() if key != "seed" or name == "seeded"}}
                        for name, data in include.items()}}


def flown(data) -> dict:
    return {track.topic: track for track in CompiledRun(Scenario(data, "whole.yaml")).run().tracks}


def assert_alike(alone, together, vehicle):
    """Each number of each message, and its time, is that of the vehicle alone."""
    for topic, track in alone.items():
        other = together[namespaces.topic_within(topic, vehicle)]
        assert track.stamps_ns.tolist() == other.stamps_ns.tolist(), topic
        mine, theirs = (one.records.view("u1").reshape(len(one.records), -1) for one in (track, other))
        for (path, _, here, size), (_, _, there, _) in zip(track.signal.leaves(), other.signal.leaves(), strict=True):
            assert mine[:, here:here + size].tobytes() == theirs[:, there:there + size].tobytes(), f"{topic}.{path}"


@pytest.fixture(scope="module")
def group():
    """Three chains with a fault of every type: two at the same depth, one in a vehicle of a vehicle; and their data."""
    data = whole({"chain_a": inside(), "chain_b": inside(), "fl": whole({"abcd": inside()})})
    return data, flown(data)


@pytest.mark.parametrize("path", [["chain_a"], ["chain_b"], ["fl", "abcd"]], ids=".".join)
def test_each_flies_as_alone_with_its_seed(group, path):
    seed = 5
    for name in path:
        seed = seed_of(seed, name)
    assert_alike(flown(inside(seed=seed)), group[1], ".".join(path))


def test_one_machine_code_serves_every_namespace():
    """Copies bring each number of a record to its place, and nothing of the frame's name; no name makes code anew."""
    for name in ("a", "a_name_that_nobody_has_taken"):
        inside = namespaces.within(chain.Gauge, name)
        for plain, signal in [(chain.Gauge.outputs[port], one) for port, one in inside.outputs.items()]:
            one, other = np.zeros(plain.dtype.itemsize, "u1"), signal.zeros(1).view("u1").copy()
            for number, (_, _, here, size) in enumerate(signal.leaves()):
                other[here:here + size] = number + 1
            for there, here, size in moved.stretches(plain, signal):
                one[there:there + size] = other[here:here + size]
            for number, (_, _, there, size) in enumerate(plain.leaves()):
                assert (one[there:there + size] == number + 1).all(), (name, number)
        keys = {parts.key(moved.made_of(inside), part) for part in part_calls.parts(inside)}
        assert keys == {parts.key(chain.Gauge, part) for part in part_calls.parts(chain.Gauge)}


def test_names_whose_messages_differ_in_places_alone():
    """Messages of one size, in which a byte behind the frame's name lies elsewhere: names of so many letters, and one more."""
    one = chain.data()
    together = flown(whole({"a" * letters: one for letters in range(3, 8)}, 0.3))
    for letters in range(3, 8):
        name = "a" * letters
        assert together[f"{name}/chain/range"].records["radiation_type"].tolist() == [200] * len(
            together[f"{name}/chain/range"].records), name
        assert_alike(flown({**one, "duration_s": 0.3, "seed": seed_of(5, name)}), together, name)


def test_two_of_one_kind_have_noise_of_their_own(group):
    a, b = (group[1][f"{name}/chain/imu"].records["angular_velocity"] for name in ("chain_a", "chain_b"))
    assert a.shape != b.shape or (a != b).any()


def test_plain_python_and_the_data_of_a_bag(group):
    data, tracks = group
    assert {topic: fly(data)[topic] for topic in tracks} == plainly(data) == fly(Scenario(data, "whole.yaml").resolved())


def test_topics_and_frames(group):
    signal = group[1]["fl/abcd/chain/imu"].signal
    assert signal.fixed["header.frame_id"] == "fl/abcd/chain"
    plant = load("rovers_and_lander").graph.nodes["rover_a.plant"]
    messages = {one.topic: one.function(plant.component.outputs[one.port].zeros(1).view(np.recarray)[0])
                for one in plant.component.said(plant.values)}
    frames = {(one.header.frame_id, one.child_frame_id) for topic in ("tf", "tf_static") for one in messages[topic].transforms}
    assert frames >= {("map", "rover_a/site"), ("rover_a/site", "rover_a/cubli_base")}
    assert {name.split("/")[0] for pair in frames for name in pair} == {"map", "rover_a"}
    seen = scene_of(load("rovers_and_lander"))
    assert {*frames} <= {(one.parent, one.name) for one in seen.frames} and "probe/asteroid" in seen.tree
    assert {"rover_a/cubli/truth", "probe/lander/truth"} & {one.topic for one in seen.arrows}
    assert {one.header.frame_id.split("/")[0] for one in messages["rover_a/scene"].markers} == {"rover_a"}


def test_a_path_from_outside_is_the_key_inside():
    """Faults, events and monitors of the whole do what the same ones of the vehicle would."""
    faults = [{"id": "off", "at": "gauge.imu.angular_velocity[0]", "type": "bias", "value": 0.4, "from_s": 0.2},
              {"id": "late", "at": "follower <- imu", "type": "delay", "ticks": 2, "when": "gauge.imu.angular_velocity[0] > 0.3"}]
    monitors = {"watchpoints": [{"id": "fast", "when": "imu.angular_velocity[0] > 0.35"},
                                {"id": "old", "stale": "gauge.range", "after_s": 0.04}],
                "actionpoints": [{"id": "act", "when": "fast", "mode": {"manager": "hold"}, "set": {"gauge.gain": 2.0}}]}
    own = whole({"chain_a": {**chain.data(faults, events=EVENTS), "monitors": monitors}})
    above = whole({"chain_a": chain.data()}, events=[{"at_s": 0.3, "set": {"chain_a.gauge.offset": [0.1, 0.0, 0.0]}}])
    above["faults"] = [{**one, "at": f"chain_a.{one['at']}"} for one in copy.deepcopy(faults)]
    above["faults"][1]["when"] = "chain_a.gauge.imu.angular_velocity[0] > 0.3"
    above["monitors"] = {"watchpoints": [{"id": "fast", "when": "chain_a.gauge.imu.angular_velocity[0] > 0.35"},
                                         {"id": "old", "stale": "chain_a.gauge.range", "after_s": 0.04}],
                         "actionpoints": [{"id": "act", "when": "fast", "mode": {"chain_a.manager": "hold"},
                                           "set": {"chain_a.gauge.gain": 2.0}}]}
    one, other = flown(own), flown(above)
    for topic in ("imu", "range", "echo", "mode"):
        topic = f"chain_a/chain/{topic}"
        assert one[topic].records.tobytes() == other[topic].records.tobytes(), topic
    assert one["chain_a/chain/mode"].records["changes"][-1] > 0


def test_sweeps_and_metrics_reach_in():
    measures = {"peak": {"largest": "gauge.imu.angular_velocity", "of": "absolute"}}
    vary = {"grid": {"chain_a.gauge.gain": [1.0, 2.0], "chain_a.faults.off.value": [0.0, 0.5]}}
    faults = [{"id": "off", "at": "gauge.imu.angular_velocity[0]", "type": "bias", "value": 0.1}]
    data = whole({"chain_a": {**chain.data(faults), "measures": measures}}, vary=vary,
                 measures={"seen": {"final": "chain_a.follower.echo.count"}})
    data["include"]["other"] = {"scenario": chain.data()}
    scenario = Scenario(data, "whole.yaml")
    case, _ = Variation(scenario).case(1)
    assert case.vehicles["other"] is scenario.vehicles["other"] and case.vehicles["chain_a"] is not scenario.vehicles["chain_a"]
    cases = Cases(scenario)
    rows = cases.rows(range(4))
    for row, (gain, value) in zip(rows, [(1.0, 0.0), (1.0, 0.5), (2.0, 0.0), (2.0, 0.5)], strict=True):
        assert row.varied == {"chain_a.gauge.gain": gain, "chain_a.faults.off.value": value}
        faults[0]["value"] = value
        alone = {**chain.data(faults), "measures": measures}
        alone["components"]["gauge"]["parameters"] = {"gain": gain}
        tracks = flown(alone)
        assert row.metrics["chain_a.peak"] == abs(tracks["chain/imu"].records["angular_velocity"]).max()
        assert row.metrics["seen"] == 150.0 and row.metrics["chain_a.fault_onset_s"] == 0.0
    assert cases.units["chain_a.gauge.gain"] == "1"


def test_a_fault_from_outside_is_no_false_alarm():
    """Monitors of a vehicle are judged by the faults that strike it, whoever sets them."""
    monitors = {"watchpoints": [{"id": "fast", "when": "imu.angular_velocity[0] > 0.6"}],
                "actionpoints": [{"id": "act", "when": "fast", "blames": ["gauge"]}]}
    data = whole({"chain_a": {**chain.data(), "monitors": monitors}, "chain_b": {**chain.data(), "monitors": monitors}})
    data["faults"] = [{"id": "off", "at": "chain_a.gauge.imu.angular_velocity[0]", "type": "bias", "value": 0.7, "from_s": 0.5}]
    scenario = Scenario(data, "whole.yaml")
    found = metrics.compute(scenario, CompiledRun(scenario).run())
    assert found["chain_a.fault_onset_s"] == 0.5 and found["chain_a.false_alarms"] == 0 and found["chain_a.fault_isolated"]
    assert found["chain_b.false_alarms"] == 0 and "chain_b.fault_onset_s" not in found


def test_the_rovers_and_the_lander_fly_as_alone():
    names = {"rover_a": "cubli_asteroid", "rover_b": "cubli_asteroid", "probe": "lander_nominal"}
    scenario = load("rovers_and_lander", {"duration_s": 3.0})
    together = {track.topic: track for track in CompiledRun(scenario).run().tracks}
    given = yaml.safe_load("{plant.wheel_effectiveness: 0.8, plant.initial_angles: [0.2, -0.2, 0.2]}")
    for vehicle, name in names.items():
        changes = {"duration_s": 3.0, "seed": scenario.vehicles[vehicle].seed, **(given if vehicle == "rover_b" else {})}
        alone = {track.topic: track for track in CompiledRun(load(name, changes)).run().tracks}
        assert_alike(alone, together, vehicle)
    seeds = [scenario.vehicles[name].seed for name in names]
    assert seeds == [seed_of(1, name) for name in names] and len(set(seeds)) == 3


# -- files --------------------------------------------------------------------------------------------------------------
HEAD = "name: x\ntitle: x\nduration_s: 1\n"
PAIR = ("components: {plant: {use: sim_nodes/cubli_plant}, law: {use: cubli_ros/pd_controller}}\n"
        "connect: {law.attitude: plant.attitude}\n")


class Ear(Component):
    """Reads the gauge of the vehicle chain_a."""

    inputs = {"imu": namespaces.signal_within(chain.IMU, "chain_a")}
    outputs = {"heard": named_vector("ears", "", {"rate": Quantity(3, "rad/s")}, Role.TELEMETRY)}
    kernel = chain.see


def test_files_and_settings(tmp_path):
    """A vehicle in a vehicle by relative files; set, seeds, and a parameter that follows one of theirs."""
    (tmp_path / "rover").mkdir()
    (tmp_path / "rover/one.yaml").write_text(HEAD + "include: {inner: two.yaml}\n")
    (tmp_path / "rover/two.yaml").write_text(HEAD.replace("1\n", "9\nseed: 4\nrecord: {max_rate_hz: 1}\n") + PAIR)
    (tmp_path / "all.yaml").write_text(HEAD + "seed: 8\ninclude: {a: {scenario: rover/one.yaml, set: {inner.plant.mass: 3}}, "
                                       "b: {scenario: rover/two.yaml, set: {seed: 12}}}\n"
                                       + PAIR.replace("cubli_plant}", "cubli_plant, parameters: {mass: '= 2 * a.inner.plant.mass'}}"))
    scenario = load(str(tmp_path / "all.yaml"), {"b.law.rate_hz": 50, "a.seed": 3})
    nodes = scenario.graph.nodes
    assert nodes["a.inner.plant"].values["mass"] == 3.0 and nodes["plant"].values["mass"] == 6.0 and nodes["b.law"].rate_hz == 50
    assert scenario.vehicles["b"].seed == 12 and scenario.vehicles["a"].vehicles["inner"].seed == seed_of(3, "inner")
    assert scenario.vehicles["a"].vehicles["inner"].duration_ns == 10**9 and scenario.vehicles["b"].file.record.max_rate_hz is None


def test_who_reads_a_vehicle_names_its_frame():
    """An input of the whole finds a vehicle's topic by its full name."""
    data = whole({"chain_a": chain.data()}) | {"components": {"ear": {"use": f"{__file__}:Ear"}}}
    tracks = flown(data)
    assert tracks["ears"].records["rate"].tobytes() == tracks["chain_a/chain/seen"].records["rate"].tobytes()
    data["connect"] = {"ear.imu": "chain_a.gauge.range"}
    with pytest.raises(FlightError, match="ear.imu: chain_a.gauge.range is the wrong signal"):
        Scenario(data, "whole.yaml")


REFUSED = {
    "include: {a: x.yaml}": "include.a: a scenario cannot include itself: x.yaml -> x.yaml",
    "include: {a: nowhere.yaml}": "include.a: there is no scenario file '.*nowhere.yaml'",
    "include: {a: cubli_asteroit}": "include.a: no scenario called 'cubli_asteroit'; did you mean 'cubli_asteroid'",
    "include: {a: cubli_asteroid}\ncomponents: {a: {use: sim_nodes/cubli_plant}}": "include.a: a component has this name",
    "include: {a/b: cubli_asteroid}": "include.a/b: this is no name of a node",
    "include: {faults: cubli_asteroid}": "include.faults: this name is taken",
    "include: [cubli_asteroid]": "include: input should be a valid dictionary",
    "include: {a: {scenari: cubli_asteroid}}": "include.a.scenario: field required",
    "include: {a: {scenario: cubli_asteroid, set: {controler.k_a: 1}}}":
        "include.a.set controler.k_a: no component called 'controler'; did you mean 'controller'",
    "include: {a: {scenario: cubli_asteroid, set: {controller.k_b: 1}}}":
        r"include.a \(cubli_asteroid\): components.controller.parameters: no parameter called 'k_b'",
    "include: {a: {scenario: cubli_asteroid, set: {duration_s: 1}}}": "include.a.set duration_s: the scenario that includes decides",
    "include: {a: cubli_asteroid}\nevents: [{at_s: 1, set: {a.controler.k_a: 1}}]": "events.*no component called 'a.controler'",
    "include: {a: cubli_asteroid}\nfaults: [{id: f, at: b.imu.imu, type: drop}]": "faults.f.at: no component called 'b'",
    "include: {a: cubli_asteroid}\nconnect: {a.plant.comand: a.controller.command}": "a.plant: no input called 'comand'",
    "include: {a: cubli_asteroid}\nvary: {grid: {a.duration_s: [1]}}": "'a.duration_s' cannot be varied",
    "include: {a: cubli_asteroid}\nvary: {grid: {a.plant.mas: [1]}}": "vary: a.plant: no parameter called 'mas'",
    "include: {" + ", ".join(f"v{i}: cubli_asteroid" for i in range(40)) + "}": "240 components, .*; allowed: 200",
}


@pytest.mark.parametrize("text", REFUSED)
def test_refused(tmp_path, text):
    (tmp_path / "x.yaml").write_text(HEAD + text + "\n")
    with pytest.raises(FlightError, match=f"^x.yaml: .*{REFUSED[text]}"):
        load(str(tmp_path / "x.yaml"))


def test_circles_depth_and_number(tmp_path):
    for name, other in (("c1", "c2.yaml"), ("c2", "c1.yaml"), *((f"d{i}", f"d{i + 1}.yaml") for i in range(7)), ("d7", "cubli_asteroid")):
        (tmp_path / f"{name}.yaml").write_text(f"{HEAD}include: {{v: {other}}}\n")
    for level, other in enumerate(("n1.yaml", "n2.yaml", "cubli_asteroid")):
        entries = ", ".join(f"v{i}: {other}" for i in range(20))
        (tmp_path / f"n{level}.yaml").write_text(f"{HEAD}include: {{{entries}}}\n")
    for name, sentence in (("c1", "c1.yaml -> c2.yaml -> c1.yaml"), ("d0", "each other more than 5 deep"),
                           ("n0", "more than 100 scenarios are included")):
        with pytest.raises(FlightError, match=sentence):
            load(str(tmp_path / f"{name}.yaml"))


@pytest.mark.parametrize("text", ["include: {a: ../other.yaml}", "include: {a: {scenario: cubli_asteroid, set: {plant.use: ../evil.py:C}}}",
                                  "include: {a: {scenario: {name: y, title: y, metrics: '../evil.py:m', include: {b: cubli_asteroid}}}}"])
def test_code_of_what_is_included_needs_consent(tmp_path, text):
    """Code beside the scenario itself is its own; that beside an included one in another folder is not. Nothing has run."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    (tmp_path / "other.yaml").write_text(HEAD + "components: {c: {use: 'evil.py:C'}}\n")
    (tmp_path / "mine/x.yaml").write_text(HEAD + text + "\n")
    with pytest.raises(Untrusted, match=r"evil.py, SHA-256 .*add --trust"):
        load(str(tmp_path / "mine/x.yaml"), consent=refuse)
    assert not (tmp_path / "ran").exists()


def test_a_scenario_that_names_files_is_for_readers_of_files():
    with pytest.raises(FlightError, match="include.a: scenarios are included where a file is read"):
        Scenario({"name": "x", "title": "x", "duration_s": 1, "include": {"a": "cubli_asteroid"}}, "x.yaml")


def test_parameter_files_know_vehicles(tmp_path):
    known = {name: ("cubli_ros/appc_controller", None) for name in ("law", "a.law", "b.law")}
    for section, meant in (("/a/law", ["a.law"]), ("law", [*known]), ("/fleet/b/law", ["b.law"]), ("/*/law", ["a.law", "b.law"]),
                           ("/fleet/law", ["law"]), ("/b/appc_controller", ["b.law"])):
        (tmp_path / "p.yaml").write_text(f"{section}:\n  ros__parameters: {{k_a: 0.5}}\n")
        assert sorted(overrides(tmp_path / "p.yaml", known)[0]) == sorted(f"{name}.k_a" for name in meant), section


@pytest.mark.ros
def test_as_nodes(tmp_path):
    """Faults of every type, monitors, events and checkpoints inside of a vehicle, over ROS in lockstep."""
    pytest.importorskip("rclpy")
    data = whole({"chain_a": inside()}, record={"checkpoint_period_s": 0.25})
    for engine in ("compiled", "ros"):
        runs.execute(Scenario(data, "whole.yaml"), engine, out=tmp_path / engine)
    assert_equal(tmp_path / "compiled", tmp_path / "ros")
