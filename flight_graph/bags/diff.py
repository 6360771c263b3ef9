"""Comparing two bags topic by topic: equal bytes, or where and by how much they differ."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from flight_graph.bags.fields import columns, entry_names, named
from flight_graph.bags.message_types import vector_paths
from flight_graph.bags.reader import Bag, read_bag


@dataclass(frozen=True)
class FirstDifference:
    """The first message that differs. field: dotted path, 'stamp' (log time [ns]) or 'padding' (no value differs)."""

    index: int
    stamp_ns: int
    field: str
    value_a: object
    value_b: object


@dataclass(frozen=True)
class FieldDifference:
    """Largest differences of a column over all common messages; relative to the larger magnitude of the two."""

    absolute: float
    relative: float


@dataclass(frozen=True)
class TopicDifference:
    """The comparison of one topic. counts None: the topic is missing in that bag."""

    topic: str
    count_a: int | None
    count_b: int | None
    equal: bool  # same stamps and payload bytes
    same_values: bool  # equal, or different in padding bytes only
    first: FirstDifference | None = None
    fields: dict = field(default_factory=dict)  # column -> FieldDifference, of those that differ
    remark: str = ""

    def __str__(self):
        if self.equal:
            return f"{self.topic}: equal ({self.count_a} messages, byte for byte)"
        if self.remark:
            return f"{self.topic}: {self.remark}"
        parts = [] if self.count_a == self.count_b else [f"{self.count_a} and {self.count_b} messages"]
        if self.same_values and self.first is not None:
            parts.append("equal values; padding bytes differ")
        elif self.first is not None:
            parts.append(f"first difference at {seconds_text(self.first.stamp_ns)} s (message {self.first.index}): "
                         f"{self.first.field} {_short(self.first.value_a)} and {_short(self.first.value_b)}")
            worst = max(self.fields.items(), key=lambda item: item[1].relative, default=None)
            if worst is not None:
                parts.append(f"largest relative difference {worst[1].relative:.3g} ({worst[0]}, "
                             f"absolute {worst[1].absolute:.3g})")
        return f"{self.topic}: " + "; ".join(parts)


def seconds_text(stamp_ns: int) -> str:
    """A stamp in seconds, to the nanosecond."""
    return f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09d}"


def _short(value) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 100 else text[:97] + "..."


def diff(bag_a, bag_b, topics=None) -> list:
    """Compare two bags (paths or `Bag`); return one `TopicDifference` for each topic of either."""
    a, b = (bag if isinstance(bag, Bag) else read_bag(Path(bag)) for bag in (bag_a, bag_b))
    names = list(topics) if topics is not None else list(dict.fromkeys([*a.topics, *b.topics]))
    return [_compare(a, b, name) for name in names]


def _compare(a, b, topic):
    count_a, count_b = (bag.topics[topic].count if topic in bag else None for bag in (a, b))
    if count_a is None or count_b is None:
        missing = (a if count_a is None else b).path
        return TopicDifference(topic, count_a, count_b, False, False, remark=f"missing in '{missing}'")
    types = a.topics[topic].type_name, b.topics[topic].type_name
    if types[0] != types[1]:
        return TopicDifference(topic, count_a, count_b, False, False, remark=f"{types[0]} and {types[1]}")
    common = min(count_a, count_b)
    stamps_a, stamps_b = a.stamps_ns(topic)[:common], b.stamps_ns(topic)[:common]
    wrong = (stamps_a != stamps_b) | _bytes_differ(a.payloads(topic), b.payloads(topic), common)
    if not wrong.any():
        same = count_a == count_b
        return TopicDifference(topic, count_a, count_b, same, same)
    differences, first = _compare_values(a, b, topic, common)
    wrong_stamps = np.flatnonzero(stamps_a != stamps_b)
    if len(wrong_stamps) and (first is None or wrong_stamps[0] <= first[0]):
        index = int(wrong_stamps[0])
        first = (index, "stamp", int(stamps_a[index]), int(stamps_b[index]))
    same_values = first is None
    if same_values:
        first = (int(np.flatnonzero(wrong)[0]), "padding", None, None)
    return TopicDifference(
        topic, count_a, count_b, False, same_values and count_a == count_b,
        FirstDifference(first[0], int(stamps_a[first[0]]), *first[1:]), differences)


def _bytes_differ(a, b, common):
    """Return (common,) bool."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        if a.shape[1] != b.shape[1]:
            return np.ones(common, bool)
        return (a[:common] != b[:common]).any(axis=1)
    return np.array([bytes(x) != bytes(y) for x, y in zip(a[:common], b[:common])], bool)


