"""The pictures of docs/questions: every command of a page is typed in an empty folder, and what it drew is copied.

    python benchmarks/question_pictures.py                  # all pages
    python benchmarks/question_pictures.py gain --show      # one, and what its commands print

A page says so itself, in comments that no reader sees: ``<!-- file NAME -->`` above a block that is saved,
``<!-- output -->`` above lines that its commands print, ``<!-- by hand -->`` above commands of several terminals, which
are left out here, and ``<!-- picture FROM TO -->`` above a picture.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES, PICTURES = ROOT / "docs/questions", ROOT / "docs/images/questions"
_BLOCK = re.compile(r"^(?:<!-- (?P<mark>[^>]*?) -->\n)?```(?P<language>\w*)\n(?P<text>.*?)^```$", re.M | re.S)
_PICTURE = re.compile(r"^<!-- picture (\S+) (\S+) -->$", re.M)


@dataclass(frozen=True)
class Step:
    """A block of a page. kind: file (name: its name), commands, by hand, output; text: what is in it."""

    kind: str
    text: str
    name: str = ""

    @property
    def lines(self) -> list[str]:
        return self.text.strip().splitlines()


def steps(page: Path) -> list[Step]:
    """The blocks of a page that mean something to it, in their order."""
    found = []
    for block in _BLOCK.finditer(page.read_text(encoding="utf-8")):
        mark, _, name = (block["mark"] or "").partition(" ")
        if mark == "file":
            found.append(Step("file", block["text"], name))
        elif mark == "output":
            found.append(Step("output", block["text"]))
        elif not block["language"]:
            found.append(Step("by hand" if mark == "by" else "commands", block["text"]))
    return found


def pictures(page: Path) -> list[tuple[str, str]]:
    """(what a command drew, its name in the handbook) of a page."""
    return _PICTURE.findall(page.read_text(encoding="utf-8"))


def draw(page: Path, show: bool) -> None:
    """Type the commands of a page and copy its pictures."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    with tempfile.TemporaryDirectory() as folder:
        for step in steps(page):
            if step.kind == "file":
                (Path(folder) / step.name).write_text(step.text, encoding="utf-8")
            for command in step.lines if step.kind == "commands" else ():
                done = subprocess.run(command, shell=True, cwd=folder, env={**os.environ, "PATH": path},
                                      capture_output=True, encoding="utf-8")
                if show:
                    print(f"$ {command}\n{done.stdout}{done.stderr}", flush=True)
        for drawn, name in pictures(page):
            if (Path(folder) / drawn).exists():
                shutil.copyfile(Path(folder) / drawn, PICTURES / name)
                print(PICTURES / name)
            else:
                print(f"{page.name}: {drawn} is drawn by hand")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", nargs="*", help="names of pages; all when left out")
    parser.add_argument("--show", action="store_true", help="what the commands print")
    options = parser.parse_args()
    PICTURES.mkdir(parents=True, exist_ok=True)
    for page in sorted(PAGES.glob("*.md")):
        if not options.pages or page.stem in options.pages:
            draw(page, options.show)


if __name__ == "__main__":
    main()
