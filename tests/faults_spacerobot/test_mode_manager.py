"""Modes: what passes, what each safe state does to the motion, and when the manager takes it by itself."""

import numpy as np
import pytest

from spacerobot_ros.mode_manager import ModeManager
from tests.faults_spacerobot.runs import FREE, HOLD, TRACK, between, fly, times

MODE = "spacerobot/mode"


def torques(recording, prefix=""):
    """Commanded torques (m, 7): base and joints."""
    return np.hstack([recording[f"spacerobot/{prefix}base_command"]["wrench"]["torque"],
                      recording[f"spacerobot/{prefix}joint_command"]["effort"]])


def changes(recording):
    """(time [s], mode, cause) of each change."""
    record, t = recording[MODE], times(recording, MODE)
    return [(t[k + 1], record["mode"][k + 1], record["cause"][k + 1]) for k in np.flatnonzero(np.diff(record["mode"]))]


def test_track_passes_the_controller_bit_for_bit():
    recording = fly()
    assert torques(recording, "safe_").tobytes() == torques(recording).tobytes()
    assert recording["spacerobot/brakes"]["engaged"].max() == 0.0 and ModeManager.modes == ("track", "hold", "free")


def test_a_command_that_is_late_is_hold_and_its_return_is_track():
    """controller silent from 8.0 to 8.5 s: command_age 0.1 s, return_after 2 s."""
    recording = fly("controller", "hang", from_s=8, for_s=0.5)
    (to_hold, hold, cause), (to_track, track, _) = changes(recording)
    assert (hold, cause, track) == (HOLD, -2.0, TRACK)
    assert to_hold == pytest.approx(8.1, abs=0.021) and to_track == pytest.approx(10.5, abs=0.05)
    held = (recording[MODE]["mode"] == HOLD)
    assert recording["spacerobot/brakes"]["engaged"][held].min() == 1.0
    assert np.abs(torques(recording, "safe_")[held, 3:]).max() == 0.0
    error = between(recording, "spacerobot/control", 20.0)["joint_error"]
    assert np.abs(error).max() < 0.01  # [rad] it has caught up


def test_without_an_estimate_it_is_hold_then_free():
    """estimate_age 0.1 s, estimate_patience 0.2 s; rates_patience 1 s."""
    recording = fly("state", "crash", from_s=8)
    (to_hold, hold, _), (to_free, free, _) = changes(recording)
    assert (hold, free) == (HOLD, FREE)
    assert to_hold == pytest.approx(8.3, abs=0.05) and to_free == pytest.approx(9.1, abs=0.05)
    later = recording[MODE]["mode"] == FREE
    assert np.abs(torques(recording, "safe_")[later]).max() == 0.0
    assert recording["spacerobot/brakes"]["engaged"][later].max() == 0.0


def test_free_keeps_the_angular_momentum_of_everything():
    """No torque from outside, none from the drives: base, arm and wheels together keep what they have."""
    recording = fly("state", "crash", from_s=8)
    truth = between(recording, "spacerobot/truth", 9.3)
    q = truth["attitude"]
    vector, scalar, wheels = q[:, :3], q[:, 3:], truth["wheel_momentum"]
    turned = wheels + 2.0 * np.cross(vector, np.cross(vector, wheels) + scalar * wheels)
    whole = truth["angular_momentum"] + turned
    assert np.abs(whole - whole[0]).max() < 1e-6  # [N m s] the wheels' friction is an inner torque
    assert np.abs(truth["joint_torque"]).max() == 0.0


def test_hold_takes_energy_until_nothing_turns():
    """tau = -D w within the wheels' limit, and the kinetic energy only falls, but for what the wheels' quantum (1e-3 N m)
    and friction leave."""
    recording = fly("plant.parameters.joint_seized[1]", "stuck", value=1000.0, from_s=8)
    begin = changes(recording)[-1][0]
    truth, rates = (between(recording, topic, begin + 0.1) for topic in ("spacerobot/truth", "spacerobot/odometry"))
    command = between(recording, "spacerobot/safe_base_command", begin + 0.1)["wrench"]["torque"]
    np.testing.assert_array_equal(command, np.clip(-2.0 * rates["twist"]["twist"]["angular"], -0.05, 0.05))
    assert np.diff(truth["kinetic_energy"]).max() < 1e-8  # [J]
    assert truth["kinetic_energy"][-1] < 1e-3 * truth["kinetic_energy"][0]
    assert np.abs(truth["rates"][-1]).max() < 1e-3 and np.abs(truth["joint_rates"][10:]).max() < 1e-6  # [rad/s]


