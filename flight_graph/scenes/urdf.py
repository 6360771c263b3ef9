"""A scene's vehicle as URDF: links, joints, masses and inertias as the dynamics have them, boxes, cylinders and spheres.

The text is self-contained: it names no mesh file, so that a bag that carries it shows the vehicle anywhere. What is no
primitive goes into the latched markers (`flight_graph.scenes.messages`). Numbers are written so that they read back equal.
"""

import math
from xml.sax.saxutils import quoteattr

from flight_graph.scenes.scene import Box, Cylinder, Joint, Pose, Scene, Shape, Sphere
from flight_math import Quaternion, atan2, rotation_matrix, uncompiled

NO_LIMIT = 1e9  # [N m], [rad/s] of a joint without a limit: URDF asks for a number


def is_primitive(shape: Shape) -> bool:
    """Whether URDF has this geometry."""
    geometry = shape.geometry
    return isinstance(geometry, (Box, Cylinder)) or isinstance(geometry, Sphere) and len(set(geometry.semi_axes)) == 1


def urdf(scene: Scene) -> str:
    """The URDF text of the scene's vehicle: its base and what that carries."""
    links = scene.links
    lines = ['<?xml version="1.0"?>', f"<robot name={quoteattr(scene.name)}>"]
    for name in links:
        lines += _link(scene, name)
    for name in links[1:]:
        lines += _joint(scene.tree[name])
    return "\n".join([*lines, "</robot>", ""])


def _link(scene, name):
    inner = [line for body in scene.bodies if body.frame == name for line in _inertial(body)]
    shapes = [shape for shape in scene.shapes if shape.frame == name and shape.kind == "vehicle" and is_primitive(shape)]
    inner += [line for shape in shapes for line in _visual(shape)]
    return [f"  <link name={quoteattr(name)}>", *inner, "  </link>"] if inner else [f"  <link name={quoteattr(name)}/>"]


def _inertial(body):
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia
    values = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
    return ["    <inertial>", f"      {_origin(Pose(body.center_of_mass))}", f'      <mass value="{float(body.mass)!r}"/>',
            "      <inertia " + " ".join(f'{key}="{float(value)!r}"' for key, value in values.items()) + "/>",
            "    </inertial>"]


def _visual(shape):
    geometry = shape.geometry
    if isinstance(geometry, Box):
        text = f'<box size="{_numbers(geometry.size)}"/>'
    elif isinstance(geometry, Cylinder):
        text = f'<cylinder radius="{float(geometry.radius)!r}" length="{float(geometry.length)!r}"/>'
    else:
        text = f'<sphere radius="{float(geometry.semi_axes[0])!r}"/>'
    return [f"    <visual name={quoteattr(shape.name)}>", f"      {_origin(shape.pose)}",
            f"      <geometry>{text}</geometry>",
            f"      <material name={quoteattr(shape.name)}><color rgba=\"{_numbers(shape.colour)}\"/></material>",
            "    </visual>"]


def _joint(frame):
    joint = frame.joint
    kind = "fixed" if joint is None else "continuous" if joint.lower is None or joint.upper is None else "revolute"
    name = f"{frame.name}_joint" if joint is None else joint.name
    lines = [f"  <joint name={quoteattr(name)} type=\"{kind}\">", f"    <parent link={quoteattr(frame.parent)}/>",
             f"    <child link={quoteattr(frame.name)}/>", f"    {_origin(frame.pose)}"]
    if joint is not None:
        lines += [f'    <axis xyz="{_numbers(joint.axis)}"/>', f"    {_limit(joint, kind)}"]
    return [*lines, "  </joint>"]


def _limit(joint: Joint, kind):
    bounds = f'lower="{float(joint.lower)!r}" upper="{float(joint.upper)!r}" ' if kind == "revolute" else ""
    effort, velocity = float(joint.effort or NO_LIMIT), float(joint.velocity or NO_LIMIT)
    return f'<limit {bounds}effort="{effort!r}" velocity="{velocity!r}"/>'


def _origin(pose):
    return f'<origin xyz="{_numbers(pose.position)}" rpy="{_numbers(roll_pitch_yaw(pose.orientation))}"/>'


def roll_pitch_yaw(orientation) -> tuple[float, float, float]:
    """Angles [rad] about x, then y, then z of the parent's axes (URDF's order) of a quaternion x, y, z, w."""
    if tuple(orientation) == (0.0, 0.0, 0.0, 1.0):
        return 0.0, 0.0, 0.0
    m, angle = uncompiled(rotation_matrix)(Quaternion(*map(float, orientation))), uncompiled(atan2)
    level = math.sqrt(float(m[0, 0]) * float(m[0, 0]) + float(m[1, 0]) * float(m[1, 0]))
    pitch = float(angle(0.0 - float(m[2, 0]), level))
    if level < 1e-9:  # roll and yaw turn about one axis: all of it is yaw
        return 0.0, pitch, float(angle(0.0 - float(m[0, 1]), float(m[1, 1])))
    return float(angle(float(m[2, 1]), float(m[2, 2]))), pitch, float(angle(float(m[1, 0]), float(m[0, 0])))


def _numbers(values) -> str:
    return " ".join(repr(float(value)) for value in values)
