"""The topic ``/faults``: which faults are active, at each change. It is the truth; flight software never reads it.

A component of every graph with faults, called ``flight_graph.faults.report:ID,ID,...``. It computes nothing: its record is
filled by the faults themselves, each of which sets its own number while its window is open and its condition holds (chance
and counts are left out).
"""

from functools import cache

from flight_graph.components.component import Component
from flight_graph.timebase import SECOND
from flight_math import kernel
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector

REPORT = "faults"  # name of the node and of its topic
MONITORS = "monitors"  # name of the other node whose records the schedule fills, see `flight_graph.monitors`
_FASTEST_HZ = 1000.0


@kernel
def nothing(t_ns, p, x, outputs):
    """The schedule fills the records."""


def __getattr__(name: str) -> type[Component]:
    """The component that reports faults with these ids, which stand in its name."""
    if name.startswith("__"):
        raise AttributeError(name)
    return fault_report(tuple(name.split(",")))


def use(identifiers) -> str:
    """The name of the component that reports faults with these ids."""
    return f"{__name__}:{','.join(identifiers)}"


@cache
def fault_report(identifiers: tuple[str, ...]) -> type[Component]:
    """The component that reports faults with these ids."""
    signal = named_vector(REPORT, "", {name: Quantity(None, "1", "1 while it is active") for name in identifiers},
                          Role.TRUTH, doc="the faults of the scenario, at each change")

    class FaultReport(Component):
        """Says which faults are active."""

        outputs = {REPORT: signal}
        rate_hz = 100.0
        kernel = nothing

    return FaultReport


def does_nothing(component: type[Component]) -> bool:
    """Whether a component's records are filled by the schedule."""
    return component.kernel is nothing


def report_rate_hz(nodes) -> float:
    """The rate at which the report looks: that of the fastest component, halved until it is at most 1 kHz."""
    rate_hz = max(node.rate_hz for node in nodes)
    while _FASTEST_HZ < rate_hz <= SECOND:
        rate_hz /= 2.0
    return rate_hz
