"""Where each number of a message stands in its CDR body, by its definition and the constant parts that fix it."""

import struct

import numpy as np

from msg_schemas.definitions import Nodetype, definition

_PRIMITIVES = {
    "bool": "?", "byte": "u1", "octet": "u1", "char": "u1", "uint8": "u1", "int8": "i1", "uint16": "<u2", "int16": "<i2",
    "uint32": "<u4", "int32": "<i4", "uint64": "<u8", "int64": "<i8", "float32": "<f4", "float64": "<f8",
}
_GROUPS = (["x", "y", "z"], ["x", "y", "z", "w"])


class BodyLayout:
    """Walks a message definition once, and lays out its CDR body: fields, constant bytes, padding."""

    def __init__(self, type_name, fixed, groups):
        self.fixed, self.groups = fixed, groups
        self.body = bytearray()
        self.padding = []
        self.unused, self.constants = set(fixed), {}
        self.quaternions = {name for parts in groups.values() for name, quantity in parts.items() if quantity.quaternion}
        self.fields = self._struct(definition(type_name).fields, "", 0)
        if self.unused:
            raise ValueError(f"{type_name} has no variable part called {sorted(self.unused)}")

    def _align(self, size):
        while len(self.body) % size:
            self.padding.append(len(self.body))
            self.body.append(0)

    def _constant(self, path, default):
        self.unused.discard(path)
        self.constants[path] = self.fixed.get(path, default)
        return self.constants[path]

    def _string(self, text):
        self._align(4)
        encoded = text.encode() + b"\0"
        self.body += struct.pack("<I", len(encoded)) + encoded

    def _number(self, fmt, shape=()):
        itemsize = np.dtype(fmt).itemsize
        count = int(np.prod(shape)) if shape else 1
        if count:
            self._align(itemsize)
        start = len(self.body)
        self.body += bytes(itemsize * count)
        return ((fmt, shape) if shape else fmt), start

    def _struct(self, fields, prefix, base):
        names = []
        for name, node in fields:
            made = self._field(f"{prefix}{name}", node)
            if made is None:
                continue
            for entry, fmt, start in self._grouped(f"{prefix}{name}", name, *made):
                names.append((entry, fmt, start - base))
        return names

    def _grouped(self, path, name, fmt, start):
        """Split a float64 array into its named quantities, where the signal names them."""
        if path not in self.groups:
            yield name, fmt, start
            return
        for entry, quantity in self.groups[path].items():
            yield entry, ("<f8" if quantity.length is None else ("<f8", (quantity.length,))), start
            start += 8 * quantity.count

    def _field(self, path, node):
        kind, argument = node
        if kind == Nodetype.BASE:
            if argument[0] == "string":
                self._string(self._constant(path, ""))
                return None
            return self._number(_PRIMITIVES[argument[0]])
        if kind == Nodetype.NAME:
            return self._nested(argument, path)
        (element_kind, element), length = argument
        if kind == Nodetype.SEQUENCE:
            length = self._constant(path, 0)
            self._align(4)
            self.body += struct.pack("<I", length if isinstance(length, int) else len(length))
            if element_kind == Nodetype.BASE and element[0] == "string":
                for text in length or []:
                    self._string(text)
                return None
        if length == 0:
            return None
        if element_kind == Nodetype.BASE:
            return self._number(_PRIMITIVES[element[0]], (length,))
        if length != 1:
            raise ValueError(f"{path}: a sequence of {length} structures has no fixed record; length 1 has")
        return self._nested(element, path)

    def _nested(self, type_name, path):
        fields = definition(type_name).fields
        names = [name for name, _ in fields]
        kinds = {node for _, node in fields}
        if names in _GROUPS and len(kinds) == 1 and next(iter(kinds))[0] == Nodetype.BASE:
            if len(names) == 4:
                self.quaternions.add(path)
            return self._number(_PRIMITIVES[fields[0][1][1][0]], (len(names),))
        base = len(self.body)
        entries = self._struct(fields, f"{path}.", base)
        if not entries:
            return None
        return record_dtype(entries, len(self.body) - base), base


def record_dtype(entries, itemsize):
    names, formats, offsets = zip(*entries)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": itemsize})


def leaves(dtype, prefix="", base=0):
    for name in dtype.names:
        sub, offset = dtype.fields[name][:2]
        if sub.names:
            yield from leaves(sub, f"{prefix}{name}.", base + offset)
        else:
            yield f"{prefix}{name}", sub, base + offset, sub.itemsize
