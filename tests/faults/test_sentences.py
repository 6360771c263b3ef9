"""What is wrong in a block of faults or monitors is said in one sentence, with the fault, the key and what is allowed."""

import copy
import json

import pytest
import yaml

from flight_graph.errors import FlightError
from flight_graph.faults.fault_types import TYPES
from flight_graph.graphs.scenario import Scenario, load
from tests.commands import runner
from tests.faults import chain
from tests.faults.chain import fault

pytestmark = pytest.mark.xdist_group("faults")
BIAS = {"id": "it", "at": "gauge.imu.angular_velocity[0]", "type": "bias", "value": 0.1}
INF, NAN = float("inf"), float("nan")


def said(data) -> str:
    with pytest.raises(FlightError) as error:
        Scenario(data, "chain.yaml")
    text = str(error.value)
    assert len(text) < 2000 and text.startswith("chain.yaml: ")
    return text.removeprefix("chain.yaml: ")


def told(*faults) -> str:
    return said(chain.data(list(faults)))


@pytest.mark.parametrize("at, sentence", [
    ("gaug.imu.angular_velocity[0]", "no component called 'gaug'; did you mean 'gauge'?"),
    ("gauge.inu.angular_velocity[0]", "gauge: no output called 'inu'; did you mean 'imu'?"),
    ("gauge.imu.angular_velocty[0]", "gauge.imu: no field called 'angular_velocty'; did you mean 'angular_velocity'"),
    ("gauge.imu.angular_velocity[3]", "angular_velocity[3] is not there: angular_velocity has 3 entries"),
    ("gauge.imu.angular_velocity[0][0]", "angular_velocity[0][0] is not there: angular_velocity has 3 entries"),
    ("gauge.imu.angular_velocity[" + "9" * 100 + "]", "is not there: angular_velocity has 3 entries"),
    ("gauge.imu.angular_velocity[-1]", "'angular_velocity[-1]' is no field; write its names with dots, and [i] for one number"),
    ("gauge.imu.angular_velocity [0]", "is no field"), ("gauge.imu.angular_velocity.x", "angular_velocity is an array"),
    ("gauge.range.range[0]", "range[0] is not there: range has one number"),
    ("gauge.imu.header", "header is no number; name one of it: stamp"),
    ("gauge.imu.header.stamp.sec", "header.stamp.sec is the stamp; 'stale' and 'delay' are the faults of stamps"),
    ("gauge.truth.angle", "truth is an input of gauge; write 'gauge <- truth.angle'"),
    ("follower <- imv.angular_velocity[0]", "follower: no input called 'imv'; did you mean 'imu'?"),
    ("follower <- echo.rate", "follower: no input called 'echo'"), ("follower <-", "follower: no input called ''"),
    ("<- imu.angular_velocity", "'' is no component; a place is component.output.field[i], reader <- input.field[i]"),
    ("follower.state.totl", "follower.state: no field called 'totl'; did you mean 'total'?"),
    ("follower.state.fault", "no field called 'fault'"), ("gauge.parameters.period", "no field called 'period'"),
    ("follower.state", "follower.state is no number; name one of it: total, held, count"),
    ("gauge.state", "gauge.state is no number; name one of it: it has none"),
    ("gauge.parameters.gian", "gauge.parameters: no field called 'gian'; did you mean 'gain'?"),
    ("gauge.parameters", "gauge.parameters is no number; name one of it: gain, offset, steps"),
    ("faults", "no component called 'faults'"), ("faults.faults.it", "no component called 'faults'"),
    ("world.truth.angle[0]", "world.truth.angle[0] is the truth, which has no faults; break what measures it or acts on it"),
    ("", "'' is no component"), ("...", "'' is no component"), ("a b", "'a b' is no component"), ("/gauge", "'/gauge' is no component"),
    ("gauge\n", None), (" gauge.imu.angular_velocity[0] ", None), ("gauge..imu", "gauge: no output called ''")])
def test_places(at, sentence):
    if sentence is None:
        chain.scenario([{**BIAS, "at": at}]) if "imu" in at else told({**BIAS, "at": at})
        return
    text = told({**BIAS, "at": at})
    assert text.startswith("faults.it.at: ") or text.startswith("faults.it: ")
    assert sentence in text


