"""Where faults stand in a schedule: which firing looks at them, and which arrays they work on.

Names of arrays, besides those of `flight_graph.engines.schedule`: E_ (an output behind its faults), S_ and F_ (an input on
its way through its faults, and as its reader sees it), N_ (parameters before faults), Z_ (the state at the start), W_ (a
signal that a condition reads), T_ (the ticks of a log whose messages are not regular), A_ (what a fault remembers), B_
(numbers and messages that it keeps), C_ (the steps of its condition), G_ (all parameters from an event
on, and where a body is put).
"""

from dataclasses import dataclass

import numpy as np

from flight_graph.engines import effects
from flight_graph.engines.addresses import same
from flight_graph.engines.condition_steps import STEP
from flight_graph.faults import fault_types as types
from flight_graph.faults.conditions import Condition
from flight_graph.faults.fault_set import FOREVER, Fault, FaultSet
from flight_graph.graphs.events import Change
from flight_graph.graphs.placements import Placed
from flight_graph.monitors.limit_checker import STATUS, request_port
from flight_graph.monitors.monitor_set import Action, MonitorSet


@dataclass(frozen=True)
class Effect:
    """One fault at one record. array, offset, dtype, count: the numbers; stamp: offset of the stamp, for messages.

    kept: bytes that it keeps (numbers, or messages of ``size``). name: of its arrays.
    """

    name: str
    fault: Fault | None
    op: int
    array: str
    offset: int = 0
    dtype: np.dtype = np.dtype("<f8")
    count: int = 0
    stamp: int = 0
    kept: int = 0
    node: str = ""  # whose firings look at it
    condition: Condition | None = None
    action: Action | None = None  # of ACT and REQUEST
    mode: int = 0  # of REQUEST: the number of the mode, the record that keeps it, and (array, offset) of the acts
    written: str = ""
    acts: tuple[str, int] = ("", 0)
    change: Change | None = None  # of SET, and when the next one of the component begins
    end: int = 0


@dataclass(frozen=True)
class Channel:
    """A record on its way through the effects on it: from ``origin`` to ``record``, and on to ``visible`` where it is
    shown.
    """

    name: str
    origin: str
    record: str
    visible: str | None
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Put:
    """A placement for the one firing from begin_ns until before end_ns. array: of its record."""

    array: str
    begin_ns: int
    end_ns: int
    record: np.ndarray


@dataclass(frozen=True)
class Own:
    """What a firing looks at before it calls its part. first: whether it is the component's first part in a tick."""

    node: str
    first: bool
    ends: tuple[Effect, ...] = ()  # of the component itself
    effects: tuple[Effect, ...] = ()  # of state and parameters
    channels: tuple[Channel, ...] = ()  # of inputs
    parameters: str | None = None  # array of the parameters as the part sees them, where faults change them
    placements: tuple["Put", ...] = ()  # of the body, after all that


_NUMBER_OPS = {"bias": effects.BIAS, "spike": effects.BIAS, "scale": effects.SCALE, "drift": effects.DRIFT,
               "noise": effects.NOISE, "quantise": effects.QUANTISE, "saturate": effects.SATURATE, "off": effects.STUCK,
               "bit_flip": effects.BIT_FLIP}
_MESSAGE_OPS = {"drop": effects.DROP, "delay": effects.DELAY, "duplicate": effects.DUPLICATE, "freeze": effects.FREEZE,
                "stale": effects.STALE}


def _op(fault: Fault) -> int:
    if fault.entry.type == "stuck":
        return effects.HOLD if fault.entry.value is None else effects.STUCK
    if fault.place.kind == types.COMPONENT:
        return effects.RESTART if fault.entry.type == "restart" else effects.DOWN
    if fault.place.kind == types.INPUT_MESSAGE and fault.entry.type == "drop":
        return effects.LOSE
    return {**_NUMBER_OPS, **_MESSAGE_OPS}[fault.entry.type]


