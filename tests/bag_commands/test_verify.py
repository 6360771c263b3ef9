"""flight verify: what it says of sound, altered, unfinished and realtime bags."""

import dataclasses
import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from flight_graph.bags.reader import read_bag
from flight_graph.bags.recover import recover
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from flight_graph.recordings import recorded_run
from flight_graph.recordings.recording import RunBag, messages, versions, write_recording
from flight_graph.runs import verify
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector
from tests.bag_commands.conftest import recorded

ROOT = Path(__file__).resolve().parents[2]


def altered(tmp_path, change):
    """A bag of the Earth scenario in which change(topic -> records) has changed what was recorded."""
    def apply(recording):
        tracks = [dataclasses.replace(track, records=track.records.view("u1").copy().view(track.records.dtype))
                  for track in recording.tracks]
        change({track.topic: track.records for track in tracks})
        return dataclasses.replace(recording, tracks=tracks)
    return recorded("cubli_earth", {"duration_s": 0.5}, tmp_path / "altered", apply)


def elsewhere(monkeypatch):
    """Pretend that this machine differs from the one that made the bag."""
    monkeypatch.setattr(recorded_run, "versions", lambda: {**versions(), "numba": "0.1"})


def test_a_run_verifies_itself(flight, asteroid):
    done = flight("verify", asteroid)
    assert done.status == 0
    assert "equal, byte for byte: 3859 messages on 19 topics" in done.out
    report = json.loads(flight("verify", asteroid, "--json").out)
    assert (report["holds"], report["verdict"], report["applied"], report["topics"]) == (True, "equal", "bytes", [])


def test_one_bit(flight, tmp_path):
    """The last bit of one number: topic, stamp, field and both values are named."""
    def change(records):
        column = records["cubli/wheel_command"]["effort"]
        column[100, 1] = np.nextafter(column[100, 1], 1.0)

    bag = altered(tmp_path, change)
    values = [CompiledRun(load("cubli_earth", {"duration_s": 0.5})).run()["cubli/wheel_command"]["effort"][100, 1]]
    values.append(np.nextafter(values[0], 1.0))
    done = flight("verify", bag)
    assert done.status == 1
    assert "/cubli/wheel_command: first difference" in done.out and "effort[wheel_y]" in done.out
    assert "t = 0.100000000 s" in done.out and all(repr(float(value)) in done.out for value in values)


def test_other_versions_are_named_and_compared_within_a_tolerance(flight, tmp_path, monkeypatch, earth):
    elsewhere(monkeypatch)
    done = flight("verify", earth)
    assert done.status == 0 and "equal, byte for byte" in done.out
    assert f"numba {versions()['numba']} in the bag, 0.1 here" in done.out

    def scale(factor):
        def change(records):
            records["cubli/wheel_command"]["effort"][:] *= 1.0 + factor
        return change

    close = altered(tmp_path / "a", scale(1e-9))
    assert flight("verify", close).status == 0
    assert verify(close).verdict == "close" and verify(close).applied == "tolerance"
    assert verify(close, tolerance=1e-12).verdict == "different"
    assert flight("verify", altered(tmp_path / "b", scale(1e-4))).status == 1


def test_a_field_that_is_zero_but_for_rounding(tmp_path, monkeypatch):
    """No relative tolerance fits a field that is zero: each field has an absolute floor besides it."""
    elsewhere(monkeypatch)

    def disturbed(size):
        def change(records):
            assert not records["cubli/truth"]["disturbance"].any()
            records["cubli/truth"]["disturbance"][7] = size
        return change

    assert verify(altered(tmp_path / "a", disturbed(4e-17))).verdict == "close"
    result = verify(altered(tmp_path / "b", disturbed(1e-9)))
    assert result.verdict == "different" and "disturbance[0]" in result.sentences[0]
    quantities = {"lever": Quantity(2, "m"), "torque": Quantity(None, "N m", floor=1e-15)}
    signal = named_vector("toy", "base", quantities, Role.TELEMETRY)
    assert [signal.floor(f"position[{name}]") for name in ("lever[1]", "torque")] == [1e-12, 1e-15]
    assert signal.floor("header.stamp.sec") == 1e-12


