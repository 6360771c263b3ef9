"""The monitors of a scenario, checked against its graph: what each watchpoint reads, what each actionpoint does.

Watchpoints are looked at once a firing of the component ``monitors``, on signals as they were before the tick. A
parameter that an actionpoint sets is set where the component fires, once its actionpoint has acted.
"""

import re
from dataclasses import dataclass

from flight_graph.components import names
from flight_graph.errors import FlightError, unknown
from flight_graph.faults import places
from flight_graph.faults.conditions import Condition, condition
from flight_graph.faults.fault_file import FaultEntry
from flight_graph.faults.fault_set import FOREVER, Fault, Window
from flight_graph.faults.report import MONITORS, REPORT
from flight_graph.monitors.limit_checker import STATUS, limit_checker, use
from flight_graph.monitors.monitor_file import Actionpoint, MonitorsFile, Watchpoint
from flight_graph.text_files import short
from msg_schemas.qos import Role

REQUEST = "request"  # the input of a component that takes modes
_TOPIC = "/mode_request"
_NO_WORD = str.maketrans(".[", "__", "]")
_MESSAGE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)+")


@dataclass(frozen=True)
class Watch:
    """A watchpoint and its condition."""

    entry: Watchpoint
    condition: Condition


@dataclass(frozen=True)
class Action:
    """An actionpoint, its condition over watchpoints, and what it asks for: (component, number of the mode)."""

    entry: Actionpoint
    condition: Condition
    number: int
    requests: tuple[tuple[str, int], ...]


def component_of(found: MonitorsFile, nodes: dict, where: str) -> tuple[str, type]:
    """The name and the class of the component ``monitors``. nodes: name -> node, of the rest of the graph. Raises
    FlightError.
    """
    wanted = {name: _vehicle(name, nodes, f"{where}.{one.id}.mode") for one in found.actionpoints for name in one.mode}
    watchpoints, actionpoints = (tuple(one.id for one in entries) for entries in (found.watchpoints, found.actionpoints))
    told = tuple((one.level, one.text) for one in found.actionpoints)
    made = limit_checker(watchpoints, actionpoints, tuple("=".join((name, *modes)) for name, modes in wanted.items()), told)
    return use(watchpoints, actionpoints, wanted), made


def _vehicle(name, nodes, where) -> tuple[str, str]:
    """The vehicle whose modes a component manages, and the frame in which they are said."""
    if name not in nodes:
        raise unknown("component", name, nodes, where)
    component = nodes[name].component
    signal = component.inputs.get(REQUEST)
    if signal is None or not signal.topic.endswith(_TOPIC) or not getattr(component, "modes", ()):
        takers = [other for other, node in nodes.items() if getattr(node.component, "modes", ())]
        raise FlightError(f"{where}: {name} takes no modes; components that do: "
                          f"{', '.join(takers) or 'none in this graph'}")
    return signal.topic.removesuffix(_TOPIC), signal.fixed["header.frame_id"]


class MonitorSet:
    """All monitors of a graph, or of a vehicle in it. Raises FlightError, which begins with ``where`` and the id.

    nodes: name, as the block has it -> node. node: the name of the component that they are; commands: node -> what sets
    parameters there, in the form of faults.
    """

    def __init__(self, found: MonitorsFile, nodes: dict, where: str):
        self.node = nodes[MONITORS].name
        self._nodes = {name: node for name, node in nodes.items() if name not in (MONITORS, REPORT)}
        self._called = {node.name: name for name, node in self._nodes.items()}
        record = nodes[MONITORS].component.outputs[STATUS]
        fields = {one.id: places.entry(record.dtype, one.id, where) for one in found.watchpoints}
        self.watches = [Watch(one, self._watched(one, f"{where}.{one.id}")) for one in found.watchpoints]
        self.actions = [self._action(number, one, fields, f"{where}.{one.id}")
                        for number, one in enumerate(found.actionpoints)]
        self.commands = {}
        for action in self.actions:
            for path, value in action.entry.set.items():
                self._command(action, path, value, nodes, f"{where}.{action.entry.id}.set")

    @property
    def signals(self) -> list[tuple[str, str]]:
        """The (node, port) that watchpoints read."""
        return list(dict.fromkeys(signal for watch in self.watches for signal in watch.condition.signals))

    def _watched(self, entry, where) -> Condition:
        if entry.when is not None:
            found = condition(entry.when, self._nodes, f"{where}.when")
        else:
            if not _MESSAGE.fullmatch(entry.stale) or "." in names.split(entry.stale, self._nodes)[1]:
                raise FlightError(f"{where}.stale: '{short(entry.stale)}' is no message; write component.output")
            found = condition(f"age({entry.stale}) > {entry.after_s!r}", self._nodes, f"{where}.stale")
        for name, port in found.signals:
            name = self._called[name]
            if self._nodes[name].component.outputs[port].role is Role.TRUTH:
                raise FlightError(f"{where}: {name}.{port} is the truth, which flight software cannot see; watch a sensor, "
                                  "an estimate or a command")
        if not found.signals:
            raise FlightError(f"{where}: it watches no signal")
        return found

    def _action(self, number, entry, fields, where) -> Action:
        asked = []
        for name, mode in entry.mode.items():
            modes = self._nodes[name].component.modes
            if mode not in modes:
                raise unknown("mode", mode, modes, f"{where}.mode.{name}")
            asked.append((name, modes.index(mode)))
        return Action(entry, condition(entry.when, {}, f"{where}.when", fields), number, tuple(asked))

    def _command(self, action, path, value, nodes, where):
        node, name = names.split(path, self._nodes)
        place = places.place(f"{node}.parameters.{name}", self._nodes, where)
        declared = self._nodes[node].component.parameters.entries[name.partition("[")[0]]
        if place.field.dtype.kind != "f":
            raise FlightError(f"{where}: {path} is a {declared.kind}; only real numbers can be set in flight")
        nominal = self._nodes[node].values[declared.name]
        declared.validate(_filled(nominal, value), f"{where}: {path}")
        identifier = f"{action.entry.id}_sets_{node}_{name}".translate(_NO_WORD)
        entry = FaultEntry(id=identifier[:60], at=f"{node}.parameters.{name}", type="stuck", value=value)
        asked = condition(f"{MONITORS}.{STATUS}.{action.entry.id} > 0", nodes, where)
        self.commands.setdefault(place.node, []).append(Fault(entry, place, Window(0, FOREVER, 0, 0), asked, 0))


def _filled(nominal, value):
    return [_filled(part, value) for part in nominal] if isinstance(nominal, list) else value
