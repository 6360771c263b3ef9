"""The numbers of a structured array as flat columns: dotted paths to 1-D arrays."""

import numpy as np

_AXES = "xyzw"


def columns(array: np.ndarray, is_vector):
    """Yield (column name, path of its field, (n,) array).

    Entries of an array are ``field[i]``, of arrays of structs ``field[i].part``, of an x, y, z (w) group ``field.x``
    where ``is_vector(path without indices, length)``. Object fields stay whole.
    """
    yield from _columns(array, "", "", is_vector)


def _columns(array, name, path, is_vector):
    for field in array.dtype.names:
        values, label, where = array[field], f"{name}{field}", f"{path}{field}"
        group = values.ndim > array.ndim and values.dtype.names is None and is_vector(where, values.shape[-1])
        shape = values.shape[1:]
        for index in np.ndindex(*shape):
            entry = values[(slice(None), *index)]
            plain = index[:-1] if group else index
            text = label + "".join(f"[{i}]" for i in plain) + (f".{_AXES[index[-1]]}" if group else "")
            if entry.dtype.names:
                yield from _columns(entry, f"{text}.", f"{where}.", is_vector)
            else:
                yield text, where, entry


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
