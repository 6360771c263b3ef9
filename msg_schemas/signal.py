"""Signals: records whose memory is the CDR body of a standard ROS 2 message.

A `Signal` is made from a message definition and the constant parts that fix its layout (frame ids, names, array
lengths). Its NumPy dtype carries the message's own field names (``imu.angular_velocity[0]``,
``odometry.pose.pose.position[2]``, ``header.stamp.sec``); groups x, y, z (w) of one float type read as arrays.
Publishing is sending the record's bytes behind the four-byte encapsulation header, receiving is copying them back.
"""

from dataclasses import dataclass, field

import numpy as np

from msg_schemas.body_layout import BodyLayout, leaves, record_dtype
from msg_schemas.definitions import deserialize
from msg_schemas.qos import Role

ENCAPSULATION = b"\x00\x01\x00\x00"  # CDR, little endian
_LITTLE_ENDIAN = ENCAPSULATION[:2]
LONGEST_VALUE = 16  # longer arrays of float64 are read by reference
TURNING = {"position": "rad", "velocity": "rad/s", "effort": "N m"}
ROUNDING = 1e-12  # [SI unit of the field] two values that differ by less are the same but for rounding


class SignalMismatch(ValueError):
    """A received message does not fit the signal that its topic carries."""


@dataclass(frozen=True)
class Quantity:
    """A named part of a float64 array: its length (None: a scalar), unit and meaning; whether it is a quaternion.

    floor: the difference [unit] below which two values count as the same where bags of different machines are compared;
    smaller than the default where the quantity itself is.
    """

    length: int | None
    unit: str
    doc: str = ""
    floor: float = ROUNDING
    quaternion: bool = False

    @property
    def count(self) -> int:
        return 1 if self.length is None else self.length


