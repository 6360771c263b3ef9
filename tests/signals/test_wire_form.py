"""Signals against rclpy's own serialiser: the same bytes, padding aside, for every signal of every vehicle."""

import array
import importlib
import json
import os
import pkgutil
import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import msg_schemas
from msg_schemas.definitions import TYPESTORE, definition
from msg_schemas.signal import Signal, SignalMismatch

pytest.importorskip("rclpy")
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402

SPECIAL = np.array([  # bits of float64: NaNs with payloads, infinities, subnormals, zeros, extremes
    0x7FF8000000000000, 0xFFF8000000000001, 0x7FF8DEADBEEFCAFE, 0x7FF0000000000001, 0x7FF0000000000000,
    0xFFF0000000000000, 0x0000000000000001, 0x800FFFFFFFFFFFFF, 0x8000000000000000, 0, 0x7FEFFFFFFFFFFFFF,
], np.uint64).view(np.float64)
STAMPS = [(-2**31, 0), (2**31 - 1, 2**32 - 1), (0, 0), (0, 1), (946728000, 999_999_999)]
SIZES = {"boolean": 1, "octet": 1, "uint8": 1, "int8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float": 4,
         "int64": 8, "uint64": 8, "double": 8}


def vehicles():
    names = [info.name for info in pkgutil.iter_modules(msg_schemas.__path__)]
    return [importlib.import_module(f"msg_schemas.{name}") for name in names]


SIGNALS = {f"{module.__name__.partition('.')[2]}.{name}": value
           for module in vehicles() for name, value in sorted(vars(module).items()) if isinstance(value, Signal)}
every_signal = pytest.mark.parametrize("signal", SIGNALS.values(), ids=SIGNALS.keys())


def message_class(type_name):
    package, _, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def random_record(signal, generator, stamp):
    """A payload and its record, filled with random bits and special values, with the given stamp."""
    payload, record = signal.new()
    for _, dtype, offset, length in signal.leaves():
        target = record.view("u1")[offset:offset + length]
        if dtype.base.kind == "f":
            count = length // dtype.base.itemsize
            bits = np.frombuffer(generator.bytes(8 * count), np.float64).copy()
            chosen = generator.random(count) < 0.4
            bits[chosen] = generator.choice(SPECIAL, chosen.sum())
            with np.errstate(all="ignore"):
                target[:] = bits.astype(dtype.base).view("u1")
        elif dtype.base.kind == "b":
            target[:] = generator.integers(0, 2, length)
        else:
            target[:] = np.frombuffer(generator.bytes(length), "u1")
    header = record
    for part in signal.stamp_path.split("."):
        header = header[part]
    header["sec"], header["nanosec"] = stamp
    return payload, record


def ros_message(signal, record):
    """An rclpy message with the record's values, filled by the message's own field names and the constant parts."""
    message = message_class(signal.type_name)()
    groups = {path: np.concatenate([np.atleast_1d(record[0][name]) for name in parts])
              for path, parts in signal.groups.items()}
    _fill(message, signal.type_name, record[0], "", signal.fixed, groups)
    return message


def _fill(message, type_name, values, prefix, fixed, groups):
    for name, ros_type in message.get_fields_and_field_types().items():
        path = f"{prefix}{name}"
        current = getattr(message, name)
        if path in groups:
            setattr(message, name, array.array("d", groups[path].tobytes()))
        elif isinstance(fixed.get(path), (str, list)):
            setattr(message, name, fixed[path])
        elif values is None or name not in (values.dtype.names or ()):
            if hasattr(current, "get_fields_and_field_types"):
                _fill(current, ros_type, None, f"{path}.", fixed, groups)
        elif hasattr(current, "get_fields_and_field_types"):
            axes = list(current.get_fields_and_field_types())
            if axes in (["x", "y", "z"], ["x", "y", "z", "w"]) and not values[name].dtype.names:
                for axis, number in zip(axes, values[name]):
                    setattr(current, axis, float(number))
            else:
                _fill(current, ros_type, values[name], f"{path}.", fixed, groups)
        elif isinstance(current, np.ndarray):
            current[:] = values[name]
        elif isinstance(current, array.array):
            setattr(message, name, array.array(current.typecode, np.asarray(values[name]).tobytes()))
        elif isinstance(current, list) and values[name].dtype.names:  # a sequence of one structure
            element = message_class(ros_type.replace("sequence<", "").rstrip(">").replace("/", "/msg/"))()
            _fill(element, ros_type, values[name], f"{path}.", fixed, groups)
            setattr(message, name, [element])
        else:
            setattr(message, name, values[name].tolist())


