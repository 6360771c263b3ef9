"""The ``monitors:`` block of a scenario, in the terms of cFS's limit checker: watchpoints and actionpoints.

    monitors:
      rate_hz: 20
      watchpoints:
        - {id: fast, when: "abs(estimator.attitude.angular_velocity[0]) > 0.2"}
        - {id: tracker_silent, stale: star_tracker.measured, after_s: 1.0}
      actionpoints:
        - {id: lost, when: fast or tracker_silent, in_a_row: 3, act: once, level: error, text: attitude lost,
           blames: [star_tracker], mode: {modes: hold}, set: {controller.torque_limit: 0.01}}

A watchpoint is true while its expression holds, or while a signal's newest message is older than a time. An actionpoint
joins watchpoints; when they have held so often in a row, it acts: once in a run, or each time anew. What it means in a
graph is worked out in `flight_graph.monitors.monitor_set`.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from flight_graph.errors import FlightError, sentence_of, unknown
from flight_graph.faults import identifiers
from flight_graph.text_files import short

MOST = 500  # watchpoints, actionpoints


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class _Named(_Strict):
    id: str = Field(description="what it is called: a letter, then letters, digits and underscores")

    @field_validator("id")
    @classmethod
    def _is_name(cls, value):
        return identifiers.check(value)


class Watchpoint(_Named):
    """A limit: an expression, or the age of a signal."""

    when: str | None = Field(None, max_length=1000, description=(
        "true while this holds: an expression over the outputs of flight software and sensors"))
    stale: str | None = Field(None, max_length=300, description="`component.output`: true while its newest message is old")
    after_s: float | None = Field(None, gt=0, le=1e9, allow_inf_nan=False, description="stale: how old [s]")

    @model_validator(mode="after")
    def _one(self):
        if (self.when is None) == (self.stale is None) or (self.stale is None) != (self.after_s is None):
            raise ValueError("a watchpoint has either when, or stale and after_s")
        return self


class Actionpoint(_Named):
    """What is done when watchpoints hold."""

    when: str = Field(max_length=1000, description="watchpoints, joined by and, or, not")
    in_a_row: int = Field(1, ge=1, le=1_000_000, description="how many times in a row it must hold")
    act: Literal["once", "each"] = Field("once", description="once in a run, or each time that it comes to hold")
    level: Literal["warn", "error"] = Field("error", description="of its diagnostic")
    text: str = Field("", max_length=300, description="of its diagnostic")
    blames: list[Annotated[str, Field(max_length=60)]] = Field(default_factory=list, max_length=100, description=(
        "units that it holds to have failed; a unit is what `unit` of a fault names"))
    mode: dict[str, str] = Field(default_factory=dict, max_length=20, description=(
        "component -> mode that it is asked to take; the component has an input `request` and a list `modes`"))
    set: dict[str, float] = Field(default_factory=dict, max_length=100, description=(
        "`component.parameter` -> value that it has from then on"))


class MonitorsFile(_Strict):
    """The keys of the block."""

    rate_hz: float = Field(20.0, description="how often the watchpoints are looked at [Hz]")
    watchpoints: list[Watchpoint] = Field(min_length=1, max_length=MOST, description="limits")
    actionpoints: list[Actionpoint] = Field(default_factory=list, max_length=MOST, description="what follows from them")


def read(data, where: str) -> MonitorsFile:
    """Check the keys of a block. Raises FlightError, which begins with ``where``."""
    try:
        found = MonitorsFile.model_validate(data)
    except ValidationError as error:
        raise FlightError(f"{where}{_sentence(error, data)}") from None
    seen = set()
    for one in [*found.watchpoints, *found.actionpoints]:
        if one.id in seen:
            raise FlightError(f"{where}.{one.id}: two watchpoints or actionpoints have this id")
        seen.add(one.id)
    return found


def _sentence(error, data) -> str:
    first = error.errors()[0]
    place, value = "", data
    for part in first["loc"]:
        listed = isinstance(part, int) and isinstance(value, list) and isinstance(value[part], dict)
        named = listed and value[part].get("id")
        place += f".{short(str(named), 60)}" if named else f"[{part}]" if isinstance(part, int) else f".{short(part, 60)}"
        value = value[part] if isinstance(value, (dict, list)) and first["type"] != "missing" and (
            isinstance(part, int) or part in value) else None
    if first["type"] == "extra_forbidden":
        model = {"watchpoints": Watchpoint, "actionpoints": Actionpoint}.get(first["loc"][0], MonitorsFile)
        above = place.rpartition(".")[0]
        return f"{above}: {unknown('key', str(first['loc'][-1]), model.model_fields)}"
    got = "" if first["type"] == "missing" else f" (got {short(repr(first['input']))})"
    return f"{place}: {sentence_of(first)}{got}"