def test_hold_is_the_same_whatever_the_parameters_are_believed_to_be():
    """Half the damping law's claim: it reads rates alone, so a robot twice as heavy comes to rest too."""
    for scale in (0.5, 2.0):
        recording = fly("controller", "crash", from_s=8, over=(
            ("plant.payload_time", 1.0), ("plant.payload_scale", scale), ("modes.return_after", 0.0)))
        truth = recording["spacerobot/truth"]
        assert recording[MODE]["mode"][-1] == HOLD and np.abs(truth["rates"][-1]).max() < 1e-3
        assert np.abs(truth["joint_rates"][-1]).max() < 1e-6


def test_brakes_hold_a_drive_that_runs_away():
    recording = fly("plant <- joint_command.effort[2]", "stuck", value=0.2, from_s=8)
    (begin, mode, cause), = changes(recording)
    assert mode == HOLD and cause >= 0.0 and begin < 8.5
    truth = between(recording, "spacerobot/truth", begin + 0.1)
    assert np.abs(truth["joint_torque"][:, 2]).min() == pytest.approx(0.2) and np.abs(truth["joint_rates"]).max() < 1e-6


def test_adaptation_rests_outside_of_track():
    recording = fly("controller", "crash", from_s=8, over=(("modes.return_after", 0.0),))
    pi = between(recording, "spacerobot/parameters", 8.2)["pi"]
    assert (pi == pi[0]).all() and between(recording, "spacerobot/adaptation", 8.2)["freeze"].min() == 1.0
    before = between(recording, "spacerobot/parameters", 2.0, 8.0)["pi"]
    assert (np.abs(np.diff(before, axis=0)).max(axis=1) > 0.0).all()


def test_adaptation_rests_while_a_sensor_is_out():
    recording = fly("imu.imu", "drop", from_s=8)
    assert recording[MODE]["mode"].max() == TRACK
    pi = between(recording, "spacerobot/parameters", 8.5)["pi"]
    assert (pi == pi[0]).all()


def test_commands_that_do_not_arrive_count_as_zero():
    """plant.command_timeout 0.2 s."""
    recording = fly("plant <- joint_command", "drop", from_s=8, over=(("duration_s", 9),))
    torque, t = np.abs(recording["spacerobot/truth"]["joint_torque"]).max(axis=1), times(recording, "spacerobot/truth")
    lost = t[(t > 8.0) & (torque == 0.0)]
    assert lost[0] == pytest.approx(8.2, abs=0.045) and torque[t > 8.26].max() == 0.0
    never = fly("plant <- joint_command", "drop", from_s=8, over=(("duration_s", 9), ("plant.command_timeout", 0.0)))
    assert np.abs(never["spacerobot/truth"]["joint_torque"][-1]).max() > 0.0


def test_robots_with_other_joints_have_the_same_parts():
    """The factories, for two joints under a name of their own."""
    from flight_graph.components.component import Component
    from msg_schemas.spacerobot import topics
    from sim_nodes.spacerobot.plant import plant
    from spacerobot_ros.actuator_monitor import monitor
    from spacerobot_ros.mode_manager import manager
    from spacerobot_ros.robust_state_estimator import estimator
    signals = topics(["shoulder", "elbow"], ["bus", "upper", "fore"], "two_joints")
    for component in (plant(signals), monitor(signals), manager(signals), estimator(signals)):
        assert issubclass(component, Component)
    assert manager(signals).inputs["request"].topic == "two_joints/mode_request"
    assert estimator(signals).outputs["status"].new()[1]["encoder_age"].shape[-1] == 2
