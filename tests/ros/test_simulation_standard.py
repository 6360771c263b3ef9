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
        early = call(srv.GetEntityState, "get_entity_state", entity="plant").result
        assert early.result == msg.Result.RESULT_OPERATION_FAILED and "no pose has been published" in early.error_message
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
        assert call(srv.SetEntityState, "set_entity_state", entity="plant").result.result == (
            msg.Result.RESULT_FEATURE_UNSUPPORTED)
        alone = call(srv.ResetSimulation, "reset_simulation", scope=srv.ResetSimulation.Request.SCOPE_TIME).result
        assert alone.result == msg.Result.RESULT_FEATURE_UNSUPPORTED
        assert call(srv.ResetSimulation, "reset_simulation").result.result == msg.Result.RESULT_OK
        assert call(srv.GetSimulationState, "get_simulation_state").state.state == control.PAUSED
        assert set_state(control.QUITTING) == msg.Result.RESULT_OK
        assert process.wait(60) == 0
