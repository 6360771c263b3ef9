"""Views of records: fields read and assigned as values. ``x.adaptive = x.adaptive + p.period * rate``

`Kinds` says which fields of a record are values, and of which kind; view(record, kinds) makes the view, compiled (kinds is
then a constant of the kernel) and in plain Python. Fields that are not named in it read as they stand in the record:
numbers, arrays by reference, nested records as views.
"""

import difflib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flight_math.errors import refuse
from flight_math.values.classes import Mask, Value, kind_name, kind_of


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


def wrong_kind(name, wanted, given) -> str:
    """The sentence for an assignment of another kind."""
    remedy = f"; an array of {wanted.count} numbers is made one by {maker(wanted)}(...)" if given.startswith("array") else ""
    return f"'{name}' is a {kind_name(wanted)}, and a {given} is assigned to it{remedy}"


def maker(kind) -> str:
    """The function or class that makes a value of an array."""
    return {"Vec3": "vec3", "Mat3": "mat3", "Quaternion": "quaternion4"}.get(kind.title, kind.title)


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
        kind, found = self._kinds.by_name.get(name), record[name]
        if isinstance(kind, type):
            return kind.of(found.ravel().tolist())
        if found.dtype.names:
            return View(found, kind or NO_KINDS)
        return found

    def __setattr__(self, name, value):
        record = self._record
        if name not in record.dtype.names:
            refuse(no_entry(name, record.dtype.names))
        kind, place = self._kinds.by_name.get(name), record.dtype[name]
        given = kind_of(value)
        if isinstance(kind, type):
            if given is not kind:
                refuse(wrong_kind(name, kind, "array" if given is np.ndarray else kind_name(given)))
            record[name] = np.reshape(value.parts(), kind.shape)
        elif place.names or place.shape:
            refuse(not_assigned_whole(name, bool(place.names)))
        elif given not in (float, bool):
            refuse(wrong_kind(name, float, "Mask" if isinstance(value, Mask) else kind_name(given)))
        else:
            record[name] = value

    def __repr__(self):
        return f"View({self._record!r})"


def not_assigned_whole(name, nested: bool) -> str:
    """The sentence for an assignment to an array or a nested record."""
    if nested:
        return f"'{name}' is a nested record: assign its fields one by one"
    return f"'{name}' is an array, read by reference: assign its elements, {name}[i] = ... or {name}[:] = ..."


def view(record, kinds=NO_KINDS):
    """A record (numpy.record, numpy.void, a row of a structured array) as a view; a view stays as it is."""
    return record if isinstance(record, View) else View(record, kinds)


def is_value_class(kind) -> bool:
    """Whether an annotation is a class of values."""
    return isinstance(kind, type) and issubclass(kind, Value)
