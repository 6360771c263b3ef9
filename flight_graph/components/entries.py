"""One declared entry of a record: its kind, shape, words and range, and what a value of it must be.

An entry comes from an annotation and a `field` in a class body (`flight_graph.components.records`).
"""

import sys
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np
from pydantic import Field, StrictBool, TypeAdapter, ValidationError

from flight_graph.components.places import refuse
from flight_graph.errors import FlightError, sentence_of
from flight_graph.text_files import short
from flight_math.values.views import is_value_class

LONGEST_TEXT = 1000  # characters of a parameter that is a text


@dataclass(frozen=True)
class Array:
    """The shape of an array-valued entry."""

    shape: tuple

    def __init__(self, *shape):
        object.__setattr__(self, "shape", shape)


class Integers(Array):
    """The shape of an entry of whole numbers (int64), as the indices of a tree; kernels see it by reference."""


@dataclass(frozen=True)
class Choice:
    """One of several words; in the record it is the word's index (int64)."""

    words: tuple

    def __init__(self, *words):
        object.__setattr__(self, "words", words)


@dataclass(frozen=True)
class Entry:
    """One declared entry of a record."""

    name: str
    kind: str  # float, int, bool, choice or text
    shape: tuple
    words: tuple
    default: object
    unit: str
    source: str
    doc: str
    bounds: tuple  # of (gt|ge|lt|le, number)
    value: type | None = None  # class of the value that kernels see
    used_if: tuple = ()  # of (another entry, the words of it with which this one has an effect)

    @property
    def range_text(self) -> str:
        """What is allowed, in words."""
        signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
        if self.words:
            return "one of " + ", ".join(self.words)
        text = " and ".join(f"{signs[key]} {bound:g}" for key, bound in self.bounds)
        size = f"{' x '.join(map(str, self.shape))} {'whole ' * (self.kind == 'int')}numbers" if self.shape else {
            "float": "a finite number", "int": "a whole number", "bool": "true or false", "text": "a text"}[self.kind]
        return f"{size}{', ' + text if text else ''}{' [' + self.unit + ']' if self.unit not in ('', '1') else ''}"

    @property
    def format(self):
        fmt = {"float": "<f8", "int": "<i8", "choice": "<i8", "bool": "?"}[self.kind]
        return (fmt, self.shape) if self.shape else fmt

    def validate(self, value, where: str):
        """Return the value in the record's form. Raises FlightError with a sentence."""
        if self.kind == "choice":
            if value not in self.words:
                raise FlightError(f"{where}: {short(repr(value))} is not allowed; allowed: {self.range_text}")
            return self.words.index(value)
        if self.kind == "text":
            if not isinstance(value, str) or len(value) > LONGEST_TEXT or not value.isprintable():
                raise FlightError(f"{where}: {short(repr(value))} is not allowed; allowed: {self.range_text}")
            return value
        try:
            if not self.shape:
                return _adapter(self, ()).validate_python(_number(value, self.kind))
            if np.ndim(value) == 0:
                return np.full(self.shape, _adapter(self, ()).validate_python(_number(value, self.kind)))
            rows = _rows([_number(item, self.kind) for item in value], self.shape)
            return np.array(_adapter(self, self.shape).validate_python(rows))
        except (ValidationError, ValueError, TypeError) as error:
            detail = sentence_of(error.errors()[0]) if isinstance(error, ValidationError) else str(error)
            raise FlightError(f"{where}: {short(repr(value))} is not allowed ({short(detail)}); allowed: "
                              f"{self.range_text}") from None

    def plain(self, record_value):
        """The value as a scenario file writes it."""
        if self.kind == "choice":
            return self.words[int(record_value)]
        scalar = {"float": float, "int": int, "bool": bool, "text": str}[self.kind]
        return record_value.tolist() if self.shape else scalar(record_value)


