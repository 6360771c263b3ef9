"""The parts of a component and the machine code of each: compiled once, for every graph and every engine.

A part (start, kernel, output, update, place) is one C function ``void part(int64 t_ns, P *, X *, void **io)``; see
`flight_graph.engines.object_code`. Its key is a fingerprint of that part alone: of the kernels it reaches and of the
layouts of its records, of the versions of what makes the code, and of the processor.
"""

import hashlib
import platform
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import llvmlite
import numba
import numpy as np

from flight_graph.components.component import Component
from flight_graph.components.kernel_rules import reached
from flight_graph.engines import cache as store
from flight_graph.engines import machine
from flight_graph.engines.moved import called, made_of
from flight_graph.engines.part_calls import parts, records
from flight_graph.faults.report import does_nothing
from flight_math.kernel import fingerprint

ABI = 1  # of the C functions


@dataclass(frozen=True)
class Code:
    """A loaded part. errors: number -> sentence of what it may raise, see `flight_graph.engines.stops.RAISED`."""

    address: int
    errors: dict[int, str]


@cache
def key(component: type[Component], part: str, check_bounds: bool = False) -> str:
    """Fingerprint of everything that the machine code of a part depends on.

    With checked bounds it names lines, so it depends on where the kernels stand, too.
    """
    if does_nothing(component):
        return digest("a part that does nothing")  # whatever its records are
    places = [f"{source.path}:{source.tree.lineno}" for source in reached(component)] if check_bounds else []
    return digest(f"part {part}", fingerprint(getattr(component, part)), *map(repr, records(component, part)),
                  f"bounds {check_bounds}", *places)


def digest(*texts: str) -> str:
    """A key of texts, of what makes code here, and of this processor."""
    made = [*texts, f"ABI {ABI}", *_makers(), platform.python_version(), *machine.cpu()]
    return hashlib.sha256("\n".join(made).encode()).hexdigest()[:32]


@cache
def _makers():
    sources = [Path(__file__).with_name(name).read_bytes() for name in (
        "linked_code.py", "object_code.py", "machine.py")]
    return [numba.__version__, llvmlite.__version__, np.__version__, hashlib.sha256(b"".join(sources)).hexdigest()]


def missing(component: type[Component], check_bounds: bool = False) -> list[str]:
    """The parts whose machine code is not in the cache."""
    component = made_of(component)
    return [part for part in parts(component) if not store.has(key(component, part, check_bounds))]


def load(component: type[Component], check_bounds: bool = False) -> dict[str, Code] | None:
    """part -> its machine code from the cache; None where some is missing or spoiled."""
    found, plain = {}, made_of(component)
    for part in parts(component):
        name = key(plain, part, check_bounds)
        if (code := load_code(name)) is None:
            return None
        found[part] = code if plain is component else Code(called(component, part, symbol(name), code.address), code.errors)
    return found


def forget(component: type[Component], check_bounds: bool = False) -> None:
    """Take spoiled machine code out of the cache."""
    component = made_of(component)
    for part in parts(component):
        name = key(component, part, check_bounds)
        if store.read(name) is None:
            store.remove(name)


_LOADED = {}


def load_code(name: str) -> Code | None:
    """The code under a key from the cache, loaded once a process; None where it is missing or spoiled."""
    if name not in _LOADED:
        stored = store.read(name)
        if stored is None:
            return None
        code, about = stored
        _LOADED[name] = Code(machine.load(about["symbol"], code), {int(n): text for n, text in about["errors"].items()})
    return _LOADED[name]


def symbol(name: str) -> str:
    """The C name under which the code of a key is loaded."""
    return f"flight_{name}"