@dataclass
class NodeFaults:
    """The faults of one component, bound to the names of arrays.

    node: with ``name`` and ``component``. irregular: whether it may fall silent; is_report: whether it reports them.
    """

    node: object
    faults: list[Fault]
    irregular: bool
    monitors: MonitorSet | None = None  # where the component is that of the monitors
    parameter_changes: tuple[Change, ...] = ()
    is_report: bool = False
    placements: tuple[Placed, ...] = ()

    def __post_init__(self):
        self._numbers = {id(fault): number for number, fault in enumerate(self.faults)}

    def _effect(self, fault: Fault, array: str, signal=None) -> Effect:
        place, op = fault.place, _op(fault)
        common = {"name": f"{self.node.name}.{self._numbers[id(fault)]}", "fault": fault, "op": op, "array": array,
                  "node": self.node.name,
                  "condition": fault.condition}
        if place.field is not None:
            found = place.field
            return Effect(**common, offset=found.offset, dtype=found.dtype, count=found.count,
                          kept=8 * found.count if op == effects.HOLD else 0)
        if signal is None:
            return Effect(**common)
        size, ring = signal.dtype.itemsize, (fault.entry.ticks or 0) + 1
        return Effect(**common, stamp=_stamp_offset(signal), kept=size * ring)

    def output(self, port: str, written: str, record: str) -> Channel | None:
        """The way of an output through its faults; None where it has none."""
        signal = self.node.component.outputs[port]
        mine = [fault for fault in self.faults if fault.place.port == port
                and fault.place.kind in (types.OUTPUT, types.OUTPUT_MESSAGE)]
        found = tuple(self._effect(fault, record, signal) for fault in mine)
        if self.is_report:
            found = self._report(record, signal)
        elif self.monitors and port == STATUS:
            found = (*self._status(record, signal), *found)
        elif self.monitors:
            found = (*self._requests(port, written, record, signal), *found)
        if not found and not self.irregular:
            return None
        return Channel(f"{self.node.name}.{port}", written, record, None, found)

    def _report(self, record, signal):
        flags = [Effect(f"{self.node.name}.{fault.id}", fault, effects.FLAG, record, signal.dtype.fields[fault.id][1],
                        count=1, node=self.node.name, condition=fault.condition) for fault in self.faults]
        changed = Effect(f"{self.node.name} changed", self.faults[0], effects.ON_CHANGE, record,
                         stamp=_stamp_offset(signal), kept=signal.dtype.itemsize)
        return (*flags, changed)

    def _status(self, record, signal):
        """Watchpoints set their numbers, then actionpoints count."""
        for watch in self.monitors.watches:
            yield self._point(watch.entry.id, effects.FLAG, watch.condition, record, signal)
        for action in self.monitors.actions:
            yield self._point(action.entry.id, effects.ACT, action.condition, record, signal, action)

    def _point(self, name, op, asked, record, signal, action=None):
        return Effect(f"{self.node.name} {name}", None, op, record, signal.dtype.fields[name][1], count=1,
                      node=self.node.name, condition=asked, action=action)

    def _requests(self, port, written, record, signal):
        for action in self.monitors.actions:
            for component, mode in action.requests:
                if request_port(component) == port:
                    status = self.node.component.outputs[STATUS].dtype.fields[action.entry.id][1]
                    yield Effect(f"{self.node.name} {port} {action.entry.id}", None, effects.REQUEST, record,
                                 signal.dtype.fields["mode"][1], node=self.node.name, action=action, mode=mode,
                                 written=written, acts=(f"E_{self.node.name}.{STATUS}", status))

    def input(self, port: str, origin: str) -> Channel | None:
        """The way of an input through its faults; None where it has none."""
        mine = [fault for fault in self.faults if fault.place.port == port
                and fault.place.kind in (types.INPUT, types.INPUT_MESSAGE)]
        if not mine or self.is_report:
            return None
        name, signal = f"{self.node.name}.{port}", self.node.component.inputs[port]
        return Channel(name, origin, f"S_{name}", f"F_{name}",
                       tuple(self._effect(fault, f"S_{name}", signal) for fault in mine))

    def own(self, part: str, parameters: str, state: str, inputs: tuple[Channel, ...]) -> Own | None:
        """What the firing of a part looks at; None where there is nothing."""
        if self.is_report:
            return None
        component = self.node.component
        first = part == next(name for name in ("kernel", "output", "update") if getattr(component, name) is not None)
        ends = [self._effect(fault, "") for fault in self.faults if fault.place.kind == types.COMPONENT]
        changes = list(self._sets(parameters))
        changes += [self._effect(fault, parameters if fault.place.kind == types.PARAMETER else state)
                   for fault in self.faults if fault.place.kind in (types.STATE, types.PARAMETER)]
        if not (ends or changes or inputs or self.placements):
            return None
        changed = self.changes_parameters
        if not first:
            return Own(self.node.name, False, channels=inputs) if inputs or ends else None
        puts = tuple(Put(f"G_{self.node.name}.place {number}", one.begin_ns, one.begin_ns + self.node.period_ns, one.record)
                     for number, one in enumerate(self.placements))
        return Own(self.node.name, True, tuple(ends), tuple(changes), inputs, parameters if changed else None, puts)

    def _sets(self, parameters):
        """What events set, before faults act on it: each holds until the next one."""
        ends = [*(change.begin_ns for change in self.parameter_changes[1:]), FOREVER]
        for number, (change, end) in enumerate(zip(self.parameter_changes, ends)):
            size = change.record.nbytes
            yield Effect(f"{self.node.name}.set {number}", None, effects.SET, parameters, count=size, node=self.node.name,
                         change=change, end=end)

    @property
    def changes_parameters(self) -> bool:
        """Whether a fault or an event changes parameters."""
        return bool(self.parameter_changes) or any(fault.place.kind == types.PARAMETER for fault in self.faults)


