"""A run continued from any tick is the run itself from there on, byte for byte; a branch says what it is; both verify."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flight_graph import runs
from flight_graph.bags.reader import read_bag
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load
from flight_graph.recordings import beginning
from flight_graph.recordings.continuation import continued, memory_from
from flight_graph.recordings.recorded_run import open_recorded
from tests.faults import chain
from tests.faults.everything import FAULTS, MONITORS
from tests.stepping.bags import changed

ROOT = Path(__file__).resolve().parents[2]
VEHICLES = {"cubli_faults": 3.0, "spacerobot_faults": 2.0, "lander_faults": 2.0}  # scenario -> seconds
PLAINLY = """
import sys
from pathlib import Path
from flight_graph import runs
from flight_graph.recordings.continuation import continued
made = continued(sys.argv[1], trust=True)
runs.execute(made.scenario, "python", out=Path(sys.argv[2]), begin=made.begin)
"""


def messages(bag, begin_ns: int = 0) -> list:
    """(topic, stamp, payload) of all messages from a time on, in their order."""
    return [message for message in read_bag(bag).messages() if message[1] >= begin_ns]


@pytest.mark.parametrize("name", VEHICLES)
def test_from_random_ticks_of_each_vehicle(name):
    scenario = load(name, {"duration_s": VEHICLES[name]})
    machine, chance = CompiledRun(scenario), np.random.default_rng(42)
    whole = machine.run()
    for tick in chance.integers(1, scenario.ticks, 4):
        saved = memory_from(scenario, None, int(tick)).encode()
        part = machine.run(begin=Checkpoint.decode(saved, "saved"))
        for track, other in zip(whole.tracks, part.tracks):
            later = slice(int(np.searchsorted(track.stamps_ns, tick * scenario.graph.base_ns)), None)
            assert np.array_equal(track.stamps_ns[later], other.stamps_ns), (tick, track.topic)
            assert track.signal.payloads(track.records[later]).tobytes() == (
                track.signal.payloads(other.records).tobytes()), (tick, track.topic)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Bags of a chain in which every type of fault acts: with checkpoints, and without; and of a rover."""
    folder = tmp_path_factory.mktemp("continuation")
    data = chain.data(FAULTS, monitors=MONITORS, record={"checkpoint_period_s": 0.1})
    runs.execute(chain.Scenario(data, "chain.yaml"), out=folder / "kept")
    runs.execute(chain.Scenario(chain.data(FAULTS, monitors=MONITORS), "chain.yaml"), out=folder / "bare")
    runs.execute(load("cubli_earth", {"duration_s": 0.5, "record": {"checkpoint_period_s": 0.2}}), out=folder / "rover")
    return folder


def go_on(text, out, **options):
    """Run what goes on at ``BAG@SECONDS``; its folder."""
    made = continued(str(text), trust=True, **options)
    runs.execute(made.scenario, out=out, begin=made.begin)
    return out


@pytest.mark.parametrize("parent", ["kept", "bare"])
def test_a_bag_continued(folder, parent, tmp_path):
    begin_ns = open_recorded(folder / parent, trust=True).scenario.epoch_ns + 430_000_000
    out = go_on(f"{folder / parent}@0.43", tmp_path / "part")
    assert messages(out) == messages(folder / "bare", begin_ns)
    assert read_bag(out).metadata["flight_graph.begins"]["parent"] == parent
    again = go_on(f"{out}@0.6", tmp_path / "again")
    assert messages(again) == messages(folder / "bare", begin_ns + 170_000_000)
    result = runs.verify(again, trust=True)
    assert result.verdict == "equal", result.sentences
    for component in ("follower", "gauge", "world", "monitors"):
        replayed = runs.replay(again, component, trust=True)
        assert replayed.comparison.verdict == "equal", (component, replayed.comparison.sentences)


def test_checkpoints_do_not_change_the_messages_and_verify(folder):
    assert messages(folder / "kept") == messages(folder / "bare")
    assert beginning.ticks(read_bag(folder / "kept")) == list(range(10, 100, 10))
    result = runs.verify(folder / "kept", trust=True)
    assert result.verdict == "equal" and "equal, too: 9 checkpoints" in result.sentences