def _compare_values(a, b, topic, common):
    """`_compare_fields` of two topics; strings and lengths that are constant in both bags count as fields."""
    vectors = vector_paths(a.field_trees(topic), a.topic(topic).type_name)
    layouts = a.layout(topic), b.layout(topic)
    if None in layouts or layouts[0].dtype != layouts[1].dtype:
        return _compare_fields(a.decoded(topic)[:common], b.decoded(topic)[:common], vectors)
    found, first = _compare_fields(a[topic][:common], b[topic][:common], vectors, entry_names(a, topic))
    for path in dict.fromkeys([*layouts[0].constants, *layouts[1].constants]):
        values = [layout.constants.get(path) for layout in layouts]
        if values[0] != values[1]:
            found[path] = FieldDifference(np.inf, np.inf)
            first = (0, path, *values) if first is None or first[0] > 0 else first
    return found, first


def _compare_fields(a, b, vectors, names=()):
    """Return ({column: FieldDifference}, (index, column, value a, value b) of the first difference or None)."""
    found, first = {}, None
    columns_a, columns_b = (
        {named(name, names): values for name, _, values in columns(array, lambda path, length: path in vectors)}
        for array in (a, b))
    for name in dict.fromkeys([*columns_a, *columns_b]):
        if name not in columns_a or name not in columns_b:
            wrong, found[name] = np.ones(len(a), bool), FieldDifference(np.inf, np.inf)
        else:
            wrong, found_here = _compare_column(columns_a[name], columns_b[name])
            if found_here is None:
                continue
            found[name] = found_here
        index = int(np.flatnonzero(wrong)[0])
        if first is None or index < first[0]:
            values = [_plain(values[name][index]) if name in values else None for values in (columns_a, columns_b)]
            first = (index, name, *values)
    return found, first


def _compare_column(a, b):
    if a.dtype == object or b.dtype == object or a.dtype.kind != b.dtype.kind == "V":
        wrong = np.array([not _same(x, y) for x, y in zip(a, b)], bool)
        if not wrong.any():
            return wrong, None
        gaps = np.array([_gap(x, y) for x, y in zip(a[wrong], b[wrong])], float)
        return wrong, FieldDifference(float(gaps[:, 0].max()), float(gaps[:, 1].max()))
    wrong = a != b
    if a.dtype.kind == "V":
        return wrong, FieldDifference(np.inf, np.inf) if wrong.any() else None
    if a.dtype.kind == "f":
        wrong &= ~(np.isnan(a) & np.isnan(b))
        wrong |= (a == 0) & (np.signbit(a) != np.signbit(b))
    if not wrong.any():
        return wrong, None
    if a.dtype.kind in "iu":
        gap = np.array([abs(int(x) - int(y)) for x, y in zip(a[wrong], b[wrong])], float)
    else:
        with np.errstate(invalid="ignore", over="ignore"):
            gap = np.abs(a[wrong].astype(float) - b[wrong].astype(float))
    gap[np.isnan(gap)] = np.inf
    size = np.fmax(np.abs(a[wrong].astype(float)), np.abs(b[wrong].astype(float)))
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = np.where(gap == 0, 0.0, np.where(np.isinf(gap), np.inf, gap / size))
    return wrong, FieldDifference(float(gap.max()), float(relative.max()))


def _same(x, y):
    if isinstance(x, np.ndarray) and isinstance(y, np.ndarray):
        if x.shape != y.shape or x.dtype != y.dtype:
            return False
        if x.dtype.names:
            return all(_same(x[name], y[name]) for name in x.dtype.names)
        if x.dtype == object:
            return all(_same(p, q) for p, q in zip(x.ravel(), y.ravel()))
        return x.tobytes() == y.tobytes()
    if isinstance(x, list) and isinstance(y, list):
        return len(x) == len(y) and all(_same(p, q) for p, q in zip(x, y))
    return type(x) is type(y) and x == y


def floats(value):
    """Yield every float of a decoded value, structures and lists walked through, as arrays."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        for name in value.dtype.names:
            yield from floats(value[name])
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
        yield value.astype(float).ravel()
    elif isinstance(value, list) or isinstance(value, np.ndarray) and value.dtype == object:
        for entry in value:
            yield from floats(entry)


def _gap(x, y):
    """(absolute, relative) difference of two decoded values that differ in floats alone; infinite where in more."""
    left, right = list(floats(x)), list(floats(y))
    if [part.shape for part in left] != [part.shape for part in right] or not _same(_without_floats(x), _without_floats(y)):
        return np.inf, np.inf
    left, right = np.concatenate(left or [np.empty(0)]), np.concatenate(right or [np.empty(0)])
    if not np.array_equal(np.isfinite(left), np.isfinite(right)):
        return np.inf, np.inf
    gap, size = np.abs(left - right), np.fmax(np.abs(left), np.abs(right))
    where = gap > 0
    return (float(gap.max(initial=0.0)), float((gap[where] / size[where]).max(initial=0.0)))


def _without_floats(value):
    """A decoded value with its floats left out."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        return [_without_floats(value[name]) for name in value.dtype.names]
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        return value.shape
    if isinstance(value, list) or isinstance(value, np.ndarray) and value.dtype == object:
        return [_without_floats(entry) for entry in value]
    return value


def _plain(value):
    return value.item() if isinstance(value, np.generic) else value
