"""A bag is data: no command runs code that it carries, names, or lies beside, without consent."""

import hashlib
import json

import pytest

from flight_graph.recordings.recorded_run import open_recorded
from tests.security.attacks import Trap, bag, plant_compiled, scenario

READING = (("info", "BAG"), ("info", "BAG", "--json"), ("info", "BAG", "--attachment", "scenario.json"),
           ("export", "BAG", "--to", "csv", "--out", "OUT"), ("diff", "BAG", "BAG"), ("recover", "BAG", "--out", "OUT"), ("report", "BAG", "--html", "OUT"),
           ("plot", "BAG", "--fields"))
RUNNING = (("verify", "BAG"), ("replay", "BAG", "--component", "plant"))
PLOT = ("plot", "BAG", "--out", "OUT.png")  # by numbers alone, where the scenario names no figure


def used(use):
    return scenario(components={"plant": {"use": use}})


def attacked(kind, folder, trap):
    """A bag of a kind of attack."""
    path = folder / "a bag"
    inside, beside = trap.write(path).relative_to(folder), trap.write(folder)
    code = {"component/plant.py": trap.text.encode()}
    made = {
        "file inside": lambda: bag(path / "b", used(f"{path / 'evil_law.py'}:Law")),
        "file beside": lambda: bag(path / "b", used(f"{beside}:Law")),
        "file beside, by name": lambda: bag(path / "b", used("evil_law.py:Law")),
        "file by a relative path": lambda: bag(path / "b", used(f"../{inside}:Law")),
        "file that it carries": lambda: bag(path / "b", used("/home/of/somebody/evil_law.py:Law"), code),
        "file that it carries and that is here": lambda: bag(path / "b", used(f"{beside}:Law"), code),
        "module": lambda: bag(path / "b", used("evil_law:Law")),
        "module of a package": lambda: bag(path / "b", used("evil.evil_law:Law")),
        "module of Python": lambda: bag(path / "b", used("antigravity:Law")),
        "figure of a module": lambda: bag(path / "b", scenario(figure="evil_law:draw")),
        "figure of a file": lambda: bag(path / "b", scenario(figure=f"{beside}:draw")),
        "metrics of a module": lambda: bag(path / "b", scenario(metrics="evil_law:draw")),
        "metrics of a file": lambda: bag(path / "b", scenario(metrics=f"{beside}:draw")),
        "function of vary": lambda: bag(path / "b", scenario(vary={"function": "evil_law:draw", "runs": 2})),
        "function of Python": lambda: bag(path / "b", scenario(vary={"function": "os:kill"})),
        "component under vary": lambda: bag(path / "b", scenario(vary={"grid": {"plant.use": ["evil_law:Law"]}})),
    }
    return made[kind]()


KINDS = ["file inside", "file beside", "file beside, by name", "file by a relative path", "file that it carries",
         "file that it carries and that is here", "module", "module of a package", "module of Python", "figure of a module",
         "figure of a file", "metrics of a module", "metrics of a file", "function of vary", "function of Python",
         "component under vary"]
HARMLESS_TO_VERIFY = {"figure of a module", "figure of a file", "metrics of a module", "metrics of a file", "function of vary",
                      "component under vary"}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_of_a_bag_runs(flight, monkeypatch, tmp_path, kind):
    trap = Trap(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    trap.write(tmp_path / "evil").with_name("__init__.py").write_text(trap.text)
    folder = attacked(kind, tmp_path, trap)
    before = {path for path in tmp_path.rglob("*")}
    for number, command in enumerate(READING):
        done = flight(*[{"BAG": folder, "OUT": tmp_path / f"out {number}"}.get(part, part) for part in command])
        assert done.status == 0 and not trap.ran, (command, done.err)
    monkeypatch.setattr("flight_graph.engines.compiled.CompiledRun.compile", lambda *_: pytest.fail("it would be compiled"))
    for number, command in enumerate(RUNNING):
        if kind in HARMLESS_TO_VERIFY:
            open_recorded(folder)  # names what these commands do not call
            continue
        done = flight(*[{"BAG": folder, "OUT": tmp_path / f"out b{number}"}.get(part, part) for part in command])
        assert done.status == 2 and done.err.startswith("error: ") and "Traceback" not in done.err, done.err
    done = flight(*[{"BAG": folder, "OUT.png": tmp_path / "out p.png"}.get(part, part) for part in PLOT])
    assert done.status == (2 if kind.startswith("figure") else 0), done.err
    assert not trap.ran
    assert {path for path in tmp_path.rglob("*")} - before <= {path for path in tmp_path.rglob("*") if "out " in str(path)}


@pytest.mark.parametrize("engine", ["compiled", "python", "ros"])
def test_the_refusal_says_what_would_run(flight, tmp_path, monkeypatch, engine):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "0")
    trap = Trap(tmp_path)
    folder = attacked("file that it carries and that is here", tmp_path, trap)
    done = flight("verify", folder, "--engine", engine)
    assert done.status == 2 and not trap.ran
    for part in ("component plant is evil_law.py, which the bag carries", hashlib.sha256(trap.text.encode()).hexdigest(),
                 "add --trust to run it", f"flight info '{folder}' --attachment component/plant.py"):
        assert part in done.err, done.err


