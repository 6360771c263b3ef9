"""What is known of a value before a kernel is compiled: a number, a vector of three, a record of these fields.

Kinds are found by reading. Whatever cannot be told is `UNKNOWN`, and nothing is said of it.
"""

from dataclasses import dataclass, field


class Kind:
    """Base of all kinds; str() names it in a sentence."""


@dataclass(frozen=True)
class Unknown(Kind):
    def __str__(self):
        return "something"


@dataclass(frozen=True)
class Nothing(Kind):
    """What a kernel without a return gives."""

    def __str__(self):
        return "nothing"


@dataclass(frozen=True)
class Text(Kind):
    text: str = ""

    def __str__(self):
        return "a text"


@dataclass(frozen=True)
class Number(Kind):
    """A number or a truth.

    of: float, int or bool where it is known. low, high: the whole numbers it lies between, both of which it takes.
    loops: the loops that it runs with. words: of a Choice.
    """

    of: type | None = None
    low: int | None = None
    high: int | None = None
    loops: frozenset = frozenset()
    words: tuple = ()

    def __str__(self):
        return "a truth" if self.of is bool else "a number"


@dataclass(frozen=True)
class Range(Kind):
    """What a loop runs over; low, high as in `Number`."""

    low: int | None = None
    high: int | None = None

    def __str__(self):
        return "a range"


@dataclass(frozen=True)
class Value(Kind):
    """An immutable value of `flight_math`, by its class."""

    value: type

    @property
    def shape(self) -> tuple:
        return self.value.shape

    def __str__(self):
        return f"a {self.value.title}"


@dataclass(frozen=True)
class Array(Kind):
    """An array by reference. role: of the record it belongs to, '' for one of the kernel's own."""

    shape: tuple
    role: str = ""

    def __str__(self):
        return f"an array of {' x '.join('n' if n is None else str(n) for n in self.shape)} numbers"


@dataclass(frozen=True, eq=False)
class Record(Kind):
    """A record with named fields. role: parameters, state, input, output; title: its declaration."""

    title: str
    role: str
    fields: dict
    texts: tuple = ()  # parameters that the kernel's record does not carry

    def __str__(self):
        return f"the record {self.title}"


@dataclass(frozen=True)
class Items(Kind):
    """A tuple of known length. fields: the names of a NamedTuple's."""

    items: tuple
    fields: tuple = ()

    def __str__(self):
        return f"{len(self.items)} values"


@dataclass(frozen=True)
class Partly(Kind):
    """A name that has a value only where a condition holds; line: of that condition, depth: how many it stands under."""

    kind: Kind
    line: int
    depth: int


@dataclass(frozen=True, eq=False)
class Object(Kind):
    """A thing of Python itself: a module, a function, a class. name: as the kernel's source writes it."""

    value: object = field(repr=False)
    name: str

    def __eq__(self, other):
        return isinstance(other, Object) and self.value is other.value

    def __hash__(self):
        return id(self.value)

    def __str__(self):
        return f"'{self.name}'"


UNKNOWN, NOTHING, NUMBER = Unknown(), Nothing(), Number()
TRUTH, WHOLE, REAL = Number(bool), Number(int), Number(float)


def whole(low: int, high: int | None = None, loops=frozenset()) -> Number:
    """A whole number between low and high."""
    return Number(int, low, low if high is None else high, loops)


def join(a: Kind, b: Kind) -> Kind:
    """What holds of a value that is one or the other."""
    if a == b:
        return a
    if isinstance(a, Partly) or isinstance(b, Partly):  # two conditions may make it whole
        return join(getattr(a, "kind", a), getattr(b, "kind", b))
    if isinstance(a, Number) and isinstance(b, Number):
        return Number(a.of) if a.of is b.of else NUMBER
    if isinstance(a, Items) and isinstance(b, Items) and len(a.items) == len(b.items):
        return Items(tuple(map(join, a.items, b.items)), a.fields if a.fields == b.fields else ())
    return UNKNOWN


def without_range(kind: Kind) -> Kind:
    """A kind as it is passed to another kernel: the range of a number is forgotten."""
    if isinstance(kind, Number) and not kind.words:
        return Number(kind.of)
    return Items(tuple(map(without_range, kind.items)), kind.fields) if isinstance(kind, Items) else kind


def is_several(kind: Kind) -> bool:
    """Whether it is certain to be more than one number."""
    return isinstance(kind, (Value, Array, Items))
