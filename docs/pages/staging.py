"""The folder that Sphinx reads: the handbook's files, with links that lead out of docs/ turned into pages of the site.

A page of the handbook is plain Markdown, which any forge shows: files of the repository are linked as ``../examples/x.py``.
Here such a file becomes a page under ``files/`` with numbered lines (``files/examples/x.py.html#L12``), and a folder the
list of its files.
"""

import os
import re
import shutil
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from pages import diagrams

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FILES = "files"  # the folder of the pages of files
COMMANDS = ("flight ", "make ", "python ", "pip ", "ros2 ", "cd ", "export ", "source ", "git ")
_LINK = re.compile(r"\[([^\[\]]+)\]\((?!https?:|#|mailto:)([^()\s#]+)(#[^()\s]*)?\)")
_FENCE = re.compile(r"^( *)(```+)([^\n`]*)\n(.*?)^\1\2 *$", re.M | re.S)
_NOT_OURS = ("pages", "_static")  # folders of docs/ that are no pages
_FILE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 14px/1.45 ui-monospace, monospace; margin: 1.5rem; }}
h1 {{ font-size: 1.1rem; }}
pre {{ overflow-x: auto; }}
pre a {{ display: inline-block; width: 3.5em; color: GrayText; text-decoration: none; user-select: none; }}
pre a:target {{ background: Highlight; }}
</style></head><body><p><a href="{home}">Flight Graph</a></p><h1>{title}</h1>{body}</body></html>
"""


@dataclass
class Stage:
    """folder: what Sphinx reads; extra: what goes beside its pages as it is; wanted: files and folders that are linked."""

    folder: Path
    extra: Path
    wanted: set = field(default_factory=set)

    def write(self, name: str, text: str) -> None:
        """A page by its name below the folder; its relative links are those that it would have in docs/."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(self._read(text, name), encoding="utf-8")

    def copy(self) -> None:
        """All pages, pictures and notebooks of docs/."""
        for path in sorted(DOCS.rglob("*")):
            name = path.relative_to(DOCS)
            if name.parts[0] in _NOT_OURS or "__pycache__" in name.parts or ".ipynb_checkpoints" in name.parts:
                continue
            if path.suffix == ".md":
                self.write(name.as_posix(), path.read_text(encoding="utf-8"))
            elif path.is_file() and path.suffix != ".py":
                (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(path, self.folder / name)

    def write_files(self) -> None:
        """The pages of what is linked; a folder brings the pages of its files."""
        written = set()
        while open_ := self.wanted - written:
            for path in sorted(open_):
                written.add(path)
                body = self._listed(path) if path.is_dir() else _numbered(path)
                page = self.extra / page_of(path)
                page.parent.mkdir(parents=True, exist_ok=True)
                home = os.path.relpath("index.html", Path(page_of(path)).parent)
                page.write_text(_FILE.format(title=escape(path.relative_to(ROOT).as_posix()), home=home, body=body),
                                encoding="utf-8")

    def _listed(self, path):
        files = [one for one in sorted(path.rglob("*")) if one.is_file() and "__pycache__" not in one.parts]
        self.wanted |= set(files)
        links = (f'<li><a href="{os.path.relpath(page_of(one), Path(page_of(path)).parent)}">'
                 f"{escape(one.relative_to(path).as_posix())}</a></li>" for one in files)
        return f"<ul>{''.join(links)}</ul>"

    def _read(self, text, name):
        """The text of a page with its links as they lead here; code is left as it is."""
        parts, at = [], 0
        for found in _FENCE.finditer(text):
            parts += [self._links(text[at:found.start()], name), _fenced(found)]
            at = found.end()
        return "".join([*parts, self._links(text[at:], name)])

    def _links(self, text, name):
        return _LINK.sub(lambda found: self._link(found, Path(name).parent), text)

    def _link(self, found, folder):
        words, target, anchor = found[1], found[2], found[3] or ""
        path = (DOCS / folder / target).resolve()
        if path == ROOT / "README.md":
            return f"[{words}]({os.path.relpath('index.md', folder)}{anchor})"
        if not path.exists() or path.is_relative_to(DOCS):
            return found[0]
        self.wanted.add(path)
        words = re.sub(r"`([^`]*)`", r"<code>\1</code>", words)
        return f'<a href="{os.path.relpath(page_of(path), folder)}{anchor}">{words}</a>'


def page_of(path: Path) -> str:
    """The name in the site of the page of a file or a folder of the repository."""
    name = path.relative_to(ROOT).as_posix()
    return f"{FILES}/{name}/index.html" if path.is_dir() else f"{FILES}/{name}.html"


def _numbered(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    return "<pre>" + "\n".join(f'<a id="L{number}" href="#L{number}">{number}</a>{escape(line)}'
                               for number, line in enumerate(lines, 1)) + "</pre>"


def _fenced(found) -> str:
    """A block of code: a diagram as a picture, commands as such, the rest as it is."""
    indent, fence, language, body = found.groups()
    if language == "mermaid":
        return diagrams.html(body)
    if not language and body.lstrip("# ").startswith(COMMANDS):
        language = "bash"
    return f"{indent}{fence}{language}\n{body}{indent}{fence}"
