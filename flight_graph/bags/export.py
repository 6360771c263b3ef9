"""Bags as tables: one CSV, Parquet or npz file a topic, with named and unit-labelled columns.

The first two columns are the log time: ``stamp [ns]`` (integer) and ``time [s]``. Then every number of the message:
``angular_velocity.x [rad/s]``, ``orientation_covariance[4] [rad^2]``, ``position[wheel_x]`` where the message names its
array entries. Strings and sequences of varying length are columns of text in CSV and Parquet (JSON for sequences).
"""

import csv
import json
from pathlib import Path

import numpy as np

from flight_graph.bags.errors import BagError
from flight_graph.bags.fields import columns, entry_names, named
from flight_graph.bags.message_types import vector_paths
from flight_graph.bags.reader import Bag, read_bag
from flight_graph.bags.units import field_units

FORMATS = ("csv", "parquet", "npz")
UNITS_RECORD = "units"  # a metadata record of this name maps "topic:column" to a unit


def table(bag: Bag, topic: str, units: dict | None = None) -> dict:
    """Return column label -> (n,) array of a topic.

    units: (topic, column name without unit) -> unit, beyond those of standard messages and of the bag's own metadata
    record 'units' (keys "topic:column").
    """
    info = bag.topic(topic)
    array, stamps = bag[topic], bag.stamps_ns(topic)
    trees = bag.field_trees(topic)
    known = field_units(trees, info.type_name)
    own = {tuple(key.split(":", 1)): unit for key, unit in bag.metadata.get(UNITS_RECORD, {}).items()}
    own.update(units or {})
    names = entry_names(bag, topic)
    vectors = vector_paths(trees, info.type_name)
    result = {"stamp [ns]": stamps, "time [s]": stamps / 1e9}
    for name, path, values in columns(array, lambda path, length: path in vectors):
        name = named(name, names)
        unit = own.get((topic, name)) or known.get(path, "")
        result[f"{name} [{unit}]" if unit else name] = values
    return result


def export(bag, out_dir, to: str = "csv", topics=None, units: dict | None = None) -> list:
    """Write one file a topic below ``out_dir``; return their paths. bag: path or `Bag`. Raises BagError."""
    if to not in FORMATS:
        raise BagError(f"tables are written as {', '.join(FORMATS)}; not as '{to}'")
    bag = bag if isinstance(bag, Bag) else read_bag(bag)
    out_dir = Path(out_dir)
    paths = []
    try:
        out_dir.mkdir(parents=True, exist_ok=True)
        for topic in topics if topics is not None else bag.topics:
            path = out_dir / f"{topic.strip('/').replace('/', '.')}.{to}"
            {"csv": _write_csv, "parquet": _write_parquet, "npz": _write_npz}[to](path, table(bag, topic, units))
            paths.append(path)
    except OSError as error:
        raise BagError(f"tables cannot be written to '{out_dir}': {(error.strerror or str(error)).lower()}") from error
    return paths


def _write_csv(path, result):
    texts = [_texts(values) for values in result.values()]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(result)
        writer.writerows(zip(*texts))


def _texts(values):
    return [_json(value) for value in values] if values.dtype == object else values.tolist()


def _write_parquet(path, result):
    import pyarrow
    from pyarrow import parquet

    arrays = [pyarrow.array(_texts(values) if values.dtype == object else np.ascontiguousarray(values))
              for values in result.values()]
    parquet.write_table(pyarrow.table(arrays, names=list(result)), path)


def _write_npz(path, result):
    np.savez(path, **{name: np.array(_texts(values), dtype=str) if values.dtype == object else values
                      for name, values in result.items()})


def _json(value):
    return value if isinstance(value, str) else json.dumps(_plain(value))


def _plain(value):
    """A decoded value as JSON knows it."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        return [_plain(row) for row in value]
    if isinstance(value, np.void):
        return {name: _plain(value[name]) for name in value.dtype.names}
    if isinstance(value, (np.ndarray, list)):
        return [_plain(entry) for entry in value]
    return value.item() if isinstance(value, np.generic) else value
