"""Views of records: fields read and assigned as values. ``x.adaptive = x.adaptive + p.period * rate``

`Kinds` says which fields of a record are values, and of which kind; view(record, kinds) makes the view, compiled (kinds is
then a constant of the kernel) and in plain Python. Fields that are not named in it read as they stand in the record:
numbers, arrays by reference, nested records as views.
"""

import difflib
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flight_math.errors import refuse
from flight_math.values.classes import Value, is_matrix, is_vector, kind_name, kind_of


@dataclass(frozen=True)
class Kinds:
    """Names of a record's fields that are values, with the class of each; nested records have Kinds of their own."""

    pairs: tuple = ()

    @cached_property
    def by_name(self) -> dict:
        return dict(self.pairs)

    @classmethod
    def of(cls, paths) -> "Kinds":
        """Kinds of (path, class) pairs, the parts of a path parted by dots."""
        tree = {}
        for path, kind in paths:
            head, _, rest = path.partition(".")
            if rest:
                tree.setdefault(head, []).append((rest, kind))
            else:
                tree[head] = kind
        return cls(tuple((name, cls.of(kind) if isinstance(kind, list) else kind) for name, kind in tree.items()))

    def __repr__(self):
        return f"Kinds({', '.join(f'{name}: {kind!r}' for name, kind in self.pairs)})"


NO_KINDS = Kinds()


def no_entry(name, names) -> str:
    """The sentence for a field that a record has not."""
    near = difflib.get_close_matches(name, names, 3, 0.5)
    hint = f"; did you mean {' or '.join(near)}?" if near else ""
    return f"there is no '{name}' here{hint} There are: {', '.join(names)}" if near else (
        f"there is no '{name}' here; there are: {', '.join(names)}")


def reads_as(dtype, kinds, name):
    """What a field reads as: a class of values, float, int, bool, numpy.ndarray (by reference), or View (nested)."""
    stored, kind = dtype[name], kinds.by_name.get(name)
    if isinstance(kind, type):
        return kind
    if stored.names:
        return View
    return np.ndarray if stored.shape else {"f": float, "b": bool}.get(stored.kind, int)


def assignable(kind, given) -> bool:
    """Whether what is of the kind ``given`` may be assigned to a field that reads as ``kind``."""
    if kind is View:
        return False
    if kind is np.ndarray:
        return given is np.ndarray or is_vector(given) or is_matrix(given)
    if is_value_class(kind):
        return given is kind or given is np.ndarray
    return given in (float, int, bool)


def wrong_kind(name, kind, given) -> str:
    """The sentence for an assignment of another kind."""
    if kind is View:
        return f"'{name}' is a nested record: assign its fields one by one"
    wanted = {np.ndarray: "array"}.get(kind) or kind_name(kind)
    return f"'{name}' is {article(wanted)} {wanted}, and {article(kind_name(given))} {kind_name(given)} is assigned to it"


def wrong_count(name, shape, count) -> str:
    """The sentence for an assignment of another length."""
    return f"'{name}' holds {' x '.join(map(str, shape))} numbers, and {count} are assigned to it"


def article(word) -> str:
    """a or an"""
    return "an" if word[0] in "aeiou" else "a"


class View:
    """A record whose fields are read and assigned as values (plain Python)."""

    __slots__ = ("_record", "_kinds")

    def __init__(self, record, kinds):
        object.__setattr__(self, "_record", record)
        object.__setattr__(self, "_kinds", kinds)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        record = self._record
        if name not in record.dtype.names:
            refuse(no_entry(name, record.dtype.names))
        kind, found = reads_as(record.dtype, self._kinds, name), record[name]
        if kind is View:
            return View(found, self._kinds.by_name.get(name, NO_KINDS))
        return kind.of(found.ravel().tolist()) if is_value_class(kind) else found

    def __setattr__(self, name, value):
        record = self._record
        if name not in record.dtype.names:
            refuse(no_entry(name, record.dtype.names))
        kind, given = reads_as(record.dtype, self._kinds, name), kind_of(value)
        if not assignable(kind, given):
            refuse(wrong_kind(name, kind, given))
        if isinstance(value, (Value, np.ndarray)):
            shape = record.dtype[name].shape
            numbers = value.parts() if isinstance(value, Value) else value.ravel()
            if len(numbers) != math.prod(shape):
                refuse(wrong_count(name, shape, len(numbers)))
            value = np.reshape(numbers, shape)
        record[name] = value

    def __repr__(self):
        return f"View({self._record!r})"


def view(record, kinds=NO_KINDS):
    """A record (numpy.record, numpy.void, a row of a structured array) as a view; a view stays as it is."""
    return record if isinstance(record, View) else View(record, kinds)


def is_value_class(kind) -> bool:
    """Whether an annotation is a class of values."""
    return isinstance(kind, type) and issubclass(kind, Value)
