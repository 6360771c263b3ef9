"""Reading ``a[i]``: what an element is, and whether a constant index or a constant range lies inside."""

import ast

from flight_graph.components.kernel_rules.kinds import (
    NUMBER,
    TRUTH,
    UNKNOWN,
    Array,
    Items,
    Kind,
    Number,
    Record,
    Value,
    join,
)
from flight_graph.components.kernel_rules.scope import Scope, names_in
from flight_math.values.classes import is_mask


def element(scope: Scope, node: ast.Subscript, base: Kind, indices: list) -> Kind:
    """The kind of an element. indices: the kind of each index, None for a slice."""
    name = ast.unparse(node.value)
    if isinstance(base, Number):
        return scope.report(node, f"{name} is {base}; it has no [{ast.unparse(node.slice)}]")
    if isinstance(base, Record):
        return scope.report(node, f"{name} is a record; its fields are read by name: {', '.join(base.fields) or 'none'}")
    if isinstance(base, Items):
        return _item(scope, node, base, indices)
    if isinstance(base, Value):
        if len(indices) != len(base.shape):
            form = f"{name}[i]" if len(base.shape) == 1 else f"{name}[i, j]"
            return scope.report(node, f"{name} is {base}, which is read as {form}")
        _check(scope, node, base, indices)
        return TRUTH if is_mask(base.value) else NUMBER
    if isinstance(base, Array):
        if len(indices) > len(base.shape):
            return scope.report(node, f"{name} is {base}; it has {len(base.shape)} "
                                      f"{'index' if len(base.shape) == 1 else 'indices'}, not {len(indices)}")
        _check(scope, node, base, indices)
        left = [length for length, index in zip(base.shape, indices) if not isinstance(index, Number)]
        if any(index is None for index in indices):
            left = [None] * len(left)
        elif not all(isinstance(index, Number) for index in indices):
            return UNKNOWN
        shape = (*left, *base.shape[len(indices):])
        return Array(shape, base.role) if shape else NUMBER
    return UNKNOWN


def _item(scope, node, base, indices):
    index = indices[0]
    if isinstance(index, Number) and index.low is not None and index.low == index.high:
        if -len(base.items) <= index.low < len(base.items):
            return base.items[index.low]
        return scope.report(node, f"{ast.unparse(node)}: {ast.unparse(node.value)} has {len(base.items)} entries, 0 to "
                                  f"{len(base.items) - 1}")
    if not base.items or not isinstance(index, Number):
        return UNKNOWN
    kind = base.items[0]
    for item in base.items[1:]:
        kind = join(kind, item)
    return kind


def _check(scope, node, base, indices):
    """Report an index that is outside for certain, or a range whose end is."""
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    for part, index, length in zip(parts, indices, base.shape):
        if length is None or not isinstance(index, Number) or index.low is None:
            continue
        narrowed = names_in(part) & scope.bounded
        outside = index.low >= length or index.high < -length
        if not outside and not (index.high >= length and not narrowed):
            continue
        runs = f"{ast.unparse(part)} is {index.low}" if index.low == index.high else (
            f"{ast.unparse(part)} runs from {index.low} to {index.high}")
        runs = runs if not isinstance(part, ast.Constant) else f"there is no {index.low}"
        allowed = f"0 to {length - 1}" if length > 1 else "0 alone"
        scope.report(node, f"{ast.unparse(node)} is outside: {runs}; {ast.unparse(node.value)} is {base}, its indices "
                           f"are {allowed}")
