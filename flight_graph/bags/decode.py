"""The general decoder: CDR payloads of any layout to a structured array.

Numbers and fixed arrays keep their types; strings become str objects, sequences of numbers NumPy arrays, sequences of
strings lists, and sequences of structs structured arrays of their own. Names and nesting are those of
`flight_graph.bags.layout`. Bytes behind a message are ignored, as CDR readers do.

A wide string's length counts characters of four bytes (older Fast DDS), of two, or bytes, whoever wrote it: the form in
which the messages of a topic end where their bytes do is taken.
"""

import struct
from dataclasses import dataclass

import numpy as np
from rosbags.interfaces import Nodetype

from flight_graph.bags.errors import BagError
from flight_graph.bags.layout import Misfit, check_encapsulation, text_of
from flight_graph.bags.message_types import PRIMITIVES, WIDE, vector_group

_OBJECT = np.dtype(object)


_WIDE_FORMS = ((4, "utf-32"), (2, "utf-16"), (1, "utf-16"))  # bytes that one counted unit has, encoding


@dataclass(frozen=True)
class Form:
    """How numbers stand in a body: byte order, largest alignment [bytes], which of the forms of wide strings."""

    order: str
    largest: int
    wide: int = 0


class Decoder:
    """Decodes messages of one type. A reader is a function (body, position) -> (value, position behind it)."""

    def __init__(self, trees: dict, type_name: str):
        self._trees, self._type_name = trees, type_name
        self._readers = {}

    def decode(self, payloads) -> np.ndarray:
        """Return the (n,) structured array of the payloads. Raises Misfit."""
        dtype, payloads = self._root(Form("<", 8))[1], list(payloads)
        rows = self._rows(payloads, 0)
        if self._holds(WIDE):
            forms = (self._fitting_rows(payloads, wide) for wide in range(len(_WIDE_FORMS)))
            rows = next((found for found in forms if found is not None), rows)
        if isinstance(rows, Misfit):
            raise rows
        table = np.empty(len(rows), dtype)
        for i, row in enumerate(rows):
            table[i] = row[0]
        return table

    def _rows(self, payloads, wide):
        """[(value, end, length of the body), ...], or the Misfit that a payload is."""
        rows = []
        for payload in payloads:
            try:
                order, largest = check_encapsulation(payload)
                body = payload[4:]
                rows.append((*self._root(Form(order, largest, wide))[0](body, 0), len(body)))
            except (struct.error, UnicodeDecodeError, ValueError) as error:
                return Misfit(str(error))
            except Misfit as misfit:
                return misfit
        return rows

    def _fitting_rows(self, payloads, wide):
        """The rows in one form of wide strings, where every message ends with its bytes (or their padding)."""
        rows = self._rows(payloads, wide)
        fits = not isinstance(rows, Misfit) and all(0 <= length - end < 4 for _, end, length in rows)
        return rows if fits else None

    def _holds(self, primitive):
        return any(_innermost(node) == primitive for fields in self._trees.values() for _, node in fields)

    def _root(self, form):
        if form not in self._readers:
            self._readers[form] = self._named_fields(self._type_name, form)
        return self._readers[form]

    def _struct(self, type_name, form):
        group = vector_group(self._trees[type_name])
        if group is not None:
            return _numbers(form, PRIMITIVES[group[0]], group[1])
        return self._named_fields(type_name, form)

    def _named_fields(self, type_name, form):
        fields = self._trees[type_name]
        parts = [self._field(node, form) for _, node in fields]
        readers = [reader for reader, _ in parts]

        def read(body, position):
            values = []
            for reader in readers:
                value, position = reader(body, position)
                values.append(value)
            return tuple(values), position

        return read, np.dtype([(name, dtype) for (name, _), (_, dtype) in zip(fields, parts)])

    def _field(self, node, form):
        kind, argument = node
        if kind == Nodetype.BASE:
            if argument[0] in ("string", WIDE):
                return (_string(form) if argument[0] == "string" else _wide_string(form)), _OBJECT
            return _number(form, _format(argument[0]))
        if kind == Nodetype.NAME:
            return self._struct(argument, form)
        element, length = argument
        count = _number(form, "u4")[0] if kind == Nodetype.SEQUENCE else lambda body, position: (length, position)
        if element[0] == Nodetype.BASE and element[1][0] not in ("string", WIDE):
            fmt = _format(element[1][0])
            return _numbers(form, fmt, length) if kind == Nodetype.ARRAY else (_number_sequence(form, fmt, count), _OBJECT)
        reader, dtype = self._field(element, form)
        return _sequence(reader, dtype, count), _OBJECT


