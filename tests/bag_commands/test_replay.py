"""flight replay: every component of a run gives its recorded answers again; what cannot be replayed is said."""

import dataclasses
import json

import numpy as np
import pytest

from flight_graph.bags.reader import read_bag
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from flight_graph.recordings.recording import RunBag, messages, open_run
from flight_graph.runs import replay
from tests.bag_commands.conftest import recorded
from tests.ros.processes import flight as process


def test_every_component(asteroid, earth):
    for bag, names in ((asteroid, ["plant", "imu", "star_tracker", "estimator", "controller", "monitor"]),
                       (earth, ["plant", "controller", "monitor"])):
        assert list(open_run(bag)[1].graph.nodes) == names
        for name in names:
            result = replay(bag, name)
            assert result.holds and result.comparison.verdict == "equal", (name, result.comparison.sentences)
            assert result.firings == {"star_tracker": 16}.get(name, 400 if bag is asteroid else 500)


def test_the_command(flight, asteroid):
    done = flight("replay", asteroid, "--component", "estimator")
    assert done.status == 0
    assert "estimator: 400 firings" in done.out and "equal, byte for byte: 800 messages" in done.out
    report = json.loads(flight("replay", asteroid, "--component", "estimator", "--json").out)
    assert (report["holds"], report["open_loop"], report["verdict"], report["messages"]) == (True, False, "equal", 800)


def test_the_python_engine(asteroid, tmp_path):
    """The same component, interpreted: a debugger's way in gives the recorded bytes too."""
    for component in ("controller", "estimator"):
        done = process("replay", asteroid, "--component", component, "--engine", "python", "--json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        report = json.loads(done.stdout)
        assert (report["engine"], report["verdict"], report["firings"]) == ("python", "equal", 400)


def test_another_parameter_is_open_loop(flight, asteroid):
    """At t = 0 no loop has closed yet: the first answer is that of a whole run with the changed parameter."""
    done = flight("replay", asteroid, "--component", "controller", "--set", "lambda_a=0.0412", "--json")
    report = json.loads(done.out)
    assert done.status == 0 and report["open_loop"] and report["sentences"][0].startswith("open loop")
    first = next(topic for topic in report["topics"] if topic["topic"] == "/cubli/wheel_command")
    own = CompiledRun(load("cubli_asteroid", {"duration_s": 0.01, "controller.lambda_a": 0.0412})).run()
    assert first["first"]["index"] == 0
    assert first["first"]["value_b"] == own["cubli/wheel_command"]["effort"][0, 0]


def test_a_changed_bit_in_an_input_changes_the_answers(tmp_path):
    """The replay reads the bag: an input altered by one part in 1e9 is answered differently."""
    def change(recording):
        for track in recording.tracks:
            if track.topic == "cubli/imu":
                track.records["angular_velocity"][50] *= 1.0 + 1e-9
        return recording

    bag = recorded("cubli_asteroid", {"duration_s": 1}, tmp_path / "bag", change)
    result = replay(bag, "estimator")
    assert result.comparison.verdict == "different" and not result.holds
    assert "(t = 0.500000000 s)" in result.comparison.sentences[0]
    assert replay(bag, "controller").holds


def said_to_record(record):
    """A change of a recording: its scenario records only this."""
    def change(recording):
        scenario = load(recording.scenario.name, {"duration_s": recording.scenario.file.duration_s, "record": record})
        return dataclasses.replace(recording, scenario=scenario)
    return change


def test_what_cannot_be_replayed(flight, asteroid, tmp_path):
    thin = recorded("cubli_asteroid", {"duration_s": 1}, tmp_path / "thin", said_to_record({"max_rate_hz": 10}))
    part = recorded("cubli_asteroid", {"duration_s": 1}, tmp_path / "part",
                    said_to_record({"topics": ["cubli/imu", "cubli/wheel_command"]}))
    cases = [
        (thin, "estimator", "the bag was thinned (record.max_rate_hz 10; /cubli/imu: every 10th message"),
        (part, "estimator", "its inputs star_tracker (/cubli/star_tracker) were not recorded"),
        (part, "star_tracker", "star_tracker cannot be replayed"),
        (asteroid, "controler", "did you mean 'controller'"),
    ]
    for bag, component, sentence in cases:
        done = flight("replay", bag, "--component", component)
        assert done.status == 2 and sentence in " ".join(done.err.split()), done.err
    for setting, sentence in (("lambda=1", "lambda_a"), ("rate_hz=50", "only parameters"),
                              ("lambda_a=-1", "not allowed")):
        done = flight("replay", asteroid, "--component", "controller", "--set", setting)
        assert done.status == 2 and sentence in " ".join(done.err.split()), done.err


def test_a_gap_in_an_input_ends_the_replay(tmp_path):
    """A recovered bag with a hole: the component is replayed up to it, and the hole is named."""
    recording = CompiledRun(load("cubli_asteroid", {"duration_s": 1})).run()
    bag = RunBag(tmp_path / "bag", recording.scenario, "ros", "lockstep")
    tracks = {(track.node, track.port): track for track in recording.tracks}
    blocks = []
    for topic in bag.topics:
        track = tracks[topic.node, topic.port]
        stamps, rows = messages(topic, track.stamps_ns, track.records)
        kept = np.flatnonzero((stamps < 300_000_000) | (stamps >= 400_000_000))
        blocks.append((topic, stamps[kept], [bytes(rows[i]) for i in kept]))
    bag.write_all(blocks)
    bag.writer.metadata("recovered", {})
    bag.close({"complete": "false"})
    result = replay(tmp_path / "bag", "estimator")
    assert result.holds and result.firings == 30
    assert "replayed until t = 0.3 s of 1 s; its input imu (/cubli/imu) has no message of t = 0.3 s" in " ".join(
        result.comparison.sentences)


def test_answers_are_compared_as_far_as_they_were_recorded(tmp_path):
    bag = recorded("cubli_earth", {"duration_s": 0.2}, tmp_path / "bag",
                   said_to_record({"topics": ["cubli/wheel_command", "cubli/truth/attitude"]}))
    result = replay(bag, "plant")
    assert result.holds and [topic.topic for topic in result.comparison.topics] == ["/cubli/truth/attitude"]
    assert read_bag(bag).topics["/cubli/truth/attitude"].count == result.comparison.messages == 200


@pytest.mark.parametrize("engine", ["numba", ""])
def test_unknown_engine(flight, asteroid, engine):
    done = flight("replay", asteroid, "--component", "plant", "--engine", engine)
    assert done.status == 2 and "engine" in done.err
