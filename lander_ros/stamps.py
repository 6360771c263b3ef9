"""How old a message is."""

from flight_graph.timebase import SECOND
from flight_math import kernel


@kernel
def seconds_between(earlier, later):
    """Time [s] from one stamp to another."""
    return (later.sec - float(earlier.sec)) + (float(later.nanosec) - float(earlier.nanosec)) / SECOND