def data_bytes(message, start=0):
    """Mark which bytes of the CDR body carry data (False: padding), by the CDR rules, from an rclpy message."""
    mask = [False] * start

    def align(size):
        mask.extend([False] * (-len(mask) % size))

    def number(size, count=1):
        if count:
            align(size)
        mask.extend([True] * (size * count))

    def text(value):
        number(4)
        number(1, len(value.encode()) + 1)

    def walk(item):
        for name, ros_type in item.get_fields_and_field_types().items():
            value = getattr(item, name)
            if ros_type.startswith("sequence<"):
                number(4)
                ros_type = ros_type[len("sequence<"):-1].partition(",")[0]
            ros_type = ros_type.partition("[")[0]
            many = value if isinstance(value, (list, array.array, np.ndarray)) else [value]
            if ros_type in SIZES:
                number(SIZES[ros_type], len(many))
            else:
                for element in many:
                    text(element) if isinstance(element, str) else walk(element)

    walk(message)
    return np.array(mask)


def test_every_vehicle_has_signals():
    assert {name.partition(".")[0] for name in SIGNALS} >= {"cubli"}
    assert len(SIGNALS) >= 11


@every_signal
def test_bytes_equal_those_of_rclpy(signal):
    """The record's memory is what rclpy would send, for random bits, special floats and the extreme stamps."""
    generator = np.random.default_rng(sum(signal.topic.encode()))
    for stamp in STAMPS + [(int(generator.integers(-2**31, 2**31)), int(generator.integers(0, 2**32)))] * 5:
        payload, record = random_record(signal, generator, stamp)
        message = ros_message(signal, record)
        sent = np.frombuffer(serialize_message(message), "u1")
        mask = np.concatenate((np.ones(4, bool), data_bytes(message)))
        assert len(mask) == len(payload) and len(payload) <= len(sent) <= len(payload) + 16  # undefined bytes may follow
        np.testing.assert_array_equal(payload[mask], sent[:len(mask)][mask])
        again, back = signal.new()
        signal.receive(sent.tobytes(), again)
        np.testing.assert_array_equal(again[mask], payload[mask])
        rclpy_reads = deserialize_message(payload.tobytes(), message_class(signal.type_name))
        np.testing.assert_array_equal(np.frombuffer(serialize_message(rclpy_reads), "u1")[:len(mask)][mask], sent[:len(mask)][mask])


@every_signal
def test_batches_have_the_same_bytes(signal):
    """`zeros` and `payloads`, the recording's path, give what `new` gives."""
    generator = np.random.default_rng(1)
    records, expected = signal.zeros(3), []
    for i in range(3):
        payload, record = random_record(signal, generator, STAMPS[i])
        records[i:i + 1] = record
        expected.append(payload.tobytes())
    assert [bytes(row) for row in signal.payloads(records)] == expected


@every_signal
def test_big_endian_is_understood(signal):
    """A sender with the other byte order is deserialised the ordinary way."""
    payload, record = random_record(signal, np.random.default_rng(2), STAMPS[-1])
    message = TYPESTORE.deserialize_cdr(payload.tobytes(), signal.type_name)
    big = bytes(TYPESTORE.serialize_cdr(message, signal.type_name, little_endian=False))
    assert big[:2] == b"\x00\x00"
    received, _ = signal.new()
    signal.receive(big, received)
    mask = np.concatenate((np.ones(4, bool), data_bytes(ros_message(signal, record))))
    np.testing.assert_array_equal(received[mask], payload[mask])


@every_signal
def test_other_constants_are_refused(signal):
    """Another frame, other names, other lengths: a sentence that names the topic, the field, and both values."""
    _, record = random_record(signal, np.random.default_rng(3), STAMPS[-1])
    tried = 0
    for path, constant in signal.fixed.items():
        if not isinstance(constant, (str, list)):
            continue
        other = "elsewhere" if isinstance(constant, str) else [*constant[:-1], "elsewhere"]
        for changed in (other, "" if isinstance(constant, str) else [*constant, "one more"]):
            message = ros_message(signal, record)
            owner = message
            *parents, last = path.split(".")
            for part in parents:
                owner = owner[0] if isinstance(owner, list) else owner
                owner = getattr(owner, part)
            setattr(owner[0] if isinstance(owner, list) else owner, last, changed)
            target = signal.new()[0]
            before = target.copy()
            with pytest.raises(SignalMismatch) as refused:
                signal.receive(bytes(serialize_message(message)), target)
            assert signal.topic in str(refused.value) and path in str(refused.value), refused.value
            assert repr(changed) in str(refused.value) and repr(constant) in str(refused.value), refused.value
            np.testing.assert_array_equal(target, before)
            tried += 1
    assert tried