def test_whole_numbers_have_no_tolerance(tmp_path, monkeypatch):
    elsewhere(monkeypatch)

    def change(records):
        records["cubli/wheel_command"]["header"]["stamp"]["nanosec"][-1] += 1

    result = verify(altered(tmp_path, change))
    assert result.verdict == "different" and "header.stamp.nanosec" in result.sentences[0]


def test_another_order_of_equal_stamps(tmp_path):
    recording = CompiledRun(load("cubli_earth", {"duration_s": 0.1})).run()
    bag = RunBag(tmp_path / "bag", recording.scenario, "compiled", "none")
    tracks = {(track.node, track.port): track for track in recording.tracks}
    found = [(topic, tracks[topic.node, topic.port]) for topic in reversed(bag.topics)]
    bag.write_all([(topic, *messages(topic, track.stamps_ns, track.records)) for topic, track in found])
    bag.close({"complete": "true"})
    assert verify(tmp_path / "bag").sentences[0].startswith("the same messages in another order: at 946728000.0")


def test_an_interrupted_run(tmp_path):
    """What Ctrl-C leaves: topics that end at different stamps, and an outcome that says so."""
    recording = CompiledRun(load("cubli_earth", {"duration_s": 0.5})).run()
    bag = RunBag(tmp_path / "bag", recording.scenario, "ros", "lockstep")
    tracks = {(track.node, track.port): track for track in recording.tracks}
    blocks = []
    for number, topic in enumerate(bag.topics):
        track = tracks[topic.node, topic.port]
        kept = int(np.searchsorted(track.stamps_ns, 200_000_000 + 1_000_000 * number))
        blocks.append((topic, *messages(topic, track.stamps_ns[:kept], track.records[:kept])))
    bag.write_all(blocks)
    bag.close({"complete": "false"})
    result = verify(tmp_path / "bag")
    assert result.verdict == "equal"
    assert "the run was interrupted: 0.212 of 0.5 s are recorded" in result.sentences[-1]


