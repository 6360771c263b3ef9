"""The space robot as data: a base and up to 12 revolute joints in a tree, read from one YAML file.

Source: Aerospace 2023, 10(8), 679, section 4; the paper's Tables 1 and 2 of masses are not in its text, so the numbers
of `models/mini_space_robot.yaml` are our own. A URDF is read by `spacerobot_ros.urdf`; `spacerobot_ros.robot_files`
finds a robot by name or file.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from flight_graph import yaml_text
from flight_graph.errors import FlightError, sentence_of
from flight_math import sincos
from spacerobot_ros.inertial_parameters import NAMES, ModelError, body_parameters, check_body
from spacerobot_ros.kinematics import Geometry
from spacerobot_ros.model_schema import Joint, ModelFile


@dataclass(frozen=True)
class SpaceRobot:
    """A robot flattened for kernels; n joints, n+1 bodies, body i+1 hangs on joint i, body 0 is the base.

    parent: (n,) int64, body that carries joint i (less than i+1).  fixed_rotation: (n, 3, 3) body i+1's axes to its
    parent's at angle zero.  offset: (n, 3) origin of body i+1 in its parent's axes [m].  axis: (n, 3) unit vector in
    body i+1's axes.  pi: (10(n+1),) inertial parameters.  lower, upper: (n,) [rad]; velocity_limit: (n,) [rad/s];
    torque_limit: (n,) [N m]; infinite where none is given.
    """

    name: str
    body_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    parent: np.ndarray
    fixed_rotation: np.ndarray
    offset: np.ndarray
    axis: np.ndarray
    pi: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    velocity_limit: np.ndarray
    torque_limit: np.ndarray

    @property
    def geometry(self) -> Geometry:
        """The tree as kernels take it."""
        return Geometry(self.parent, self.fixed_rotation.reshape(-1, 9), self.offset, self.axis)

    @property
    def joints(self) -> int:
        """Number n of joints."""
        return len(self.joint_names)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of pi's elements, as 'base.Ixx'."""
        return tuple(f"{body}.{name}" for body in self.body_names for name in NAMES)

    def check_prior(self, prior) -> np.ndarray:
        """The prior as a float64 array, or a `ModelError` if it has the wrong count or a number that is not finite."""
        prior = np.asarray(prior, float)
        count = 10 * (self.joints + 1)
        if prior.shape != (count,):
            raise ModelError(
                f"prior has shape {prior.shape}; robot '{self.name}' with {self.joints} joints needs {count} "
                "parameters, ten for each body"
            )
        if not np.all(np.isfinite(prior)):
            bad = self.parameter_names[int(np.argmin(np.isfinite(prior)))]
            raise ModelError(f"prior of '{bad}' is not a finite number")
        return prior


def load_model(path) -> SpaceRobot:
    """Read and check a robot model from a YAML file. Raises `ModelError` with a sentence."""
    path = Path(path)
    try:
        data = yaml_text.read(path, f"robot model {path}")
    except FlightError as error:
        raise ModelError(str(error)) from None
    return model_from_mapping(data, str(path))


def model_from_mapping(data, where: str = "robot model") -> SpaceRobot:
    """Check a model given as a mapping (the YAML's content) and flatten it. ``where`` begins every error sentence."""
    try:
        file = ModelFile.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"]) or "the file"
        raise ModelError(f"{where}: {key}: {sentence_of(first)}") from None
    try:
        return _flatten(file)
    except ModelError as error:
        raise ModelError(f"{where}: {error}") from None


def _flatten(file: ModelFile) -> SpaceRobot:
    joints = _outward_order(file.base.name, file.joints)
    bodies = [file.base, *(joint.body for joint in joints)]
    for body in bodies:
        check_body(body.name, body.mass, body.inertia.matrix())
    index = {body.name: k for k, body in enumerate(bodies)}
    n = len(joints)
    fixed_rotation, offset, axis = np.zeros((n, 3, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    for i, joint in enumerate(joints):
        fixed_rotation[i], offset[i] = _placement(joint)
        axis[i] = np.array(joint.axis) / math.sqrt(sum(part * part for part in joint.axis))

    def bounds(name, default):
        values = [getattr(joint.limits, name) for joint in joints]
        return np.array([default if value is None else value for value in values], float)

    parameters = [body_parameters(body.mass, body.center_of_mass, body.inertia.matrix()) for body in bodies]
    return SpaceRobot(
        name=file.name,
        body_names=tuple(body.name for body in bodies),
        joint_names=tuple(joint.name for joint in joints),
        parent=np.array([index[joint.parent] for joint in joints], np.int64),
        fixed_rotation=fixed_rotation,
        offset=offset,
        axis=axis,
        pi=np.concatenate(parameters),
        lower=bounds("lower", -np.inf),
        upper=bounds("upper", np.inf),
        velocity_limit=bounds("velocity", np.inf),
        torque_limit=bounds("torque", np.inf),
    )


def _placement(joint: Joint) -> tuple[np.ndarray, np.ndarray]:
    if joint.dh is not None:
        c, s = _cos_sin(joint.dh.alpha)
        turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        return turn, turn @ np.array([joint.dh.a, 0.0, joint.dh.d])
    origin = joint.origin
    turn = rotation_from_rpy(origin.rpy or (0.0, 0.0, 0.0)) if origin.rotation is None else np.array(origin.rotation)
    return turn, np.array(origin.xyz)


def rotation_from_rpy(rpy) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll), the URDF's order, shape (3, 3); angles in rad."""
    (cr, sr), (cp, sp), (cy, sy) = (_cos_sin(angle) for angle in rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _cos_sin(angle: float) -> tuple[float, float]:
    """Cosine and sine, exact at multiples of a right angle that were written with a float's digits."""
    quarter = angle / (0.5 * math.pi)
    if abs(quarter - round(quarter)) < 1e-15:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    sine, cosine = sincos(angle)
    return float(cosine), float(sine)


def _outward_order(base: str, joints: list[Joint]) -> list[Joint]:
    """The joints, each after the one that carries its parent body, else in the file's order."""
    carrier = {}
    names = set()
    for joint in joints:
        if joint.name in names:
            raise ModelError(f"joint name '{joint.name}' is used twice; every joint needs its own")
        names.add(joint.name)
        if joint.body.name == base or joint.body.name in carrier:
            raise ModelError(
                f"body '{joint.body.name}' of joint '{joint.name}' already exists; in a tree every body is carried once"
            )
        carrier[joint.body.name] = joint
    for joint in joints:
        if joint.parent != base and joint.parent not in carrier:
            known = ", ".join([base, *carrier])
            raise ModelError(f"joint '{joint.name}': parent body '{joint.parent}' does not exist; bodies are: {known}")
        path = [joint.body.name]
        body = joint.parent
        while body != base:
            if body in path:
                loop = " -> ".join([*path[path.index(body) :], body])
                raise ModelError(f"joints form a loop ({loop}) that does not reach the base '{base}'; a tree is needed")
            path.append(body)
            body = carrier[body].parent
    placed = {base}
    ordered = []
    while len(ordered) < len(joints):
        for joint in joints:
            if joint.parent in placed and joint.body.name not in placed:
                ordered.append(joint)
                placed.add(joint.body.name)
    return ordered
