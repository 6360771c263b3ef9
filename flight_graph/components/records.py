"""Parameters and states: declared once as a class, used as a numba record, a ROS parameter, a scenario key, a page.

    class AppcParameters(Parameters):
        lambda_a: Vec3 = field(0.041, unit="rad/s", gt=0, source="Table 2", doc="gain on the attitude error")
        law: Choice("explicit", "implicit") = field("implicit", doc="form of the law")

An annotation is ``float``, ``int``, ``bool``, a ``Choice``, a kind of value (``Vec3``, ``Mat3``, ``Quaternion``,
``Vec(n)``, ``Mat(n, m)``, ``DualQuaternion``, ``DualVector``), an array that kernels see by reference, of float64
(``Array(20, 20)``) or of int64 (``Integers(4)``), or ``str``: a text (a file's name) for `Component.resolve`, which the
kernel's record does not carry.
"""

import copy

import numpy as np

from flight_graph.components.entries import Array, Choice, Entry, Integers, declared_entry, field
from flight_graph.components.findings import nearest
from flight_graph.components.places import refuse
from flight_graph.errors import FlightError, unknown
from flight_math.values import DualQuaternion, DualVector, Kinds, Mat, Mat3, Quaternion, Vec, Vec3

__all__ = ["Array", "Choice", "DualQuaternion", "DualVector", "Entry", "Integers", "Mat", "Mat3", "Parameters",
           "Quaternion", "Record", "State", "Vec", "Vec3", "field"]


class Record:
    """Base of Parameters and State: collects the entries of a class body and lays out the record.

    ``dtype`` is the record's layout, ``kinds`` names the entries that kernels see as values (`flight_math.values.Kinds`).
    """

    RESERVED: tuple = ()
    entries: dict = {}

    def __init_subclass__(cls):
        cls.entries = {name: entry for base in reversed(cls.__bases__) for name, entry in base.entries.items()}
        for name, annotation in cls.__dict__.get("__annotations__", {}).items():
            if name in ("entries", "RESERVED"):
                continue
            given = cls.__dict__.get(name, field())
            given = given if isinstance(given, dict) else field(given)
            _check_bounds(cls, name, given["bounds"])
            cls.entries[name] = declared_entry(name, annotation, given, cls)
        for name, value in cls.__dict__.items():
            if isinstance(value, dict) and value.keys() == field().keys() and name not in cls.entries:
                refuse(cls, name, f"it has no annotation; write '{name}: float = field(...)', or another kind")
        for name in cls.entries:
            if name in dict(cls.RESERVED):
                refuse(cls, name, "this name is reserved: the record has such an entry already; take another name")
            if hasattr(np.record, name):
                refuse(cls, name, "this name is reserved (NumPy records have it too); take another name")
        for entry in cls.entries.values():
            for name, words in entry.used_if:
                _check_condition(cls, entry.name, name, words)
        cls.dtype = np.dtype(
            [(entry.name, *_pair(entry.format)) for entry in cls.entries.values() if entry.kind != "text"]
            + list(cls.RESERVED), align=True)
        cls.kinds = Kinds.of((entry.name, entry.value) for entry in cls.entries.values() if entry.value is not None)

    @classmethod
    def defaults(cls) -> dict:
        """The declared defaults, as a scenario file writes them."""
        if "_defaults" not in cls.__dict__:
            found = {}
            for name, entry in cls.entries.items():
                try:
                    found[name] = entry.plain(np.asarray(entry.validate(entry.default, "the default")))
                except FlightError as error:
                    refuse(cls, name, str(error))
            cls._defaults = found
        return copy.deepcopy(cls._defaults)

    @classmethod
    def validate(cls, values: dict, where: str) -> dict:
        """Check ``values`` (a part of the entries) and return them in plain form. Raises FlightError."""
        checked = {}
        for name, value in values.items():
            if name not in cls.entries:
                raise unknown("parameter", name, cls.entries, where)
            entry = cls.entries[name]
            checked[name] = entry.plain(np.asarray(entry.validate(value, f"{where}.{name}")))
        return checked

    @classmethod
    def record(cls, values: dict | None = None, where: str = "") -> np.ndarray:
        """Return a (1,) record array of the defaults, updated by ``values``."""
        record = np.zeros(1, cls.dtype)
        for name, entry in cls.entries.items():
            value = entry.validate((values or {}).get(name, entry.default), f"{where}.{name}")
            if entry.kind != "text":
                record[name] = value
        return record


class Parameters(Record):
    """Parameters of a component. ``period`` [s], the component's own firing period, is always there."""

    RESERVED = (("period", "<f8"),)


class State(Record):
    """Memory of a component between firings. ``fault`` (0: none) is always there: a kernel that cannot go on sets it
    to a code of the component's ``faults``, and the engine stops the run with that sentence."""

    RESERVED = (("fault", "<i8"),)


def _pair(fmt):
    return fmt if isinstance(fmt, tuple) else (fmt,)


def _check_bounds(cls, name, bounds):
    """Refuse a keyword of `field` that there is not."""
    known = ("default", "unit", "source", "doc", "used_if", "gt", "ge", "lt", "le")
    for key, bound in bounds:
        if key not in known:
            refuse(cls, name, f"field has no '{key}'; {nearest(key, known)}")
        if isinstance(bound, bool) or not isinstance(bound, (int, float)):
            refuse(cls, name, f"{key}={bound!r} is no number")


def _check_condition(cls, entry, name, words):
    """Refuse a ``used_if`` of what is no choice of the record, or of words that it does not have."""
    if name not in cls.entries or not cls.entries[name].words:
        choices = [other for other, one in cls.entries.items() if one.words]
        refuse(cls, entry, f"used_if names '{name}', which is no choice of this record; {nearest(name, choices)}")
    for word in words:
        if word not in cls.entries[name].words:
            refuse(cls, entry, f"used_if: {name} has no word '{word}'; {nearest(word, cls.entries[name].words)}")