def test_a_recovered_bag(asteroid, tmp_path):
    """A bag cut at two thirds of its bytes, recovered: what is left is what the run does again."""
    broken = tmp_path / "asteroid"
    shutil.copytree(asteroid, broken)
    file = next(broken.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:file.stat().st_size * 2 // 3])
    recover(broken, tmp_path / "saved")
    assert 0 < read_bag(tmp_path / "saved").topics["/cubli/imu"].count < 400
    result = verify(tmp_path / "saved")
    assert result.verdict == "equal" and "was recovered after a crash" in " ".join(result.sentences)


def test_a_run_that_a_component_stopped(tmp_path):
    """The bag of a run that ended in a fault is compared up to there; the fault comes again."""
    overrides = {"duration_s": 0.5, "controller.rho_a0": 1.0}
    whole = CompiledRun(load("cubli_earth", overrides)).run()
    bag = RunBag(tmp_path / "bag", load("cubli_earth", {**overrides, "controller.rho_a0": 0.01}), "ros", "lockstep")
    tracks = {(track.node, track.port): track for track in whole.tracks}
    found = [(topic, tracks[topic.node, topic.port]) for topic in bag.topics]
    bag.write_all([(topic, *messages(topic, track.stamps_ns[:5], track.records[:5])) for topic, track in found])
    bag.close({"complete": "false"})
    result = verify(tmp_path / "bag")
    assert result.verdict == "not compared" and "controller stopped at t = 0 s" in result.sentences[0]


def test_realtime_is_not_compared(flight, tmp_path):
    recording = CompiledRun(load("cubli_earth", {"duration_s": 0.1})).run()
    bag = RunBag(tmp_path / "bag", recording.scenario, "ros", "realtime:1")
    bag.close({"complete": "true"})
    done = flight("verify", tmp_path / "bag")
    assert done.status == 1 and "the wall clock decided" in done.out


USERS_OWN = """
from flight_graph.components.component import Component
from flight_math.kernel import kernel
from flight_graph.components.records import Parameters, State, field
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector

class P(Parameters):
    slope: float = field(0.5)

class X(State):
    level: float

@kernel
def ramp(t_ns, p, x, level):
    x.level += p.slope * p.period
    level.height = x.level

class Ramp(Component):
    parameters, state, kernel = P, X, ramp
    outputs = {"level": named_vector("level", "world", {"height": Quantity(None, "m")}, Role.TRUTH)}
"""


def test_a_component_of_the_user_travels_in_the_bag(flight, tmp_path):
    """It runs with --trust, whether this machine has the same file or not; what runs is what the bag carries."""
    own = tmp_path / "users_ramp.py"
    own.write_text(USERS_OWN)
    scenario = tmp_path / "ramp.yaml"
    scenario.write_text("name: ramp\ntitle: A ramp\nduration_s: 1\ncomponents:\n  ramp: {use: 'users_ramp.py:Ramp'}\n")
    bag = recorded(str(scenario), {}, tmp_path / "bag")
    for text in (USERS_OWN, "another file"):
        own.write_text(text)
        for command in (("verify", bag), ("replay", bag, "--component", "ramp")):
            refused = flight(*command)
            assert refused.status == 2 and "add --trust to run it" in " ".join(refused.err.split())
            assert hashlib.sha256(USERS_OWN.encode()).hexdigest() in refused.err
            assert flight(*command, "--trust").status == 0
    assert flight("info", bag, "--attachment", "component/ramp.py").out == USERS_OWN


def test_a_bag_of_somebody_else(flight, tmp_path):
    from tests.bag.sample_bags import write_bag
    done = flight("verify", write_bag(tmp_path / "hop").folder)
    assert done.status == 2 and "carries no scenario" in " ".join(done.err.split())


def test_info_lists_topics_at_their_rates(flight, asteroid):
    topics = {topic["topic"]: topic for topic in json.loads(flight("info", asteroid, "--json").out)["topics"]}
    assert (topics["/cubli/imu"]["count"], topics["/cubli/imu"]["rate_hz"]) == (400, 100.0)
    assert (topics["/cubli/star_tracker"]["count"], topics["/cubli/star_tracker"]["rate_hz"]) == (16, 4.0)


def test_what_a_bag_says_of_itself(asteroid):
    """Scenario with every parameter, claims of its paper, versions, engine, units of the named quantities."""
    bag = read_bag(asteroid)
    scenario = json.loads(bag.attachments["scenario.json"].data)
    assert scenario["components"]["controller"]["parameters"]["lambda_a"] == [0.041] * 3
    assert scenario["duration_s"] == 4 and scenario["seed"] == 1
    assert bag.attachments["claims.yaml"].data == (ROOT / "papers" / "appc" / "claims.yaml").read_bytes()
    made = {"engine", "pace", "seed", "python", "numpy", "numba", "commit", "cpu", "libc"}
    assert made <= bag.metadata["flight_graph"].keys()
    assert bag.metadata["units"]["/cubli/truth:position[wheel_speed[0]]"] == "rad/s"


def test_existing_read_only_and_impossible_folders(flight, tmp_path, earth):
    existing = tmp_path / "there"
    existing.mkdir()
    file = tmp_path / "file"
    file.write_text("")
    for out, sentence in ((existing, "exists already"), (file / "bag", "cannot be written"),
                          ("/proc/flight/bag", "cannot be written")):
        done = flight("run", "cubli_earth", "--duration", "0.5", "--out", out)
        assert done.status == 2 and sentence in " ".join(done.err.split()), done.err


@pytest.mark.parametrize("bytes_left", [0, 5_000, 60_000])
def test_a_full_disk_leaves_a_mark(tmp_path, bytes_left, monkeypatch):
    """The mark RECORDING stays, and reading commands name the way out."""
    import os

    from flight_graph.bags.errors import BagDamaged, BagError
    left, write = [bytes_left], os.write

    def short(file, data):
        if not os.readlink(f"/proc/self/fd/{file}").endswith(".mcap"):
            return write(file, data)
        if left[0] <= 0:
            raise OSError(28, "No space left on device")
        count = write(file, bytes(data)[:left[0]])
        left[0] -= count
        return count

    recording = CompiledRun(load("cubli_earth", {"duration_s": 0.5})).run()
    monkeypatch.setattr("flight_graph.bags.mcap_file.os.write", short)
    with pytest.raises(BagError, match="no space left on device"):
        write_recording(recording, tmp_path / "bag", "compiled")
    monkeypatch.undo()
    if (tmp_path / "bag" / "RECORDING").exists():
        with pytest.raises(BagError) as error:
            read_bag(tmp_path / "bag")
        assert isinstance(error.value, BagDamaged) or "still being recorded" in str(error.value)
