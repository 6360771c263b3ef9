"""What a sweep varies: the ``vary:`` block of a scenario, and the values that case number K has.

    vary:
      cases:                                   # variants that change several values together
        - {name: slow, controller.lambda_a: 0.029, controller.lambda_u: 0.029}
        - {name: fast, controller.lambda_a: 0.046, controller.lambda_u: 0.046}
      grid:                                    # every combination of these values
        controller.rate_hz: [20, 50, 100]
        plant.gravity: {geometric: [8.0e-5, 2.0e-3, 5]}
      random:                                  # drawn anew for every run
        plant.initial_angles: {uniform: [-0.3, 0.3], size: 3}
        plant.mass: {normal: [2.0, 0.04]}
        seed: {count: 20201}
      runs: 200                                # draws for each combination of cases and grid
      seed: 7                                  # of the draws

A key is ``component.parameter``, ``component.rate_hz``, ``component.use``, ``seed`` or ``duration_s``. The combinations
(cases outermost, last key of the grid innermost) are numbered first: case K is combination K mod C with draw K div C.
A draw is a pure function of (seed, key, draw number), so case K has the same values whatever ran before it and however
many runs there are, and all combinations meet the same draws.
"""

import importlib
import itertools
import math
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from flight_graph.errors import FlightError, unknown
from flight_math import elementary, noise
from flight_math.uncompiled import uncompiled

cos, exp, log, sin = (uncompiled(function) for function in (
    elementary.cos, elementary.exp, elementary.log, elementary.sin))  # a draw is the same on every machine

TOP_LEVEL = ("seed", "duration_s")
Numbers = float | list[float]
_ALTERNATIVES = ("Spaced",)


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Spaced(_Strict):
    """Evenly spaced values of a grid: [first, last, how many]."""

    linear: tuple[float, float, int] | None = None
    geometric: tuple[float, float, int] | None = None

    @model_validator(mode="after")
    def _one(self):
        _exactly_one(self, "linear", "geometric")
        first, last, count = self.linear or self.geometric
        if count < 1 or (self.geometric and first * last <= 0.0):
            raise ValueError("allowed: [first, last, how many], how many >= 1; geometric: ends of one sign, not zero")
        return self

    def values(self) -> list[float]:
        spaced = np.linspace(*self.linear) if self.linear else np.geomspace(*self.geometric)
        return spaced.tolist()


class Cone(_Strict):
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


class Distribution(_Strict):
    """One random value: exactly one distribution; bounds and moments are numbers or vectors."""

    uniform: tuple[Numbers, Numbers] | None = None  # from, to
    normal: tuple[Numbers, Numbers] | None = None  # mean, standard deviation
    loguniform: tuple[Numbers, Numbers] | None = None  # from, to, both > 0
    choice: list[Any] | None = Field(None, min_length=1)
    count: int | None = None  # this number plus the number of the draw
    direction: float | tuple[float, float] | None = None  # vector of this length (or of a uniform one), any direction
    cone: Cone | None = None
    size: int | None = Field(None, ge=1)  # independent draws of a vector's entries

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


class VaryFile(_Strict):
    """The keys of the block. function: ``module:name`` of f(draw number, seed) -> {key: value}, for joint draws."""

    cases: list[dict[str, Any]] = Field(default_factory=list)
    grid: dict[str, list[Any] | Spaced] = Field(default_factory=dict)
    random: dict[str, Distribution] = Field(default_factory=dict)
    function: str | None = None
    runs: int = Field(1, ge=1)
    seed: int = 0

    @field_validator("grid")
    @classmethod
    def _some(cls, grid):
        for key, values in grid.items():
            if values == []:
                raise ValueError(f"'{key}' has no values")
        return grid


