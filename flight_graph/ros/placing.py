"""Where a body truly is, and that it is put elsewhere: the part of its node, in a run that is controlled.

The hidden service ``~/_motion`` (std_srvs/Trigger) tells its motion at its next firing as JSON, and the parameter
``graph.place`` takes a placement as JSON, which acts before that firing. As what is set of parameters, it is told on
``/_parameter_changes`` with its time, as an entry of a scenario's ``events``.
"""

import json
import threading

import numpy as np
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from std_srvs.srv import Trigger

from flight_graph.components import placement
from flight_graph.engines.addresses import same
from flight_graph.engines.single import SingleComponent
from flight_graph.errors import FlightError
from flight_graph.graphs import placements
from flight_graph.graphs.placements import Placed
from flight_graph.text_files import parse_json

PLACE, MOTION = "graph.place", "~/_motion"
_LONGEST = 10_000  # [characters]


class Placing:
    """Made once the node has its machine. arguments: of the node's `SingleComponent`; lock: held while it fires."""

    def __init__(self, node, arguments: tuple):
        self._node, self.lock, self.has_begun = node, threading.Lock(), threading.Event()
        self.t_ns, self._pending = 0, {}  # of its next firing, and what acts before that
        name, use, component, parameters, state, inputs, _, *rest = arguments
        self._outputs = {port: signal.new()[1] for port, signal in component.outputs.items()}
        self._copy = SingleComponent(name, use, component, same(parameters), same(state),
                                     {port: same(record) for port, record in inputs.items()}, self._outputs, *rest)
        node.create_service(Trigger, MOTION, self._tell)
        if component.place is not None:
            node.free_parameters.add(PLACE)
            node.declare_parameter(PLACE, "", ParameterDescriptor(
                description="where it is put before its next firing, as JSON"))
            node.add_on_set_parameters_callback(self._on_set)

    def came(self, t_ns: int) -> None:
        """Its next firing is at t."""
        self.t_ns = t_ns
        self.has_begun.set()

    # -- asked by others, in the thread of the node's services ---------------------------------------------------------
    def _tell(self, _, response):
        try:
            if not self.has_begun.wait(self._node.settings.timeout_s):
                raise FlightError("it has not begun yet")
            response.message, response.success = json.dumps(self._motion({})), True
        except FlightError as error:
            response.message = f"{self._node.graph_name}: {error}"
        return response

    def _on_set(self, parameters):
        try:
            for parameter in parameters:
                if parameter.name == PLACE and parameter.value:
                    given = placement.checked(parse_json(parameter.value, PLACE, _LONGEST), PLACE)
                    self._motion(given)
                    with self.lock:
                        self._pending |= given
        except FlightError as error:
            return SetParametersResult(successful=False, reason=f"{self._node.graph_name}: {error}")
        return SetParametersResult(successful=True)

    def _motion(self, given) -> dict:
        """The motion at the next firing, with what is pending and what is given. Raises FlightError."""
        with self.lock:
            self._copy.take_motion(self._node.machine)
            t_ns, given = self.t_ns, {**self._pending, **given}
        sentence = self._copy.place(placement.record_of(given), t_ns) if given else ""
        sentence = sentence or self._copy.call("output", t_ns)
        if sentence:
            raise FlightError(sentence.partition(" s: ")[2] or sentence)
        found = self._node.component.motion({port: record.view(np.recarray)[0] for port, record in self._outputs.items()})
        return {"t_ns": t_ns, **vars(found)}

    # -- in the node's loop --------------------------------------------------------------------------------------------
    def look(self, t_ns: int) -> dict | None:
        """Before the firing at t: take over where it is put; the entry of that. Raises FlightError."""
        if not self._pending:
            return None
        node = self._node
        with self.lock:
            given, self._pending = self._pending, {}
        placed = Placed.of(t_ns, given)
        if node.faults is not None:
            node.faults.placements.setdefault(node.graph_name, []).append(placed)
            node.take_faults(node.faults)
        elif sentence := node.machine.place(placed.record, t_ns):
            raise FlightError(sentence)
        return placements.as_entry(node.graph_name, t_ns, given)
