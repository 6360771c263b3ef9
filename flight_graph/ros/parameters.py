"""A component's declared parameters as ROS parameters: descriptors, checks, live changes."""

from collections import deque

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter

from flight_graph.components import declared
from flight_graph.components.entries import Entry, flat
from flight_graph.errors import FlightError


def descriptor(entry: Entry) -> ParameterDescriptor:
    """Unit, range and source of an entry. Closed numeric ranges are given to ROS as ranges too."""
    text = ". ".join(part for part in (entry.doc, f"source: {entry.source}" if entry.source else "") if part)
    made = ParameterDescriptor(
        name=entry.name, description=f"{text} [{entry.unit or '1'}]", additional_constraints=entry.range_text,
        dynamic_typing=True)  # a whole number or a scalar for an array is welcome; the declared check decides
    bounds = dict(entry.bounds)
    if {"ge", "le"} <= bounds.keys():
        if entry.kind == "int":
            made.integer_range = [IntegerRange(from_value=int(bounds["ge"]), to_value=int(bounds["le"]))]
        else:
            made.floating_point_range = [FloatingPointRange(from_value=float(bounds["ge"]), to_value=float(bounds["le"]))]
    return made


def declare_once(node, name: str, default, description: ParameterDescriptor):
    """The value of a parameter, declared at the first call: a node that could not be configured may be so again."""
    if node.has_parameter(name):
        return node.get_parameter(name).value
    return node.declare_parameter(name, default, description).value


class ComponentParameters:
    """Declares the parameters of a component on a node and keeps the record that the kernel reads.

    A change that passes the checks is taken over between two firings (`refresh`).
    """

    def __init__(self, node, component):
        self._node, self._component = node, component
        self._values, self._given = {}, deque()
        for name, entry in component.parameters.entries.items():
            default = component.parameters.defaults()[name]
            try:
                self._values[name] = declare_once(node, name, flat(default), descriptor(entry))
            except ParameterException as error:
                raise FlightError(f"{node.graph_name}.{name}: {error}; allowed: {entry.range_text}") from None
        self._values = component.parameters.validate(self._values, node.graph_name)
        self._values = declared.resolved(component, self._values, node.graph_name, None)
        self.record = component.parameters.record(self._values, node.graph_name)

    @property
    def values(self) -> dict:
        """The resolved values, in plain form."""
        return self._values

    def accept_changes(self) -> None:
        """Check what is set from now on; before, everything that the node declares has been declared.

        A scalar fills an array: the parameter is an array in any case, as it was declared.
        """
        self._node.set_parameters(self._filled(self._node.get_parameters(list(self._values))))
        self._node.add_pre_set_parameters_callback(self._filled)
        self._node.add_on_set_parameters_callback(self._on_set)

    def follow(self, values: dict) -> None:
        """What is set from now on is set on top of these values: an event of the scenario has come."""
        self._values = values

    def taken(self) -> dict:
        """What was set since this was asked last, in plain form."""
        given = {}
        while self._given:
            given |= self._given.popleft()
        return given

    def refresh(self) -> None:
        """Write the values into the record."""
        period = self.record["period"].copy()
        self.record[:] = self._component.parameters.record(self._values, self._node.graph_name)
        self.record["period"] = period

    def _filled(self, parameters) -> list[Parameter]:
        """The same parameters, each of its declared type: a number for an array as that array, a whole one as a number."""
        return [self._fill(parameter) for parameter in parameters]

    def _fill(self, parameter):
        entry = self._component.parameters.entries.get(parameter.name)
        if entry is None or isinstance(parameter.value, bool) or not isinstance(parameter.value, (int, float)):
            return parameter
        default = flat(self._component.parameters.defaults()[parameter.name])
        if not isinstance(default, list):
            return Parameter(parameter.name, value=float(parameter.value)) if isinstance(default, float) else parameter
        value = float(parameter.value) if isinstance(default[0], float) else parameter.value
        return Parameter(parameter.name, value=[value] * len(default))

    def _on_set(self, parameters):
        changes = {p.name: p.value for p in parameters if p.name in self._component.parameters.entries}
        fixed = [p.name for p in parameters if p.name not in changes and p.name not in self._node.free_parameters]
        if fixed:
            return SetParametersResult(successful=False, reason=f"{', '.join(fixed)}: fixed when the node starts")
        try:
            given = self._component.parameters.validate(changes, self._node.graph_name)
            values = {**self._values, **given}
            values = declared.resolved(self._component, values, self._node.graph_name, None)
        except FlightError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self._values = values
        self._given.append(given)
        return SetParametersResult(successful=True)
