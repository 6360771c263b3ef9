"""Packages that only some installations have: what to say where one is missing."""

import importlib
import re
import sys
from importlib import metadata

from flight_graph.errors import FlightError

PROJECT = "flight_graph"


def required(module: str, extra: str, command: str, instead: str = ""):
    """Import a module of an optional extra. Raises FlightError, which names the command that installs it.

    command: who needs it, for the sentence. instead: the end of the sentence, on what does without.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != module.partition(".")[0]:
            raise
    raise FlightError(f"{command} needs {_needed(extra)}, which is not installed; to install it: "
                      f"{install(extra)}{instead}") from None


def install(extra: str) -> str:
    """The command that installs what an extra needs: from a package index, on which this project itself need not be."""
    return f"{sys.executable} -m pip install {_needed(extra)}"


def _needed(extra):
    return " ".join(f"'{text}'" for text in requirements(extra))


def requirements(extra: str) -> list[str]:
    """The requirements of an extra of this project, without their markers."""
    try:
        found = metadata.requires(PROJECT) or []
    except metadata.PackageNotFoundError:
        found = []
    wanted = re.compile(rf"""extra\s*==\s*["']{re.escape(extra)}["']""")
    return [text.partition(";")[0].strip() for text in found if wanted.search(text)] or [f"{PROJECT}[{extra}]"]
