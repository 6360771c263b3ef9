"""A scenario file that a person names: what of its code runs without a question, and what does not."""

import json
import os
import sys

import pytest
import yaml

from flight_graph.errors import FlightError
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario, load
from tests.security.attacks import Trap, scenario

OTHER = "evil_law:Law"


def written(path, data):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
    return path


def outside(trap, tmp_path):
    """Scenarios whose code lies neither in the packages nor in their own folder."""
    file = trap.write(tmp_path / "elsewhere")
    link = tmp_path / "own" / "link_law.py"
    link.parent.mkdir()
    link.symlink_to(file)
    use = {"by its path": f"{file}:Law", "by a relative path": "../elsewhere/evil_law.py:Law", "by a link": "link_law.py:Law",
           "a module": OTHER, "a module of Python": "antigravity:Law"}
    made = {f"component {name}": scenario(components={"plant": {"use": text}}) for name, text in use.items()}
    made |= {f"metrics {name}": scenario(metrics=text.replace("Law", "draw")) for name, text in use.items() if "Python" not in name}
    made |= {f"figure {name}": scenario(figure=text.replace("Law", "draw")) for name, text in use.items() if "Python" not in name}
    for name, text in use.items():
        made[f"case {name}"] = scenario(vary={"cases": [{"name": "a", "plant.use": text}]})
        made[f"grid {name}"] = scenario(vary={"grid": {"plant.use": [text]}})
        made[f"choice {name}"] = scenario(vary={"random": {"plant.use": {"choice": [text]}}})
        if "Python" not in name:
            made[f"function {name}"] = scenario(vary={"function": text.replace("Law", "draw")})
    return made


def test_code_of_elsewhere_needs_consent(flight, monkeypatch, tmp_path):
    trap = Trap(tmp_path)
    monkeypatch.syspath_prepend(tmp_path / "elsewhere")
    (tmp_path / "given.yaml").write_text("plant: {ros__parameters: {gravity: 0.1}}\n")
    for number, (kind, data) in enumerate(outside(trap, tmp_path).items()):
        file = written(tmp_path / "own" / f"s{number}.yaml", data)
        for command in (("run", file), ("run", file, "--params", tmp_path / "given.yaml"), ("run", file, "--case", 0),
                        ("sweep", file), ("sweep", file, "--params", tmp_path / "given.yaml"), ("demo", file), ("compile", file),
                        ("identify", "spacerobot", "--trajectory", file)):
            done = flight(*command)
            assert done.status == 2 and "add --trust to run it" in done.err and not trap.ran, (kind, command, done.err)
        for command in (("list", file), ("list", file, "--json")):
            done = flight(*command)
            assert done.status == 0 and not trap.ran, (kind, done.err)
        assert json.loads(done.out)["not_imported"], kind
    assert not (tmp_path / "runs").exists()


def test_a_file_beside_the_scenario_runs_when_the_person_runs_it(flight, tmp_path):
    trap = Trap(tmp_path, "own_law")
    trap.write(tmp_path / "own" / "laws")
    file = written(tmp_path / "own" / "s.yaml", scenario(components={"plant": {"use": "laws/own_law.py:Law"}}))
    listed = flight("list", file)
    assert listed.status == 0 and not trap.ran
    assert "laws/own_law.py:Law" in listed.out and "shown with --trust" in listed.err and "SHA-256" in listed.err
    flight("run", file)
    assert trap.ran


def test_list_imports_with_trust(flight, tmp_path):
    trap = Trap(tmp_path, "listed_law")
    trap.write(tmp_path)
    file = written(tmp_path / "s.yaml", scenario(components={"plant": {"use": "listed_law.py:Law"}}))
    flight("list", file, "--trust")
    assert trap.ran


PYTHONS_OWN = ["os:kill", "os:system", "shutil:rmtree", "subprocess:run", "builtins:exec", "importlib:import_module", "posix:kill"]
NO_NAMES = [".attacks:draw", "..x:y", "a", "a:", ":b", "a:b:c", "a b:c", "a:b.c", "a.py", "/dev/stdin:x", "a\n:b", "a/b:c", "",
            "x" * 10_000 + ":y", "a.:b", "1a:b"]


@pytest.mark.parametrize("key", ["metrics", "figure", "function"])
@pytest.mark.parametrize("name", PYTHONS_OWN + NO_NAMES)
def test_what_can_be_no_function_is_refused_before_anything(monkeypatch, key, name):
    """Also where everything is allowed: in a program of one's own, and with --trust."""
    monkeypatch.setattr(os, "kill", lambda *_: pytest.fail("it was called"))
    data = scenario(vary={"function": name}) if key == "function" else scenario(**{key: name})
    if name == "":
        Scenario(data, "s.yaml") if key != "function" else None  # an empty text names nothing
        return
    with pytest.raises(FlightError, match="Python's own library|names no function") as caught:
        Scenario(data, "s.yaml")
    assert "s.yaml" in str(caught.value) and len(str(caught.value)) < 600


def test_list_and_verify_never_call_the_function(flight, tmp_path):
    (tmp_path / "draws_here.py").write_text("raise SystemExit('imported')\n")
    file = written(tmp_path / "s.yaml", scenario(vary={"function": "draws_here.py:draw", "runs": 3}))
    assert flight("list", file).status == 0
    from tests.security.attacks import bag
    flight("verify", bag(tmp_path / "bag", scenario(vary={"function": "draws_here.py:draw", "runs": 3})))


