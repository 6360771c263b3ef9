"""Transforms between frames as messages for /tf and /tf_static."""

from msg_schemas.definitions import TYPESTORE

TYPE = "tf2_msgs/msg/TFMessage"
NOWHERE, UNTURNED = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)


def header(stamp, frame: str):
    """A std_msgs/Header of a record's stamp."""
    types = TYPESTORE.types
    time = types["builtin_interfaces/msg/Time"](int(stamp.sec), int(stamp.nanosec))
    return types["std_msgs/msg/Header"](time, frame)


def transforms(stamp, *found):
    """A TFMessage of (parent, child, translation [m], quaternion x, y, z, w that turns child axes into parent axes)."""
    types = TYPESTORE.types
    return types[TYPE]([
        types["geometry_msgs/msg/TransformStamped"](header(stamp, parent), child, types["geometry_msgs/msg/Transform"](
            types["geometry_msgs/msg/Vector3"](*map(float, translation)),
            types["geometry_msgs/msg/Quaternion"](*map(float, rotation))))
        for parent, child, translation, rotation in found])
