"""How old a message is."""

from typing import NamedTuple

from flight_graph.timebase import SECOND
from flight_math import kernel

NEVER = 1e9  # [s] age of what has not arrived yet


class Stamp(NamedTuple):
    """A stamp that a component keeps: seconds and nanoseconds."""

    sec: float
    nanosec: float


@kernel
def age(now, stamp):
    """Seconds from a ``stamp`` to the stamp ``now``; `NEVER` for a message that has not arrived (stamp zero)."""
    if stamp.sec == 0:
        return NEVER
    return (now.sec - float(stamp.sec)) + (now.nanosec - float(stamp.nanosec)) / SECOND