def test_plain_python_goes_on_where_machine_code_stood_and_the_other_way_round(folder, tmp_path):
    subprocess.run([sys.executable, "-c", PLAINLY, f"{folder / 'kept'}@0.43", tmp_path / "plain"], cwd=ROOT, check=True,
                   env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)})
    epoch_ns = open_recorded(folder / "kept", trust=True).scenario.epoch_ns
    assert messages(tmp_path / "plain") == messages(folder / "kept", epoch_ns + 430_000_000)
    for tick in range(50, 100, 10):
        one, other = (beginning.checkpoint(read_bag(bag), tick).digest
                      for bag in (folder / "kept", tmp_path / "plain"))
        assert one == other
    back = go_on(f"{tmp_path / 'plain'}@0.77", tmp_path / "back")
    assert messages(back) == messages(folder / "kept", epoch_ns + 770_000_000)


def test_a_branch_is_the_parent_with_something_set(folder, tmp_path):
    """The first firing answers the parent's inputs with the new parameter; what is not set is as it was."""
    out = go_on(f"{folder / 'rover'}@0.3", tmp_path / "branch", settings={"controller.lambda_a": 0.05}, duration_s=0.1)
    said = read_bag(out).metadata["flight_graph.begins"]
    assert (said["parent"], said["tick"], json.loads(said["changes"])) == ("rover", "300", {"controller.lambda_a": 0.05})
    parent = memory_from(load("cubli_earth", {"duration_s": 0.5}), None, 300)
    assert said["parent_digest"] == parent.digest
    run = open_recorded(out)
    assert [name for name, content in run.first.arrays.items() if content != parent.arrays[name]] == ["P_controller"]
    assert run.scenario.graph.nodes["controller"].values["lambda_a"] == [0.05] * 3
    assert run.scenario.duration_ns == 400_000_000 and run.complete
    truth, other = (read_bag(bag)["/cubli/truth/attitude"] for bag in (folder / "rover", out))
    assert truth[300] == other[0] and truth[399] != other[99]
    assert runs.verify(out).verdict == "equal"


def test_another_seed_is_other_noise_from_there_on(folder, tmp_path):
    made = continued(f"{folder / 'bare'}@0.5", {"seed": 9}, trust=True)
    whole = open_recorded(folder / "bare", trust=True).scenario
    seeds = [scenario.graph.nodes["gauge"].values.get("seed") for scenario in (made.scenario, whole)]
    assert made.scenario.seed == 9 and (seeds[0] is None or seeds[0] != seeds[1])


def test_what_acts_at_the_start_is_said(folder):
    made = continued(f"{folder / 'rover'}@0.3", {"plant.initial_angles": [0.1, 0.0, 0.0]})
    assert "initial_angles acts at the start, too, which is over" in " ".join(made.warnings)


@pytest.mark.parametrize("text, settings, duration_s, sentence", [
    ("rover@0.7", {}, None, "tick 700 .* is outside of it; it holds the run from tick 0 .* to 500"),
    ("rover@0.5", {}, None, "the run of 0.5 s is over"),
    ("rover@0.30005", {}, None, "there is no tick at t = 0.30005 s; the nearest are at 0.3 and 0.301 s"),
    ("rover@later", {}, None, "'later' is no time"),
    ("rover@-1", {}, None, "'-1' is no time"),
    ("rover@nan", {}, None, "'nan' is no time"),
    ("rover", {}, None, "at which time"),
    ("nowhere@1", {}, None, "there is no bag"),
    ("rover@0.3", {}, float("nan"), "--duration nan"),
    ("rover@0.3", {"controller.lambda_a": float("nan")}, None, "lambda_a"),
    ("rover@0.3", {"controller.nothing": 1}, None, "no parameter called 'nothing'"),
    ("rover@0.3", {"controller.rate_hz": 500.0}, None, "keeps the shape of its graph; .* controller has a period"),
    ("rover@0.3", {"controller.use": "cubli_ros/pd_controller"}, None, "keeps the shape of its graph"),
    ("rover@0.3", {"live_faults": 1}, None, "keeps the shape of its graph; .* component faults is only here"),
    ("rover@0.3", {"epoch_ns": 10**18}, None, "keeps the shape of its graph; .* stamp of t = 0"),
])
def test_bad_input(folder, text, settings, duration_s, sentence, monkeypatch):
    monkeypatch.chdir(folder)
    with pytest.raises(FlightError, match=sentence):
        continued(text, settings, duration_s)


