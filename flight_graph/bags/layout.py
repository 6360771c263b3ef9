"""Fixed layouts: where in a CDR body each number stands, given a message definition and one payload.

When all messages of a topic have the same strings and sequence lengths, their bodies differ in numbers only and are
rows of one structured array. Field names and nesting are those of `msg_schemas.signal.Signal`: groups x, y, z (w) read
as arrays, strings are constants; sequences of structs are arrays of records.
"""

import struct
from dataclasses import dataclass

import numpy as np
from rosbags.interfaces import Nodetype

from flight_graph.bags.message_types import PRIMITIVES, vector_group


@dataclass(frozen=True)
class Layout:
    """dtype: of the body, item size a multiple of 8. size: bytes of the body.

    constants: path -> string, list of strings, or length of a sequence. columns: (m,) positions in the payload of the
    bytes that must be the same in all messages.
    """

    dtype: np.dtype
    size: int
    constants: dict
    columns: np.ndarray


class Ragged(Exception):
    """A message that no fixed layout can describe."""


class Misfit(Exception):
    """A payload that does not fit its message definition."""


def fixed_layout(trees: dict, type_name: str, payload: bytes) -> Layout:
    """Lay out a topic by its first payload. Raises Ragged or Misfit.

    Bytes behind the message are ignored, as CDR readers do: Fast DDS leaves some behind empty sequences.
    """
    check_encapsulation(payload)
    walker = _Walker(trees, payload)
    entries = walker.struct(trees[type_name], "")
    size = walker.position
    if not entries:
        raise Ragged("no numbers")
    columns = np.concatenate([np.arange(2), *[4 + np.arange(start, stop) for start, stop in walker.fixed]])
    return Layout(
        _dtype(entries, 0, (size + 7) // 8 * 8), size, walker.constants,
        columns.astype(np.int64))


_XCDR1, _XCDR2 = (0, 1), (6, 7)  # plain forms: big and little endian
_OTHER_FORMS = {2: "a parameter list (PL_CDR)", 3: "a parameter list (PL_CDR)", 8: "delimited (D_CDR2)",
                9: "delimited (D_CDR2)", 10: "a parameter list (PL_CDR2)", 11: "a parameter list (PL_CDR2)"}


def check_encapsulation(payload: bytes) -> tuple[str, int]:
    """Return (byte order '<' or '>', largest alignment [bytes]) of a payload. Raises Misfit for anything but plain CDR.

    XCDR2 (of other vendors' middleware) aligns numbers of eight bytes to four.
    """
    form = int.from_bytes(payload[:2], "big") if len(payload) >= 4 else -1
    if form not in _XCDR1 + _XCDR2:
        what = _OTHER_FORMS.get(form, f"unknown ({payload[:4].hex() or 'missing'})")
        raise Misfit(f"no plain CDR: its encapsulation is {what}")
    return "<" if form % 2 else ">", 8 if form in _XCDR1 else 4


def text_of(raw) -> str:
    """A string of a message; bytes that are no UTF-8 are escaped."""
    return bytes(raw).decode(errors="backslashreplace")


class _Walker:
    def __init__(self, trees, payload):
        self.trees, self.body = trees, payload[4:]
        self.order, self.largest = check_encapsulation(payload)
        self.position = 0
        self.constants, self.fixed = {}, []

    def _align(self, size):
        self.position += -self.position % min(size, self.largest)

    def _take(self, size):
        start = self.position
        self.position += size
        if self.position > len(self.body):
            raise Misfit("fewer bytes than its definition needs")
        return start

    def _count(self):
        self._align(4)
        start = self._take(4)
        self.fixed.append((start, start + 4))
        return struct.unpack_from(self.order + "I", self.body, start)[0]

    def _string(self):
        length = self._count()
        start = self._take(length)
        self.fixed.append((start, start + length))
        return text_of(self.body[start:start + max(length - 1, 0)])

    def _numbers(self, primitive, count):
        fmt = np.dtype(self.order + PRIMITIVES[primitive])
        self._align(fmt.itemsize)
        return fmt, self._take(fmt.itemsize * count)

    def struct(self, fields, path):
        entries = []
        for name, node in fields:
            made = self._field(node, f"{path}{name}")
            if made is not None:
                entries.append((name, *made))
        return entries

    def _field(self, node, path):
        kind, argument = node
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            return self._array(kind, *argument, path)
        if kind == Nodetype.NAME:
            return self._nested(argument, path)
        if argument[0] == "string":
            self.constants[path] = self._string()
            return None
        return self._numbers(_known(argument[0]), 1)

    def _nested(self, type_name, path):
        fields = self.trees[type_name]
        group = vector_group(fields)
        if group is not None:
            fmt, start = self._numbers(*group)
            return np.dtype((fmt, (group[1],))), start
        base = self.position
        entries = self.struct(fields, f"{path}.")
        return (_dtype(entries, base, self.position - base), base) if entries else None

    def _array(self, kind, element, length, path):
        if kind == Nodetype.SEQUENCE:
            length = self._count()
            self.constants[path] = length
        if length > len(self.body):
            raise Misfit("fewer bytes than its definition needs")
        if element[0] == Nodetype.NAME:
            return self._structs(element[1], length, path)
        if element[1][0] == "string":
            self.constants[path] = [self._string() for _ in range(length)]
            return None
        if length == 0:
            return None
        fmt, start = self._numbers(_known(element[1][0]), length)
        return np.dtype((fmt, (length,))), start

    def _structs(self, type_name, length, path):
        made = []
        for i in range(length):
            self._align(_first_alignment(self.trees, type_name))
            made.append(self._nested(type_name, f"{path}[{i}]"))
        if not made or made[0] is None:
            return None
        (first, start), starts = made[0], np.array([entry[1] for entry in made])
        stride = int(starts[1] - start) if length > 1 else first.itemsize
        if any(entry[0] != first for entry in made) or (np.diff(starts) != stride).any():
            raise Ragged(f"{path}: its elements differ in layout")
        if stride != first.itemsize:
            if first.names is None:
                raise Ragged(f"{path}: its elements are padded")
            first = np.dtype({"names": first.names, "formats": [first.fields[n][0] for n in first.names],
                              "offsets": [first.fields[n][1] for n in first.names], "itemsize": stride})
        return np.dtype((first, (length,))), start


def _first_alignment(trees, type_name):
    """Alignment [bytes] of the first number of a struct."""
    kind, argument = trees[type_name][0][1]
    if kind == Nodetype.ARRAY:
        kind, argument = argument[0]
    if kind == Nodetype.NAME:
        return _first_alignment(trees, argument)
    if kind == Nodetype.SEQUENCE or argument[0] == "string":
        return 4
    return np.dtype(PRIMITIVES[_known(argument[0])]).itemsize


def _known(primitive):
    if primitive not in PRIMITIVES:
        raise Ragged(f"{primitive} has no fixed form")
    return primitive


def _dtype(entries, base, itemsize):
    names, formats, starts = zip(*entries)
    return np.dtype({"names": names, "formats": formats, "offsets": [start - base for start in starts],
                     "itemsize": itemsize})
