"""One entry of the ``faults:`` block of a scenario, as its file writes it.

    faults:
      - {id: gyro, at: "imu.imu.angular_velocity[2]", type: bias, value: 0.01, ramp_s: 5, from_s: 20, until_s: 60}
      - {id: tracker, at: star_tracker.attitude, type: drop, probability: 0.3, from_s: 10}
      - {id: wheel, at: "plant <- command.effort[2]", type: scale, value: 0.4, from_s: 12}
      - {id: upset, at: "estimator.state.bias[0]", type: bit_flip, bit: 51, at_s: 30}
      - {id: law, at: controller, type: hang, from_s: 40, for_s: 0.3}

What it means in a graph is worked out in `flight_graph.faults.fault_set`.
"""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from flight_graph.errors import FlightError, sentence_of, unknown
from flight_graph.faults import identifiers
from flight_graph.faults.fault_types import SPARE, TYPES
from flight_graph.faults.report import REPORT
from flight_graph.text_files import short

MOST = 1000  # faults of a scenario
_Number = Annotated[float, Field(allow_inf_nan=False)]
_Seconds = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
_Span = Annotated[float, Field(ge=1e-9, le=1e9, allow_inf_nan=False)]


class FaultEntry(BaseModel):
    """The keys of a fault."""

    model_config = ConfigDict(extra="forbid")

    id: str = Field(description="what it is called: a letter, then letters, digits and underscores")
    at: str = Field(max_length=300, description=(
        "the place: `component.output.field[i]` (all who read it), `reader <- input.field[i]` (that one alone), "
        "`component.state.entry[i]`, `component.parameters.entry[i]`, `component.output` or `reader <- input` (whole "
        "messages), `component`; a field without an index is all of its numbers"))
    type: str = Field(description="what happens there; see the table of kinds")
    value: _Number | None = Field(None, description="the size; what it means stands in the table of kinds")
    ramp_s: _Span | None = Field(None, description="bias, scale: grows from nothing within this time [s]")
    bit: int | None = Field(None, ge=0, le=63, description="bit_flip: number of the bit, 0 the lowest")
    ticks: int | None = Field(None, ge=1, le=1000, description="delay: by how many firings")
    every: int | None = Field(None, ge=2, le=1_000_000, description="drop, duplicate: every so manieth message")
    probability: float | None = Field(None, gt=0, le=1, allow_inf_nan=False, description="of each firing in the window")
    from_s: _Seconds | None = Field(None, description="begin of the window [s]; 0 when left out")
    until_s: _Span | None = Field(None, description="its end [s]; the end of the run when left out")
    for_s: _Span | None = Field(None, description="instead of until_s: how long it lasts [s], once, at each `every_s`, or "
                                                  "from each onset of `when`")
    at_s: _Seconds | None = Field(None, description="one firing: the first at or after this time [s]")
    every_s: _Span | None = Field(None, description="again and again, with this period [s]")
    unit: str | None = Field(None, description=(
        "the unit that fails, as actionpoints blame it; the component of the place when left out"))
    when: str | None = Field(None, max_length=1000, description=(
        "only while this holds: an expression over recorded signals, as `plant.truth.rates[0] > 0.1`"))

    @field_validator("id")
    @classmethod
    def _is_name(cls, value):
        return identifiers.check(value)

    @field_validator("unit")
    @classmethod
    def _is_unit(cls, value):
        if value is not None and not identifiers.is_form(value):
            raise ValueError("it is no name; allowed: a letter, then letters, digits and underscores, 60 in all")
        return value

    @field_validator("*", mode="before")
    @classmethod
    def _is_no_truth(cls, value):
        if isinstance(value, bool):
            raise ValueError("yes, no, true and false mean nothing here")
        return value

    @property
    def given(self) -> dict:
        """The keys that are given."""
        return self.model_dump(exclude_none=True)


def read(data, where: str) -> list[FaultEntry]:
    """Check the entries of a block by themselves. Raises FlightError, which begins with ``where`` and the fault."""
    if not isinstance(data, list) or len(data) > MOST or not all(isinstance(one, dict) for one in data):
        raise FlightError(f"{where}: it is a list of at most {MOST} faults, each with id, at and type")
    entries = [_entry(one, f"{where}[{number}]", where) for number, one in enumerate(data)]
    seen = set()
    for entry in entries:
        if entry.id in seen:
            raise FlightError(f"{where}.{entry.id}: two faults have this id")
        seen.add(entry.id)
    return entries