class Vary:
    """A checked ``vary:`` block. combinations: the fixed part of the cases, as (name, {key: value})."""

    def __init__(self, data: dict, origin: str):
        self.origin = origin
        try:
            self.file = VaryFile.model_validate(data)
        except ValidationError as error:
            raise FlightError(f"{origin}: {_sentence(error)}") from None
        file = self.file
        names = [entry.get("name") for entry in file.cases]
        for name in names:
            if names.count(name) > 1 and name is not None:
                raise FlightError(f"{origin}: vary.cases: two cases are called '{name}'")
        variants = [(str(entry.get("name", number)), {k: v for k, v in entry.items() if k != "name"})
                    for number, entry in enumerate(file.cases)] or [(None, {})]
        axes = [[(key, value) for value in (values.values() if isinstance(values, Spaced) else values)]
                for key, values in file.grid.items()]
        self.combinations = [(name, {**values, **dict(point)})
                             for name, values in variants for point in itertools.product(*axes)]
        self._keys()
        self._joint = _function(file.function, origin) if file.function else None

    @property
    def is_random(self) -> bool:
        return bool(self.file.random or self.file.function)

    @property
    def count(self) -> int:
        """How many cases there are."""
        return len(self.combinations) * self.file.runs

    def keys(self) -> list[str]:
        """Everything that is varied, in the order of the file; what a joint function varies is seen in draw 0."""
        keys = list(dict.fromkeys(key for _, values in self.combinations for key in values))
        return keys + list(self.file.random) + (list(self._joint(0, self.file.seed)) if self._joint else [])

    def name(self, case: int) -> str | None:
        """The variant's name, where the block has cases."""
        return self.combinations[case % len(self.combinations)][0]

    def draw_number(self, case: int) -> int:
        return case // len(self.combinations)

    def overrides(self, case: int) -> dict[str, Any]:
        """The values of case K by key. Raises FlightError when there is no such case."""
        if case < 0 or (case >= self.count and not self.is_random):
            raise FlightError(f"{self.origin}: there is no case {case}; the cases are 0 to {self.count - 1}")
        number, values = self.draw_number(case), dict(self.combinations[case % len(self.combinations)][1])
        for key, distribution in self.file.random.items():
            with np.errstate(over="ignore"):
                values[key] = distribution.draw(noise.stream_key(self.file.seed, key), number)
        if self._joint:
            values.update(self._joint(number, self.file.seed))
        return values

    def check(self, components: dict) -> None:
        """Refuse keys and fixed values that the components do not have. components: name -> class."""
        uses = {key.partition(".")[0] for key in self.keys() if key.endswith(".use")}
        for key in self.keys():
            name, _, parameter = key.partition(".")
            if not parameter:
                if key not in TOP_LEVEL:
                    raise FlightError(f"{self.origin}: vary: '{key}' cannot be varied; allowed: component.parameter, "
                                      "component.rate_hz, component.use, seed, duration_s")
            elif name not in components:
                raise unknown("component", name, components, f"{self.origin}: vary: {key}")
            elif name not in uses and parameter not in ("rate_hz", "use"):
                for value in self._values(key):
                    components[name].parameters.validate({parameter: value}, f"{self.origin}: vary: {name}")

    def _values(self, key):
        fixed = [values[key] for _, values in self.combinations if key in values]
        return fixed or [self.overrides(0)[key]]

    def _keys(self):
        seen = {}
        parts = {"cases": {key for entry in self.file.cases for key in entry}, "grid": self.file.grid,
                 "random": self.file.random}
        for part, keys in parts.items():
            for key in keys:
                if seen.setdefault(key, part) != part:
                    raise FlightError(f"{self.origin}: vary: '{key}' is varied twice, in {seen[key]} and in {part}")
        if self.file.runs > 1 and not self.is_random:
            raise FlightError(f"{self.origin}: vary.runs: {self.file.runs} equal runs of each case make no sense; "
                              "name what is drawn under vary.random (such as seed: {count: 1})")
        if not seen and not self.file.function:
            raise FlightError(f"{self.origin}: vary: nothing is varied; give cases, grid, random or function")


def _function(name, origin):
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ModuleNotFoundError, AttributeError, ValueError) as error:
        raise FlightError(f"{origin}: vary.function: '{name}' cannot be loaded: {error}") from None


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


def _sentence(error: ValidationError) -> str:
    def depth(found):  # of two readings of one value (a list, or a Spaced), the one that it was meant to be
        return sum(any(name in str(part) for name in _ALTERNATIVES) for part in found["loc"]), -len(found["loc"])

    first = max(error.errors(), key=depth)
    where = ".".join(["vary", *(str(part) for part in first["loc"] if "[" not in str(part) and part not in _ALTERNATIVES
                                and part != "float")])
    if first["type"] == "extra_forbidden":
        model = VaryFile if len(first["loc"]) == 1 else Spaced if "Spaced" in str(first["loc"]) else (
            Cone if "cone" in first["loc"] else Distribution)
        return f"{where}: there is no such key; allowed here: {', '.join(model.model_fields)}"
    return f"{where}: {first['msg'].removeprefix('Value error, ')} (got {first['input']!r})"
