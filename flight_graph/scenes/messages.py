"""What a bag and latecomers are told once of a scene: the vehicle's URDF, the fixed frames, and markers of all else.

A component that declares a scene lists `latched(port)` among its ``formatted`` messages.
"""

from collections.abc import Callable

import numpy as np

from flight_graph.components.component import Formatted
from flight_graph.scenes.scene import Box, Cylinder, Frame, Pose, Scene, Shape, Sphere
from flight_graph.scenes.transforms import TYPE, header, transforms
from flight_graph.scenes.triangles import triangles
from flight_graph.scenes.urdf import is_primitive, urdf
from flight_math import Quaternion, sincos, uncompiled
from msg_schemas.definitions import TYPESTORE
from msg_schemas.qos import Role

ROBOT_DESCRIPTION, TF_STATIC, MARKERS = "robot_description", "tf_static", "scene"
_CUBE, _SPHERE, _CYLINDER, _TRIANGLES = 1, 2, 3, 11  # of visualization_msgs/Marker


def latched(port: str, ground: bool = True) -> tuple[Formatted, ...]:
    """The messages that are said of a component's scene at the start, with the first message of an output.

    ground: whether there is more to show than the vehicle.
    """
    told = [(TF_STATIC, TYPE, fixed_frames), (ROBOT_DESCRIPTION, "std_msgs/msg/String", robot_description),
            *([(MARKERS, "visualization_msgs/msg/MarkerArray", markers)] if ground else [])]
    return tuple(Formatted(topic, type_name, port, function, Role.LATCHED, once=True, of_scene=True)
                 for topic, type_name, function in told)


def moving(port: str, poses: Callable) -> tuple[Formatted, ...]:
    """/tf with each message of an output. poses(record, scene) yields (frame, pose) of the frames that move."""
    def moving_frames(record, scene):
        """The transforms of the frames that move."""
        return transforms(record.header.stamp, *((scene.tree[name].parent, name, pose.position, pose.orientation)
                                                 for name, pose in poses(record, scene)))
    return (Formatted("tf", TYPE, port, moving_frames, of_scene=True),)


def turned_joint(frame: Frame, angle: float) -> Pose:
    """The pose of a frame whose joint stands at an angle [rad]."""
    sine, cosine = uncompiled(sincos)(0.5 * float(angle))
    about = Quaternion(*(float(sine) * part for part in frame.joint.axis), float(cosine))
    turn = Quaternion(*frame.pose.orientation) * about
    return Pose(frame.pose.position, tuple(float(part) for part in turn.parts()))


def joint_states(record, names, angles, rates=()):
    """A sensor_msgs/JointState of joints' angles [rad] and rates [rad/s]."""
    return TYPESTORE.types["sensor_msgs/msg/JointState"](
        header(record.header.stamp, ""), list(names), np.array(angles, float), np.array(rates, float), np.zeros(0))


def fixed_frames(record, scene: Scene):
    """The transforms of the frames that stand still in their parents."""
    return transforms(record.header.stamp, *(
        (frame.parent, frame.name, frame.pose.position, frame.pose.orientation)
        for frame in scene.frames if frame.is_fixed))


def robot_description(record, scene: Scene):
    """The vehicle's URDF."""
    return TYPESTORE.types["std_msgs/msg/String"](urdf(scene))


def markers(record, scene: Scene):
    """All shapes that the URDF has not got, as markers: ground, bodies, views, funnels."""
    shown = [shape for shape in scene.shapes if shape.kind != "vehicle" or not is_primitive(shape)]
    return TYPESTORE.types["visualization_msgs/msg/MarkerArray"]([_marker(record.header.stamp, shape) for shape in shown])


def _marker(stamp, shape: Shape):
    """A marker that keeps its place in its frame, for ever."""
    types, geometry = TYPESTORE.types, shape.geometry
    kind, scale, points = {Box: _CUBE, Sphere: _SPHERE, Cylinder: _CYLINDER}.get(type(geometry), _TRIANGLES), (1.0,) * 3, []
    if isinstance(geometry, Box):
        scale = geometry.size
    elif isinstance(geometry, Sphere):
        scale = tuple(2.0 * axis for axis in geometry.semi_axes)
    elif isinstance(geometry, Cylinder):
        scale = (2.0 * geometry.radius, 2.0 * geometry.radius, geometry.length)
    else:
        mesh = triangles(geometry)
        corners = mesh.vertices[mesh.faces.reshape(-1)]
        points = [types["geometry_msgs/msg/Point"](*map(float, corner)) for corner in corners]
    ever = types["builtin_interfaces/msg/Duration"](0, 0)
    colour = types["std_msgs/msg/ColorRGBA"](*map(float, shape.colour))
    pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](*map(float, shape.pose.position)),
                                           types["geometry_msgs/msg/Quaternion"](*map(float, shape.pose.orientation)))
    nothing = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "")
    return types["visualization_msgs/msg/Marker"](
        header=header(stamp, shape.frame), ns=shape.name, id=0, type=kind, action=0, pose=pose,
        scale=types["geometry_msgs/msg/Vector3"](*map(float, scale)), color=colour, lifetime=ever, frame_locked=True,
        points=points, colors=[], texture_resource="",
        texture=types["sensor_msgs/msg/CompressedImage"](nothing, "", np.zeros(0, np.uint8)), uv_coordinates=[], text="",
        mesh_resource="", mesh_file=types["visualization_msgs/msg/MeshFile"]("", np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False)
