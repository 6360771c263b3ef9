"""The component ``monitors``: says which watchpoints hold and how often each actionpoint has acted, and asks for modes.

It is called ``flight_graph.monitors.limit_checker:WATCHPOINTS;ACTIONPOINTS;COMPONENT=VEHICLE`` (ids joined by commas; one
COMPONENT=VEHICLE for each component whose mode it asks for). Like the report of faults it computes nothing itself: its
records are filled where the schedule looks at watchpoints.
"""

from functools import cache

from flight_graph.components.component import Component, Formatted
from flight_graph.faults.report import MONITORS, nothing
from msg_schemas.definitions import TYPESTORE
from msg_schemas.modes import mode_request
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector

STATUS = "status"  # its first output
_LEVELS = {"warn": 1, "error": 2}  # of diagnostic_msgs/DiagnosticStatus


def __getattr__(name: str) -> type[Component]:
    """The component with these ids and requests, which stand in its name."""
    if name.startswith("__"):
        raise AttributeError(name)
    watchpoints, actionpoints, requests = (tuple(filter(None, part.split(","))) for part in name.split(";"))
    return limit_checker(watchpoints, actionpoints, requests)


def use(watchpoints, actionpoints, requests: dict[str, str]) -> str:
    """The name of the component. requests: component -> (vehicle, frame) of its modes."""
    asked = ("=".join((component, *modes)) for component, modes in requests.items())
    return f"{__name__}:{','.join(watchpoints)};{','.join(actionpoints)};{','.join(asked)}"


def request_port(component: str) -> str:
    """The output that asks a component for a mode."""
    return f"request_{component.replace('.', '__')}"


@cache
def limit_checker(watchpoints: tuple[str, ...], actionpoints: tuple[str, ...], requests: tuple[str, ...],
                  told: tuple[tuple[str, str], ...] = ()) -> type[Component]:
    """The component with these ids. requests: ``component=vehicle=frame``; told: (level, text) of each actionpoint."""
    status = named_vector(MONITORS, "", {
        **{name: Quantity(None, "1", "1 while the watchpoint holds") for name in watchpoints},
        **{name: Quantity(None, "1", "how often the actionpoint has acted") for name in actionpoints},
    }, Role.TELEMETRY, doc="watchpoints and actionpoints of the scenario")
    asked = {component: modes for component, *modes in (one.split("=") for one in requests)}

    def diagnostics(record):
        """A DiagnosticArray: one status for each actionpoint that has acted, or one that says that none has."""
        types = TYPESTORE.types
        acted = [(name, *one) for name, one in zip(actionpoints, told or [("error", "")] * len(actionpoints))
                 if getattr(record, name) > 0]
        value = types["diagnostic_msgs/msg/KeyValue"]
        held = [value(key=name, value=str(int(getattr(record, name)))) for name in watchpoints]
        made = [types["diagnostic_msgs/msg/DiagnosticStatus"](
            level=_LEVELS[level], name=f"monitors: {name}", message=text or f"{name} has acted", hardware_id="",
            values=held) for name, level, text in acted]
        none = types["diagnostic_msgs/msg/DiagnosticStatus"](level=0, name="monitors", message="no actionpoint has acted",
                                                             hardware_id="", values=held)
        stamp = record.header.stamp
        header = types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=int(stamp.sec), nanosec=int(stamp.nanosec)), frame_id="")
        return types["diagnostic_msgs/msg/DiagnosticArray"](header=header, status=made or [none])

    class LimitChecker(Component):
        """Watches limits, and acts when they are passed."""

        outputs = {STATUS: status, **{request_port(name): mode_request(*modes) for name, modes in asked.items()}}
        rate_hz = 20.0
        formatted = (Formatted("diagnostics", "diagnostic_msgs/msg/DiagnosticArray", STATUS, diagnostics),)
        kernel = nothing

    return LimitChecker
