"""Simulation control by the services and the action of simulation_interfaces, where that package is installed.

Names are those that other simulators have, in the namespace of the nodes: ``get_simulation_state``, ``step_simulation``.
"""

import importlib.util
from functools import partial
from math import nan

from geometry_msgs.msg import Point, Quaternion, Vector3
from rclpy.action import ActionServer, CancelResponse

from flight_graph.components import placement
from flight_graph.errors import FlightError
from flight_graph.ros import simulation as control
from flight_graph.ros.simulation import Answer
from flight_graph.timebase import stamp_parts

PACKAGE = "simulation_interfaces"
_FEATURES = ("ENTITY_CATEGORIES", "ENTITY_STATE_GETTING", "ENTITY_INFO_GETTING", "SIMULATION_STATE_GETTING",
             "SIMULATION_STATE_SETTING", "SIMULATION_STATE_PAUSE", "STEP_SIMULATION_SINGLE", "STEP_SIMULATION_MULTIPLE",
             "STEP_SIMULATION_ACTION", "ENTITY_STATE_SETTING")
_TIME, _STATE, _SPAWNED = 1, 2, 4  # scopes of a reset
_ABOUT = ("docs/simulation_control.md. A step is one firing of the clock master. Time and state are reset together; the "
          "parameter reset_to_s of the node simulation says to which time, its parameter rate how fast the run goes. "
          "Velocities and accelerations that are not known are NaN; accelerations cannot be set.")
_UNKNOWN = (nan, nan, nan)


def offer(node) -> bool:
    """Make the services of a `flight_graph.ros.simulation_node.SimulationNode`; whether the package is there."""
    if importlib.util.find_spec(PACKAGE) is None:
        return False
    from simulation_interfaces import srv
    served = _Served(node)
    for name, type_ in {"get_simulator_features": srv.GetSimulatorFeatures, "get_simulation_state": srv.GetSimulationState,
                        "set_simulation_state": srv.SetSimulationState, "step_simulation": srv.StepSimulation,
                        "reset_simulation": srv.ResetSimulation, "get_entities": srv.GetEntities,
                        "get_entities_states": srv.GetEntitiesStates, "get_entity_info": srv.GetEntityInfo,
                        "get_entity_state": srv.GetEntityState, "set_entity_state": srv.SetEntityState}.items():
        node.create_service(type_, name, getattr(served, name), callback_group=node.group)
    from simulation_interfaces.action import SimulateSteps
    served.action = ActionServer(node, SimulateSteps, "simulate_steps", served.simulate_steps, callback_group=node.group,
                                 cancel_callback=lambda _: CancelResponse.ACCEPT)
    return True