def override(data, path: str, value, where: str) -> list[dict]:
    """A copy of a block with ``ID.key`` replaced; a value of None takes the key away. Raises FlightError."""
    name, _, key = path.partition(".")
    entries = [dict(one) for one in data] if isinstance(data, list) and all(isinstance(one, dict) for one in data) else []
    found = [one for one in entries if one.get("id") == name]
    if not found:
        raise unknown("fault", name, [str(one.get("id")) for one in entries], where)
    if key not in FaultEntry.model_fields or key == "id":
        raise unknown("key of a fault", key, [known for known in FaultEntry.model_fields if known != "id"], where)
    found[0][key] = value
    if value is None:
        del found[0][key]
    return entries


def value(data: list[dict], path: str):
    """The value of ``ID.key`` in a block; None where it is left out."""
    name, _, key = path.partition(".")
    return next((one.get(key) for one in data or [] if one.get("id") == name), None)


def _entry(data, place, where) -> FaultEntry:
    name = data.get("id")
    label = f"{where}.{name}" if identifiers.is_form(name) else place
    try:
        entry = FaultEntry.model_validate(data)
    except ValidationError as error:
        raise FlightError(f"{label}: {_sentence(error, data)}") from None
    if entry.type not in TYPES:
        raise unknown("type of fault", entry.type, TYPES, label)
    _check_keys(entry, label)
    _check_window(entry, label)
    return entry


def _sentence(error, data):
    first = error.errors()[0]
    key = ".".join(short(str(part)) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return str(unknown("key", key, FaultEntry.model_fields))
    if first["type"] == "missing":
        return f"the key {key} is missing; a fault has at least id, at and type"
    return f"{key}: {sentence_of(first)} (got {short(repr(first['input']))})"


def _check_keys(entry, label):
    kind = TYPES[entry.type]
    allowed = {"id", "at", "type", "unit", *kind.needs, *kind.takes}
    for key in entry.given:
        if key not in allowed:
            raise FlightError(f"{label}.{key}: {entry.type} has no such key; it takes {', '.join(_ordered(allowed))}")
    for key in kind.needs:
        if getattr(entry, key) is None:
            meaning = f" ({kind.value})" if key == "value" and kind.value else ""
            raise FlightError(f"{label}: {entry.type} needs {key}{meaning}")
    if entry.type == "noise" and entry.value < 0 or entry.type in ("quantise", "saturate") and entry.value <= 0:
        raise FlightError(f"{label}.value: {entry.value:g} is not allowed; allowed: {kind.value}, greater than 0")


def _ordered(keys):
    return [name for name in FaultEntry.model_fields if name in keys]


def _check_window(entry, label):
    if entry.at_s is not None:
        others = [key for key in ("from_s", "until_s", "for_s", "every_s", "when") if getattr(entry, key) is not None]
        if others:
            raise FlightError(f"{label}: at_s is one instant: it goes with none of from_s, until_s, for_s, every_s, when "
                              f"({', '.join(others)} is given)")
    begin = entry.from_s or 0.0
    if entry.until_s is not None and entry.until_s <= begin:
        raise FlightError(f"{label}: the window ends before it begins: from_s {begin:g}, until_s {entry.until_s:g}")
    if entry.until_s is not None and entry.for_s is not None and entry.every_s is None and entry.when is None:
        raise FlightError(f"{label}: until_s and for_s both say when it ends; give one of them")
    if entry.every_s is not None and entry.for_s is not None and entry.for_s >= entry.every_s:
        raise FlightError(f"{label}: it lasts {entry.for_s:g} s (for_s) and begins anew every {entry.every_s:g} s "
                          "(every_s); for_s must be the shorter one")
    if entry.every_s is not None and entry.when is not None:
        raise FlightError(f"{label}: every_s and when both say when it begins; give one of them")
    is_event = TYPES[entry.type].is_event
    if is_event and all(getattr(entry, key) is None for key in ("at_s", "from_s", "every_s", "probability", "when")):
        raise FlightError(f"{label}: a {entry.type} happens at instants; say which: at_s, every_s, probability or when")
    if is_event and entry.for_s is not None and entry.probability is None:
        raise FlightError(f"{label}.for_s: a {entry.type} happens at instants and does not last")
    if entry.probability is not None and entry.every is not None:
        raise FlightError(f"{label}: probability and every both say which messages; give one of them")


def spare(identifier: str) -> FaultEntry:
    """A place that is kept for a fault that is injected while the graph runs."""
    return FaultEntry(id=identifier, at=REPORT, type=SPARE.name)