def _innermost(node):
    """Name of the primitive or type of a field, behind arrays and sequences."""
    while node[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        node = node[1][0]
    return node[1][0] if node[0] == Nodetype.BASE else node[1]


def _format(primitive):
    if primitive not in PRIMITIVES:
        raise BagError(f"messages with {primitive} are not read")
    return PRIMITIVES[primitive]


def _number(form, fmt):
    dtype = np.dtype(form.order + fmt)
    unpack = struct.Struct(form.order + {"u1": "B", "i1": "b", "u2": "H", "i2": "h", "u4": "I", "i4": "i", "u8": "Q",
                                         "i8": "q", "f4": "f", "f8": "d", "?": "?"}[fmt]).unpack_from
    size, alignment = dtype.itemsize, min(dtype.itemsize, form.largest)

    def read(body, position):
        position += -position % alignment
        return unpack(body, position)[0], position + size

    return read, dtype.newbyteorder("=")


def _slice(dtype, alignment, body, position, count):
    position += -position % alignment
    end = position + count * dtype.itemsize
    if end > len(body):
        raise ValueError("fewer bytes than its definition needs")
    return np.frombuffer(body, dtype, count, position).astype(dtype.newbyteorder("="), copy=False), end


def _numbers(form, fmt, count):
    dtype = np.dtype(form.order + fmt)
    alignment = min(dtype.itemsize, form.largest)
    return lambda body, position: _slice(dtype, alignment, body, position, count), \
        np.dtype((dtype.newbyteorder("="), (count,)))


def _number_sequence(form, fmt, count_reader):
    dtype = np.dtype(form.order + fmt)
    alignment = min(dtype.itemsize, form.largest)

    def read(body, position):
        count, position = count_reader(body, position)
        return _slice(dtype, alignment, body, position, count) if count else (np.empty(0, fmt), position)

    return read


def _string(form):
    unpack = struct.Struct(form.order + "I").unpack_from

    def read(body, position):
        position += -position % 4
        start = position + 4
        end = start + unpack(body, position)[0]
        if end > len(body):
            raise ValueError("fewer bytes than its definition needs")
        return text_of(body[start:max(end - 1, start)]), end

    return read


def _wide_string(form):
    unpack = struct.Struct(form.order + "I").unpack_from
    width, encoding = _WIDE_FORMS[form.wide]
    encoding += "-le" if form.order == "<" else "-be"

    def read(body, position):
        position += -position % 4
        start = position + 4
        end = start + width * unpack(body, position)[0]
        if end > len(body):
            raise ValueError("fewer bytes than its definition needs")
        return body[start:end].decode(encoding, errors="backslashreplace").removesuffix("\0"), end

    return read


def _sequence(reader, dtype, count_reader):
    def read(body, position):
        count, position = count_reader(body, position)
        if count > len(body):
            raise ValueError("fewer bytes than its definition needs")
        values = []
        for _ in range(count):
            value, position = reader(body, position)
            values.append(value)
        if dtype == _OBJECT:
            return values, position
        table = np.empty(count, dtype) if dtype.names else np.array(values, dtype.base).reshape(count, *dtype.shape)
        if dtype.names:
            for i, value in enumerate(values):
                table[i] = value
        return table, position

    return read
