"""The one exception a user sees: a sentence that says what is wrong, where, and what is allowed."""

import difflib

_LONGEST, _MOST = 200, 200  # characters of a name that a sentence repeats, and names


class FlightError(ValueError):
    """Something a user can put right. The command line prints the sentence and exits with status 2."""


class RunStopped(FlightError):
    """A run that a component stopped. reason: ``fault``, ``nonfinite`` or ``error`` (a kernel raised one).

    t_ns: time of the tick since the start of the run; recording: what was recorded until then, where the engine keeps it.
    """

    def __init__(self, sentence: str, reason: str, t_ns: int = 0, recording=None):
        super().__init__(sentence)
        self.reason, self.t_ns, self.recording = reason, t_ns, recording


def sentence_of(mistake: dict) -> str:
    """What pydantic says of one mistake of a ValidationError, as the middle of a sentence."""
    text = mistake["msg"].removeprefix("Value error, ")
    return text[:1].lower() + text[1:]


def unknown(kind: str, name: str, known, where: str = "") -> FlightError:
    """An unknown name, with the nearest known ones."""
    known, name = sorted(known), name if len(name) <= _LONGEST else f"{name[:_LONGEST]}..."
    near = difflib.get_close_matches(name, [other for other in known if len(other) <= _LONGEST], n=3, cutoff=0.5)
    shown = ", ".join(known[:_MOST]) + (f" and {len(known) - _MOST} more" if len(known) > _MOST else "")
    hint = f"did you mean {' or '.join(repr(n) for n in near)}?" if near else f"known: {shown or 'none'}"
    return FlightError(f"{where}{': ' if where else ''}no {kind} called '{name}'; {hint}")
