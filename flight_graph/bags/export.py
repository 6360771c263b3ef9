"""Bags as tables: one CSV, Parquet or npz file a topic, with named and unit-labelled columns.

The first two columns are the log time: ``stamp [ns]`` (integer) and ``time [s]``. Then every field of the message in the
order of its definition: ``angular_velocity.x [rad/s]``, ``orientation_covariance[4] [rad^2]``, ``position[wheel_x]`` where
the message names its array entries. Strings are columns of text; sequences of varying length, and long arrays, are lists
(JSON in CSV and npz); the bytes of an image or a point cloud are one column of bytes (base64 in CSV).
"""

import base64
import csv
import hashlib
import io
import json
import re
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from flight_graph.bags.errors import BagError
from flight_graph.bags.fields import columns, definition_order, entry_names, named
from flight_graph.bags.message_types import vector_paths
from flight_graph.bags.reader import Bag, read_bag
from flight_graph.bags.units import field_units

FORMATS = ("csv", "parquet", "npz")
UNITS_RECORD = "units"  # a metadata record of this name maps "topic:column" to a unit
_LONGEST_NAME = 120  # characters of a file's name


@dataclass
class Exported:
    """What `export` wrote: topic -> file; and topic -> sentence of those that could not be written."""

    files: dict[str, Path] = field(default_factory=dict)
    problems: dict[str, str] = field(default_factory=dict)

    @property
    def paths(self) -> list[Path]:
        """The files that were written."""
        return list(self.files.values())


def table(bag: Bag, topic: str, units: dict | None = None) -> dict:
    """Return column label -> (n,) array of a topic. Raises BagError where it cannot be decoded.

    units: (topic, column name without unit) -> unit, beyond those of standard messages and of the bag's own metadata
    record 'units' (keys "topic:column").
    """
    info = bag.topic(topic)
    trees = bag.field_trees(topic)
    array, stamps = bag[topic], bag.stamps_ns(topic)
    known = field_units(trees, info.type_name)
    own = {tuple(key.split(":", 1)): unit for key, unit in bag.metadata.get(UNITS_RECORD, {}).items()}
    own.update(units or {})
    names = entry_names(bag, topic)
    vectors = vector_paths(trees, info.type_name)
    order = definition_order(trees, info.type_name)
    found = [*_constant_columns(bag, topic, len(stamps)), *columns(array, lambda path, length: path in vectors)]
    result = {"stamp [ns]": stamps, "time [s]": stamps / 1e9}
    for name, path, values in sorted(found, key=lambda column: order.get(column[1], len(order))):
        name = named(name, names)
        unit = own.get((topic, name)) or known.get(path, "")
        result[f"{name} [{unit}]" if unit else name] = values
    return result


def _constant_columns(bag, topic, count):
    """Yield (name, path without indices, values) of the strings, and of the empty sequences, that all messages share."""
    for name, value in bag.constants(topic).items():
        value = [] if value == 0 else value
        if not isinstance(value, int):  # another length shows in the columns themselves
            values = np.empty(count, object)
            values[:] = [value] * count
            yield name, re.sub(r"\[\d+\]", "", name), values


def export(bag, out_dir, to: str = "csv", topics=None, units: dict | None = None) -> Exported:
    """Write one file a topic below ``out_dir``. A topic that cannot be read is named and leaves the others alone.

    bag: path or `Bag`. Raises BagError where nothing can be written at all.
    """
    if to not in FORMATS:
        raise BagError(f"tables are written as {', '.join(FORMATS)}; not as '{to}'")
    bag = bag if isinstance(bag, Bag) else read_bag(bag)
    names = [bag.topic(topic).name for topic in topics] if topics is not None else list(bag.topics)
    out_dir, done = Path(out_dir), Exported()
    write = {"csv": _write_csv, "parquet": _write_parquet, "npz": _write_npz}[to]
    try:
        out_dir.mkdir(parents=True, exist_ok=True)
        for topic in names:
            path = out_dir / f"{_file_name(topic, {file.stem for file in done.paths})}.{to}"
            try:
                content = table(bag, topic, units)
                path.unlink(missing_ok=True)  # what lies there may be a link to a file elsewhere
                write(path, content)
            except BagError as error:
                done.problems[topic] = str(error)
            else:
                done.files[topic] = path
    except OSError as error:
        raise BagError(f"tables cannot be written to '{out_dir}': {(error.strerror or str(error)).lower()}") from error
    return done


def _file_name(topic, taken):
    """A topic's name as that of a file, on any system: ``cubli.imu``; what another topic has already gets a digest."""
    name = re.sub(r"[^A-Za-z0-9_.~-]", "_", topic.strip("/").replace("/", ".")).lstrip(".") or "topic"
    if len(name) > _LONGEST_NAME or name.lower() in {other.lower() for other in taken}:
        name = f"{name[:_LONGEST_NAME]}-{hashlib.sha256(topic.encode()).hexdigest()[:8]}"
    return name


def _write_csv(path, result):
    texts = [[_text(value) for value in values] if values.dtype.kind in "OV" else values.tolist()
             for values in result.values()]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(result)
        writer.writerows(zip(*texts))


def _write_parquet(path, result):
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table([_arrow(pyarrow, values) for values in result.values()], names=list(result)), path)


def _arrow(pyarrow, values):
    if values.dtype.kind == "V":
        return pyarrow.array([value.tobytes() for value in values], pyarrow.binary())
    if values.dtype != object:
        return pyarrow.array(np.ascontiguousarray(values.astype(values.dtype.newbyteorder("="), copy=False)))
    if any(_is_bytes(value) for value in values):
        return pyarrow.array([np.asarray(value, np.uint8).tobytes() for value in values], pyarrow.binary())
    kinds = {value.dtype for value in values if isinstance(value, np.ndarray) and value.dtype.kind in "fiub"}
    if len(kinds) == 1 and all(isinstance(value, np.ndarray) and value.ndim == 1 for value in values):
        return pyarrow.array(list(values))
    return pyarrow.array([_text(value) for value in values], pyarrow.string())


def _write_npz(path, result):
    """As np.savez does, which takes no column of the name ``file``."""
    with zipfile.ZipFile(path, "w", allowZip64=True) as archive:
        for name, values in result.items():
            if values.dtype == object:
                values = np.array([_text(value) for value in values], dtype=str)
            content = io.BytesIO()
            np.lib.format.write_array(content, np.ascontiguousarray(values), allow_pickle=False)
            archive.writestr(f"{name}.npy", content.getvalue())


def _is_bytes(value):
    return isinstance(value, np.ndarray) and value.dtype in (np.uint8, np.int8)


def _text(value):
    """A decoded value as text: strings as they are, bytes in base64, all else as JSON."""
    if isinstance(value, str):
        return value
    if _is_bytes(value) or (isinstance(value, np.void) and value.dtype.names is None):
        return base64.b64encode(value.tobytes()).decode()
    return json.dumps(_plain(value))


def _plain(value):
    """A decoded value as JSON knows it."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        return [_plain(row) for row in value]
    if isinstance(value, np.void):
        return {name: _plain(value[name]) for name in value.dtype.names}
    if isinstance(value, (np.ndarray, list)):
        return [_plain(entry) for entry in value]
    return value.item() if isinstance(value, np.generic) else value
