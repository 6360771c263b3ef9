"""The services of simulation_interfaces, where that package is installed (the wheels of ROS 2 do not have it)."""

import math
import os
import sys

import pytest
from rclpy.action import ActionClient

from flight_graph.ros import simulation as control
from tests.ros.processes import ROOT, running

pytest.importorskip("simulation_interfaces")

from simulation_interfaces import msg, srv  # noqa: E402
from simulation_interfaces.action import SimulateSteps  # noqa: E402

from tests.ros.test_simulation_control import DOMAIN, operator  # noqa: E402, F401 (a fixture)

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("live faults")]


def test_the_lander_is_driven_by_the_standard(tmp_path, operator):  # noqa: F811
    client, feedback = operator.client, []

    def call(type_, name, **fields):
        return client.call(type_, f"/{name}", type_.Request(**fields))

    def set_state(state):
        return call(srv.SetSimulationState, "set_simulation_state", state=msg.SimulationState(state=state)).result.result

    def put(state, entity="plant"):
        flags = {name: True for name in ("set_pose", "set_twist") if hasattr(srv.SetEntityState.Request, name)}  # of newer ones
        found = call(srv.SetEntityState, "set_entity_state", entity=entity, state=state, **flags).result
        return found.result, found.error_message

    def act(steps):
        actions = ActionClient(client.node, SimulateSteps, "/simulate_steps")
        sent = actions.send_goal_async(SimulateSteps.Goal(steps=steps), lambda one: feedback.append(
            (one.feedback.completed_steps, one.feedback.remaining_steps)))
        client.spin_until(sent.done)
        found = sent.result().get_result_async()
        client.spin_until(found.done)
        return found.result().result.result.result

    with running("run", "lander_nominal", "--engine", "ros", "--control", "--out", tmp_path / "bag", cwd=tmp_path,
                 ROS_DOMAIN_ID=str(DOMAIN), PYTHONPATH=os.pathsep.join([str(ROOT), *sys.path])) as process:  # where the package is
        features = call(srv.GetSimulatorFeatures, "get_simulator_features").features.features
        assert {msg.SimulatorFeatures.SIMULATION_RESET, msg.SimulatorFeatures.STEP_SIMULATION_ACTION} <= {*features}
        assert set_state(control.STOPPED) == srv.SetSimulationState.Response.ALREADY_IN_TARGET_STATE
        assert set_state(msg.SimulationState.STATE_LOADING_WORLD) == srv.SetSimulationState.Response.INCORRECT_TRANSITION
        refused = call(srv.StepSimulation, "step_simulation", steps=1).result
        assert (refused.result, refused.error_message) == (
            msg.Result.RESULT_OPERATION_FAILED, "the run is stopped; steps are made where it is paused")
        early = call(srv.GetEntityState, "get_entity_state", entity="plant")
        assert early.result.result == msg.Result.RESULT_OK and early.state.pose.position.x == -900.0
        assert put(early.state) == (msg.Result.RESULT_INCORRECT_STATE,
                                    "the run is stopped; things are put elsewhere where it is paused")
        assert set_state(control.PAUSED) == msg.Result.RESULT_OK
        assert call(srv.StepSimulation, "step_simulation", steps=2).result.result == msg.Result.RESULT_OK
        assert act(3) == msg.Result.RESULT_OK
        assert feedback[:2] == [(1, 2), (2, 1)]  # a client hears no more once it has the result
        assert call(srv.GetEntities, "get_entities").entities == ["plant"]
        state = call(srv.GetEntityState, "get_entity_state", entity="plant").state
        position, speed = state.pose.position, state.twist.linear
        assert state.header.frame_id == "landing_site" and math.isnan(state.acceleration.linear.x)
        assert (position.x, position.y, position.z) == pytest.approx((-900.0 + 0.4 * 0.3, 450.0 - 0.4 * 0.2, 340.0 + 0.4 * 0.1),
                                                                     abs=0.01)  # [m] after 0.4 s at the scenario's start velocity
        assert (speed.x, speed.y, speed.z) == pytest.approx((0.3, -0.2, 0.1), abs=0.05)
        unknown = call(srv.GetEntityState, "get_entity_state", entity="rover").result
        assert unknown.result == msg.Result.RESULT_NOT_FOUND
        state.pose.position.z, state.twist.linear.y = 250.0, 0.4
        assert put(state)[0] == msg.Result.RESULT_OK
        state = call(srv.GetEntityState, "get_entity_state", entity="plant").state
        assert (state.pose.position.z, state.twist.linear.y) == (250.0, 0.4)
        assert call(srv.StepSimulation, "step_simulation", steps=10).result.result == msg.Result.RESULT_OK
        after = call(srv.GetEntitiesStates, "get_entities_states").states[0]
        assert after.pose.position.y - state.pose.position.y == pytest.approx(0.4, abs=0.05)  # [m] in 1 s
        state.pose.orientation.w = 3.0
        assert put(state)[0] == srv.SetEntityState.Response.INVALID_POSE
        state.pose.orientation.w = math.nan
        assert put(state)[0] == srv.SetEntityState.Response.INVALID_POSE
        after.header.frame_id = "base_link"
        assert put(after)[0] == msg.Result.RESULT_FEATURE_UNSUPPORTED
        assert put(after, "rover")[0] == msg.Result.RESULT_NOT_FOUND
        alone = call(srv.ResetSimulation, "reset_simulation", scope=srv.ResetSimulation.Request.SCOPE_TIME).result
        assert alone.result == msg.Result.RESULT_FEATURE_UNSUPPORTED
        assert call(srv.ResetSimulation, "reset_simulation").result.result == msg.Result.RESULT_OK
        assert call(srv.GetSimulationState, "get_simulation_state").state.state == control.PAUSED
        assert set_state(control.QUITTING) == msg.Result.RESULT_OK
        assert process.wait(60) == 0
