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
