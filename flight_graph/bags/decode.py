"""The general decoder: CDR payloads of any layout to a structured array.

Numbers and fixed arrays keep their types; strings become str objects, sequences of numbers NumPy arrays, sequences of
strings lists, and sequences of structs structured arrays of their own. Names and nesting are those of
`flight_graph.bags.layout`. Bytes behind a message are ignored, as CDR readers do.
"""

import struct

import numpy as np
from rosbags.interfaces import Nodetype

from flight_graph.bags.errors import BagError
from flight_graph.bags.layout import Misfit, check_encapsulation
from flight_graph.bags.message_types import PRIMITIVES, vector_group

_OBJECT = np.dtype(object)


class Decoder:
    """Decodes messages of one type. A reader is a function (body, position) -> (value, position behind it)."""

    def __init__(self, trees: dict, type_name: str):
        self._trees, self._type_name = trees, type_name
        self._readers = {}

    def decode(self, payloads) -> np.ndarray:
        """Return the (n,) structured array of the payloads. Raises Misfit."""
        rows, dtype = [], self._root("<")[1]
        for payload in payloads:
            read = self._root(check_encapsulation(payload))[0]
            try:
                value, _ = read(payload[4:], 0)
            except (struct.error, UnicodeDecodeError, ValueError) as error:
                raise Misfit(str(error)) from None
            rows.append(value)
        table = np.empty(len(rows), dtype)
        for i, row in enumerate(rows):
            table[i] = row
        return table

    def _root(self, order):
        if order not in self._readers:
            self._readers[order] = self._named_fields(self._type_name, order)
        return self._readers[order]

    def _struct(self, type_name, order):
        group = vector_group(self._trees[type_name])
        if group is not None:
            return _numbers(order + PRIMITIVES[group[0]], group[1])
        return self._named_fields(type_name, order)

    def _named_fields(self, type_name, order):
        fields = self._trees[type_name]
        parts = [self._field(node, order) for _, node in fields]
        readers = [reader for reader, _ in parts]

        def read(body, position):
            values = []
            for reader in readers:
                value, position = reader(body, position)
                values.append(value)
            return tuple(values), position

        return read, np.dtype([(name, dtype) for (name, _), (_, dtype) in zip(fields, parts)])

    def _field(self, node, order):
        kind, argument = node
        if kind == Nodetype.BASE:
            return (_string(order), _OBJECT) if argument[0] == "string" else _number(order + _format(argument[0]))
        if kind == Nodetype.NAME:
            return self._struct(argument, order)
        element, length = argument
        count = _number(order + "u4")[0] if kind == Nodetype.SEQUENCE else lambda body, position: (length, position)
        if element[0] == Nodetype.BASE and element[1][0] != "string":
            fmt = order + _format(element[1][0])
            return _numbers(fmt, length) if kind == Nodetype.ARRAY else (_number_sequence(fmt, count), _OBJECT)
        reader, dtype = self._field(element, order)
        return _sequence(reader, dtype, count), _OBJECT


def _format(primitive):
    if primitive not in PRIMITIVES:
        raise BagError(f"messages with {primitive} are not read")
    return PRIMITIVES[primitive]


def _number(fmt):
    dtype = np.dtype(fmt)
    unpack = struct.Struct(fmt[0] + {"u1": "B", "i1": "b", "u2": "H", "i2": "h", "u4": "I", "i4": "i", "u8": "Q",
                                     "i8": "q", "f4": "f", "f8": "d", "?": "?"}[fmt[1:]]).unpack_from
    size = dtype.itemsize

    def read(body, position):
        position += -position % size
        return unpack(body, position)[0], position + size

    return read, dtype.newbyteorder("=")


def _slice(dtype, body, position, count):
    position += -position % dtype.itemsize
    end = position + count * dtype.itemsize
    if end > len(body):
        raise ValueError("fewer bytes than its definition needs")
    return np.frombuffer(body, dtype, count, position), end


def _numbers(fmt, count):
    dtype = np.dtype(fmt)
    return lambda body, position: _slice(dtype, body, position, count), \
        np.dtype((dtype.newbyteorder("="), (count,)))


def _number_sequence(fmt, count_reader):
    dtype = np.dtype(fmt)

    def read(body, position):
        count, position = count_reader(body, position)
        return _slice(dtype, body, position, count) if count else (np.empty(0, dtype), position)

    return read


def _string(order):
    unpack = struct.Struct(order + "I").unpack_from

    def read(body, position):
        position += -position % 4
        start = position + 4
        end = start + unpack(body, position)[0]
        if end > len(body):
            raise ValueError("fewer bytes than its definition needs")
        return body[start:max(end - 1, start)].decode(), end

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