PLACES = {"a field of an output": "gauge.imu.angular_velocity[0]", "a field of one input": "follower <- imu.angular_velocity[0]",
          "an entry of a state": "follower.state.total", "a parameter": "gauge.parameters.gain",
          "the messages of an output": "gauge.imu", "the messages of one input": "follower <- imu", "a component": "gauge"}
GIVEN = {"value": 0.5, "bit": 3, "ticks": 2, "for_s": 0.1}


@pytest.mark.parametrize("name", TYPES)
def test_each_type_at_each_place(name):
    """Where it has a meaning it is taken; where it has none, the sentence says what has."""
    kind = TYPES[name]
    for place, at in PLACES.items():
        entry = {"id": "it", "at": at, "type": name, "from_s": 0.1, **{key: GIVEN[key] for key in kind.needs}}
        if place in kind.places:
            chain.scenario([entry])
            continue
        text = told(entry)
        assert text.startswith(f"faults.it: {name} has no meaning for {place} ({at}); allowed there: ")
        allowed = text.partition("allowed there: ")[2].partition(";")[0].split(", ")
        assert allowed == [other for other, one in TYPES.items() if place in one.places]
        if "messages" in place and kind.places and "a field of an output" in kind.places:
            assert "; or name a field: " in text and "angular_velocity" in text
    for key in kind.needs:
        assert f"{name} needs {key}" in told({"id": "it", "at": PLACES[kind.places[0]], "type": name, "from_s": 0.1,
                                               **{other: GIVEN[other] for other in kind.needs if other != key}})


