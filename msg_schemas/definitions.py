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
    text, type_hash = TYPESTORE.generate_msgdef(type_name, ros_version=2)
    return Definition(type_name, text, type_hash, tuple(TYPESTORE.get_msgdef(type_name).fields))


__all__ = ["TYPESTORE", "Definition", "Nodetype", "definition"]
