"""Where a body is put, and where it is: what the part ``place`` of a component takes, and what its ``motion`` tells.

All of it is in the frame in which the component publishes its true pose, positions and velocities in that frame's axes, as
in simulation_interfaces/EntityState.
"""

import math
from dataclasses import dataclass

import numpy as np

from flight_graph.components.records import Record
from flight_graph.errors import FlightError, unknown
from flight_math import Quaternion, Vec3, rotate
from msg_schemas.qos import Role

NUMBERS = {"position": 3, "orientation": 4, "velocity": 3, "angular_velocity": 3}
UNIT_TOLERANCE = 1e-3  # [1] of the norm of an orientation; it is scaled to 1
ODOMETRY, POSE_MESSAGE = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"


class Placement(Record):
    """What is to be of a body: each quantity, and whether it is set; others stay.

    position [m]; orientation: quaternion x, y, z, w of norm 1, body to frame; velocity [m/s], angular_velocity [rad/s].
    """

    position: Vec3
    orientation: Quaternion
    velocity: Vec3
    angular_velocity: Vec3
    sets_position: bool
    sets_orientation: bool
    sets_velocity: bool
    sets_angular_velocity: bool


@dataclass(frozen=True)
class TrueMotion:
    """Where a body truly is, each as plain numbers; None: not known.

    position [m] (3,), orientation (4,), velocity [m/s] (3,), angular_velocity [rad/s] (3,), acceleration [m/s^2] (3,),
    angular_acceleration [rad/s^2] (3,), which are those under the forces of the interval before.
    """

    position: list
    orientation: list
    velocity: list | None = None
    angular_velocity: list | None = None
    acceleration: list | None = None
    angular_acceleration: list | None = None


def checked(given: dict, where: str) -> dict:
    """What is given of a `Placement`, in plain form. Raises FlightError, which begins with ``where``."""
    if not isinstance(given, dict) or not given:
        raise FlightError(f"{where}: allowed: some of {', '.join(NUMBERS)}, each with its numbers")
    found = {}
    for name, numbers in given.items():
        if name not in NUMBERS:
            raise unknown("quantity", str(name), NUMBERS, where)
        found[name] = _numbers(numbers, NUMBERS[name], f"{where}.{name}")
    if "orientation" in found:
        size = _size(found["orientation"])
        if abs(size - 1.0) > UNIT_TOLERANCE:
            raise FlightError(f"{where}.orientation: {found['orientation']} has norm {size:.6g}; allowed: a unit "
                              f"quaternion x, y, z, w within {UNIT_TOLERANCE:g} of 1")
    return found


def _numbers(value, count, where) -> list[float]:
    try:
        numbers = [float(one) for one in value if not isinstance(one, (bool, str))] if not isinstance(value, str) else []
    except (TypeError, ValueError, OverflowError):
        numbers = []
    if len(numbers) != count or len(numbers) != len(value) or not np.isfinite(numbers).all():
        raise FlightError(f"{where}: {value} is not allowed; allowed: {count} finite numbers")
    return numbers


def record_of(given: dict) -> np.ndarray:
    """The (1,) record of a `Placement` of what was `checked`."""
    record = np.zeros(1, Placement.dtype)
    for name, numbers in given.items():
        record[name] = numbers
        record[f"sets_{name}"] = True
    if "orientation" in given:
        size = _size(given["orientation"])
        record["orientation"] = [number / size for number in given["orientation"]]
    return record


def _size(q) -> float:
    return math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])


def pose_signal(component):
    """The output by which a component that moves says where it truly is; None where there is none."""
    if component.update is None:
        return None
    truth = [signal for signal in component.outputs.values() if signal.role is Role.TRUTH]
    return next((signal for wanted in (ODOMETRY, POSE_MESSAGE) for signal in truth if signal.type_name == wanted), None)


def motion_of_pose(component, outputs: dict) -> TrueMotion:
    """What the message of the true pose says; an odometry's velocities are in the axes of the body. outputs: port -> its
    record, fields by attribute.
    """
    wanted = pose_signal(component)
    record = next(outputs[port] for port, signal in component.outputs.items() if signal is wanted)
    if wanted.type_name == POSE_MESSAGE:
        return TrueMotion(record.pose.position.tolist(), record.pose.orientation.tolist())
    pose, twist = record.pose.pose, record.twist.twist
    turn = Quaternion(*pose.orientation.tolist())
    linear, angular = (list(rotate(turn, Vec3(*part.tolist())).parts()) for part in (twist.linear, twist.angular))
    return TrueMotion(pose.position.tolist(), pose.orientation.tolist(), linear, angular)


def frame_of(component) -> str:
    """The frame of a component's true pose."""
    return pose_signal(component).fixed["header.frame_id"]
