"""What the handbook tells to type: each command line is one that there is, its tutorials' cheap ones run, its anchors exist."""

import re
import shlex
import shutil
import unicodedata
from pathlib import Path

import pytest
import typer

from tests.commands import runner

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```([\w-]*)\n(.*?)^```", re.M | re.S)
PLACEHOLDERS = {"BAG", "SCENARIO", "DIR", "K", "PAPER", "FILE"}


def lines(page: Path, languages=("", "bash")):
    """The lines of a page's blocks of commands."""
    for language, block in FENCE.findall(page.read_text(encoding="utf-8")):
        if language in languages:
            yield from block.replace("\\\n", " ").splitlines()


def words(line: str) -> list[str]:
    """The words of a command line behind ``flight``, without what follows it in a pipe, or in another column."""
    given = shlex.split(re.split(r" {2,}", line)[0], comments=True)[1:]
    ends = [number for number, word in enumerate(given) if word in ("&&", "&", "|", ";", ">")]
    return given[:min(ends, default=len(given))]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_each_command_line_is_one_that_there_is(page):
    from flight_graph.cli.app import app
    group = typer.main.get_command(app)
    top = group.make_context("flight", ["doctor"])
    for line in lines(page):
        if not line.startswith("flight ") or "..." in line.split("#")[0]:
            continue
        name, *given = words(line)
        if name.startswith("-") or PLACEHOLDERS & set(given):
            continue
        command = group.get_command(top, name)
        assert command is not None, f"{page.name}: {line}: there is no command {name}"
        try:
            command.make_context(name, list(given), parent=top)
        except Exception as error:
            pytest.fail(f"{page.name}: {line}: {getattr(error, 'message', error)}")


def slug(heading: str) -> str:
    """The anchor that a forge gives a heading."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
    kept = (letter for letter in text if letter in " -_" or unicodedata.category(letter)[0] in "LN")
    return "".join(kept).replace(" ", "-")


def anchors(page: Path) -> set[str]:
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    return {slug(heading) for heading in re.findall(r"^#+ (.*)$", text, re.M)}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_to_files_and_headings(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]+))?\)", text):
        if target.startswith("http"):
            assert re.fullmatch(r"https?://[\w.-]+\.\w+(/\S*)?", target), f"{page.name}: {target} is no address"
            continue
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), f"{page.name} links to {target}, which is not there"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path), f"{page.name}: {target}#{anchor}: there is no such heading"


CHEAP = {  # of a tutorial: the first words of its lines that are run, in order, and what one of the answers has
    "ros_user": (("flight run cubli_asteroid --duration", "flight info", "flight list"),
                 "/cubli/wheel_command"),
    "controls_researcher": (("flight run cubli_asteroid --set controller.lambda_a=0.06", "flight step"), "attitude_xi"),
    "author_of_a_paper": (("flight run cubli_asteroid_paper", "flight verify"), "equal, byte for byte"),
}
STATUS = {"flight run cubli_asteroid --set controller.lambda_a=0.06": 2}


@pytest.mark.parametrize("tutorial", CHEAP)
def test_cheap_commands_of_a_tutorial_run_as_they_stand(tutorial, tmp_path, monkeypatch, capsys):
    """Those that need neither nodes nor many runs; bags of the others are taken from what the cheap ones made."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    run, (starts, expected) = runner(monkeypatch, capsys), CHEAP[tutorial]
    said = ""
    for line in lines(ROOT / f"docs/tutorials/{tutorial}.md"):
        start = next((start for start in starts if line.startswith(start)), None)
        if start is None:
            continue
        given = [word.replace("runs/nodes", "runs/loop") for word in words(line)]
        if given[0] in ("info", "verify") and not any((tmp_path / word).exists() for word in given[1:]):
            continue
        status, out, error = run(*given)
        assert status == STATUS.get(start, 0), f"{line}: {error}"
        said += out + error
    assert expected in said
