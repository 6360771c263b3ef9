"""What a node knows of its graph, as ROS parameters under ``graph.``: rates, sources, pace, whom to wait for.

Without them (a node started by hand) a component runs alone, in realtime, at its default rates and topics.
"""

import json
from dataclasses import dataclass, field

from rcl_interfaces.msg import ParameterDescriptor

from flight_graph.errors import FlightError
from flight_graph.ros.parameters import declare_once
from flight_graph.ros.simulation_settings import Control, control_of
from flight_graph.timebase import J2000, SECOND, duration_ns, period_ns


@dataclass
class Source:
    """Where an input comes from: topic, period of its messages (0: unknown), delay in firings (0 or 1); or from nowhere."""

    topic: str
    period_ns: int = 0
    delay: int = 0
    is_connected: bool = True  # False: the graph leaves this input open, and it stays zero
    slotted: bool = False  # its messages may be missing: slots say what was sent
    foreign: str = ""  # the foreign node that it comes from, where it does

    def expected_ns(self, t_ns: int) -> int | None:
        """Stamp of the message that belongs to a firing at t: None when there is none yet, or no rate is known."""
        if not self.period_ns:
            return None
        latest = (t_ns - (1 if self.delay else 0)) // self.period_ns * self.period_ns
        return latest if latest >= 0 else None


@dataclass
class Settings:
    """The settings of one node."""

    period_ns: int
    lockstep: bool
    factor: float  # simulated seconds per wall second in realtime
    epoch_ns: int
    duration_ns: int  # 0: until told to stop
    clock_master: bool
    wait_for: list[str]  # nodes whose progress the clock master watches
    window_ns: int  # how far the clock master may run ahead of them
    timeout_s: float
    stale_after_s: float  # realtime: a command older than this becomes zero
    supervised: bool  # tell the clock master how far this node has come
    linger: bool  # stay after the end until told to stop, so that nothing on its way is lost
    check_bounds: bool = False  # an index beyond an array's end stops the node
    knows_epoch: bool = True  # False: a node among strangers takes its time zero from what it hears
    sources: dict[str, Source] = field(default_factory=dict)
    subscribers: dict[str, int] = field(default_factory=dict)
    slotted: dict[str, bool] = field(default_factory=dict)  # outputs whose messages may be missing
    foreign_readers: dict[str, str] = field(default_factory=dict)  # output -> foreign nodes that read it
    match_s: float = 0.0  # longest wait for the others to appear [s of wall time]
    scenario: str = ""  # of the graph, where its faults concern this node
    beats: dict[str, int] = field(default_factory=dict)  # realtime: node -> allowed time between two beats [ns]
    beats_often: bool = False  # realtime: tell how far this node has come at every firing
    joins: bool = False  # realtime: the graph runs already
    control: Control | None = None  # of a run that may be paused
    again: bool = False  # a launch started it: where the run is taken back, it begins again by itself
    clock_period_ns: int = 0  # of /clock, for a node that does not go ahead of it where the run may stand
    checkpoints: dict = field(default_factory=dict)  # see `flight_graph.ros.checkpoint_settings.CheckpointSettings`

    def output_period_ns(self, component, port: str) -> int:
        slower = component.output_rate_hz.get(port)
        return self.period_ns if slower is None else max(self.period_ns, period_ns(slower, port))


def declare(node, component) -> Settings:
    """Declare and read the settings of a node. Raises FlightError."""
    def get(name, default, doc):
        full = f"graph.{name}" if name != "rate_hz" else name
        description = ParameterDescriptor(description=doc, read_only=True, dynamic_typing=True)
        return declare_once(node, full, default, description)

    name = node.graph_name
    pace = get("pace", "realtime", "lockstep: as fast as the graph answers; realtime: on the wall clock")
    if pace not in ("lockstep", "realtime"):
        raise FlightError(f"{name}.graph.pace: {pace!r} is not allowed; allowed: lockstep or realtime")
    rate = get("rate_hz", float(component.rate_hz), "firing rate [Hz]")
    duration = get("duration_s", 0.0, "length of the run [s]; 0: until told to stop")
    alone = bool(component.update)
    settings = Settings(
        period_ns=period_ns(rate, f"{name}.rate_hz"),
        lockstep=pace == "lockstep",
        factor=float(get("factor", 1.0, "simulated seconds per wall second in realtime")),
        epoch_ns=int(get("epoch_ns", J2000, "stamp of simulation time zero [ns]")),
        duration_ns=duration_ns(duration, f"{name}.graph.duration_s") if duration else 0,
        clock_master=bool(get("clock_master", alone, "whether this node sets the time")),
        wait_for=list(get("wait_for", [""], "nodes that the clock master waits for")),
        window_ns=int(get("window_ns", SECOND, "how far the clock master may run ahead [ns]")),
        timeout_s=float(get("timeout_s", 10.0, "longest wait for an input or a node [s of wall time]")),
        stale_after_s=float(get("stale_after_s", 0.5, "realtime: age at which a command becomes zero [s]")),
        supervised=bool(get("supervised", False, "tell the clock master how far this node has come")),
        linger=bool(get("linger", False, "stay after the end until told to stop")),
        check_bounds=bool(get("check_bounds", False, "whether an index beyond an array's end stops the node")),
    )
    settings.knows_epoch = settings.supervised or "graph.epoch_ns" in node._parameter_overrides
    settings.wait_for = [other for other in settings.wait_for if other]
    if settings.factor <= 0:
        raise FlightError(f"{name}.graph.factor: {settings.factor} is not allowed; allowed: greater than 0")
    for port, signal in component.inputs.items():
        settings.sources[port] = Source(
            get(f"inputs.{port}.topic", signal.topic, "topic of this input"),
            int(get(f"inputs.{port}.period_ns", 0, "period of its messages [ns]; 0: take the newest")),
            int(get(f"inputs.{port}.delay", 0, "0: the message of this stamp; 1: the one before")),
            is_connected=not settings.supervised or f"graph.inputs.{port}.topic" in node._parameter_overrides,
            slotted=bool(get(f"inputs.{port}.slotted", False, "whether faults may keep its messages back")),
            foreign=get(f"inputs.{port}.foreign", "", "the foreign node that publishes it"))
    settings.beats = json.loads(get("beats", "{}", "allowed time between beats of each node [ns], as JSON"))
    settings.beats_often = bool(get("beats_often", False, "tell at every firing how far this node has come"))
    settings.joins = bool(get("joins", False, "whether the graph runs already"))
    settings.checkpoints = json.loads(get("checkpoints", "{}", "which checkpoints it tells, and begins at, as JSON"))
    settings.clock_period_ns = int(get("clock_period_ns", 0, "a run that may be paused: period of /clock [ns]"))
    settings.control = control_of(get("control", "", "of a run that may be paused, as JSON"))
    settings.again = bool(get("again", False, "begin again in the same process, where the run is taken back"))
    settings.scenario = get("scenario", "", "the scenario, where its faults concern this node: a name, or a file")
    settings.match_s = float(get("match_s", settings.timeout_s, "longest wait for others to appear [s of wall time]"))
    for port in component.outputs:
        settings.foreign_readers[port] = get(f"outputs.{port}.foreign", "", "foreign nodes that read it")
        settings.slotted[port] = bool(get(f"outputs.{port}.slotted", False, "whether faults may keep its messages back"))
        settings.subscribers[port] = int(get(f"outputs.{port}.subscribers", 0, "readers to wait for at the start"))
    return settings

