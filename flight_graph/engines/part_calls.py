"""How a part takes its records: as views, each by itself or in named tuples."""

import inspect
from collections import namedtuple
from functools import cache

import numpy as np

from flight_graph.components.component import Component, kinds_of
from flight_graph.components.declarations import UNTIMED, parts
from flight_graph.components.placement import Placement
from flight_math.kernel import plain
from flight_math.values import Kinds, view
from msg_schemas.body_layout import leaves


def fired(component: type[Component]) -> list[str]:
    """The parts that a schedule fires."""
    return [part for part in parts(component) if part not in UNTIMED]


def ports(component: type[Component], part: str) -> tuple[list[str], list[str]]:
    """The inputs and the outputs that a part takes, in the order of its arguments."""
    inputs = [] if part in (*UNTIMED, "output") else list(component.inputs)
    outputs = [] if part in (*UNTIMED, "update") else list(component.outputs)
    return inputs, outputs


def bundles(function) -> tuple[bool, bool]:
    """Whether a part takes its inputs, its outputs, as one named tuple each: arguments called inputs, outputs."""
    names = inspect.signature(plain(function)).parameters
    return "inputs" in names, "outputs" in names


def records(component: type[Component], part: str) -> list[tuple[np.dtype, Kinds]]:
    """Layout and kinds of a part's records: parameters, state, inputs, outputs; of ``place`` the placement last."""
    inputs, outputs = ports(component, part)
    signals = [component.inputs[port] for port in inputs] + [component.outputs[port] for port in outputs]
    own = [component.parameters, component.state, *([Placement] if part == "place" else [])]
    return [(one.dtype, one.kinds) for one in own] + [(signal.dtype, kinds_of(signal)) for signal in signals]


@cache
def _tuple_of(side: str, names: tuple):
    return namedtuple(side, names)


def arranged(component: type[Component], part: str, given: list, bundle) -> list:
    """What stands for each record, in the form of the part's arguments; bundle(named tuple class, items) makes a bundle."""
    function = getattr(component, part)
    own = 3 if part == "place" else 2
    arguments, rest = list(given[:own]), list(given[own:])
    for side, names, bundled in zip(("inputs", "outputs"), ports(component, part), bundles(function)):
        items, rest = rest[:len(names)], rest[len(names):]
        if bundled:
            arguments.append(bundle(_tuple_of(side, tuple(names)), items))
        else:
            arguments += items
    return arguments


def plain_arguments(component: type[Component], part: str, arrays: list[np.ndarray]) -> list:
    """The arguments of a part in plain Python, but for the time: over the memory of these (1,) records."""
    given = [view(array.view(np.recarray)[0], kinds) for array, (_, kinds) in zip(arrays, records(component, part))]
    return arranged(component, part, given, lambda bundle, items: bundle(*items))


def compiled_arguments(component: type[Component], part: str, aligned: bool = False) -> list:
    """Numba's types of the arguments of a part. aligned: records begin at multiples of eight bytes, so that the numbers in
    them lie at multiples of their size: a machine that does not read across such borders reads them at once.
    """
    from numba.core import types
    from numba.np.numpy_support import from_dtype

    from flight_math.values.compiled_views import ViewType
    found = records(component, part)
    given = [ViewType(_twin(from_dtype(dtype), dtype) if aligned else from_dtype(dtype), kinds) for dtype, kinds in found]
    time = [types.int64] if part not in UNTIMED else []

    def bundle(cls, items):
        if items and all(item == items[0] for item in items):
            return types.NamedUniTuple(items[0], len(items), cls)
        return types.NamedTuple(tuple(items), cls)
    return time + arranged(component, part, given, bundle)


def _twin(record, dtype: np.dtype):
    """Numba's type of the same record with its numbers at multiples of their size; as it is, where they are not."""
    sizes = [number.base.itemsize for _, number, _, _ in leaves(dtype) if number.base.kind in "fiu"]
    if any(offset % number.base.itemsize for _, number, offset, _ in leaves(dtype) if number.base.kind in "fiu"):
        return record
    fields, end = [], record.size
    for name, found in record.fields.items():
        kind = found.type
        if dtype.fields[name][0].names:
            kind = _twin(kind, dtype.fields[name][0])
            end = max(end, found.offset + kind.size)
        fields.append((name, {"type": kind, "offset": found.offset}))
    widest = max(sizes, default=1)
    return type(record)(fields, -(-end // widest) * widest, True)  # a size that NumPy takes; nothing follows