@pytest.mark.parametrize("name", [n for n, s in SIGNALS.items() if s.type_name == "sensor_msgs/msg/JointState"])
def test_other_lengths_are_refused(name):
    """A JointState with one array too long, too short or empty."""
    signal = SIGNALS[name]
    _, record = random_record(signal, np.random.default_rng(4), STAMPS[-1])
    for field in ("position", "velocity", "effort"):
        right = len(getattr(ros_message(signal, record), field))
        for length in {right + 1, right + 3, max(0, right - 1), 0} - {right}:
            message = ros_message(signal, record)
            setattr(message, field, [1.0] * length)
            with pytest.raises(SignalMismatch, match=signal.topic):
                signal.receive(bytes(serialize_message(message)), signal.new()[0])


@every_signal
def test_truncated_payloads_are_refused(signal):
    payload = random_record(signal, np.random.default_rng(5), STAMPS[-1])[0].tobytes()
    target = signal.new()[0]
    before = target.copy()
    for length in sorted({*range(0, min(len(payload), 60)), *range(60, len(payload), 17), len(payload) - 1}):
        with pytest.raises(SignalMismatch):
            signal.receive(payload[:length], target)
    np.testing.assert_array_equal(target, before)


@every_signal
def test_garbage_is_refused(signal):
    """Random bytes, random bytes behind a good header, another encapsulation: never another exception."""
    generator = random.Random(6)
    payload = random_record(signal, np.random.default_rng(7), STAMPS[-1])[0].tobytes()
    target = signal.new()[0]
    for _ in range(40):
        garbage = generator.randbytes(generator.choice([5, 20, len(payload), len(payload) + 40]))
        for sent in (garbage, payload[:4] + garbage, b"\0\0\0\0" + garbage):
            with pytest.raises(SignalMismatch):
                signal.receive(sent, target)
    for head in (b"\x00\x03\x00\x00", b"\x00\x07\x00\x00", b"\x17\x01\x00\x00"):
        with pytest.raises(SignalMismatch):
            signal.receive(head + payload[4:], target)

TYPES = sorted({signal.type_name for signal in SIGNALS.values()} | {
    "rosgraph_msgs/msg/Clock", "diagnostic_msgs/msg/DiagnosticArray"})


@pytest.mark.parametrize("type_name", TYPES)
def test_type_hashes_equal_those_of_the_ros_packages(type_name):
    """RIHS01 of the definitions against share/<package>/msg/<Type>.json of the installed ROS packages."""
    package, _, name = type_name.split("/")
    prefixes = [*filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]
    files = [Path(prefix) / "share" / package / "msg" / f"{name}.json" for prefix in prefixes]
    described = json.loads(next(path for path in files if path.is_file()).read_text())
    hashes = {entry["type_name"]: entry["hash_string"] for entry in described["type_hashes"]}
    assert definition(type_name).type_hash == hashes[type_name]


def test_everything_but_the_nodes_works_without_rclpy(tmp_path):
    """In an interpreter that cannot import ROS, signals pack and unpack and a scenario is validated."""
    code = """
import sys
from importlib.machinery import PathFinder
find = PathFinder.find_spec
ROS = ('rclpy', 'sensor_msgs', 'geometry_msgs', 'std_msgs', 'rosgraph_msgs', 'rcl_interfaces')
PathFinder.find_spec = lambda name, *more: None if name.split('.')[0] in ROS else find(name, *more)
from msg_schemas import cubli
from flight_graph.engines import compiled
from flight_graph.recordings import recording
from flight_graph.components import registry
from flight_graph import runs
from flight_graph.graphs import scenario
from flight_graph.cli import app
payload, record = cubli.IMU.new()
record['angular_velocity'][0] = 1, 2, 3
again, back = cubli.IMU.new()
cubli.IMU.receive(payload.tobytes(), again)
assert back['angular_velocity'][0].tolist() == [1, 2, 3]
assert scenario.load('cubli_asteroid').graph.order and registry.components()
try:
    runs.execute(scenario.load('cubli_asteroid'), 'ros', out=__import__('pathlib').Path(sys.argv[1]))
except ValueError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "bag"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "the ros engine needs rclpy" in done.stdout and "install" in done.stdout