def relabelled(checkpoint, **shape):
    """A checkpoint that says another shape, with a digest that fits."""
    return Checkpoint(checkpoint.tick, {**checkpoint.shape, **shape}, checkpoint.arrays).encode()


def test_a_checkpoint_that_does_not_fit(folder, tmp_path):
    """Damaged, of another graph, of another version: said with what differs, by every command that takes one up."""
    known = beginning.checkpoint(read_bag(folder / "rover"), 200)
    flipped = bytearray(known.encode())
    flipped[len(flipped) // 2] ^= 1
    records = {**known.shape["records"], "X_controller": {"integral": "3 of <f8 at byte 0"}}
    of_the_chain = beginning.checkpoint(read_bag(folder / "kept"), 20)
    for number, (content, sentence) in enumerate([
            (bytes(flipped), "it is damaged"), (b"nothing", "it is damaged"), (known.encode()[:100], "it is damaged"),
            (Checkpoint(300, known.shape, known.arrays).encode(), "it is of tick 300"),
            (relabelled(known, records=records), "the state of controller: integral is 3 of <f8 at byte 0 there, not here"),
            (relabelled(known, base_ns=7), "the base tick is 7 ns there, 1000000 ns here"),
            (Checkpoint(200, of_the_chain.shape, of_the_chain.arrays).encode(), "component .* is only")]):
        bag = changed(folder / "rover", tmp_path / str(number), {known.name: content})
        with pytest.raises(FlightError, match=sentence):
            continued(f"{bag}@0.3")


def test_a_realtime_run_is_not_taken_up(folder, tmp_path):
    bag = changed(folder / "rover", tmp_path / "bag", metadata={"flight_graph": {"pace": "realtime:1"}})
    with pytest.raises(FlightError, match="the run was in realtime"):
        continued(f"{bag}@0.3")


def test_an_altered_checkpoint_does_not_verify(folder, tmp_path):
    known = beginning.checkpoint(read_bag(folder / "rover"), 200)
    state = np.frombuffer(known.arrays["X_controller"], "u1").copy()
    state[0] ^= 1
    content = Checkpoint(200, known.shape, {**known.arrays, "X_controller": state.tobytes()}).encode()
    result = runs.verify(changed(folder / "rover", tmp_path / "bag", {known.name: content}))
    assert result.verdict == "different"
    assert "the checkpoint of tick 200 is another one: the state of controller: " in " ".join(result.sentences)


def test_a_branch_sets_what_an_event_has_set(tmp_path):
    """What is set takes the place of what an event before has set; events that follow come as they would have."""
    events = [{"at_s": 0.1, "set": {"controller.lambda_a": 0.03}}, {"at_s": 0.4, "set": {"controller.lambda_u": 0.05}}]
    scenario = load("cubli_earth", {"duration_s": 0.5, "events": events, "record": {"checkpoint_period_s": 0.1}})
    runs.execute(scenario, out=tmp_path / "parent")
    result = runs.verify(tmp_path / "parent")
    assert result.verdict == "equal" and "equal, too: 4 checkpoints" in result.sentences, result.sentences
    made = continued(f"{tmp_path / 'parent'}@0.2", {"controller.lambda_a": 0.06})
    before = scenario.graph.nodes["controller"].values["lambda_u"]
    for t_s, lambda_u in ((0.3, before), (0.45, [0.05] * 3)):
        memory = memory_from(made.scenario, made.begin.checkpoint, round(t_s * 1000))
        record = np.frombuffer(memory.arrays["P_controller"], made.scenario.graph.nodes["controller"].component.parameters.dtype)
        assert record["lambda_a"][0].tolist() == [0.06] * 3 and record["lambda_u"][0].tolist() == list(lambda_u)


@pytest.mark.parametrize("name", ["cubli_bennu", "lander_faults", "rovers_and_lander"])
def test_the_last_tick_by_itself_is_a_run(name):
    """So short a part has no metrics of what is summed up once a second, and no error either."""
    scenario = load(name, {"duration_s": 1.95})
    part = CompiledRun(scenario).run(begin=memory_from(scenario, None, scenario.ticks - 1))
    found = metrics.compute(scenario, part)
    assert not [key for key in found if key.endswith(("height_m", "friction_ratio_max")) and "rover" not in key]
