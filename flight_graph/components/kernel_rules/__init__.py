"""What a kernel may not do, found by reading it: milliseconds, before anything is compiled.

`check(component)` reads each part and every kernel it calls, with the kinds of parameters, state and messages, and raises
FlightError with one sentence: file, line, component, part, what is wrong, what is allowed. It says nothing of what it
cannot tell; the compiler finds the rest (`flight_graph.engines`).
"""

from functools import cache

from flight_graph.components import declarations
from flight_graph.components.findings import ComponentMistake, Finding
from flight_graph.components.kernel_rules import parts
from flight_graph.components.sources import Source


@cache
def _readings(component):
    return [parts.reading(component, part) for part in declarations.parts(component)]


def findings(component) -> tuple[Finding, ...]:
    """All that is wrong with a component's kernels, in the order of its parts."""
    return tuple(finding for found, _ in _readings(component) for finding in found)


def reached(component) -> list[Source]:
    """The kernels that a component reaches, but for those of `flight_math`; each once."""
    return list({source.function: source for _, sources in _readings(component) for source in sources}.values())


def check(component) -> None:
    """Raise ComponentMistake with the first thing that is wrong with a component's kernels."""
    found = findings(component)
    if found:
        raise ComponentMistake(str(found[0]))
