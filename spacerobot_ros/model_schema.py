"""What a robot model's YAML file may hold, checked field by field (pydantic). `spacerobot_ros.model` reads it."""

import math
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

MAX_JOINTS = 12


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is not a finite number")
    return value


Number = Annotated[float, AfterValidator(_finite)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Inertia(_Strict):
    """Inertia tensor's elements about the centre of mass, body axes [kg m^2]; products carry the tensor's sign."""

    xx: Number
    xy: Number = 0.0
    xz: Number = 0.0
    yy: Number
    yz: Number = 0.0
    zz: Number

    def matrix(self) -> np.ndarray:
        return np.array([[self.xx, self.xy, self.xz], [self.xy, self.yy, self.yz], [self.xz, self.yz, self.zz]])


class Body(_Strict):
    """One rigid body: mass [kg], centre of mass in its own frame [m], inertia about it."""

    name: str = Field(min_length=1)
    mass: Number
    center_of_mass: Vector
    inertia: Inertia


class ModifiedDenavitHartenberg(_Strict):
    """T = Rx(alpha) Tx(a) Rz(theta) Tz(d) (Craig), the convention of equations (8)-(19)."""

    alpha: Number = 0.0  # [rad]
    a: Number = 0.0  # [m]
    d: Number = 0.0  # [m]


class Origin(_Strict):
    """Plain transform of the joint in its parent's frame: translation [m], and roll-pitch-yaw about fixed axes [rad].

    ``rotation``: rows of the matrix that turns the joint's axes into the parent's, in place of ``rpy``.
    """

    xyz: Vector = [0.0, 0.0, 0.0]
    rpy: Vector | None = None
    rotation: Annotated[list[Vector], Field(min_length=3, max_length=3)] | None = None

    @model_validator(mode="after")
    def _proper_rotation(self):
        if self.rpy is not None and self.rotation is not None:
            raise ValueError("an origin takes 'rpy' or 'rotation', not both")
        if self.rotation is not None:
            matrix = np.array(self.rotation)
            if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-9 or np.linalg.det(matrix) < 0.0:
                raise ValueError("'rotation' is not a rotation matrix (orthonormal rows, determinant +1)")
        return self


class Limits(_Strict):
    """Range of the joint angle [rad], rate limit [rad/s], torque limit [N m]; a bound left out is infinite."""

    lower: Number | None = None
    upper: Number | None = None
    velocity: Annotated[Number, Field(gt=0)] | None = None
    torque: Annotated[Number, Field(gt=0)] | None = None


class Joint(_Strict):
    """A revolute joint and the body it carries; placed by `dh` (axis z) or by `origin` and `axis`."""

    name: str = Field(min_length=1)
    parent: str
    dh: ModifiedDenavitHartenberg | None = None
    origin: Origin | None = None
    axis: Vector = [0.0, 0.0, 1.0]
    limits: Limits = Limits()
    body: Body

    @model_validator(mode="after")
    def _one_placement(self):
        if (self.dh is None) == (self.origin is None):
            raise ValueError(f"joint '{self.name}' needs exactly one of 'dh' and 'origin'")
        if self.dh is not None and self.axis != [0.0, 0.0, 1.0]:
            raise ValueError(f"joint '{self.name}': with 'dh' the axis is z; give 'origin' for another axis")
        if math.hypot(*self.axis) < 1e-9:
            raise ValueError(f"joint '{self.name}': axis {self.axis} has no direction")
        lower, upper = self.limits.lower, self.limits.upper
        if lower is not None and upper is not None and lower >= upper:
            raise ValueError(f"joint '{self.name}': lower limit {lower:g} rad is not below the upper, {upper:g} rad")
        return self


class ModelFile(_Strict):
    """What one YAML file holds."""

    name: str = Field(min_length=1)
    source: str = ""
    base: Body
    joints: Annotated[list[Joint], Field(max_length=MAX_JOINTS)]
