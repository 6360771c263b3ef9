"""The keys of a scenario file; what they mean together is checked in `flight_graph.graphs.scenario`."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from flight_graph.bags.journal import FLUSH_PERIOD_S
from flight_graph.errors import FlightError, sentence_of
from flight_graph.text_files import short
from flight_graph.timebase import J2000

MOST_COMPONENTS = 200  # of a scenario
FOREIGN = "foreign"  # the ``use`` of a node that is not ours
FOREIGN_KEYS = ("inputs", "outputs", "answer_within_s", "late")  # of such a component alone
PortName = Annotated[str, Field(max_length=100, pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
TopicName = Annotated[str, Field(max_length=255, pattern=r"^/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$")]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class ComponentEntry(_Strict):
    """One component of the graph."""

    use: str = Field(max_length=1000, description=(
        "`package/executable`, `module:Class`, or `file.py:Class` relative to the scenario; `foreign`: a node that is not "
        "ours, see foreign.md"))
    rate_hz: float | None = Field(None, description="firing rate [Hz]; the component's own when left out")
    parameters: dict[str, Any] = Field(default_factory=dict, description=(
        'values that differ from the defaults; `"= plant.gravity"` follows another component\'s'))
    inputs: dict[PortName, TopicName] | None = Field(None, max_length=100, description=(
        "of a foreign node: port -> topic that it subscribes to"))
    outputs: dict[PortName, TopicName] | None = Field(None, max_length=100, description=(
        "of a foreign node: port -> topic that it publishes"))
    answer_within_s: float | None = Field(None, gt=0, le=1e6, allow_inf_nan=False, description=(
        "of a foreign node: wall time [s] in which it has to answer a stamp in lockstep; 5 when left out"))
    late: Literal["stop", "hold"] | None = Field(None, description=(
        "of a foreign node, when it has not: `stop` ends the run (when left out), `hold` goes on with its last message"))


class IncludeEntry(_Strict):
    """A vehicle: a scenario inside this one."""

    scenario: str | dict[str, Any] = Field(description=(
        "a scenario of the packages, a YAML file relative to this one, or its keys"))
    set: dict[str, Any] = Field(default_factory=dict, max_length=10_000, description=(
        "`component.parameter` -> value, `seed`, `faults.ID.key`: what is different in it"))
    folder: str | None = Field(None, max_length=4000, description="where relative names in it start; that of its file")


class EdgeEntry(_Strict):
    """One input, wired by hand."""

    source: str = Field(alias="from", description="`component.port` of the output")
    delay: int = Field(0, description="1: the message before the newest one, which breaks a loop")


class RecordEntry(_Strict):
    """What the bag holds."""

    topics: list[TopicName] | None = Field(None, max_length=1000, description="topics to record; all when left out")
    max_rate_hz: float | None = Field(None, ge=1e-6, allow_inf_nan=False, description=(
        "every topic is thinned to at most this rate [Hz]"))
    flush_period_s: float = Field(FLUSH_PERIOD_S, ge=0.01, le=60, allow_inf_nan=False, description=(
        "wall time [s] of messages that a kill -9 of the recorder may cost at most"))
    checkpoint_period_s: float | None = Field(None, ge=1e-3, le=1e9, allow_inf_nan=False, description=(
        "simulated time [s] between checkpoints, from which a run can be continued; none when left out; see time.md"))


class EngineLimit(_Strict):
    """The one engine that can run the scenario."""

    engine: str = Field(description="compiled or ros")
    because: str = Field(max_length=1000, description="the reason, shown to whoever asks for another engine")


class EventEntry(_Strict):
    """Parameters that are set at a time of the run, and bodies that are put elsewhere."""

    at_s: float = Field(ge=0, le=1e9, allow_inf_nan=False, description="time [s]: before the first firing then or later")
    set: dict[str, Any] | None = Field(None, min_length=1, max_length=1000, description="`component.parameter` -> value")
    place: dict[str, dict[str, Any]] | None = Field(None, min_length=1, max_length=1000, description=(
        "component that moves -> some of `position`, `orientation`, `velocity`, `angular_velocity`"))

    @model_validator(mode="after")
    def _does_something(self):
        if self.set is None and self.place is None:
            raise ValueError("an event has set, or place, or both")
        return self


class RestartEntry(_Strict):
    """How often a node may be started again."""

    limit: int = Field(3, ge=1, le=1000, description="restarts of one node at most ...")
    window_s: float = Field(60.0, gt=0, le=1e9, allow_inf_nan=False, description="... within this time [s]")


class WatchdogEntry(_Strict):
    """What happens in realtime when a node ends or says nothing; without it a silent node is waited for."""

    gap_s: float = Field(0.5, gt=0, le=3600, allow_inf_nan=False, description=(
        "a node that has not beaten for so long, and its own period, is taken for dead [s]"))
    restart: RestartEntry | None = Field(None, description="start it again; when left out, the run ends and names it")


class ScenarioFile(_Strict):
    """The file's keys."""

    name: str = Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=100, description=(
        "what bags and error texts call it: letters, digits, `_`, `-` and `.`"))
    title: str = Field(max_length=1000, description="one line for lists")
    description: str = Field("", max_length=20_000, description="what to know of it")
    duration_s: float = Field(description="simulated time [s]")
    seed: int = Field(0, ge=-2**63, lt=2**63, description=(
        "of all noise: each component's own stream follows from it and the component's name"))
    epoch_ns: int = Field(J2000, description="stamp of t = 0 [ns since 1970]; J2000 when left out")
    base_rate_hz: float | None = Field(None, description=(
        "rate of the base tick [Hz]; the slowest that fits all rates when left out"))
    components: dict[str, ComponentEntry] = Field(default_factory=dict, max_length=MOST_COMPONENTS, description=(
        "name -> component, in the order in which they are listed"))
    include: dict[str, IncludeEntry] | None = Field(None, max_length=100, description=(
        "name -> scenario that flies in this one (a name or a file alone will do); its components are `name.component`; "
        "see vehicles.md"))
    connect: dict[str, str | EdgeEntry] = Field(default_factory=dict, description=(
        "`component.port` of an input -> `component.port` of its source; inputs left out find theirs by topic"))
    record: RecordEntry = Field(default_factory=RecordEntry, description="what the bag holds")
    faults: list[dict[str, Any]] | None = Field(None, description=(
        "what breaks, where and when; see faults.md"))
    events: list[EventEntry] | None = Field(None, max_length=10_000, description=(
        "parameters that change while it runs, bodies that are put elsewhere; see events.md"))
    live_faults: int | None = Field(None, ge=1, le=100, description=(
        "places `live_1` to `live_N` for faults that are injected while the graph runs as nodes; see faults.md"))
    monitors: dict[str, Any] | None = Field(None, description=(
        "limits that flight software watches, and what it does when they are passed; see faults.md"))
    watchdog: WatchdogEntry | None = Field(None, description="in realtime: what is done about nodes that end or hang")
    metrics: str | None = Field(None, description="`module:function` or `file.py:function` of the run's numbers")
    measures: dict[str, dict[str, Any]] | None = Field(None, max_length=1000, description=(
        "numbers that the messages are reduced to, without a function; see campaigns.md"))
    figure: str | None = Field(None, description="`module:function` or `file.py:function` that draws the run")
    paper: str | None = Field(None, description="folder in `papers/` whose claims the bag carries")
    only: EngineLimit | None = Field(None, description="the one engine that can run it, and why")
    vary: dict[str, Any] | None = Field(None, description="what `flight sweep` varies; see campaigns.md")

    @field_validator("include", mode="before")
    @classmethod
    def _whole_entries(cls, value):
        return {name: {"scenario": entry} if isinstance(entry, str) else entry for name, entry in value.items()} if (
            isinstance(value, dict)) else value

    @classmethod
    def read(cls, data: dict, origin: str) -> "ScenarioFile":
        """Check the keys and the types of their values. Raises FlightError with the first thing that is wrong."""
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise FlightError(f"{origin}: {_first_sentence(error)}") from None


def _first_sentence(error: ValidationError) -> str:
    first = error.errors()[0]
    where = ".".join(short(str(part)) for part in first["loc"] if part not in ("str", "EdgeEntry", "dict[str,any]"))
    if first["type"] == "extra_forbidden":
        return f"{where}: there is no such key; allowed here: " + ", ".join(_keys_at(first["loc"]))
    if first["type"] == "string_pattern_mismatch":
        allowed = "a topic's name: letters, digits, _ and /"
        if where == "name" or "[key]" in where:
            allowed = "letters, digits and _ - ." if where == "name" else "letters, digits and _"
        return f"{where}: {short(repr(first['input']))} is not allowed; allowed: {allowed}"
    return f"{where}: {sentence_of(first)} (got {short(repr(first['input']))})"


PARTS = {"components": ComponentEntry, "include": IncludeEntry, "events": EventEntry, "connect": EdgeEntry,
         "record": RecordEntry, "only": EngineLimit, "watchdog": WatchdogEntry}  # below a key


def _keys_at(location):
    model = PARTS.get(location[0] if len(location) > 1 else "", ScenarioFile)
    return [info.alias or name for name, info in model.model_fields.items()]
