"""What the space robot looks like: each body as the homogeneous box of its inertia, joints as drums about their axes.

Tree, masses, inertias, axes and limits are the plant's parameters (before a payload is taken). The wheels have no inertia
in the model: their momentum is an arrow.
"""

import math

import numpy as np

from flight_graph.scenes.messages import joint_states
from flight_graph.scenes.scene import MAP, Arrow, Body, Cylinder, Frame, Joint, Pose, Scene, Shape, Trail
from flight_graph.scenes.shapes import equivalent_box, pose_of
from flight_graph.scenes.transforms import transforms
from flight_math import Vec3, cross, norm
from msg_schemas import spacerobot
from spacerobot_ros.inertial_parameters import tensor
from spacerobot_ros.robot_parameters import NO_LIMIT

BODY, DRUM, LINK = (0.82, 0.78, 0.6, 1.0), (0.3, 0.32, 0.36, 1.0), (0.7, 0.72, 0.76, 1.0)
TORQUE_SCALE, MOMENTUM_SCALE = 0.5, 1.0  # [m / (N m)], [m / (N m s)]


def scene(values: dict, topics: spacerobot.Topics) -> Scene:
    """The scene of a space robot's resolved parameters."""
    names, joints = topics.frames, topics.joint_state.fixed["name"]
    frames = [Frame(spacerobot.INERTIAL, MAP), Frame(spacerobot.BASE, spacerobot.INERTIAL, None)]
    bodies = [_body(name, pi) for name, pi in zip(names, np.reshape(values["pi"], (-1, 10)))]
    shapes = [shape for body in bodies for shape in _box(body, BODY if body.frame == spacerobot.BASE else LINK)]
    arrows = [_of_base("torque on the base", topics.truth.topic, "base_torque", "N m", TORQUE_SCALE, (0.9, 0.2, 0.1, 1.0)),
              _of_base("momentum of the wheels", topics.truth.topic, "wheel_momentum", "N m s", MOMENTUM_SCALE,
                       (0.55, 0.25, 0.75, 1.0))]
    for i, (joint, parent) in enumerate(zip(joints, values["parent"])):
        axis = tuple(map(float, values["axis"][i]))
        turns = Joint(joint, axis, _limit(values["lower"][i]), _limit(values["upper"][i]),
                      _limit(values["joint_torque_limit"][i]))
        pose = pose_of(values["offset"][i], np.reshape(values["fixed_rotation"][i], (3, 3)))
        frames.append(Frame(names[i + 1], names[parent], pose, turns))
        shapes.append(_drum(names[i + 1], axis))
        arrows.append(Arrow(f"torque of {joint}", topics.truth.topic, "position", names[i + 1], "N m", TORQUE_SCALE,
                            (f"joint_torque[{i}]",), (axis,), colour=(0.95, 0.6, 0.1, 1.0)))
    reach = 1.0 + sum(float(norm(Vec3(*offset))) for offset in values["offset"])
    return Scene("space_robot", spacerobot.BASE, tuple(frames), tuple(bodies), tuple(shapes), tuple(arrows),
                 (Trail(spacerobot.BASE), Trail(names[-1], colour=(0.9, 0.5, 0.1, 1.0))), reach)


def _of_base(name, topic, quantity, unit, scale, colour):
    return Arrow(name, topic, "position", spacerobot.BASE, unit, scale, tuple(f"{quantity}[{i}]" for i in range(3)),
                 colour=colour)


def _limit(value) -> float | None:
    return None if abs(value) >= NO_LIMIT else float(value)


def _body(frame, pi) -> Body:
    """Mass, centre and inertia about it of ten parameters about the frame's origin."""
    mass = float(pi[9])
    x, y, z = (float(moment / mass) for moment in pi[6:9])
    about = tensor(pi[:6]) - mass * np.array([[y * y + z * z, -x * y, -x * z], [-x * y, x * x + z * z, -y * z],
                                              [-x * z, -y * z, x * x + y * y]])
    return Body(frame, mass, (x, y, z), tuple(tuple(float(part) for part in row) for row in about))


def _box(body, colour):
    """The box of a body; none for one that no masses could make."""
    if not body.mass > 0.0:
        return []
    box, pose = equivalent_box(body.mass, body.center_of_mass, body.inertia)
    return [Shape(f"{body.frame}_body", body.frame, box, pose, colour)]


def _drum(frame, axis):
    """A drum about the axis of a joint, at its origin."""
    up, along = Vec3(0.0, 0.0, 1.0), Vec3(*axis)
    turn, cosine = cross(up, along), float(along.z)
    if cosine < -0.999999:
        quaternion = (1.0, 0.0, 0.0, 0.0)
    else:
        half = math.sqrt(2.0 * (1.0 + cosine))
        quaternion = (*(float(part / half) for part in turn.parts()), 0.5 * half)
    return Shape(f"{frame}_joint", frame, Cylinder(0.05, 0.12), Pose(orientation=quaternion), DRUM)


def moving_frames(names):
    """The function of a record of truth/frames that makes the transforms of base and links. names: of the bodies."""
    def made(record):
        """The transforms of the frames that move."""
        links = ((names[int(parent)], names[i + 1], record.offsets[3 * i:3 * i + 3], record.rotations[4 * i:4 * i + 4])
                 for i, parent in enumerate(record.parents))
        return transforms(record.header.stamp, (spacerobot.INERTIAL, spacerobot.BASE, record.position, record.attitude),
                          *links)
    return made


def true_joints(topics):
    """The function of a record of truth/frames that makes the joints' angles."""
    names = topics.joint_state.fixed["name"]

    def made(record):
        """The joints' angles."""
        return joint_states(record, names, record.joints)
    return made
