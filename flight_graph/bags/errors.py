"""What a user is told about a bag: one sentence, with the way out."""

from flight_graph.errors import FlightError


class BagError(FlightError):
    """A bag cannot be written, read or exported as asked."""


class BagDamaged(BagError):
    """A bag is truncated, corrupted or unfinished."""

    def __init__(self, path, what: str):
        super().__init__(f"bag '{path}' is damaged: {what}; `flight recover {path}` saves what is intact")
        self.what = what
