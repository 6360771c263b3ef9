"""How the values of a sweep are made: evenly spaced ones, and random ones."""

import math
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from flight_math import elementary, noise
from flight_math.uncompiled import uncompiled

MOST_COMBINATIONS = 100_000  # of cases and grid
MOST_NUMBERS = 10_000  # of a drawn vector
Numbers = float | list[float]
cos, exp, log, sin = (uncompiled(function) for function in (
    elementary.cos, elementary.exp, elementary.log, elementary.sin))  # a draw is the same on every machine


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Spaced(Strict):
    """Evenly spaced values of a grid: [first, last, how many]."""

    linear: tuple[float, float, int] | None = None
    geometric: tuple[float, float, int] | None = None

    @model_validator(mode="after")
    def _one(self):
        _exactly_one(self, "linear", "geometric")
        first, last, count = self.linear or self.geometric
        if count < 1 or (self.geometric and first * last <= 0.0):
            raise ValueError("allowed: [first, last, how many], how many >= 1; geometric: ends of one sign, not zero")
        if count > MOST_COMBINATIONS:
            raise ValueError(f"allowed: at most {MOST_COMBINATIONS} values")
        return self

    def values(self) -> list[float]:
        spaced = np.linspace(*self.linear) if self.linear else np.geomspace(*self.geometric)
        return spaced.tolist()


class Cone(Strict):
    """A unit vector about an axis; ``uniform_in: angle`` draws the angle itself uniformly, ``area`` the direction."""

    axis: tuple[float, float, float]
    angle: float = Field(gt=0, le=math.pi)  # [rad] largest
    uniform_in: str = Field("area", pattern="^(area|angle)$")
    length: float = 1.0

    @field_validator("axis")
    @classmethod
    def _unit(cls, axis):
        size = math.sqrt(sum(part * part for part in axis))
        if not size > 0.0:
            raise ValueError("an axis of length zero has no direction")
        return tuple(part / size for part in axis)


class Distribution(Strict):
    """One random value: exactly one distribution; bounds and moments are numbers or vectors."""

    uniform: tuple[Numbers, Numbers] | None = None  # from, to
    normal: tuple[Numbers, Numbers] | None = None  # mean, standard deviation
    loguniform: tuple[Numbers, Numbers] | None = None  # from, to, both > 0
    choice: list[Any] | None = Field(None, min_length=1)
    count: int | None = None  # this number plus the number of the draw
    direction: float | tuple[float, float] | None = None  # vector of this length (or of a uniform one), any direction
    cone: Cone | None = None
    size: int | None = Field(None, ge=1, le=MOST_NUMBERS)  # independent draws of a vector's entries

    @model_validator(mode="after")
    def _check(self):
        kind = _exactly_one(self, "uniform", "normal", "loguniform", "choice", "count", "direction", "cone")
        if self.size and kind not in ("uniform", "normal", "loguniform", "choice"):
            raise ValueError(f"'size' has no meaning with '{kind}'")
        if kind in ("uniform", "loguniform"):
            low, high = np.broadcast_arrays(*map(np.asarray, getattr(self, kind)))
            if not (low < high).all() or (kind == "loguniform" and not (low > 0.0).all()):
                raise ValueError("allowed: [from, to] with from < to" + (", both > 0" if kind == "loguniform" else ""))
        if kind == "normal" and not (np.asarray(self.normal[1]) >= 0.0).all():
            raise ValueError("allowed: [mean, standard deviation] with a standard deviation >= 0")
        if kind != "choice":
            _finite(getattr(self, kind))
        return self

    def draw(self, key: int, number: int):
        """The value of draw ``number`` of the stream ``key``, in plain types."""
        if self.count is not None:
            return self.count + number
        if self.direction is not None or self.cone is not None:
            return self._vector([float(noise.uniform(key, number, i)) for i in range(3)])
        if self.choice is not None:
            picked = [self.choice[min(int(noise.uniform(key, number, i) * len(self.choice)), len(self.choice) - 1)]
                      for i in range(self.size or 1)]
            return picked if self.size else picked[0]
        a, b = self.uniform or self.normal or self.loguniform
        shape = (self.size,) if self.size else np.broadcast_shapes(np.shape(a), np.shape(b))
        a, b = (np.broadcast_to(value, shape).reshape(-1).tolist() for value in (a, b))
        values = [self._scalar(key, number, i, a[i], b[i]) for i in range(len(a))]
        return values if shape else values[0]

    def _scalar(self, key, number, index, a, b):
        if self.normal is not None:
            return a + b * float(noise.gaussian(key, number, index))
        u = float(noise.uniform(key, number, index))
        if self.uniform is not None:
            return a + (b - a) * u
        return exp(log(a) + (log(b) - log(a)) * u)

    def _vector(self, u):
        azimuth = 2.0 * math.pi * u[0]
        if self.cone is None:
            low, high = self.direction if isinstance(self.direction, tuple) else (self.direction,) * 2
            length, cosine, axis = low + (high - low) * u[2], 2.0 * u[1] - 1.0, (0.0, 0.0, 1.0)
        else:
            length, axis = self.cone.length, self.cone.axis
            cosine = (cos(self.cone.angle * u[1]) if self.cone.uniform_in == "angle"
                      else 1.0 - (1.0 - cos(self.cone.angle)) * u[1])
        sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
        least = min(range(3), key=lambda i: abs(axis[i]))
        across = np.cross(axis, np.eye(3)[least])
        across /= math.sqrt(float(across[0] ** 2 + across[1] ** 2 + across[2] ** 2))
        other = np.cross(axis, across)
        return [length * (cosine * axis[i] + sine * (cos(azimuth) * float(across[i])
                                                     + sin(azimuth) * float(other[i]))) for i in range(3)]


def _exactly_one(model, *names) -> str:
    given = [name for name in names if getattr(model, name) is not None]
    if len(given) != 1:
        raise ValueError(f"exactly one of {', '.join(names)} is allowed here, not {' and '.join(given) or 'none'}")
    return given[0]


def _finite(value):
    for number in value if isinstance(value, (list, tuple)) else [value]:
        if isinstance(number, (list, tuple)):
            _finite(number)
        elif isinstance(number, float) and not math.isfinite(number):
            raise ValueError("only finite numbers are allowed")