@pytest.mark.parametrize("changes, sentence", [
    ({"type": "bia"}, "no type of fault called 'bia'; did you mean 'bias'"), ({"type": ""}, "no type of fault called ''"),
    ({"valu": 1}, "no key called 'valu'; did you mean 'value'?"), ({"bit": 3}, "faults.it.bit: bias has no such key; it takes id, at, type"),
    ({"ticks": 3}, "bias has no such key"), ({"every": 3}, "bias has no such key"),
    ({"value": None}, "bias needs value (added [unit of the field])"), ({"value": NAN}, "value: input should be a finite number"),
    ({"value": INF}, "value: input should be a finite number"), ({"value": "x"}, "value: input should be a valid number"),
    ({"value": [1.0]}, "value: input should be a valid number"), ({"value": {}}, "value: "), ({"value": True}, "value: yes, no, true and false mean nothing here"),
    ({"value": 10**400}, "value: input should be"), ({"ramp_s": 0}, "ramp_s: input should be greater than"), ({"ramp_s": INF}, "ramp_s: "),
    ({"probability": 1.5}, "probability: input should be less than or equal to 1"), ({"probability": 0}, "probability: input should be greater than 0"),
    ({"probability": -1}, "probability: "), ({"probability": NAN}, "probability: "),
    ({"from_s": -1}, "from_s: input should be greater than or equal to 0"), ({"from_s": NAN}, "from_s: "), ({"from_s": 1e10}, "from_s: "),
    ({"until_s": 0}, "until_s: input should be greater"), ({"until_s": 1e-10}, "until_s: input should be greater"), ({"for_s": 0}, "for_s: "),
    ({"for_s": 1e-12}, "for_s: "), ({"every_s": 1e-12}, "every_s: "),
    ({"from_s": 5, "until_s": 5}, "the window ends before it begins: from_s 5, until_s 5"),
    ({"from_s": 5, "until_s": 2}, "the window ends before it begins: from_s 5, until_s 2"),
    ({"until_s": 5, "for_s": 2}, "until_s and for_s both say when it ends; give one of them"),
    ({"every_s": 1, "for_s": 1}, "it lasts 1 s (for_s) and begins anew every 1 s (every_s); for_s must be the shorter one"),
    ({"every_s": 1, "when": "t > 1"}, "every_s and when both say when it begins; give one of them"),
    ({"at_s": 1, "from_s": 1}, "at_s is one instant: it goes with none of from_s"), ({"at_s": 1, "when": "t > 1"}, "at_s is one instant"),
    ({"unit": "a b"}, "unit: it is no name; allowed: a letter"), ({"unit": ""}, "unit: it is no name"), ({"unit": 3}, "unit: input should be a valid string"),
    ({"when": 3}, "when: input should be a valid string"), ({"when": True}, "when: yes, no, true and false mean nothing here"),
    ({"when": "t > 1" + " " * 1000}, "when: string should have at most 1000 characters"), ({"at": "x" * 301}, "at: string should have at most 300 characters"),
    ({"type": "spike"}, "a spike happens at instants; say which: at_s, every_s, probability or when"),
    ({"type": "spike", "every_s": 1, "for_s": 0.5}, "faults.it.for_s: a spike happens at instants and does not last"),
    ({"type": "noise", "value": -1}, "faults.it.value: -1 is not allowed"), ({"type": "quantise", "value": 0}, "faults.it.value: 0 is not allowed"),
    ({"type": "saturate", "value": -2}, "faults.it.value: -2 is not allowed"), ({"type": "off"}, "faults.it.value: off has no such key"),
    ({"type": "bit_flip", "value": None, "bit": 64, "at_s": 1}, "bit: input should be less than or equal to 63"),
    ({"type": "bit_flip", "value": None, "bit": -1, "at_s": 1}, "bit: "), ({"type": "bit_flip", "value": None, "bit": 1.5, "at_s": 1}, "bit: "),
    ({"type": "bit_flip", "value": None, "bit": 32, "at_s": 1, "at": "gauge.range.range"}, "faults.it.bit: 32 is outside of the number; range has 32 bits, 0 to 31"),
    ({"type": "bit_flip", "value": None, "bit": 8, "at_s": 1, "at": "gauge.range.radiation_type"}, "8 is outside of the number; radiation_type has 8 bits, 0 to 7"),
    ({"type": "bit_flip", "value": None, "bit": 3, "at_s": 1, "at": "gauge.imu.angular_velocity"}, "angular_velocity has 3 numbers; name one: angular_velocity[0]"),
    ({"at": "gauge.range.radiation_type"}, "radiation_type is a whole number, where bias has no meaning; allowed there: bit_flip"),
    ({"at": "gauge.parameters.steps"}, "steps is a whole number"), ({"at": "follower.state.count", "type": "stuck"}, "count is a whole number"),
    ({"at": "gauge.parameters.gain", "type": "stuck", "value": -1}, "gauge.parameters.gain: -1.0 is not allowed"),
    ({"at": "gauge.parameters.gain", "type": "stuck", "value": 11}, "gauge.parameters.gain: 11.0 is not allowed"),
    ({"at": "gauge.imu", "type": "drop", "value": None, "probability": 0.5, "every": 2}, "probability and every both say which messages"),
    ({"at": "gauge.imu", "type": "drop", "value": None, "every": 1}, "every: input should be greater than or equal to 2"),
    ({"at": "gauge.imu", "type": "delay", "value": None, "ticks": 0}, "ticks: "), ({"at": "gauge.imu", "type": "delay", "value": None, "ticks": 1001}, "ticks: "),
    ({"at": "gauge.imu", "type": "drop"}, "faults.it.value: drop has no such key"),
    ({"at": "world", "type": "hang", "value": None}, "world is the world itself (it moves with time): it cannot hang"),
    ({"at": "gauge", "type": "crash", "value": None, "until_s": 1}, "faults.it.until_s: crash has no such key"),
    ({"id": "header"}, "faults.header: id: it is no name"), ({"id": "position"}, "faults.position: id: it is no name"), ({"id": "True"}, "it is no name"),
    ({"id": "T"}, "it is no name"), ({"id": "t"}, "it is no name"), ({"id": "lambda"}, "it is no name"), ({"id": "dtype"}, "it is no name"), ({"id": ""}, "faults[0]: id: it is no name"),
    ({"id": "1a"}, "it is no name"), ({"id": "a-b"}, "it is no name"), ({"id": "a.b"}, "it is no name"), ({"id": "x" * 61}, "it is no name"),
    ({"id": "ä"}, "it is no name"), ({"id": "a\n"}, "it is no name"), ({"id": 5}, "faults[0]: id: input should be a valid string (got 5)"),
    ({"id": None}, "id: input should be a valid string"), ({"id": ["a"]}, "id: input should be a valid string")],
    ids=lambda value: str(value)[:60] if isinstance(value, dict) else "")
