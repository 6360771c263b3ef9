"""What a number is to be: one of a few relations to numbers that are written down."""

import math
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, model_validator


class Relation(BaseModel):
    """Exactly one of these."""

    model_config = ConfigDict(extra="forbid")

    below: float | None = None
    above: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    near: tuple[float, float] | None = None
    between: tuple[float, float] | None = None
    is_: Any = Field(default=None, alias="is")

    @model_validator(mode="after")
    def _one(self):
        if len(self.model_fields_set) != 1:
            raise ValueError("a relation has exactly one of below, above, at_most, at_least, near, between, is")
        if any(not math.isfinite(number) for number in self.numbers):
            raise ValueError("a relation is to finite numbers")
        if self.between and self.between[0] > self.between[1]:
            raise ValueError("'between' has the lower number first")
        return self

    @property
    def numbers(self) -> tuple[float, ...]:
        """The numbers that it is to; () of ``is``."""
        given = getattr(self, next(iter(self.model_fields_set)))
        return () if self.is_equality or given is None else given if isinstance(given, tuple) else (given,)

    @property
    def is_equality(self) -> bool:
        """Whether it says what the value is, in place of where it lies."""
        return "is_" in self.model_fields_set

    def holds(self, value) -> bool:
        """Whether the relation holds; None (missing) holds for ``is: null`` alone."""
        return value == self.is_ if self.is_equality else self.margin(value) >= 0.0 and not self._on_open_end(value)

    def margin(self, value) -> float:
        """How far inside its limit a value lies, in its own unit: below 0 outside, -inf of a value that is missing. Of
        ``is``: 0 or -inf."""
        if self.is_equality:
            return 0.0 if value == self.is_ else -math.inf
        if value is None or isinstance(value, str) or not math.isfinite(value):
            return -math.inf
        if self.below is not None or self.at_most is not None:
            return self.numbers[0] - value
        if self.above is not None or self.at_least is not None:
            return value - self.numbers[0]
        if self.near is not None:
            return self.near[1] - abs(value - self.near[0])
        return min(value - self.between[0], self.between[1] - value)

    def _on_open_end(self, value) -> bool:
        return (self.below is not None and value == self.below) or (self.above is not None and value == self.above)

    @property
    def text(self) -> str:
        """The relation in symbols."""
        if self.is_equality:
            return f"is {self.is_}"
        if self.near is not None:
            return f"{self.near[0]:g} +- {self.near[1]:g}"
        if self.between is not None:
            return f"{self.between[0]:g} to {self.between[1]:g}"
        symbols = {"below": "<", "above": ">", "at_most": "<=", "at_least": ">="}
        return f"{symbols[next(iter(self.model_fields_set))]} {self.numbers[0]:g}"
