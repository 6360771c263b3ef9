"""The faults of a scenario, checked against its graph: what each does, to which numbers or messages, and when.

Each fault belongs to the firings of one component: of the one that publishes the output, reads the input, or owns state and
parameters. There it is looked at once a firing, and decided by time, by the seed and its own name, and by signals as they
were before the tick, so that every engine comes to the same.
"""

from dataclasses import dataclass

from flight_graph.errors import FlightError
from flight_graph.faults import fault_types as types
from flight_graph.faults.conditions import Condition, condition
from flight_graph.faults.fault_file import FaultEntry
from flight_graph.faults.fault_types import SPARE, TYPES, FaultType
from flight_graph.faults.places import Place, place
from flight_graph.faults.report import REPORT
from flight_graph.timebase import SECOND
from flight_math.noise import stream_key
from msg_schemas.qos import Role

FOREVER = 2**62  # [ns]


@dataclass(frozen=True)
class Window:
    """When a fault may be active [ns]: from begin until before end; of each ``every`` (0: never again) the first ``span``.

    With a condition, ``span`` counts from each onset of it (0: as long as it holds).
    """

    begin: int
    end: int
    every: int
    span: int


@dataclass(frozen=True)
class Fault:
    """A fault in its graph. key: of its random numbers."""

    entry: FaultEntry
    place: Place
    window: Window
    condition: Condition | None
    key: int

    @property
    def id(self) -> str:
        return self.entry.id

    @property
    def type(self) -> FaultType:
        return TYPES.get(self.entry.type, SPARE)

    @property
    def unit(self) -> str:
        """The unit that fails."""
        return self.entry.unit or self.place.node


class FaultSet:
    """All faults of a graph. Raises FlightError, which begins with ``where`` and the fault's id.

    nodes: name, as the entries have it -> node of the graph; seed: of the scenario. monitors: a `MonitorSet`, which stands
    in the schedule in the same way: it watches signals, and sets parameters as faults do. epoch_ns: stamp of t = 0.
    is_live: faults may be injected while the graph runs, so any message may be missing. changes: node -> the changes of
    its parameters in time (`flight_graph.graphs.events`), which stand in the schedule in the same way too; placements:
    likewise, where it is put (`flight_graph.graphs.placements`). vehicles: the sets of the vehicles in the graph, by name,
    each with its own report and monitors.
    """

    def __init__(self, entries: list[FaultEntry], nodes: dict, seed: int, where: str, monitors=None, epoch_ns: int = 0,
                 is_live: bool = False, changes: dict | None = None, vehicles: dict | None = None,
                 placements: dict | None = None):
        self.is_live, self.changes, self.vehicles, self.placements = is_live, changes or {}, vehicles or {}, (
            {} if placements is None else placements)
        self.nodes, self.entries, self.monitors, self.epoch_ns = nodes, entries, monitors, epoch_ns
        self.faults = [_fault(entry, nodes, seed, f"{where}.{entry.id}") for entry in entries]
        self._report = (nodes[REPORT].name if REPORT in nodes else REPORT) if self.faults else None
        _refuse_contradictions([fault for one in self.parts() for fault in one.faults], where)

    def __bool__(self):
        return bool(self.faults or self.monitors or self.is_live or self.changes or self.placements
                    or any(self.vehicles.values()))

    def parts(self):
        """Yield this set and those of all vehicles in it."""
        yield self
        for one in self.vehicles.values():
            yield from one.parts()

    def is_report(self, node: str) -> bool:
        """Whether a component reports faults."""
        return any(node == one._report for one in self.parts())

    def monitors_at(self, node: str):
        """The monitors that a component is; None where it is none."""
        return next((one.monitors for one in self.parts() if one.monitors and one.monitors.node == node), None)

    def of(self, node: str) -> list[Fault]:
        """What belongs to a component's firings: commands of monitors, faults in the order of the file, then those of
        vehicles; to a report, all that it reports.
        """
        found = []
        for one in self.parts():
            if node == one._report:
                return one.faults
            found += one.monitors.commands.get(node, []) if one.monitors else []
            found += [fault for fault in one.faults if fault.place.node == node]
        return found

    def watched(self, node: str) -> list[tuple[str, str]]:
        """The (node, port) that are read where a component fires: by conditions of its faults, by watchpoints."""
        monitors = self.monitors_at(node)
        return list(dict.fromkeys([*(monitors.signals if monitors else ()), *watched(self.of(node))]))

    def concerns(self, node: str) -> bool:
        """Whether a component's firings look at anything here."""
        return (self.is_live or node in self.changes or node in self.placements or bool(self.of(node))
                or self.monitors_at(node) is not None)

    def of_components(self) -> list[Fault]:
        """Those of whole components."""
        return [fault for one in self.parts() for fault in one.faults
                if fault.place.kind == types.COMPONENT and fault.type is not SPARE]

    def is_irregular(self, node: str, port: str) -> bool:
        """Whether messages of an output may be missing, late or double."""
        return self.is_live or self.is_report(node) or any(
            fault.place.kind == types.COMPONENT or (fault.place.kind == types.OUTPUT_MESSAGE and fault.place.port == port)
            for fault in self.of(node))