def test_keys_and_values(changes, sentence):
    """A value of None leaves the key out, except that of an id."""
    entry = {**BIAS, **changes}
    assert sentence in told({key: value for key, value in entry.items() if value is not None or key == "id"})


@pytest.mark.parametrize("block, sentence", [
    (5, "faults: input should be a valid list (got 5)"), ("x", "faults: input should be a valid list"), ({"it": BIAS}, "faults: input should be a valid list"),
    ([5], "faults.0: input should be a valid dictionary"), ([[]], "faults.0: input should be a valid dictionary"), ([None], "faults.0: input"),
    ([{}], "faults[0]: the key id is missing; a fault has at least id, at and type"), ([{1: 2}], "faults.0"),
    ([{"id": "it", "type": "bias"}], "faults.it: the key at is missing"), ([{"id": "it", "at": "gauge"}], "faults.it: the key type is missing"),
    ([BIAS, BIAS], "faults.it: two faults have this id"), ([{**BIAS, "id": f"it{n}"} for n in range(1001)], "faults: it is a list of at most 1000 faults")])
def test_blocks(block, sentence):
    assert sentence in said(chain.data(faults=block))


def test_faults_that_contradict_each_other():
    def pair(one, other, at="gauge.imu.angular_velocity", **keys):
        faults = [fault("stuck", at, "a", value=1.0, **one), fault("off", keys.get("other_at", at), "b", **other)]
        return chain.data(faults)

    sentence = "faults.b: it contradicts a: both decide gauge.imu.angular_velocity alone from"
    assert said(pair({}, {})) == f"{sentence} 0 s to the end of the run"
    assert said(pair({"until_s": 3}, {"from_s": 2})) == f"{sentence} 2 s to 3 s"
    assert "both decide" in said(pair({}, {}, other_at="gauge.imu.angular_velocity[1]"))
    Scenario(pair({"until_s": 2}, {"from_s": 2}), "chain.yaml")
    Scenario(pair({}, {}, other_at="gauge.imu.linear_acceleration"), "chain.yaml")
    Scenario(pair({}, {"when": "t > 1"}), "chain.yaml")  # the later one wins where both act
    Scenario(chain.data([fault("bias", BIAS["at"], "a", value=1.0), fault("stuck", BIAS["at"], "b")]), "chain.yaml")
    for one, other, at in (("hang", "crash", "gauge"), ("freeze", "stale", "gauge.imu"), ("freeze", "stale", "follower <- imu")):
        assert "faults.b: it contradicts a" in told(fault(one, at, "a"), fault(other, at, "b"))
    assert "contradicts" in told(fault("restart", "gauge", "a", for_s=1), fault("delay", "gauge.imu", "c", ticks=2), fault("hang", "gauge", "b"))


def test_long_names_are_shortened():
    assert len(told({**BIAS, "type": "x" * 5000})) < 700 and len(told({**BIAS, "x" * 5000: 1})) < 1000
    assert len(told({**BIAS, "id": "x" * 5000})) < 700 and len(said(chain.data(faults="x" * 5000))) < 700


# -- monitors ----------------------------------------------------------------------------------------------------------
MONITORS = {"rate_hz": 50, "watchpoints": [{"id": "fast", "when": "imu.angular_velocity[0] > 0.1"}, {"id": "old", "stale": "gauge.range", "after_s": 0.2}],
            "actionpoints": [{"id": "act", "when": "fast or old", "mode": {"manager": "hold"}, "set": {"gauge.gain": 2.0}, "blames": ["gauge"]}]}


def monitored(change) -> str:
    found = copy.deepcopy(MONITORS)
    change(found)
    return said(chain.data(monitors=found))


def watch(**keys):
    return lambda block: block["watchpoints"][0].update(keys)


def act(**keys):
    return lambda block: block["actionpoints"][0].update(keys)


