"""The node ``simulation``: services and parameters by which a controlled run is paused, stepped, taken back and ended.

Parameters: ``rate`` (simulated seconds per wall second), ``reset_to_s`` (where a reset goes back to), ``steps`` (that one
call of ~/step makes), ``place`` (what one call of ~/place puts where).
"""

import signal
import threading
from functools import partial
from types import SimpleNamespace

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node

from flight_graph.errors import FlightError
from flight_graph.ros import program, simulation_services, simulation_standard
from flight_graph.ros import simulation_settings as said
from flight_graph.ros.entities import Entities
from flight_graph.ros.entry import tell_errors
from flight_graph.ros.ports import RawPublisher
from flight_graph.ros.recorder import read_scenario
from flight_graph.ros.simulation import Limits, Simulation
from flight_graph.ros.standing import ORDERED, Reports
from flight_graph.ros.texts import TYPE, text_payload
from flight_graph.timebase import SECOND

_THREADS = 4  # calls that may wait at the same time
_NO_RESET = "the run cannot be taken back: its nodes were started neither by flight run nor by a launch file"


class SimulationNode(Node):
    """Its calls are served by threads of their own; the main thread hears the clock master."""

    def __init__(self, announce):
        super().__init__(said.NODE)
        scenario = read_scenario(self._fixed("scenario", "", "the scenario of the run: a name, or a file"))
        self.settings = SimpleNamespace(epoch_ns=scenario.epoch_ns)
        lockstep = self._fixed("graph.pace", "lockstep", "lockstep or realtime") == "lockstep"
        factor = self._fixed("graph.factor", 0.0, "the rate at the start")
        begin_ns = self._fixed("begin_ns", 0, "where the run began [ns]")
        self.relaunch = None
        if out := self._fixed("out", "", "the bag, where a launch has started the nodes"):
            from flight_graph.ros.relaunch import Relaunch  # with all engines: where flight run takes back, it has them
            self.relaunch = Relaunch(self, scenario, "lockstep" if lockstep else "realtime", factor, out)
        self.simulation = Simulation(Limits(
            scenario.graph.nodes[scenario.graph.clock_master].period_ns, begin_ns, scenario.duration_ns, lockstep,
            _why_no_reset(scenario, self._fixed("resets", False, "whether who started the nodes takes the run back")),
            _only_start(scenario, lockstep)), self._send, self._told(announce))
        self.group = ReentrantCallbackGroup()
        self._orders = RawPublisher(self, said.ORDERS, TYPE, ORDERED)
        self.reports = Reports(self, all_of_them=True)
        self.declare_parameter("rate", factor, ParameterDescriptor(
            description="simulated seconds per wall second" + ("; 0: as fast as the graph answers" if lockstep else "")))
        self.declare_parameter("reset_to_s", begin_ns / SECOND, ParameterDescriptor(
            description="where a reset takes the run back to [s of simulated time]"))
        self.declare_parameter("steps", 1, ParameterDescriptor(description="that one call of ~/step makes [1]"))
        self.add_on_set_parameters_callback(self._on_set)
        self.declare_parameter("place", "", ParameterDescriptor(
            description="what one call of ~/place puts where: ENTITY.QUANTITY=[NUMBERS], several with a semicolon between"))
        self.entities = Entities(scenario.graph)
        simulation_services.offer(self)
        simulation_standard.offer(self)

    def _fixed(self, name, default, doc):
        return self.declare_parameter(name, default, ParameterDescriptor(description=doc, read_only=True)).value

    def _told(self, announce):
        """Who is told of a reset, and of the end of the run."""
        def tell(event):
            if self.relaunch and "reset" in event:
                threading.Thread(target=self.relaunch.take_back, args=(event["reset"], event["from_ns"], event["rate"]),
                                 daemon=True).start()
            else:
                announce(event)
        return tell

    def _send(self, text):
        self._orders.publish(text_payload(text))

    @property
    def reset_to_ns(self) -> int:
        """Where a reset goes back to."""
        return round(self.get_parameter("reset_to_s").value * SECOND)

    @property
    def steps(self) -> int:
        """That one call makes."""
        return self.get_parameter("steps").value

    @property
    def placements(self) -> dict[str, dict]:
        """What one call puts where, by entity. Raises FlightError."""
        return self.entities.parse(self.get_parameter("place").value, "place")

    def _on_set(self, parameters):
        try:
            for parameter in parameters:
                self._check(parameter.name, parameter.value)
        except FlightError as error:
            return SetParametersResult(successful=False, reason=str(error))
        for parameter in parameters:
            if parameter.name == "rate":
                self.simulation.set_rate(parameter.value)
        return SetParametersResult(successful=True)

    def _check(self, name, value):
        if name == "rate":
            self.simulation.check_rate(value)
        elif name == "reset_to_s":
            if not abs(value) < 1e9:
                raise FlightError(f"reset_to_s: {value} is not allowed; allowed: a time of the run in seconds")
            self.simulation.check_reset(round(value * SECOND))
        elif name == "place" and value:
            self.entities.parse(value, name)
        elif name == "steps" and value < 1:
            raise FlightError(f"steps: {value} is not allowed; allowed: at least 1")

    def hear(self, stopping: threading.Event) -> None:
        """Take the reports of the clock master until it is time to end."""
        while not stopping.is_set() and not (self.relaunch and self.relaunch.failure):
            for report in self.reports.new():
                self.simulation.take(report)
            self.reports.wait()
        self.simulation.close()
        self.entities.close()


def _why_no_reset(scenario, resets) -> str:
    if scenario.foreign:
        return f"the run cannot be taken back: {' and '.join(scenario.foreign)} stands for a foreign node, which goes on"
    return "" if resets else _NO_RESET


def _only_start(scenario, lockstep) -> str:
    if not lockstep:
        return "in realtime the wall clock decides what reaches whom, so a run cannot be made again up to a time"
    return "where faults may be injected on the way, no memory is made of a run" if scenario.live_ids else ""


def _live(stopping, announce):
    node = SimulationNode(announce)
    try:
        executor = MultiThreadedExecutor(_THREADS)
        executor.add_node(node)
        thread = threading.Thread(target=_serve, args=(executor,), daemon=True)
        thread.start()
        announce({"ready": node.get_name()})
        node.hear(stopping)
        executor.shutdown(timeout_sec=1.0)
        thread.join(timeout=1.0)
        if node.relaunch and node.relaunch.failure:
            raise FlightError(node.relaunch.failure)
    finally:
        if node.relaunch:
            node.relaunch.close()
        node.destroy_node()


def _serve(executor):
    try:
        executor.spin()
    except ExternalShutdownException:
        pass


run_simulation = partial(program.run, said.NODE, _live)


def main(arguments: list[str], announce=None) -> int:
    """The executable ``simulation``."""
    return program.main("simulation: pauses, steps and ends a run of nodes that are controlled\n\n"
                        "usage: flight node sim_nodes/simulation --ros-args -p scenario:=cubli_asteroid",
                        run_simulation, arguments, announce or _tell)


def _tell(event):
    tell_errors(event)
    if "quit" in event:
        signal.raise_signal(signal.SIGTERM)
