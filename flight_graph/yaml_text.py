"""YAML from outside, read in one place: numbers as people write them, and no more of it than can be meant.

Numbers, booleans and null are those of the core schema of YAML 1.2 (``1e-3`` is a number, ``1:30`` is none), and ``yes``,
``no``, ``on``, ``off`` and ``1_000`` of YAML 1.1, which ROS knows as well. Tags of other types are refused.
"""

import re
from pathlib import Path

import yaml

from flight_graph.errors import FlightError
from flight_graph.text_files import LARGEST, decoded, read_bytes, short, size_text

DEEPEST = 50  # lists and mappings in each other
MOST_VALUES = 100_000  # values of a text, each counted as often as it is referred to
_TAG = "tag:yaml.org,2002:"
_LONGEST_NUMBER = 100  # digits
_FIRST = "-+.0123456789"
_DIGITS = "[0-9](?:_?[0-9])*"
_NUMBERS = (
    ("int", rf"[-+]?{_DIGITS}|[-+]?0o[0-7]+|[-+]?0x[0-9a-fA-F]+|[-+]?0b[01]+"),
    ("float", rf"[-+]?(?:\.{_DIGITS}|{_DIGITS}(?:\.(?:{_DIGITS})?)?)(?:[eE][-+]?[0-9]+)?"
              r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"),
)


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
    yaml_implicit_resolvers = {
        first: [(tag, pattern) for tag, pattern in entries if tag.removeprefix(_TAG) not in ("int", "float", "timestamp")]
        for first, entries in yaml.SafeLoader.yaml_implicit_resolvers.items()}
    yaml_constructors = {
        tag: function for tag, function in yaml.SafeLoader.yaml_constructors.items()
        if tag is None or tag.removeprefix(_TAG) in ("null", "bool", "str", "seq", "map")}


def _int(loader, node):
    text = loader.construct_scalar(node).replace("_", "")
    digits = text.lstrip("+-")
    if len(digits) > _LONGEST_NUMBER:
        raise ValueError(f"a whole number of {len(digits)} digits")
    base = {"0x": 16, "0o": 8, "0b": 2}.get(digits[:2].lower(), 10)
    return int(text, base)


def _float(loader, node):
    text = loader.construct_scalar(node).replace("_", "").lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


for _name, _pattern in _NUMBERS:
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(f"^(?:{_pattern})$"), list(_FIRST))
_Loader.add_constructor(_TAG + "int", _int)
_Loader.add_constructor(_TAG + "float", _float)


def parse(text: str | bytes, where: str, most: int = MOST_VALUES, largest: int = LARGEST):
    """The value of a YAML text of one document. Raises FlightError, which begins with ``where``."""
    if len(text) > largest:
        raise FlightError(f"{where}: the text is longer than {size_text(largest)}, which is more than is read of it")
    if isinstance(text, bytes):
        text = decoded(text, where)
    try:
        _measure(text, where, most)
        return yaml.load(text, Loader=_Loader)
    except FlightError:
        raise
    except (yaml.YAMLError, ValueError, RecursionError, TypeError) as error:
        raise FlightError(f"{where}: this is no YAML: {short(' '.join(str(error).split()), 400)}") from None


def read(path: Path, where: str | None = None):
    """The value of a YAML file. Raises FlightError, which begins with ``where`` (the path when left out)."""
    where = str(path) if where is None else where
    return parse(read_bytes(path, where), where)


def _measure(text, where, most):
    """Refuse what unfolds to more than is allowed, before it is built."""
    sizes, opened = {}, [[None, 0]]  # values behind each anchor; (anchor, values so far) of what is open
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise FlightError(f"{where}: '*{short(event.anchor, 40)}' stands for nothing, or for a value that it is in")
            opened[-1][1] += sizes[event.anchor]
        elif isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
            opened.append([event.anchor, 1])
            if len(opened) > DEEPEST + 1:
                raise FlightError(f"{where}: lists and mappings are nested more than {DEEPEST} deep")
        elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
            anchor, size = opened.pop()
            opened[-1][1] += size
            if anchor is not None:
                sizes[anchor] = size
        elif isinstance(event, yaml.ScalarEvent):
            opened[-1][1] += 1
            if event.anchor is not None:
                sizes[event.anchor] = 1
        if opened[-1][1] > most:
            raise FlightError(f"{where}: it unfolds to more than {most} values, which is more than is read of such a text")
