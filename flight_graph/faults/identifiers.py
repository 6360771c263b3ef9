"""Ids of faults, watchpoints and actionpoints: each is a number of a record, and a name in expressions."""

import keyword
import re

import numpy as np

_IDENTIFIER = re.compile("[A-Za-z][A-Za-z0-9_]{0,59}")
_TAKEN = ("t", "abs", "min", "max", "age", "header", "stamp", "name", "position", "velocity", "effort")
ALLOWED = ("a letter, then letters, digits and underscores, 60 in all (but no word of expressions, of Python or of the "
           "message's own fields, and no attribute of a NumPy record)")


def is_form(value) -> bool:
    """Whether a value has the form of an id."""
    return isinstance(value, str) and _IDENTIFIER.fullmatch(value) is not None


def check(value: str) -> str:
    """The value, where it is an id. Raises ValueError."""
    if not is_form(value) or value in _TAKEN or keyword.iskeyword(value) or hasattr(np.record, value):
        raise ValueError(f"it is no name; allowed: {ALLOWED}")
    return value
