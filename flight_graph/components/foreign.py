"""Code that does not come with the packages: what a scenario names of it, and whether it may run.

A consent is a function of (where it is named, list of `Foreign`): it returns when the code may run, and raises `Untrusted`
when it may not. Nothing of the code has been imported then.
"""

import hashlib
import importlib.machinery
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from flight_graph.components import registry
from flight_graph.errors import FlightError
from flight_graph.text_files import read_bytes

FUNCTIONS = (*registry.PACKAGES, "papers", "scenarios")  # packages whose functions a scenario may name
LARGEST = 4 << 20  # [bytes] of a file of code


@dataclass(frozen=True)
class Foreign:
    """A piece of code. what: its place in the scenario; name: as it stands there; source: its file, or module.

    sha256: of the file's content; empty where there is none to be read.
    """

    what: str
    name: str
    source: str
    sha256: str = ""

    def __str__(self):
        return f"{self.what} is {self.source}" + (f", SHA-256 {self.sha256}" if self.sha256 else "")


Consent = Callable[[str, list[Foreign]], None]


class Untrusted(FlightError):
    """Code would run to which nobody has agreed."""


def agree(where: str, found: list[Foreign]) -> None:
    """The consent to everything: of a program whose own text names the code."""


def refuse(where: str, found: list[Foreign]) -> None:
    """The consent to nothing. Raises Untrusted."""
    raise Untrusted(f"{where} names code that does not come with the packages: {'; '.join(map(str, found))}; read it, then "
                    "add --trust to run it")


def consent(trust) -> Consent:
    """A consent as one: True and False stand for everything and nothing."""
    return trust if callable(trust) else agree if trust else refuse


def of_component(what: str, use: str, folder: Path | None) -> Foreign | None:
    """The foreign code of a component ``use``; None where it is one of the packages' own."""
    return None if ":" not in use else _judged(what, use, folder, registry.PACKAGES)


def of_function(what: str, name: str, folder: Path | None) -> Foreign | None:
    """The foreign code of a function ``module:name``; None where it is one of the packages' own."""
    return _judged(what, name, folder, FUNCTIONS)


def digest(content: bytes) -> str:
    """What a person compares."""
    return hashlib.sha256(content).hexdigest()


def _judged(what, name, folder, packages):
    source = name.rpartition(":")[0]
    if source.endswith(".py"):
        path = registry.absolute(name, folder).rpartition(":")[0]
        return Foreign(what, name, path, _digest_of(path))
    if source.partition(".")[0] in packages:
        return None
    return Foreign(what, name, f"the module {source}", _digest_of(_file_of(source)))


def _digest_of(path):
    try:
        return digest(read_bytes(Path(path), "", LARGEST)) if path else ""
    except FlightError:
        return ""


def _file_of(module):
    """The file of a module that is no part of a package, found without importing anything."""
    if "." in module or module in sys.builtin_module_names:
        return ""
    try:
        found = importlib.machinery.PathFinder.find_spec(module)
    except (ImportError, ValueError):
        return ""
    return found.origin if found is not None and found.has_location else ""