FUNCTIONS = """import os
from os import kill
number = 3
def text(number, seed): return "text"
def fails(number, seed): raise KeyError("gone")
def good(number, seed): return {"plant.gravity": 0.1 + 0.1 * number}
def judged(scenario, signals): return {"one": 1}
def none(scenario, signals): return None
class Thing:
    def method(self): pass
"""
WRONG = {"draws_two.py:number": "is no function that", "draws_two.py:os": "is no function that", "draws_two.py:kill": "is no function",
         "draws_two.py:Thing": "is no function that", "draws_two.py:god": "did you mean 'good'", "draws_two.py:text": "it returns {key: value}",
         "draws_two.py:fails": "raises KeyError: 'gone'", "no.such:thing": "cannot be loaded: there is no module 'no'",
         "nowhere.py:x": "there is no file", "papers.appc.metrics:compue": "did you mean 'compute'",
         "papers.appc.metrix:compute": "cannot be loaded", "papers.appc.metrics:__name__": "is no function", "papers:x": "cannot be loaded"}


@pytest.mark.parametrize("name", WRONG)
def test_a_function_of_vary_that_is_none(monkeypatch, tmp_path, name):
    monkeypatch.delitem(sys.modules, "draws_two", raising=False)
    (tmp_path / "draws_two.py").write_text(FUNCTIONS)
    with pytest.raises(FlightError) as caught:
        load(str(written(tmp_path / "s.yaml", scenario(vary={"function": name, "runs": 2})))).vary.keys()
    assert WRONG[name] in str(caught.value) and "s.yaml: vary.function" in str(caught.value), str(caught.value)


def test_functions_of_a_file_beside_the_scenario(monkeypatch, tmp_path):
    monkeypatch.delitem(sys.modules, "draws_two", raising=False)
    (tmp_path / "draws_two.py").write_text(FUNCTIONS)
    data = scenario(vary={"function": "draws_two.py:good", "runs": 2}, metrics="draws_two.py:judged")
    loaded = load(str(written(tmp_path / "s.yaml", data)))
    assert loaded.vary.overrides(1) == {"plant.gravity": 0.2} and metrics.compute(loaded, {}) == {"one": 1}
    with pytest.raises(FlightError, match="gives NoneType; needed is a dictionary"):
        metrics.compute(load(str(written(tmp_path / "t.yaml", scenario(metrics="draws_two.py:none")))), {})


@pytest.mark.parametrize("command", [("run",), ("sweep",)])
def test_a_wrong_name_of_metrics_is_found_before_the_flight(flight, monkeypatch, tmp_path, command):
    monkeypatch.setattr("flight_graph.engines.compiled.CompiledRun.run", lambda *_, **__: pytest.fail("it flew"))
    data = scenario(metrics="papers.appc.metrics:compue", vary={"grid": {"plant.gravity": [0.1, 0.2]}})
    done = flight(*command, written(tmp_path / "s.yaml", data))
    assert done.status == 2 and "did you mean 'compute'" in done.err, done.err


NAMES = ["../up", "a/b", "..", ".hidden", "-rf", "a b", "a\nb", "", "a" * 101, "a\0b", "C:x", "ü"]


@pytest.mark.parametrize("name", NAMES)
def test_names_of_scenarios_reach_no_path(flight, tmp_path, name):
    done = flight("run", written(tmp_path / "s.yaml", scenario(name=name)))
    assert done.status == 2 and "name: " in done.err, done.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["s.yaml"]


@pytest.mark.parametrize(("keys", "sentence"), [
    ({"record": {"topics": ["a b"]}}, "record.topics.0: 'a b' is not allowed; allowed: a topic's name"),
    ({"record": {"topics": ["../x"]}}, "record.topics.0"), ({"record": {"topics": ["x" * 300]}}, "record.topics.0"),
    ({"record": {"topics": ["a"] * 2000}}, "record.topics: "), ({"record": {"max_rate_hz": 1e-9}}, "record.max_rate_hz"),
    ({"connect": {"controller.attitude.x": "plant.attitude"}}, "'controller.attitude.x' is not of the form component.port"),
    ({"connect": {"controller attitude": "plant.attitude"}}, "is not of the form component.port"),
    ({"connect": {"controller.attitude": "../plant.attitude"}}, "is not of the form component.port"),
    ({"connect": {"controller." + "a" * 5000: "plant.attitude"}}, "is not of the form component.port"),
    ({"title": "t" * 2000}, "title: "), ({"description": "t" * 30_000}, "description: "), ({"seed": 2**64}, "seed: "),
    ({"seed": -2**70}, "seed: "), ({"duration_s": 1e300}, "duration_s: 1e+300 is not allowed; allowed: at most 1e+09 s"),
    ({"base_rate_hz": 1e-300}, "base_rate_hz"), ({"epoch_ns": 10**30}, "epoch_ns"), ({"epoch_ns": -1}, "epoch_ns"),
    ({"components": {f"c{number}": {"use": "sim_nodes/cubli_plant"} for number in range(300)}}, "components: "),
    ({"components": {"plant": {"use": "x" * 5000}}}, "components.plant.use"), ({"paper": "../../x"}, None),
])
def test_limits_of_a_scenario(keys, sentence):
    data = scenario(**keys)
    if sentence is None:
        Scenario(data, "s.yaml")
        return
    with pytest.raises(FlightError) as caught:
        Scenario(data, "s.yaml")
    assert sentence in str(caught.value) and len(str(caught.value)) < 1000, str(caught.value)
