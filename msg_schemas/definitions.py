"""The standard ROS 2 Jazzy message definitions, without ROS: field trees, ros2msg texts and RIHS01 type hashes.

The source is the type store of the pure-Python package ``rosbags``.
"""

from dataclasses import dataclass
from functools import cache

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)


@dataclass(frozen=True)
class Definition:
    """One message type: name (``sensor_msgs/msg/Imu``), ros2msg text with all dependencies, RIHS01 hash, fields."""

    type_name: str
    text: str
    type_hash: str
    fields: tuple


@cache
def definition(type_name: str) -> Definition:
    """Return the definition of ``package/msg/Type``. Raises ValueError for an unknown name."""
    if type_name not in TYPESTORE.fielddefs:
        raise ValueError(f"'{type_name}' is not a message type of ROS 2 Jazzy's standard packages")
    text, _ = TYPESTORE.generate_msgdef(type_name, ros_version=2)
    return Definition(type_name, text, TYPESTORE.hash_rihs01(type_name), tuple(TYPESTORE.get_msgdef(type_name).fields))


def deserialize(payload: bytes, type_name: str):
    """A message object from its serialised form, of either byte order. Raises ValueError where there is none.

    Bytes behind the message are ignored, as CDR readers do: Fast DDS leaves some behind a message with empty sequences.
    """
    if len(payload) < 4 or payload[0] != 0 or payload[1] > 1:
        raise ValueError("no CDR encapsulation header")
    made = TYPESTORE.get_msgdef(type_name)
    read = made.deserialize_cdr_le if payload[1] else made.deserialize_cdr_be
    return read(payload[4:], 0, made.cls, TYPESTORE)[0]


__all__ = ["TYPESTORE", "Definition", "Nodetype", "definition", "deserialize"]
