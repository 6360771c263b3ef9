"""The handbook's site: it builds without a warning, its links lead somewhere, each component has its page, search knows words."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from flight_graph.components import registry
from flight_graph.components.described import described
from flight_graph.requirements import requirements_file

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "docs/build.py"
pytestmark = pytest.mark.xdist_group("site")  # one build for all


class Page(HTMLParser):
    """ids, links and what is loaded of a page."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.links, self.loaded = set(), [], []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids |= {given[name] for name in ("id", "name") if given.get(name)}
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        target = given.get("href") if tag == "link" else given.get("src")
        if target and target != "#" and tag in ("link", "script", "img", "source", "iframe", "video"):
            self.loaded.append(target)


def build(*arguments, **options):
    return subprocess.run([sys.executable, BUILD, *map(str, arguments)], capture_output=True, text=True, **options)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("handbook") / "site"
    done = build("--out", folder, "--quiet")
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert done.stdout == f"{folder / 'index.html'}\n"
    return folder


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html") if "_static" not in path.parts}


def test_every_page_builds_without_a_warning(site):
    names = {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    assert len(names) > 40 and not [name for name in names if not (site / name).is_file()]
    assert not list(site.parent.glob("site.*"))  # what was only needed for building


def test_links_and_anchors_lead_somewhere(site, pages):
    lost = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                assert parts.scheme in ("http", "https", "mailto") and (parts.netloc or parts.path), f"{path}: {link}"
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file() or parts.fragment and target in pages and (
                    unquote(parts.fragment) not in pages[target].ids):
                lost.append(f"{path.relative_to(site)}: {link}")
    assert not lost, "\n".join(lost)


def test_a_page_loads_nothing_from_elsewhere(pages):
    """It is read from a disk, without a network."""
    for path, page in pages.items():
        for target in page.loaded:
            parts = urlsplit(target)
            assert parts.scheme in ("", "data") and not parts.netloc, f"{path} loads {target}"
            assert parts.scheme or (path.parent / unquote(parts.path)).is_file(), f"{path}: {target} is not there"


def test_formulas_of_notebooks_are_drawn(site):
    """As MathML, by the browser alone: no dollar sign of theirs is left."""
    text = (site / "notebooks/your_own_controller.html").read_text(encoding="utf-8")
    assert text.count("<math ") >= 4 and "<mtable>" in text and "$" not in text.split("<article")[1].split("</article>")[0]


def test_each_component_has_a_page_that_says_what_it_is(site):
    asked = {one.id: {showing.scenario for showing in one.shown_by} for name in requirements_file.available()
             for one in requirements_file.read(name)[0].requirements}
    assert "cubli_asteroid" in asked["ROVER-020"]
    for name, component in registry.components().items():
        told = described(component)
        assert told.promises and told.bad_input, f"{name}: its docstring lacks 'Promises:' or 'Bad input:'"
        text = (site / f"components/{name}.html").read_text(encoding="utf-8")
        for word in [*component.inputs, *component.outputs, *component.parameters.entries]:
            assert f">{word}<" in text, f"{name}: {word} is not on its page"
    law = (site / "components/cubli_ros/appc_controller.html").read_text(encoding="utf-8")
    assert "ROVER-020" in law and "tests/cubli/test_laws.py" in law and "Aerospace 2022" in law and "(10)-(16)" in law


def test_search_knows_the_words_of_the_pages(site):
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    assert index.startswith("Search.setIndex(")
    assert {"components/cubli_ros/appc_controller", "api/stepping", "tutorials/ros_user"} <= set(
        re.findall(r'"([\w/]+)"', re.search(r'"docnames":\s*\[(.*?)\]', index, re.S)[1]))
    for word in ("funnel", "stepper", "prescrib"):
        assert re.search(rf'\b{word}"?:', index), f"search does not find {word}"


def test_the_interface_is_read_from_the_docstrings(site):
    text = (site / "api/stepping.html").read_text(encoding="utf-8")
    assert 'id="flight_graph.stepping.stepper.Stepper.back"' in text
    assert "files/flight_graph/stepping/stepper.py.html#L" in text
    assert (site / "files/flight_graph/stepping/stepper.py.html").is_file()


def test_a_build_that_cannot_be_says_why(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    done = build("--out", tmp_path)
    assert done.returncode == 2 and "is there and is no site" in done.stderr and (tmp_path / "thesis.txt").is_file()
    (tmp_path / "absent").mkdir()
    (tmp_path / "absent/sphinx.py").write_text("raise ModuleNotFoundError('', name='sphinx')")
    done = build("--out", tmp_path / "site", env={"PYTHONPATH": str(tmp_path / "absent")})
    assert done.returncode == 2 and done.stderr == (
        "docs: sphinx is not installed; `make docs` installs what the site needs\n")
