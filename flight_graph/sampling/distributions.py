"""How the values of a campaign are made: evenly spaced ones, and random ones.

A random value is a function of a source of numbers (`flight_graph.sampling.sources`), so one definition serves
independent draws, the points of a plan, and given standard normal numbers.
"""

import math
from functools import cached_property
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from flight_graph.sampling import normal
from flight_math import elementary
from flight_math.uncompiled import uncompiled

MOST_COMBINATIONS = 100_000  # of cases and grid
MOST_NUMBERS = 10_000  # of a drawn vector
Numbers = float | list[float]
cos, exp, log, sin = (uncompiled(function) for function in (
    elementary.cos, elementary.exp, elementary.log, elementary.sin))  # a draw is the same on every machine


class Strict(BaseModel):
    """A block of a scenario file: a key that it does not know is an error."""

    model_config = ConfigDict(extra="forbid")


class Spaced(Strict):
    """Evenly spaced values of a grid: [first, last, how many]."""

    linear: tuple[float, float, int] | None = None
    geometric: tuple[float, float, int] | None = None

    @model_validator(mode="after")
    def _one(self):
        _exactly_one(self, "linear", "geometric")
        first, last, count = self.linear or self.geometric
        finite([first, last])
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
    """One random value: exactly one distribution; bounds and moments are numbers or vectors.

    truncated: [from, to] of a normal one, null for an open end; what lies outside is not drawn.
    """

    uniform: tuple[Numbers, Numbers] | None = None  # from, to
    normal: tuple[Numbers, Numbers] | None = None  # mean, standard deviation
    loguniform: tuple[Numbers, Numbers] | None = None  # from, to, both > 0
    choice: list[Any] | None = Field(None, min_length=1)
    count: int | None = None  # this number plus the number of the draw
    direction: float | tuple[float, float] | None = None  # vector of this length (or of a uniform one), any direction
    cone: Cone | None = None
    truncated: tuple[Numbers | None, Numbers | None] | None = None
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
            finite(getattr(self, kind))
        if self.truncated is not None:
            self._check_ends(kind)
        return self

    def _check_ends(self, kind):
        if kind != "normal":
            raise ValueError(f"'truncated' has no meaning with '{kind}'; it goes with normal")
        finite(self.truncated)
        for (mean, deviation), low, high in self._entries:
            if not (low < high and deviation > 0.0):
                raise ValueError("allowed: truncated: [from, to] with from < to, of a standard deviation > 0")
            if not math.isfinite(self._between(mean, deviation, low, high, 0.5)):
                raise ValueError("nothing of the distribution lies between the ends of 'truncated'")

    @cached_property
    def _shape(self) -> tuple:
        """Of a value: () for a number."""
        if self.size:
            return (self.size,)
        ends = [end for end in self.truncated or () if end is not None]
        moments = self.uniform or self.normal or self.loguniform or ()
        return np.broadcast_shapes(*(np.shape(value) for value in (*moments, *ends)))

    @cached_property
    def _entries(self) -> list:
        """((first, second moment or bound), lower end, upper end) of each entry of a value."""
        low, high = self.truncated or (None, None)
        given = (*(self.uniform or self.normal or self.loguniform), -math.inf if low is None else low,
                 math.inf if high is None else high)
        a, b, low, high = (np.broadcast_to(value, self._shape).reshape(-1).tolist() for value in given)
        return list(zip(zip(a, b), low, high))

    @property
    def dimensions(self) -> int:
        """How many numbers of a source a value is made of."""
        if self.count is not None:
            return 0
        if self.direction is not None or self.cone is not None:
            return 3 if isinstance(self.direction, tuple) else 2
        return (self.size or 1) if self.choice is not None else len(self._entries)

    def value(self, source, number: int):
        """The value of draw ``number``, in plain types; source: `flight_graph.sampling.sources`."""
        if self.count is not None:
            return self.count + number
        if self.direction is not None or self.cone is not None:
            return self._vector([source.uniform(i) if i < self.dimensions else 0.0 for i in range(3)])
        if self.choice is not None:
            picked = [self.choice[min(int(source.uniform(i) * len(self.choice)), len(self.choice) - 1)]
                      for i in range(self.size or 1)]
            return picked if self.size else picked[0]
        values = [self._scalar(source, i, *entry) for i, entry in enumerate(self._entries)]
        return values if self._shape else values[0]

    def _scalar(self, source, index, moments, low, high):
        a, b = moments
        if self.truncated is not None:
            return self._between(a, b, low, high, source.uniform(index))
        if self.normal is not None:
            return a + b * source.gaussian(index)
        u = source.uniform(index)
        if self.uniform is not None:
            return a + (b - a) * u
        return exp(log(a) + (log(b) - log(a)) * u)

    @staticmethod
    def _between(mean, deviation, low, high, u):
        """The quantile u of a normal distribution between two ends; not finite where it has no mass there.

        It is worked out on the side of the lower tail, where probabilities keep their relative precision.
        """
        below, above = (low - mean) / deviation, (high - mean) / deviation
        if below + above > 0.0:
            value = mean - Distribution._between(0.0, 1.0, -above, -below, 1.0 - u) * deviation
            return min(max(value, low), high)
        first, last = (normal.distribution(z) if math.isfinite(z) else float(z > 0.0) for z in (below, above))
        p = first + (last - first) * u
        if not 0.0 < p < 1.0:
            return math.nan
        return min(max(mean + deviation * normal.quantile(p), low), high)

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


def finite(value) -> None:
    """Refuse infinity and NaN, in lists too. Raises ValueError."""
    for number in value if isinstance(value, (list, tuple)) else [value]:
        if isinstance(number, (list, tuple)):
            finite(number)
        elif isinstance(number, float) and not math.isfinite(number):
            raise ValueError("only finite numbers are allowed")