@pytest.mark.parametrize("change, sentence", [
    (lambda block: block.update(rate_hz=0), "monitors.rate_hz"), (lambda block: block.update(rate_hz=NAN), "monitors.rate_hz"),
    (lambda block: block.update(rate_hz=INF), "monitors.rate_hz"), (lambda block: block.update(rate_hz=3), "monitors.rate_hz: 3.0 Hz has a period"),
    (lambda block: block.update(rate_hz="x"), "monitors.rate_hz: input should be a valid number"),
    (lambda block: block.update(rate=3), "monitors: no key called 'rate'; did you mean 'rate_hz'?"),
    (lambda block: block.update(watchpoints=[]), "monitors.watchpoints: list should have at least 1 item"),
    (lambda block: block.pop("watchpoints"), "monitors.watchpoints: field required"), (lambda block: block.update(watchpoints=5), "monitors.watchpoints: "),
    (lambda block: block.update(watchpoints=[5]), "monitors.watchpoints[0]: "), (lambda block: block.update(watchpoints={"a": 1}), "monitors.watchpoints: "),
    (lambda block: block["watchpoints"].append(block["watchpoints"][0]), "monitors.fast: two watchpoints or actionpoints have this id"),
    (lambda block: block["watchpoints"].append({"id": "act", "when": "t > 1"}), "monitors.act: two watchpoints or actionpoints have this id"),
    (watch(id="header"), "monitors.watchpoints.header.id: it is no name"), (watch(id="and"), "it is no name"), (watch(id="age"), "it is no name"),
    (watch(id="is"), "it is no name"), (watch(id=3), "monitors.watchpoints.3.id: input should be a valid string"), (watch(id="T"), "it is no name"),
    (watch(wen="x"), "monitors.watchpoints.fast: no key called 'wen'; did you mean 'when'?"),
    (watch(when=None), "monitors.watchpoints.fast: a watchpoint has either when, or stale and after_s"),
    (watch(stale="gauge.imu", after_s=1), "a watchpoint has either when, or stale and after_s"), (watch(when="t >"), "monitors.fast.when: 't >' is no expression"),
    (watch(when="t > 1"), "monitors.fast: it watches no signal"), (watch(when="1"), "monitors.fast: it watches no signal"),
    (watch(when="truth.angle[0] > 1"), "monitors.fast: world.truth is the truth, which flight software cannot see; watch a sensor, an estimate or a command"),
    (watch(when="faults.faults.it > 1"), "no signal called 'faults'"), (watch(when="monitors.status.fast > 1"), "no signal called 'monitors'"),
    (watch(when="gauge.imu.nothing > 1"), "monitors.fast.when: gauge.imu: no field called 'nothing'"),
    (lambda block: block["watchpoints"][1].update(stale="gauge.rang"), "monitors.old.stale: gauge: no output called 'rang'; did you mean 'range'?"),
    (lambda block: block["watchpoints"][1].update(stale="world.truth"), "monitors.old: world.truth is the truth"),
    (lambda block: block["watchpoints"][1].update(stale="gauge.range.range"), "monitors.old.stale: 'gauge.range.range' is no message; write component.output"),
    (lambda block: block["watchpoints"][1].update(stale="gauge.range) > 0 or (t"), "monitors.old.stale: 'gauge.range) > 0 or (t' is no message"),
    (lambda block: block["watchpoints"][1].update(stale=""), "monitors.old.stale: '' is no message"),
    (lambda block: block["watchpoints"][1].update(after_s=0), "monitors.watchpoints.old.after_s: "),
    (lambda block: block["watchpoints"][1].update(after_s=NAN), "monitors.watchpoints.old.after_s: "),
    (lambda block: block["watchpoints"][1].pop("after_s"), "a watchpoint has either when, or stale and after_s"),
    (act(when="fats"), "monitors.act.when: no watchpoint called 'fats'; did you mean 'fast'?"), (act(when="act"), "monitors.act.when: no watchpoint called 'act'"),
    (act(when="gauge.imu.angular_velocity[0] > 1"), "monitors.act.when: no signal called 'gauge'"), (act(when=""), "monitors.act.when: '' is no expression"),
    (act(in_a_row=0), "monitors.actionpoints.act.in_a_row: "), (act(in_a_row=2.5), "monitors.actionpoints.act.in_a_row: "),
    (act(act="twice"), "monitors.actionpoints.act.act: input should be 'once' or 'each'"), (act(level="bad"), "level: input should be 'warn' or 'error'"),
    (act(text="x" * 301), "monitors.actionpoints.act.text: "), (act(blames="gauge"), "monitors.actionpoints.act.blames: input should be a valid list"),
    (act(blames=[3]), "monitors.actionpoints.act.blames[0]: "), (act(modes={"manager": "hold"}), "monitors.actionpoints.act: no key called 'modes'; did you mean 'mode'"),
    (act(mode={"manager": "hol"}), "monitors.act.mode.manager: no mode called 'hol'; did you mean 'hold'?"), (act(mode={"manger": "hold"}), "monitors.act.mode: no component called 'manger'; did you mean 'manager'"),
    (act(mode={"gauge": "hold"}), "monitors.act.mode: gauge takes no modes; components that do: manager"), (act(mode={"manager": 1}), "monitors.actionpoints.act.mode.manager: "),
    (act(mode="hold"), "monitors.actionpoints.act.mode: "), (act(set={"gauge.gian": 1.0}), "monitors.act.set: gauge.parameters: no field called 'gian'; did you mean 'gain'?"),
    (act(set={"gaug.gain": 1.0}), "monitors.act.set: no component called 'gaug'"), (act(set={"gauge": 1.0}), "monitors.act.set"), (act(set={"": 1.0}), "monitors.act.set"),
    (act(set={"gauge.gain": 11.0}), "monitors.act.set: gauge.gain: 11.0 is not allowed"), (act(set={"gauge.gain": NAN}), "monitors.act"), (act(set={"gauge.gain": INF}), "monitors.act"),
    (act(set={"gauge.gain": "x"}), "monitors.actionpoints.act.set.gauge.gain: "), (act(set={"gauge.steps": 2.0}), "monitors.act.set: gauge.steps is a int"),
    (act(set={"gauge.offset[3]": 2.0}), "offset[3] is not there"), (act(set={"gauge.period": 2.0}), "no field called 'period'"),
    (act(set={"monitors.x": 2.0}), "monitors.act.set: no component called 'monitors'"), (act(set={"faults.x": 2.0}), "monitors.act.set: no component called 'faults'")],
    ids=lambda value: value[:50] if isinstance(value, str) else "")
