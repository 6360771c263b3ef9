"""The numbers of a structured array as flat columns: dotted paths to 1-D arrays."""

import numpy as np
from rosbags.interfaces import Nodetype

_AXES = "xyzw"
_LONGEST = 1000  # entries of an array that become columns of their own; a longer one is one column of lists
_LONGEST_BYTES = 64  # likewise of bytes: an image is one column of bytes


def columns(array: np.ndarray, is_vector):
    """Yield (column name, path of its field, (n,) array).

    Entries of an array are ``field[i]``, of arrays of structs ``field[i].part``, of an x, y, z (w) group ``field.x``
    where ``is_vector(path without indices, length)``. Object fields stay whole. Long arrays do too: of bytes as raw bytes
    (dtype ``V``), of anything else as objects, one array a message.
    """
    yield from _columns(array, "", "", is_vector)


def _columns(array, name, path, is_vector):
    for field in array.dtype.names:
        values, label, where = array[field], f"{name}{field}", f"{path}{field}"
        group = values.ndim > array.ndim and values.dtype.names is None and is_vector(where, values.shape[-1])
        shape = values.shape[1:]
        whole = _whole(values, len(shape))
        if whole is not None:
            yield label, where, whole
            continue
        for index in np.ndindex(*shape):
            entry = values[(slice(None), *index)]
            plain = index[:-1] if group else index
            text = label + "".join(f"[{i}]" for i in plain) + (f".{_AXES[index[-1]]}" if group else "")
            if entry.dtype.names:
                yield from _columns(entry, f"{text}.", f"{where}.", is_vector)
            else:
                yield text, where, entry


def _whole(values, dimensions):
    """A long array field as one column, or None."""
    count = int(np.prod(values.shape[1:])) if dimensions else 1
    if dimensions and values.dtype.kind in "ui" and values.dtype.itemsize == 1 and count > _LONGEST_BYTES:
        return np.ascontiguousarray(values).reshape(len(values), count).view(f"V{count}")[:, 0]
    if dimensions and count > _LONGEST:
        column = np.empty(len(values), object)
        for i, row in enumerate(values):
            column[i] = row
        return column
    return None


def definition_order(trees: dict, type_name: str) -> dict:
    """Path (without indices) of every field of a type -> its place in the definition."""
    order = {}

    def visit(name, prefix):
        for field, node in trees[name]:
            order[f"{prefix}{field}"] = len(order)
            while node[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                node = node[1][0]
            if node[0] == Nodetype.NAME:
                visit(node[1], f"{prefix}{field}.")

    visit(type_name, "")
    return order


def entry_names(bag, topic: str) -> list:
    """Names of array entries: the message's own list ``name`` (JointState), where it is the same in all messages."""
    names = bag.constants(topic).get("name")
    return names if isinstance(names, list) and names and len(set(names)) == len(names) else []


def named(column: str, names: list) -> str:
    """``position[3]`` with the name of the entry in place of its number, where it has one."""
    base, bracket, index = column.partition("[")
    if bracket and base in ("position", "velocity", "effort") and index[:-1].isdigit() and int(index[:-1]) < len(names):
        return f"{base}[{names[int(index[:-1])]}]"
    return column
