"""The questions of the first hour: their commands are ones, their scenarios are sound, and what they quote is what comes out."""

import re
import runpy
import shlex
from pathlib import Path

import pytest
import typer

from benchmarks.question_pictures import PAGES, PICTURES, pictures, steps
from flight_graph.cli.app import app
from flight_graph.graphs.overrides import overrides
from flight_graph.graphs.scenario import Scenario, read
from flight_graph.reports import bag_page, page
from flight_graph.sampling.specifications import Besides
from tests.commands import runner

ROOT = Path(__file__).parents[2]
QUESTIONS = sorted(path for path in PAGES.glob("*.md") if path.name != "index.md")
RUN_HERE = ("gain", "star_tracker", "two_rovers")  # in process, in a second or two each


def commands(path):
    """(words, environment-free text) of every line that a page has typed."""
    return [shlex.split(line) for step in steps(path) if step.kind in ("commands", "by hand") for line in step.lines]


def files(path, folder):
    for step in steps(path):
        if step.kind == "file":
            (folder / step.name).write_text(step.text)


def test_there_are_twelve_and_the_index_names_each():
    index = (PAGES / "index.md").read_text()
    assert len(QUESTIONS) == 12
    for path in QUESTIONS:
        question = path.read_text().partition("\n")[0].removeprefix("# ")
        assert f"[{question}]({path.name})" in index
        assert all((PICTURES / name).is_file() and f"questions/{name}" in path.read_text() for _, name in pictures(path))
        for part in ("## What it means", "## Read on"):
            assert part in path.read_text(), f"{path.name}: {part}"


@pytest.mark.parametrize("path", QUESTIONS, ids=lambda path: path.stem)
def test_commands_are_commands_and_their_scenarios_are_sound(path, tmp_path, monkeypatch):
    files(path, tmp_path)
    monkeypatch.chdir(tmp_path)
    if path.stem == "own_plant":
        monkeypatch.chdir(ROOT / "examples/foreign")
    if (tmp_path / "shape.py").exists():
        runpy.run_path(str(tmp_path / "shape.py"))
    group, made = typer.main.get_command(app), set()
    for words in commands(path):
        assert words[0] in ("flight", "python", "dask", "ros2"), words
        if words[0] != "flight":
            continue
        context = group.commands[words[1]].make_context(words[1], list(words[2:]))  # a word that is none is an error here
        given = context.params
        for folder in [*(given.get("what") or [])[:1], *(given.get("folders") or [])]:
            assert str(folder) in made, f"{folder} is made by no line above"
        scenario = given.get("scenario")
        if scenario and str(scenario) not in made and words[1] in ("run", "sweep", "list", "serve"):
            settings = overrides(scenario, given.get("settings"), given.get("params"), None, given.get("duration"), None)
            data, origin, folder = read(scenario, settings)
            vary = Besides(tuple(given.get("vary") or ())).of(data.get("vary"))
            said = Scenario({**data, "vary": vary}, origin, folder).warnings()
            assert [one for one in said if "has no effect" in one] == []
        if given.get("out"):
            made.add(str(given["out"]))


@pytest.mark.parametrize("name", RUN_HERE)
def test_what_is_quoted_comes_out(name, tmp_path, monkeypatch, capsys):
    """Pages of HTML and pictures are left out here; their own tests make them."""
    path = PAGES / f"{name}.md"
    files(path, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bag_page, "page", lambda *given: ("", "", []))
    monkeypatch.setattr(page, "write", lambda *given: None)
    flight, said = runner(monkeypatch, capsys), ""
    for step in steps(path):
        for words in map(shlex.split, step.lines if step.kind == "commands" else ()):
            if words[1] not in ("plot", "sweep"):
                _, out, err = flight(*words[1:])
                said += out + err
        if step.kind == "output":
            for line in step.lines:
                assert line.rstrip(" …") in said, line


def test_links_of_notebooks_lead_to_files():
    """Those of pages: `tests.handbook.test_commands`."""
    for path in (ROOT / "docs/notebooks").glob("*.ipynb"):
        for target in re.findall(r"\]\(([^)#\s]+)", path.read_text()):
            assert (path.parent / target).exists(), f"{path.name} links to {target}"
