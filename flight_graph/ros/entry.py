"""What an executable runs: ``main(package, executable)`` starts one component, or the program of that name."""

import importlib
import signal
import sys

from flight_graph.components import registry
from flight_graph.errors import FlightError
from flight_graph.ros import leaving
from flight_graph.ros.environment import prepare_environment


def main(package: str, executable: str, arguments: list[str] | None = None) -> int:
    """Run ``package/executable`` with ROS arguments; return the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    leaving.at_once()
    try:
        target = registry.executables(package).get(executable)
        if target is None:
            raise registry.unknown("executable", executable, registry.executables(package), package)
        module, _, attribute = target.partition(":")
        found = getattr(importlib.import_module(module), attribute)
        if not isinstance(found, type):
            return found(arguments)
        return run_component(f"{package}/{executable}", executable, arguments)
    except FlightError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


def run_component(use: str, default_name: str, arguments: list[str], announce=None) -> int:
    """Run the component ``use`` as a node until it is done or asked to end, then end this process.

    Returns where nothing was to be run.
    """
    leaving.at_once()
    prepare_environment()
    component = registry.component(use)
    if "-h" in arguments or "--help" in arguments:
        print(_help(use, default_name, component))
        return 0
    import numba
    import rclpy  # noqa: F401 (takes a while)

    from flight_graph.engines import compilation
    if not numba.config.DISABLE_JIT:
        compilation.load({use: component}, progress=_Said(use))  # before anybody sees the node, and sends
    leaving.keep_imports()
    leaving.leave(_run(use, component, default_name, arguments, announce or tell_errors))


class _Said:
    """Says once that machine code is made: a person waits for it."""

    def __init__(self, use):
        self._use, self._is_said = use, False

    def __call__(self, done, total, names):
        if not self._is_said:
            self._is_said = True
            print(f"{self._use}: its machine code is made now, once; the node starts then", file=sys.stderr, flush=True)


def _run(use, component, default_name, arguments, announce) -> int:
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    from flight_graph.ros import lockstep, realtime
    from flight_graph.ros.managed import Stopped
    from flight_graph.ros.node import ComponentNode

    node = None
    stopping = []
    for number in leaving.SIGNALS:
        signal.signal(number, lambda *_: (stopping.append(1), node and node.stopping.set()))
    try:
        rclpy.init(args=["node", *arguments], signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy has a class of its own for each kind of wrong argument
        print(f"error: ROS arguments: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    try:
        node = ComponentNode(default_name, use, component, announce)
        if stopping:
            raise Stopped
        node.wait_until_configured()
        node.introduce()
        announce({"ready": node.graph_name})
        (lockstep if node.settings.lockstep else realtime).run(node)
        announce({"done": True, "clock_master": node.settings.clock_master, "wall_s": node.wall_s})
        while node.settings.linger:
            node.check_alive()
            node.stopping.wait(0.05)
        return 0
    except Stopped:
        announce({"stopped": True})
        if node is not None and hasattr(node, "statistics"):
            announce({"statistics": node.statistics.summary()})
        return 0
    except FlightError as error:
        announce({"error": str(error)})
        return 1
    finally:
        for number in leaving.SIGNALS:
            signal.signal(number, signal.SIG_IGN)  # a second one must not break the end
        if node is not None:
            node.close()
        rclpy.try_shutdown()


def tell_errors(event):
    """The ``announce`` of a node that nobody supervises."""
    if "error" in event:
        print(f"error: {event['error']}", file=sys.stderr)


def _help(use, name, component):
    rows = [f"{name}: {component.summary()}", "", f"usage: flight node {use} --ros-args -p NAME:=VALUE ...", "",
            "parameters:"]
    for entry in component.parameters.entries.values():
        rows.append(f"  {entry.name} = {entry.default}  ({entry.range_text}) {entry.doc}")
    rows += ["", "inputs:"] + [f"  {port}: {s.topic} ({s.type_name})" for port, s in component.inputs.items()]
    rows += ["", "outputs:"] + [f"  {port}: {s.topic} ({s.type_name})" for port, s in component.outputs.items()]
    return "\n".join(rows)