class _Served:
    """One method a service."""

    def __init__(self, node):
        self._node, self._run, self._entities = node, node.simulation, node.entities

    # -- time ----------------------------------------------------------------------------------------------------
    def get_simulator_features(self, _, response):
        from simulation_interfaces.msg import SimulatorFeatures
        names = _FEATURES if self._run.limits.why_no_reset else (*_FEATURES, "SIMULATION_RESET")
        response.features.features = [getattr(SimulatorFeatures, name) for name in names]
        response.features.custom_info = _ABOUT
        return response

    def get_simulation_state(self, _, response):
        response.state.state = self._run.state
        return _with(response, Answer(control.OK, ""))

    def set_simulation_state(self, request, response):
        return _with(response, self._run.set_state(request.state.state))

    def step_simulation(self, request, response):
        return _with(response, self._run.step(request.steps))

    def reset_simulation(self, request, response):
        scope = request.scope or _TIME | _STATE | _SPAWNED
        if scope & (_TIME | _STATE) != _TIME | _STATE:
            return _with(response, Answer(control.UNSUPPORTED, "time and state go back together: allowed is a scope with "
                                          f"both, such as 0 or {_TIME | _STATE}; it was {request.scope}"))
        return _with(response, self._run.reset(self._node.reset_to_ns))

    def simulate_steps(self, goal):
        """The action: each step is told."""
        from simulation_interfaces.action import SimulateSteps

        def told(done, left):
            goal.publish_feedback(SimulateSteps.Feedback(completed_steps=done, remaining_steps=left))
            return not goal.is_cancel_requested
        answer = self._run.step(goal.request.steps, told)
        if answer.is_ok:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return _with(SimulateSteps.Result(), answer)

    # -- entities ------------------------------------------------------------------------------------------------
    def get_entities(self, request, response):
        response.entities, answer = self._filtered(request.filters)
        return _with(response, answer)

    def get_entities_states(self, request, response):
        response.entities, answer = self._filtered(request.filters)
        try:
            response.states = [self._state(name) for name in response.entities]
        except FlightError as error:
            response.entities, answer = [], Answer(control.FAILED, str(error))
        return _with(response, answer)

    def get_entity_info(self, request, response):
        if unknown := self._unknown(request.entity):
            return _with(response, unknown)
        response.info.category.category = response.info.category.CATEGORY_ROBOT
        response.info.description = self._entities.about[request.entity]
        return _with(response, Answer(control.OK, ""))

    def get_entity_state(self, request, response):
        if unknown := self._unknown(request.entity):
            return _with(response, unknown)
        try:
            response.state = self._state(request.entity)
        except FlightError as error:
            return _with(response, Answer(control.FAILED, str(error)))
        return _with(response, Answer(control.OK, ""))

    def set_entity_state(self, request, response):
        return _with(response, self._unknown(request.entity) or self._set(request))

    def _set(self, request) -> Answer:
        """Newer versions of the standard say which half is set, the older one sets both."""
        name, sets_pose = request.entity, getattr(request, "set_pose", True)
        if not self._entities.can_be_put(name):
            return Answer(control.UNSUPPORTED, f"{name} cannot be put elsewhere: its component declares no part 'place'")
        try:
            self._entities.require_frame(name, request.state.header.frame_id)
        except FlightError as error:
            return Answer(control.UNSUPPORTED, str(error))
        pose, twist = request.state.pose, request.state.twist
        halves = [(sets_pose, control.INVALID_POSE, {"position": _numbers(pose.position), "orientation": _numbers(
            pose.orientation)}), (getattr(request, "set_twist", True), control.FAILED, {
                "velocity": _numbers(twist.linear), "angular_velocity": _numbers(twist.angular)})]
        given = {}
        for is_set, code, half in halves:
            try:
                given |= placement.checked(half, name) if is_set else {}
            except FlightError as error:
                return Answer(code, str(error))
        if not given:
            return Answer(control.UNSUPPORTED, "neither set_pose nor set_twist is true; accelerations follow from forces")
        return self._run.place(name, partial(self._entities.put, name, given), sets_pose)

    def _unknown(self, name):
        if name in self._entities.about:
            return None
        known = ", ".join(self._entities.about) or "none"
        return Answer(control.NOT_FOUND, f"there is no entity '{name}'; there is {known}")

    def _filtered(self, filters):
        if filters.tags.tags or filters.bounds.points:
            return [], Answer(control.UNSUPPORTED, "entities have no tags and no bounds here; allowed filters: the "
                              "expression, and categories")
        try:
            found = self._entities.matching(filters.filter)
        except FlightError as error:
            return [], Answer(control.FAILED, str(error))
        wanted = {one.category for one in filters.categories}
        from simulation_interfaces.msg import EntityCategory
        return found if not wanted or EntityCategory.CATEGORY_ROBOT in wanted else [], Answer(control.OK, "")

    def _state(self, name):
        """The state of an entity. Raises FlightError."""
        from simulation_interfaces.msg import EntityState
        t_ns, motion = self._entities.motion(name)
        state = EntityState()
        state.header.frame_id = self._entities.frames[name]
        state.header.stamp.sec, state.header.stamp.nanosec = stamp_parts(self._node.settings.epoch_ns + t_ns)
        state.pose.position = Point(**dict(zip("xyz", motion.position)))
        state.pose.orientation = Quaternion(**dict(zip("xyzw", motion.orientation)))
        state.twist.linear, state.twist.angular = _vector(motion.velocity), _vector(motion.angular_velocity)
        state.acceleration.linear = _vector(motion.acceleration)
        state.acceleration.angular = _vector(motion.angular_acceleration)
        return state


def _vector(numbers) -> Vector3:
    x, y, z = numbers or _UNKNOWN
    return Vector3(x=x, y=y, z=z)


def _numbers(message) -> list[float]:
    """The numbers of a point, a vector or a quaternion."""
    return [getattr(message, name) for name in message.get_fields_and_field_types()]


def _with(response, answer: Answer):
    response.result.result, response.result.error_message = answer.code, "" if answer.code == control.OK else answer.text
    return response
