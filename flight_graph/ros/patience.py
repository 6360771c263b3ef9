"""How long anything of a run of nodes waits for another: one number, $FLIGHT_TIMEOUT_S, from which all others follow.

On a machine that is busy with other work a larger number lets everything wait longer, the tests too.
"""

import os

from flight_graph.errors import FlightError

VARIABLE = "FLIGHT_TIMEOUT_S"
TIMEOUT_S = 60.0  # [s]


def patience_s() -> float:
    """How long [s of wall time] a node waits for another: $FLIGHT_TIMEOUT_S, else `TIMEOUT_S`. Raises FlightError."""
    text = os.environ.get(VARIABLE, str(TIMEOUT_S))
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < float("inf"):
        raise FlightError(f"{VARIABLE}={text}: allowed: a number of seconds greater than 0")
    return seconds


def at_least(seconds: float) -> float:
    """A wait that grows with the patience: ``seconds``, or more where $FLIGHT_TIMEOUT_S is above `TIMEOUT_S`."""
    return seconds * max(1.0, patience_s() / TIMEOUT_S)
