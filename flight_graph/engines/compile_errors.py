"""What the compiler refuses, as one sentence: file, line, component, part, what is wrong.

Numba says where it was and what it tried, type by type, over up to two hundred lines. Of these the innermost line of the
user's files is kept, and the first statement, with its types by the names that a person gave them. FLIGHT_DEBUG=1 shows
numba's own words.
"""

import os
import re
import sys
import traceback
from contextlib import contextmanager
from pathlib import Path

from flight_graph.components.findings import Finding
from flight_graph.components.kernel_rules.library import SCRATCH
from flight_graph.components.places import is_own
from flight_graph.components.sources import source
from flight_graph.engines.compiler_words import essence
from flight_graph.errors import FlightError
from flight_math.errors import KernelError

_PLACES = re.compile(r"(?:Raised from|\bat) (?P<file>\S[^\n]*?) \((?P<line>\d+)\)"
                     r"|File \"(?P<named>[^\"\n]+)\", line (?P<at>\d+)")


@contextmanager
def translated(component, part: str):
    """Whatever the compiler raises of a part becomes a FlightError with one sentence."""
    try:
        yield
    except FlightError:
        raise
    except Exception as error:  # numba raises what its own code happens to raise, too
        if os.environ.get("FLIGHT_DEBUG") == "1":
            traceback.print_exc(file=sys.stderr)
        raise FlightError(sentence(error, component, part)) from error


def sentence(error: Exception, component, part: str) -> str:
    """The one sentence for an error of the compiler's."""
    path, line = _place(error, component, part)
    return str(Finding(path, line, f"{component.__name__}.{part}", _what(error, component)))


def _what(error, component):
    text = str(error)
    if isinstance(error, KernelError):
        return error.sentence
    if "NRT required" in text:
        return f"this allocates memory, which no kernel may; write {SCRATCH}"
    if type(error).__module__ == "numba.core.errors":
        return essence(text, component)
    return f"the compiler does not take this ({type(error).__name__}: {' '.join(text.split())[:200]})"


def _place(error, component, part):
    """File and line: the innermost of the user's that the error names, else where the part begins."""
    if isinstance(error, KernelError) and error.file and is_own(component, error.file):
        return error.file, error.line
    places = [*_named(error), *_held(error)]
    if "unify return type" in str(error):  # numba names the returns in no order: the last one is taken
        returns = len(_PLACES.findall(str(error).partition("During: ")[0]))
        places = sorted(places[:returns], key=lambda place: -place[1]) + places
    for path, line in places:
        if is_own(component, path):
            return path, line
    found = source(getattr(component, part))
    return (found.path, found.tree.lineno) if found else ("", 0)


def _named(error):
    """The places in an error's text, innermost first."""
    for found in _PLACES.finditer(str(error)):
        path = Path(found["file"] or found["named"])
        yield str(path if path.is_absolute() else path.resolve()), int(found["line"] or found["at"])
    location = getattr(error, "loc", None)
    if location is not None:
        yield location.filename, location.line


def _held(error):
    """The statements that the frames of an error were at, innermost first."""
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    for frame in reversed(frames):
        for name in ("inst", "expr", "self"):
            location = getattr(frame.f_locals.get(name), "loc", None)
            if hasattr(location, "filename"):
                yield location.filename, location.line