def watched(faults: list[Fault]) -> list[tuple[str, str]]:
    """The (node, port) that the conditions of some faults read."""
    return list(dict.fromkeys(signal for fault in faults if fault.condition for signal in fault.condition.signals))


def _fault(entry, nodes, seed, where) -> Fault:
    if entry.type == SPARE.name:
        return Fault(entry, Place(types.COMPONENT, REPORT), Window(FOREVER, FOREVER, 0, 0), None, 0)
    breakable = {name: one for name, one in nodes.items() if name.rpartition(".")[2] != REPORT}
    found = place(entry.at, breakable, f"{where}.at")
    kind, node = TYPES[entry.type], next(one for one in breakable.values() if one.name == found.node)
    if node.component.is_foreign:
        raise FlightError(f"{where}.at: {found.node} is a foreign node, which nothing here can break; break what it reads "
                          "where that is published, or its answers where they are read")
    _refuse_truth(entry, found, node, where)
    if found.kind not in kind.places:
        raise FlightError(f"{where}: {entry.type} has no meaning for {found.kind} ({entry.at}); allowed there: "
                          f"{', '.join(types.allowed_at(found.kind))}{_hint(found, node, kind)}")
    _check_place(entry, found, node, where)
    period = node.period_ns
    if found.kind in (types.OUTPUT, types.OUTPUT_MESSAGE):
        period = node.output_period_ns(found.port)
    asked = condition(entry.when, nodes, f"{where}.when") if entry.when is not None else None
    return Fault(entry, found, _window(entry, period), asked, stream_key(seed, f"fault {entry.id}"))


def _hint(found, node, kind) -> str:
    if found.kind not in types.MESSAGES or not set(kind.places) & {types.OUTPUT, types.INPUT}:
        return ""
    output = found.kind == types.OUTPUT_MESSAGE
    signal = (node.component.outputs if output else node.component.inputs)[found.port]
    return f"; or name a field: {', '.join(path for path, dtype, _, _ in signal.leaves() if dtype.base.kind == 'f')}"


def _refuse_truth(entry, found, node, where):
    outputs = node.component.outputs
    if found.kind in (types.OUTPUT, types.OUTPUT_MESSAGE) and outputs[found.port].role is Role.TRUTH:
        raise FlightError(f"{where}.at: {entry.at} is the truth, which has no faults; break what measures it or acts on it")


def _check_place(entry, found, node, where):
    component = node.component
    if found.kind == types.COMPONENT and component.kernel is None:
        raise FlightError(f"{where}.at: {found.node} is the world itself (it moves with time): it cannot {entry.type}")
    field = found.field
    if field is None:
        return
    if entry.type == "bit_flip":
        if field.count != 1:
            raise FlightError(f"{where}.at: {found.path} has {field.count} numbers; name one: {found.path}[0]")
        bits = 8 * field.dtype.itemsize
        if entry.bit >= bits:
            raise FlightError(f"{where}.bit: {entry.bit} is outside of the number; {found.path} has {bits} bits, 0 to "
                              f"{bits - 1}")
    elif field.dtype.kind != "f":
        raise FlightError(f"{where}.at: {found.path} is a whole number, where {entry.type} has no meaning; allowed there: "
                          "bit_flip")
    if found.kind == types.PARAMETER:
        _check_parameter(entry, found, node, where)


def _check_parameter(entry, found, node, where):
    """The values that a fault gives to a parameter are allowed ones, as far as they are known before."""
    name = found.path.partition("[")[0]
    declared, value = node.component.parameters.entries[name], 0.0 if entry.type == "off" else entry.value
    if value is None or entry.type not in ("stuck", "off") or name not in node.values:
        return
    declared.validate(_with(node.values[name], value), f"{where}: {found.node}.parameters.{name}")


def _with(nominal, value):
    return [_with(part, value) for part in nominal] if isinstance(nominal, list) else value


def _window(entry, period) -> Window:
    def ns(seconds):
        return round(seconds * SECOND)

    if entry.at_s is not None:
        return Window(ns(entry.at_s), ns(entry.at_s) + period, 0, 0)
    begin = ns(entry.from_s or 0.0)
    end = FOREVER if entry.until_s is None else ns(entry.until_s)
    every = 0 if entry.every_s is None else ns(entry.every_s)
    span = 0 if entry.for_s is None else ns(entry.for_s)
    if TYPES[entry.type].is_event and not span and entry.probability is None:
        span = period
    if every and not span:
        span = period
    if entry.type == "crash" and entry.when is not None:
        span = FOREVER
    if span and not every and entry.when is None:
        end, span = min(end, begin + span), 0
    return Window(begin, end, every, span)


def _refuse_contradictions(faults, where):
    """Two faults that both decide a number (or messages, or a component) alone, at the same time."""
    alone = [fault for fault in faults if fault.type.replaces and fault.condition is None]
    for number, fault in enumerate(alone):
        for other in alone[:number]:
            times = max(fault.window.begin, other.window.begin), min(fault.window.end, other.window.end)
            if times[0] < times[1] and fault.place.meets(other.place):
                until = "the end of the run" if times[1] >= FOREVER else f"{times[1] / SECOND:g} s"
                raise FlightError(f"{where}.{fault.id}: it contradicts {other.id}: both decide {fault.entry.at} alone from "
                                  f"{times[0] / SECOND:g} s to {until}")