def test_with_trust_what_the_bag_carries_runs_and_nothing_else(flight, tmp_path):
    other = Trap(tmp_path / "other")
    (tmp_path / "other").mkdir()
    beside = other.write(tmp_path)
    trap = Trap(tmp_path)
    folder = bag(tmp_path / "bag", used(f"{beside}:Law"), {"component/plant.py": trap.text.encode()})
    flight("verify", folder, "--trust")
    assert trap.ran and not other.ran


def test_at_a_terminal_it_is_asked(flight, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    asked = []
    monkeypatch.setattr("typer.confirm", lambda text, **options: asked.append(text) or False)
    trap = Trap(tmp_path)
    folder = attacked("file that it carries", tmp_path, trap)
    done = flight("verify", folder)
    assert done.status == 2 and asked == ["Have you read it, and shall it run?"] and not trap.ran
    assert "evil_law.py, which the bag carries" in done.err and hashlib.sha256(trap.text.encode()).hexdigest() in done.err
    monkeypatch.setattr("typer.confirm", lambda text, **options: True)
    flight("verify", folder)
    assert trap.ran


def test_a_compiled_form_of_other_content_is_not_taken(tmp_path):
    from flight_graph.components import component_file
    trap = Trap(tmp_path)
    source = tmp_path / "honest_law_with_cache.py"
    source.write_text("honest = True\n")
    plant_compiled(source, trap.text)
    assert component_file.load(str(source)).honest and not trap.ran


SHAPES = {
    "no JSON": b"{", "a list": b"[]", "a number": b"1", "deep": b"[" * 100_000, "deep mappings": b'{"a":' * 100_000,
    "long": b" " * (5 << 20), "digits": b"9" * 5000, "no components": b"{}", "components as a list": b'{"components": []}',
    "component as a text": b'{"components": {"a": "b"}}', "no use": b'{"components": {"a": {}}}',
    "use as a list": b'{"components": {"a": {"use": ["x.py:Y"]}}}', "bytes": b"\xff\xfe\x00",
}


ENTRIES = ("component as a text", "no use", "use as a list")  # of which nothing is read for a picture


@pytest.mark.parametrize("shape", SHAPES)
def test_an_attachment_that_is_no_scenario(flight, tmp_path, shape):
    folder = bag(tmp_path / "bag", SHAPES[shape])
    for command in (("verify", folder), ("replay", folder, "--component", "a")):
        done = flight(*command)
        assert done.status == 2 and "scenario.json" in done.err and len(done.err) < 1000, done.err[:2000]
    for command in (("plot", folder), ("report", folder)):  # numbers need no scenario
        done = flight(*command)
        assert done.status == 0 and len(done.err) < 1000, done.err[:2000]
        assert "scenario.json" in done.err or (shape in ENTRIES and command[0] == "plot"), done.err
    assert flight("info", folder).status == 0


NAMES = ["../../up", "a/b", "a b", "a;b", "$(a)", "a\nb", "-a", "a\x1b[31m", "", "A" * 200, "a:b", "a.b", "ä", ".."]


@pytest.mark.parametrize("name", NAMES)
def test_names_of_nodes_are_checked_before_anything(flight, tmp_path, name):
    data = scenario(components={name: {"use": "sim_nodes/cubli_plant"}, "controller": {"use": "cubli_ros/pd_controller"}})
    folder = bag(tmp_path / "bag", data)
    done = flight("verify", folder)
    assert done.status == 2 and "this is no name of a node" in done.err and "\x1b" not in done.err, done.err
    (tmp_path / "s.json.yaml").write_text(json.dumps(data))
    done = flight("run", tmp_path / "s.json.yaml")
    assert done.status == 2 and "this is no name of a node" in done.err and not (tmp_path / "runs").exists()