def of(faults: FaultSet | None, node) -> NodeFaults | None:
    """The faults of a component; None where it has none. Those of all belong to the report of them."""
    if not faults or not faults.concerns(node.name):
        return None
    mine = faults.of(node.name)
    is_report = faults.is_report(node.name)
    silent = is_report or any(fault.place.kind == types.COMPONENT for fault in mine)
    return NodeFaults(node, mine, silent, faults.monitors_at(node.name), tuple(faults.changes.get(node.name, ())),
                      is_report, tuple(faults.placements.get(node.name, ())))


def watched(node: str, other: str, port: str) -> str:
    """The array of a signal that the conditions of a component's faults read."""
    return f"W_{node}.{other}.{port}"


def memory(firings, components: dict, arrays: dict) -> dict[str, np.ndarray]:
    """Fresh arrays of all that the faults of some firings remember and keep. components: node -> class; arrays: those that
    there are, with parameters and states as they begin."""
    made = {}
    for firing in firings:
        component, own = components[firing.node], firing.own
        for one in firing.publications:
            if one.channel is not None:
                made[one.channel.record] = one.signal.new()[1]
                _remember(made, one.channel.effects)
        if own is None:
            continue
        _remember(made, (*own.ends, *own.effects))
        for channel in own.channels:
            signal = component.inputs[channel.name.removeprefix(f"{firing.node}.")]
            made[channel.record], made[channel.visible] = signal.new()[1], signal.new()[1]
            _remember(made, channel.effects)
        made |= {one.array: same(one.record) for one in own.placements}
        if own.parameters:
            made[f"N_{firing.node}"] = same(arrays[own.parameters])
        if own.ends:
            made[f"Z_{firing.node}"] = same(arrays[firing.state])
    return made


def _remember(made, found):
    for effect in found:
        made[f"A_{effect.name}"] = np.zeros(1, effects.MEMORY)
        if effect.kept:
            made[f"B_{effect.name}"] = np.zeros(-(-effect.kept // 8), "<i8")
        if effect.change is not None:
            made[f"G_{effect.name}"] = same(effect.change.record)
        if effect.condition:
            made[f"C_{effect.name}"] = np.zeros(len(effect.condition.steps), STEP)


def _stamp_offset(signal) -> int:
    return next(offset for path, _, offset, _ in signal.leaves() if path.endswith("stamp.sec"))