def flat(value):
    """A matrix row by row, the form of ROS parameters; anything else as it is."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return [number for row in value for number in flat(row)]
    return value


def _number(value, kind):
    """NumPy scalars and arrays as plain numbers and lists; a whole number may be written as 2.0 (older bags have it so)."""
    value = value.tolist() if hasattr(value, "tolist") else list(value) if isinstance(value, tuple) else value
    if kind == "int" and isinstance(value, list):
        return [_number(item, kind) for item in value]
    return int(value) if kind == "int" and isinstance(value, float) and value.is_integer() else value


def _rows(values, shape):
    """A matrix written row by row as one list (the form of ROS parameters), as nested lists."""
    if len(shape) == 2 and len(values) == shape[0] * shape[1] and not any(isinstance(v, list) for v in values):
        return [values[i * shape[1]:(i + 1) * shape[1]] for i in range(shape[0])]
    return values


def _whole(bounds):
    """Bounds of a whole number, those of the record's 64 bits included."""
    low = {} if {"ge", "gt"} & bounds.keys() else {"ge": -2**63}
    return {**low, **bounds, **({} if {"le", "lt"} & bounds.keys() else {"le": 2**63 - 1})}


@cache
def _adapter(entry: Entry, shape: tuple) -> TypeAdapter:
    bounds = dict(entry.bounds)
    scalar = {
        "float": Annotated[float, Field(strict=True, allow_inf_nan=False, **bounds)],
        "int": Annotated[int, Field(strict=True, **_whole(bounds))],
        "bool": StrictBool,
    }[entry.kind]
    for length in reversed(shape):
        scalar = Annotated[list[scalar], Field(min_length=length, max_length=length)]
    return TypeAdapter(scalar)


def field(default=0.0, *, unit="", source="", doc="", used_if=None, **bounds):
    """Declare an entry: default (a scalar fills an array), SI unit, range (gt, ge, lt, le), source and meaning.

    used_if: {a choice of the same record: the words with which this entry has an effect}; otherwise a scenario that gives
    it is warned.
    """
    return {"default": default, "unit": unit, "source": source, "doc": doc, "bounds": tuple(bounds.items()),
            "used_if": tuple((name, tuple(words)) for name, words in (used_if or {}).items())}


def annotation_text(annotation) -> str:
    """An annotation as its file writes it, nearly."""
    return annotation.__name__ if isinstance(annotation, type) else repr(annotation)


def _evaluated(cls, name, annotation):
    """An annotation that is a text (`from __future__ import annotations`), as what it means in its file."""
    if not isinstance(annotation, str):
        return annotation
    try:
        return eval(annotation, vars(sys.modules[cls.__module__]))
    except Exception as error:  # it is the user's own text
        refuse(cls, name, f"the annotation {annotation!r} means nothing here ({error})")


def declared_entry(name: str, annotation, given: dict, cls: type) -> Entry:
    """The entry of an annotation and its `field`. Raises FlightError, with the place in the class, where it is none."""
    annotation = _evaluated(cls, name, annotation)
    kinds = {float: "float", int: "int", bool: "bool", str: "text"}
    value = annotation if is_value_class(annotation) else None
    if isinstance(annotation, Array) or value:
        kind, shape, words = "int" if isinstance(annotation, Integers) else "float", annotation.shape, ()
    elif isinstance(annotation, Choice):
        kind, shape, words = "choice", (), annotation.words
    elif annotation in kinds:
        kind, shape, words = kinds[annotation], (), ()
    else:
        refuse(cls, name, f"{annotation_text(annotation)} is not allowed; allowed: float, int, bool, str, Vec3, Mat3, "
                          "Quaternion, Vec(n), Mat(n, m), DualQuaternion, DualVector, Array(...), Integers(...) or "
                          "Choice(...)")
    default = given["default"]
    if isinstance(default, (list, np.ndarray)):
        default = tuple(np.asarray(default, int if kind == "int" else float).ravel().tolist())
    if kind == "choice" and default == 0.0:
        default = words[0]
    if kind == "bool" and default == 0.0:
        default = False
    if kind == "int" and default == 0.0:
        default = 0
    if kind == "text" and default == 0.0:
        default = ""
    return Entry(name, kind, shape, words, default, given["unit"], given["source"], given["doc"], given["bounds"], value,
                 given["used_if"])