@dataclass(frozen=True, eq=False)
class Signal:
    """One kind of message on the wire.

    topic: default topic name, relative (``cubli/imu``). type_name: ROS type. role: key of the QoS table.
    fixed: constant parts by path: a string, a list of strings, or the length of a sequence.
    groups: named quantities of a float64 array, by path. may_be_nonfinite: field paths where inf or NaN has a meaning.
    units: of joints, by field; a JointState's type leaves them open (`TURNING`: joints that turn).
    The first field is the header (or the first element's header): every signal is stamped. ``values`` names the fields that
    kernels see as vectors and quaternions: (path, "Vec3" | "Quaternion" | length).
    """

    topic: str
    type_name: str
    role: Role
    fixed: dict = field(default_factory=dict)
    groups: dict = field(default_factory=dict)
    doc: str = ""
    may_be_nonfinite: tuple = ()
    units: dict = field(default_factory=dict)

    def __post_init__(self):
        for name in (name for parts in self.groups.values() for name in parts):
            if hasattr(np.record, name):
                raise ValueError(f"{self.topic}: '{name}' is an attribute of every NumPy record; take another name")
        layout = BodyLayout(self.type_name, dict(self.fixed), self.groups)
        size = len(layout.body)
        dtype = record_dtype(layout.fields, (size + 7) // 8 * 8)
        variable = np.zeros(size, bool)
        for _, _, start, length in leaves(dtype):
            variable[start:start + length] = True
        constant = ~variable
        constant[layout.padding] = False
        edges = np.flatnonzero(np.diff(np.concatenate(([0], constant.view("i1"), [0]))))
        segments = tuple((4 + a, 4 + b, bytes(layout.body[a:b])) for a, b in zip(edges[::2], edges[1::2]))
        for name, value in {
            "dtype": dtype, "size": size, "template": ENCAPSULATION + bytes(layout.body), "_segments": segments,
            "stamp_path": _stamp_path(self, dtype), "_payload_size": size + 4,
            "_constants": layout.constants, "values": tuple(_values(dtype, layout.quaternions)),
        }.items():
            object.__setattr__(self, name, value)

    # -- records -------------------------------------------------------------------------------------------------
    def new(self):
        """Return (payload, record): a uint8 view of header and body, and a (1,) record array over the body.

        The body starts on an 8-byte boundary, so that its float64 fields are aligned.
        """
        raw = np.zeros(self.dtype.itemsize // 8 + 1, "<f8").view("u1")[4:4 + 4 + self.dtype.itemsize]
        raw[:len(self.template)] = np.frombuffer(self.template, "u1")
        return raw[:self._payload_size], raw[4:].view(self.dtype)

    def zeros(self, count: int) -> np.ndarray:
        """Return a (count,) record array that already holds the constant bytes."""
        records = np.zeros(count, self.dtype)
        body = np.frombuffer(self.template[4:].ljust(self.dtype.itemsize, b"\0"), "u1")
        records.view("u1").reshape(count, self.dtype.itemsize)[:] = body
        return records

    def payloads(self, records: np.ndarray) -> np.ndarray:
        """Return the (count, 4 + size) uint8 wire form of a record array made by `zeros`."""
        raw = np.empty((len(records), self._payload_size), "u1")
        raw[:, :4] = np.frombuffer(ENCAPSULATION, "u1")
        raw[:, 4:] = np.ascontiguousarray(records).view("u1").reshape(len(records), self.dtype.itemsize)[:, :self.size]
        return raw

    # -- receipt -------------------------------------------------------------------------------------------------
    def receive(self, payload: bytes, target: np.ndarray) -> None:
        """Copy a received payload into ``target`` (the payload view of `new`). Raises SignalMismatch."""
        if self.fits(payload):
            target[4:] = np.frombuffer(payload, "u1", self.size, 4)
        else:
            self._receive_slowly(payload, target)

    def fits(self, payload: bytes) -> bool:
        """Whether a payload has this signal's byte order, constants and length; bytes behind the body mean nothing."""
        if len(payload) < self._payload_size or payload[:2] != _LITTLE_ENDIAN:
            return False
        for start, stop, constant in self._segments:
            if payload[start:stop] != constant:
                return False
        return True

    def _receive_slowly(self, payload, target):
        try:
            message = deserialize(payload, self.type_name)
        except Exception as error:
            raise SignalMismatch(
                f"topic '{self.topic}': {len(payload)} bytes that are no {self.type_name} ({error})"
            ) from error
        self._check_constants(message)
        raw, record = self.new()
        _fill(record[0], message, self, "")
        target[:] = raw

    def _check_constants(self, message):
        for path, expected in self._constants.items():
            value = message
            for part in path.split("."):
                value = (value[0] if isinstance(value, list) else value)
                value = getattr(value, part)
            found = len(value) if isinstance(expected, int) else list(value) if isinstance(expected, list) else value
            if found != (list(expected) if isinstance(expected, (list, tuple)) else expected):
                what = f"length {found}" if isinstance(expected, int) else repr(found)
                raise SignalMismatch(
                    f"topic '{self.topic}' ({self.type_name}): {path} is {what}, this signal has {expected!r}"
                )

    # -- comparison ----------------------------------------------------------------------------------------------
    @property
    def layout(self) -> tuple:
        """What two connected ports must share: type, bytes of the template, and dtype."""
        return self.type_name, self.template, self.dtype

    def differences(self, other: "Signal") -> list[tuple[str, str, str]]:
        """(what, here, there) for all that keeps two signals from being connected: type, constant parts, lengths."""
        if self.type_name != other.type_name:
            return [("the type", self.type_name, other.type_name)]
        paths = [path for path in {**self._constants, **other._constants}
                 if self._constants.get(path) != other._constants.get(path)]
        if paths:
            return [_difference(path, self._constants.get(path), other._constants.get(path)) for path in paths]
        mine, theirs = ({path: str(dtype) for path, dtype, _, _ in signal.leaves()} for signal in (self, other))
        return [(path, mine.get(path, "not there"), theirs.get(path, "not there"))
                for path in {**mine, **theirs} if mine.get(path) != theirs.get(path)]

    def leaves(self):
        """Yield (path, dtype, offset, length in bytes) of every numeric field of the record."""
        return leaves(self.dtype)

    def floor(self, column: str) -> float:
        """The floor of a column of its table (``position[angles[0]]``), in the field's SI unit."""
        field, _, label = column.partition("[")
        quantity = self.groups.get(field, {}).get(label.rstrip("]").partition("[")[0])
        return ROUNDING if quantity is None else quantity.floor

    def columns(self):
        """Yield (path, indices, label, quantity) of every named quantity: where it stands in a float64 array."""
        for path, parts in self.groups.items():
            start = 0
            for name, quantity in parts.items():
                yield path, range(start, start + quantity.count), name, quantity
                start += quantity.count


def _difference(path, mine, theirs):
    """How two constant parts differ: a text, a list of names, or a length."""
    if isinstance(mine, (list, tuple)) and isinstance(theirs, (list, tuple)) and len(mine) == len(theirs):
        index = next(i for i, names in enumerate(zip(mine, theirs)) if names[0] != names[1])
        return f"{path}[{index}]", repr(mine[index]), repr(theirs[index])
    return path, *(repr(value) if isinstance(value, str) else
                   f"{value if isinstance(value, int) else len(value or ())} long" for value in (mine, theirs))


def _values(dtype, quaternions):
    """Yield (path, kind) of the fields that a kernel sees as values: Vec3, Quaternion, or the length of a vector."""
    for path, field_type, _, _ in leaves(dtype):
        if field_type.base == np.dtype("<f8") and field_type.ndim == 1 and field_type.shape[0] <= LONGEST_VALUE:
            yield path, "Quaternion" if path in quaternions else "Vec3" if field_type.shape == (3,) else field_type.shape[0]


def _stamp_path(signal, dtype):
    first = dtype.names[0]
    if first == "header":
        return "header.stamp"
    sub = dtype.fields[first][0]
    if sub.names and sub.names[0] == "header":
        return f"{first}.header.stamp"
    raise ValueError(f"{signal.topic}: {signal.type_name} carries no header; a signal must be stamped")


def _fill(record, message, signal, prefix):
    """Copy the fields of a deserialised message into a record, by name."""
    for name in record.dtype.names:
        group = next((path for path, parts in signal.groups.items() if name in parts), None)
        if group is not None and not prefix:
            continue
        value = getattr(message, name)
        value = value[0] if isinstance(value, list) and record.dtype[name].names else value
        if record.dtype[name].names:
            _fill(record[name], value, signal, f"{prefix}{name}.")
        elif hasattr(value, "x"):
            record[name] = [getattr(value, axis) for axis in "xyzw"[:record.dtype[name].shape[0]]]
        else:
            record[name] = value
    if not prefix:
        for path, parts in signal.groups.items():
            values, start = getattr(message, path), 0
            for name, quantity in parts.items():
                record[name] = values[start] if quantity.length is None else values[start:start + quantity.length]
                start += quantity.count


def named_vector(topic: str, frame_id: str, quantities: dict, role: Role, doc: str = "", names=None) -> Signal:
    """A stamped float64 vector: a JointState whose names label the entries of ``position``.

    quantities: name -> Quantity. Entries of an array are labelled ``name[i]``. ``names`` replaces the labels.
    """
    labels = []
    for name, quantity in quantities.items():
        labels += [name] if quantity.length is None else [f"{name}[{i}]" for i in range(quantity.length)]
    labels = list(names) if names is not None else labels
    return Signal(
        topic, "sensor_msgs/msg/JointState", role,
        fixed={"header.frame_id": frame_id, "name": labels, "position": len(labels)},
        groups={"position": quantities}, doc=doc,
    )
