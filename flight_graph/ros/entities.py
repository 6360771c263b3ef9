"""What moves in a run: each component of the truth that publishes a true pose, as an entity with the newest one.

An odometry carries pose and velocities; of a pose alone, velocities are not known (NaN).
"""

import re
from dataclasses import dataclass
from math import nan

from rclpy.serialization import deserialize_message

from flight_graph.errors import FlightError
from flight_graph.ros.ports import LoopOnly, RawSubscription
from flight_math import Quaternion, Vec3, rotate
from msg_schemas.qos import Qos, Role

ODOMETRY, POSE = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"
_NEWEST = Qos(depth=1)


@dataclass(frozen=True)
class Motion:
    """Where an entity is. header: of the message; pose: geometry_msgs/Pose; linear [m/s], angular [rad/s]: in the frame of
    the header, None: not known.
    """

    header: object
    pose: object
    linear: tuple | None
    angular: tuple | None


class Entities:
    """The entities of a graph: name -> what it is, and the reader of its pose."""

    def __init__(self, node, graph):
        self.about, self._readers, self._newest, group = {}, {}, {}, LoopOnly()
        for found in graph.nodes.values():
            signal = _pose_of(found)
            if signal is not None:
                self.about[found.name] = found.component.summary()
                self._readers[found.name] = RawSubscription(node, signal.topic, signal.type_name, _NEWEST, group)

    def matching(self, expression: str) -> list[str]:
        """The names in which a regular expression is found; all for an empty one. Raises FlightError."""
        try:
            pattern = re.compile(expression)
        except re.error as error:
            raise FlightError(f"'{expression}' is no regular expression: {error}") from None
        return [name for name in self.about if pattern.search(name)]

    def motion(self, name: str) -> Motion | None:
        """The newest pose of an entity; None: none has come. Called by one thread at a time."""
        reader = self._readers[name]
        while (message := reader.take()) is not None:
            self._newest[name] = bytes(message)
        if name not in self._newest:
            return None
        message = deserialize_message(self._newest[name], reader.message_type)
        if reader.type_name == POSE:
            return Motion(message.header, message.pose, None, None)
        pose, twist = message.pose.pose, message.twist.twist
        return Motion(message.header, pose, _turned(pose, twist.linear), _turned(pose, twist.angular))


def _pose_of(node):
    """The output of a component that says where it truly is; None where there is none."""
    if node.component.update is None:
        return None
    truth = [signal for signal in node.component.outputs.values() if signal.role is Role.TRUTH]
    return next((signal for wanted in (ODOMETRY, POSE) for signal in truth if signal.type_name == wanted), None)


def _turned(pose, vector) -> tuple:
    """A vector in the axes of the body, in those of the frame of its pose."""
    q = pose.orientation
    return rotate(Quaternion(q.x, q.y, q.z, q.w), Vec3(vector.x, vector.y, vector.z)).parts()


UNKNOWN = (nan, nan, nan)