def test_monitors(change, sentence):
    assert sentence in monitored(change)


@pytest.mark.parametrize("block", [5, "x", [], [MONITORS], {}])
def test_blocks_of_monitors(block):
    assert said(chain.data(monitors=block)).startswith("monitors")


def test_the_names_of_the_blocks_are_no_names_of_components():
    for name in ("faults", "monitors"):
        data = chain.data()
        data["components"][name] = {"use": f"{chain.__file__}:Spare"}
        assert f"components.{name}: this name is taken by a node of every run" in said(data)


# -- the command line --------------------------------------------------------------------------------------------------
@pytest.fixture
def flight(monkeypatch, capsys, tmp_path):
    """Run a command in a new folder; return (status, standard output, standard error in one line)."""
    monkeypatch.chdir(tmp_path)

    typed = runner(monkeypatch, capsys)

    def run(*arguments):
        status, out, err = typed(*arguments)
        return status, out, " ".join(err.split())
    return run


def write(tmp_path, **changes):
    path = tmp_path / "chain.yaml"
    path.write_text(yaml.safe_dump(chain.data(changes.pop("faults", [BIAS]), duration_s=0.1, **changes)))
    return path


@pytest.mark.parametrize("faults", [
    [{**BIAS, "at": "gaug.imu"}], [{**BIAS, "type": "bia"}], [{**BIAS, "value": NAN}], 5, [BIAS, BIAS], [{**BIAS, "when": "x >"}], [{**BIAS, "id": "header"}]])
def test_a_bad_file_is_one_sentence_and_status_2(flight, tmp_path, faults):
    status, out, err = flight("run", write(tmp_path, faults=faults), "--trust")
    assert status == 2 and not out and err.startswith("error: chain.yaml: faults")


