"""What the rules find: one sentence with its place, and the nearest names that would be right."""

import difflib
from dataclasses import dataclass
from pathlib import Path

from flight_graph.errors import FlightError


class ComponentMistake(FlightError):
    """A component that is wrong in itself, whatever its parameters are."""


@dataclass(frozen=True)
class Finding:
    """A mistake. part: ``SlidingController.kernel``; what: what is wrong, and what is allowed."""

    path: str
    line: int
    part: str
    what: str

    def __str__(self):
        place = f"{shown(self.path)}:{self.line}: " if self.path else ""
        return f"{place}{self.part}: {self.what}"

    def plain(self) -> dict:
        return {"file": self.path, "line": self.line, "component": self.part.partition(".")[0],
                "part": self.part.partition(".")[2], "what": self.what}


def shown(path: str) -> str:
    """A path as a person here would write it."""
    try:
        return str(Path(path).relative_to(Path.cwd()))
    except ValueError:
        return path


def nearest(name: str, known, otherwise: str = "it has") -> str:
    """The names that are meant, or all there are."""
    known = [word for word in known if not word.startswith("_")]
    near = difflib.get_close_matches(name, sorted(known), n=3, cutoff=0.6)
    if near:
        return f"did you mean {' or '.join(repr(word) for word in near)}?"
    if len(known) > 16:
        known = [*difflib.get_close_matches(name, sorted(known), n=8, cutoff=0.2), "..."]
    return f"{otherwise} {', '.join(known) or 'none'}"
