"""The one exception a user sees: a sentence that says what is wrong, where, and what is allowed."""

import difflib


class FlightError(ValueError):
    """Something a user can put right. The command line prints the sentence and exits with status 2."""


class RunStopped(FlightError):
    """A run that a component stopped. reason: ``fault`` or ``nonfinite``; t_ns: time of the tick since the epoch."""

    def __init__(self, sentence: str, reason: str, t_ns: int = 0):
        super().__init__(sentence)
        self.reason, self.t_ns = reason, t_ns


def unknown(kind: str, name: str, known, where: str = "") -> FlightError:
    """An unknown name, with the nearest known ones."""
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(repr(n) for n in near)}?" if near else f"known: {', '.join(known) or 'none'}"
    return FlightError(f"{where}{': ' if where else ''}no {kind} called '{name}'; {hint}")
