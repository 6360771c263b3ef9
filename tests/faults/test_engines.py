"""A fault of every type at every kind of place: all engines, the replay and the verification give the same bytes."""

import json

import pytest
import yaml

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.engines.compiled import CompiledRun
from flight_graph.faults.fault_types import TYPES
from flight_graph.graphs.scenario import load
from flight_graph.recordings.recording import open_run
from tests.faults import chain
from tests.faults.engines import digest, fly, plainly
from tests.faults.everything import FAULTS, MONITORS
from tests.ros.processes import flight
from tests.ros.test_lockstep import assert_equal, messages, order

pytestmark = pytest.mark.xdist_group("faults")
COMPONENTS = ("world", "gauge", "follower", "bystander", "manager")


def everything(**changes) -> dict:
    return chain.data(FAULTS, monitors=MONITORS, **changes)


def test_the_scenario_has_them_all():
    """Every type at every kind of place that allows it for one engine or another, and every key."""
    faults = chain.scenario(FAULTS).faults.faults
    assert {fault.entry.type for fault in faults} == TYPES.keys()
    kinds = {(fault.entry.type, fault.place.kind) for fault in faults}
    assert {kind for _, kind in kinds} == {kind for one in TYPES.values() for kind in one.places}
    keys = {key for fault in faults for key in fault.entry.given}
    assert keys == {"id", "at", "type", "unit", "when"} | {key for one in TYPES.values() for key in (*one.needs, *one.takes)}


@pytest.fixture(scope="module")
def compiled():
    return CompiledRun(chain.Scenario(everything(), "chain.yaml")).run()


def test_each_fault_acts_and_so_do_the_monitors(compiled):
    report = compiled["faults"]
    assert not [fault["id"] for fault in FAULTS if not report[fault["id"]].any()]
    status = compiled["monitors"]
    assert status["slow_down"][-1] > 0 and status["blind"][-1] == 1 and compiled["chain/mode"]["changes"][-1] > 0
    counts = {track.topic: len(track.records) for track in compiled.tracks}
    assert counts["chain/imu"] != 100 and counts["chain/echo"] != 50 and counts["chain/mode"] == 43


def test_two_runs_and_plain_python(compiled):
    assert digest(compiled) == fly(everything()) == plainly(everything())


def test_another_seed_is_another_run_of_the_same_faults(compiled):
    other = fly(everything(seed=8))
    assert other["chain/imu"] != digest(compiled)["chain/imu"] and other == plainly(everything(seed=8))


@pytest.mark.parametrize("record", [{"max_rate_hz": 30}, {"topics": ["chain/range", "faults"]},
                                    {"topics": ["chain/imu", "monitors", "chain/echo"], "max_rate_hz": 20}], ids=str)
def test_thinned_and_partial_recordings(compiled, record):
    """What is recorded is what a whole recording has at those ticks; the engines agree."""
    data = everything(record=record)
    part = CompiledRun(chain.Scenario(data, "chain.yaml")).run()
    assert digest(part) == plainly(data)
    whole = {track.topic: track for track in compiled.tracks}
    for track in part.tracks:
        period = {"chain/imu": 10, "chain/range": 50, "chain/echo": 20, "monitors": 20}.get(track.topic, 10)
        every = 1 if track.topic == "faults" or "max_rate_hz" not in record else -(-(1000 // period) // record["max_rate_hz"])
        kept = whole[track.topic].stamps_ns % (every * period * 1_000_000) == 0
        assert (track.stamps_ns == whole[track.topic].stamps_ns[kept]).all(), track.topic
        sent = track.signal.payloads(whole[track.topic].records)[kept]
        assert track.signal.payloads(track.records).tobytes() == sent.tobytes(), track.topic


# -- bags --------------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("everything")
    (folder / "everything.yaml").write_text(yaml.safe_dump(everything()))
    runs.execute(load(str(folder / "everything.yaml")), out=folder / "compiled")
    return folder


def test_verify(folder):
    assert runs.verify(folder / "compiled", trust=True).verdict == "equal"


@pytest.mark.parametrize("component", COMPONENTS + ("faults", "monitors"))
def test_replay(folder, component):
    result = runs.replay(folder / "compiled", component, trust=True)
    assert result.holds and result.comparison.verdict == "equal", result.comparison.sentences
    assert result.firings == {"follower": 50, "manager": 50, "monitors": 50}.get(component, 100)


def test_the_bag_carries_the_faults(folder):
    scenario = open_run(folder / "compiled", trust=True)[1]
    assert scenario.file.faults == FAULTS and scenario.file.monitors["rate_hz"] == 50


def test_numbers_of_the_run(folder, compiled):
    done = flight("run", "everything.yaml", "--trust", "--json", "--out", folder / "again", cwd=folder)
    assert done.returncode == 0, done.stderr
    judged = json.loads(done.stdout)["metrics"]
    assert judged["fault_onset_s"] == 0.0 and judged["fault_detected"]
    assert judged["final_mode"] == chain.Manager.modes[int(compiled["chain/mode"]["mode"][-1])]


@pytest.mark.ros
def test_ros_in_lockstep(folder):
    pytest.importorskip("rclpy")
    outcome = runs.execute(load(str(folder / "everything.yaml")), "ros", out=folder / "ros")
    assert outcome.lost == 0
    assert_equal(folder / "compiled", folder / "ros")
    assert order(folder / "compiled") == order(folder / "ros")
    assert outcome.metrics == runs.execute(load(str(folder / "everything.yaml")), out=folder / "third").metrics
    assert runs.verify(folder / "ros", trust=True).verdict == "equal"


@pytest.mark.ros
@pytest.mark.parametrize("component", ["gauge", "follower"])
def test_replay_as_a_node(folder, component):
    pytest.importorskip("rclpy")
    result = runs.replay(folder / "compiled", component, "ros", trust=True)
    assert result.holds and result.comparison.verdict == "equal", result.comparison.sentences


@pytest.mark.ros
def test_ros_records_a_part_thinned(folder):
    pytest.importorskip("rclpy")
    data = everything(record={"topics": ["chain/imu", "faults", "chain/mode"], "max_rate_hz": 30}, duration_s=0.5)
    (folder / "part.yaml").write_text(yaml.safe_dump(data))
    for engine in ("compiled", "ros"):
        runs.execute(load(str(folder / "part.yaml")), engine, out=folder / f"part_{engine}")
    assert_equal(folder / "part_compiled", folder / "part_ros")
    assert messages(folder / "part_ros").keys() >= {"/chain/imu", "/faults", "/chain/mode"}


# -- runs that a fault ends --------------------------------------------------------------------------------------------
def test_a_bag_of_a_run_that_a_fault_ended(folder):
    """The bag goes up to the end; each component can be replayed until there."""
    from flight_graph.errors import RunStopped
    data = everything()
    data["faults"] = [*FAULTS, *(chain.fault("bias", "gauge.imu.orientation[1]", f"end{n}", value=1.5e308, from_s=0.63) for n in range(2))]
    assert fly(data) == plainly(data) and "stopped" in fly(data)
    (folder / "ended.yaml").write_text(yaml.safe_dump(data))
    with pytest.raises(RunStopped, match="gauge stopped at t = 0.63 s"):
        runs.execute(load(str(folder / "ended.yaml")), out=folder / "ended")
    assert read_bag(folder / "ended").metadata
    for component in ("gauge", "follower", "world"):
        result = runs.replay(folder / "ended", component, trust=True)
        assert result.holds, result.comparison.sentences
