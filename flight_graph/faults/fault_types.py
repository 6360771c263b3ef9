"""The kinds of faults: their words, the places they make sense at, what they need, and what they do.

The words are those of hardware-in-the-loop benches, of MAVLink's failure injection and of sensor standards. One table: the
check of scenario files, the handbook and the command line read it.
"""

from dataclasses import dataclass

OUTPUT, INPUT, STATE, PARAMETER = "a field of an output", "a field of one input", "an entry of a state", "a parameter"
OUTPUT_MESSAGE, INPUT_MESSAGE, COMPONENT = "the messages of an output", "the messages of one input", "a component"
NUMBERS, MESSAGES = (OUTPUT, INPUT, STATE, PARAMETER), (OUTPUT_MESSAGE, INPUT_MESSAGE)
_SIGNALS = (OUTPUT, INPUT)
WINDOW = ("from_s", "until_s", "for_s", "every_s", "when")
_OFTEN = (*WINDOW, "at_s", "probability")


@dataclass(frozen=True)
class FaultType:
    """One kind. needs: keys that must be given; takes: keys that may be. value: what ``value`` means, with its unit.

    is_event: it happens at instants (at_s, every_s, probability or the onset of ``when``), not throughout its window.
    replaces: the field has no other cause while it lasts, so a second such fault at the same time contradicts it.
    """

    name: str
    places: tuple
    does: str
    value: str = ""
    needs: tuple = ()
    takes: tuple = _OFTEN
    is_event: bool = False
    replaces: bool = False


_ALL = (
    FaultType("bias", (*_SIGNALS, PARAMETER), "adds a constant", "added [unit of the field]", ("value",),
              (*_OFTEN, "ramp_s")),
    FaultType("drift", (*_SIGNALS, PARAMETER), "adds what grows from zero with time", "growth [unit of the field / s]",
              ("value",)),
    FaultType("scale", (*_SIGNALS, PARAMETER), "multiplies: a loss of effectiveness below 1", "factor [1]", ("value",),
              (*_OFTEN, "ramp_s")),
    FaultType("stuck", NUMBERS, "holds a value: the one given, or that of its onset", "the value [unit of the field]", (),
              (*_OFTEN, "value"), replaces=True),
    FaultType("spike", (*_SIGNALS, STATE), "adds once", "added [unit of the field]", ("value",), is_event=True),
    FaultType("noise", _SIGNALS, "adds white Gaussian noise", "standard deviation [unit of the field]", ("value",)),
    FaultType("quantise", _SIGNALS, "rounds to multiples of a step", "step [unit of the field]", ("value",)),
    FaultType("saturate", (*_SIGNALS, STATE), "limits the size", "largest size [unit of the field]", ("value",)),
    FaultType("off", NUMBERS, "reads zero", replaces=True),
    FaultType("bit_flip", (*_SIGNALS, STATE), "flips one bit of the number in memory: an upset", needs=("bit",),
              is_event=True),
    FaultType("drop", MESSAGES, "loses messages: all, each with a probability, or every k-th",
              takes=(*_OFTEN, "every")),
    FaultType("delay", MESSAGES, "messages arrive later, by firings of the component that sends (or reads) them",
              needs=("ticks",), takes=WINDOW, replaces=True),
    FaultType("duplicate", (OUTPUT_MESSAGE,), "sends messages twice", takes=(*_OFTEN, "every")),
    FaultType("freeze", MESSAGES, "repeats the content of its onset under new stamps", takes=WINDOW, replaces=True),
    FaultType("stale", MESSAGES, "repeats the message of its onset, its old stamp too", takes=WINDOW, replaces=True),
    FaultType("hang", (COMPONENT,), "does not fire and publishes nothing, then goes on", takes=WINDOW, replaces=True),
    FaultType("crash", (COMPONENT,), "is gone for good", takes=("from_s", "when"), replaces=True),
    FaultType("restart", (COMPONENT,), "is gone for a time, then begins again with a fresh state", needs=("for_s",),
              takes=("from_s", "until_s", "every_s", "when"), replaces=True),
)
TYPES = {one.name: one for one in _ALL}
SPARE = FaultType("spare", (), "is a place that is kept for a fault that is injected while the graph runs", takes=())


def allowed_at(place: str) -> list[str]:
    """The kinds that make sense at a kind of place."""
    return [name for name, one in TYPES.items() if place in one.places]