@pytest.mark.parametrize("text, sentence", [
    ("faults: [{id: it, at: gauge.imu.angular_velocity[0], type: bias, value: 0.1}]\n", "this is no YAML"),
    ("faults:\n  - {id: it, at: gauge, type: hang, from_s: 1:30}\n", "from_s"), ("faults:\n  - {id: no, at: gauge, type: hang}\n", "id"),
    ("faults:\n  - {id: it, at: gauge, type: hang\n", "chain.yaml"), ("faults:\n  id: it\n", "faults: input should be a valid list"),
    ("faults:\n  - !!python/object:os.system {}\n", "chain.yaml"), ("faults:\n  - {id: it, at: gauge, type: off}\n", "type"),
    ("faults:\n  - {id: it, at: gauge.imu.angular_velocity, type: bias, value: .nan}\n", "finite"), ("faults: &a [*a]\n", "chain.yaml")])
def test_odd_yaml(flight, tmp_path, text, sentence):
    path = tmp_path / "chain.yaml"
    path.write_text(yaml.safe_dump(chain.data(duration_s=0.1)) + text)
    status, _, err = flight("run", path, "--trust")
    assert status == 2 and sentence in err


def test_set_changes_one_key_of_a_fault(flight, tmp_path):
    path = write(tmp_path)
    status, out, err = flight("run", path, "--trust", "--json", "--set", "faults.it.from_s=0.05", "--set", "faults.it.unit=cable")
    assert status == 0, err
    assert json.loads(out)["metrics"]["fault_onset_s"] == 0.05
    for setting, sentence in (("faults.ti.value=1", "no fault called 'ti'; did you mean 'it'?"), ("faults.it.valu=1", "no key of a fault called 'valu'; did you mean 'value'"),
                              ("faults.it=1", "no key of a fault called ''"), ("faults.it.id=x", "no key of a fault called 'id'"), ("faults.it.value=x", "value: input should be a valid number"),
                              ("faults.it.value=nan", "value: input"), ("faults.it.type=drop", "has no"), ("faults.=1", "write component.parameter=value"), ("faults.it.value.x=1", "no key of a fault called 'value.x'")):
        status, _, err = flight("run", path, "--trust", "--set", setting)
        assert status == 2 and sentence in err, (setting, err)
    assert load(str(path), {"faults.it.value": 3.0, "faults.it.when": "t > 0.01"}, consent=lambda *_: None).file.faults == [
        {**BIAS, "value": 3.0, "when": "t > 0.01"}]
    assert load(str(path), {"faults.it.type": "stuck", "faults.it.value": None}, consent=lambda *_: None).file.faults == [
        {"id": "it", "at": BIAS["at"], "type": "stuck"}]


def test_set_where_there_are_no_faults(flight, tmp_path):
    status, _, err = flight("run", write(tmp_path, faults=None), "--trust", "--set", "faults.it.value=1")
    assert status == 2 and "no fault called 'it'; known: none" in err


@pytest.mark.parametrize("vary, sentence", [
    ({"grid": {"faults.ti.value": [1]}}, "vary: faults.ti.value: no fault called 'ti'; did you mean 'it'?"),
    ({"grid": {"faults.it.valu": [1]}}, "vary: faults.it.valu: no key of a fault called 'valu'"), ({"cases": [{"faults.it.id": "x"}]}, "no key of a fault called 'id'"),
    ({"grid": {"faults": [[]]}}, "'faults' cannot be varied; allowed: component.parameter, component.rate_hz, component.use, faults.ID.key"),
    ({"random": {"faults.ti.value": {"uniform": [0, 1]}}}, "no fault called 'ti'")])
def test_vary_names_keys_of_faults(vary, sentence):
    assert sentence in said(chain.data([BIAS], vary=vary))


def test_a_sweep_refuses_the_cases_whose_fault_makes_no_sense(flight, tmp_path):
    cases = [{"name": "good", "faults.it.value": 1.0}, {"name": "bad", "faults.it.type": "drop"}, {"name": "worse", "faults.it.at": "nowhere"},
             {"name": "other", "faults.it.at": "gauge.imu", "faults.it.type": "drop", "faults.it.value": None}]
    status, out, err = flight("sweep", write(tmp_path, vary={"cases": cases}), "--trust", "--json", "--out", tmp_path / "table")
    found = json.loads(out)
    assert (found["runs"], found["ok"]) == (4, 2) and [row["case"] for row in found["failed"]] == [1, 2]
    assert {row["status"] for row in found["failed"]} == {"refused"} and "nowhere" in found["failed"][1]["sentence"]
