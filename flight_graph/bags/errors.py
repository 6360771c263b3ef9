"""What a user is told about a bag: one sentence, with the way out."""

import shlex

from flight_graph.errors import FlightError


def quoted(path) -> str:
    """A path as a shell takes it."""
    return shlex.quote(str(path))


class BagError(FlightError):
    """A bag cannot be written, read or exported as asked."""


class BagDamaged(BagError):
    """A bag is truncated, corrupted or unfinished."""

    def __init__(self, path, what: str):
        super().__init__(f"bag '{path}' is damaged: {what}; `flight recover {quoted(path)}` saves what is intact")
        self.what = what
