"""Failures of the rover's hardware: bearings against closed forms, drives, the star tracker against SciPy."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flight_graph.components.component import kinds_of
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from flight_math import Quaternion, Vec3, plain, same
from flight_math.values import view
from msg_schemas import cubli
from sim_nodes.cubli import reaction_wheels
from sim_nodes.cubli.plant import CubliPlantParameters, CubliPlantState
from sim_nodes.cubli.sensors import StarTrackerParameters
from sim_nodes.sensors.star_tracker import is_blinded
from tests.cubli.records import made
from tests.cubli_physical.runs import SITE_FROM_BALANCE, THETA, WHEEL
from tests.faults_rover.rover_runs import Run

PERIOD = 0.01  # [s]
ON = same(1.0)


def spin_down(steps, speed, effort=(0.0, 0.0, 0.0), powered=ON, **parameters):
    """Wheel speeds (steps + 1, 3) of a body that is held still, and the torques (steps, 3) on it."""
    p = made(CubliPlantParameters, PERIOD, **parameters)
    x = made(CubliPlantState, wheel_speed=list(speed))
    command = view(cubli.COMMAND.new()[1][0], kinds_of(cubli.COMMAND))
    command.effort = Vec3(*effort)
    speeds, torques = [np.array(x.wheel_speed)], []
    for _ in range(steps):
        torque = plain(reaction_wheels.wheel_torque)(p, x, command, powered)
        x.wheel_speed = plain(reaction_wheels.spun)(p, x.wheel_speed, torque, same(0.0))
        speeds.append(np.array(x.wheel_speed))
        torques.append(np.array(torque))
    return np.array(speeds), np.array(torques)


def test_viscous_friction_is_an_exponential():
    friction = 2e-4  # [N m s/rad]; the time constant is 5 s
    speeds, torques = spin_down(1000, (100.0, -50.0, 0.0), wheel_viscous=friction)
    t = PERIOD * np.arange(len(speeds))
    exact = np.outer(np.exp(-friction / WHEEL * t), [100.0, -50.0, 0.0])
    np.testing.assert_allclose(speeds, exact, atol=0.5 * friction / WHEEL * PERIOD * 100.0)  # explicit Euler
    np.testing.assert_allclose(torques, friction * speeds[:-1], rtol=1e-12)


def test_dry_friction_stops_a_wheel_on_time_and_holds_it():
    dry = 5e-3  # [N m]
    speeds, torques = spin_down(300, (10.0, -5.0, 0.0), wheel_coulomb=dry)
    t = PERIOD * np.arange(len(speeds))
    exact = np.maximum(0.0, np.array([10.0, 5.0, 0.0]) - dry / WHEEL * t[:, None]) * [1.0, -1.0, 0.0]
    np.testing.assert_allclose(speeds, exact, atol=1e-9)
    assert not speeds[-1].any() and not torques[-1].any()


def test_a_motor_below_dry_friction_turns_nothing_and_above_it_the_rest():
    speeds, torques = spin_down(100, (0.0, 0.0, 0.0), (4e-3, -4e-3, 8e-3), wheel_coulomb=5e-3, torque_limit=0.02)
    np.testing.assert_array_equal(speeds[:, :2], 0.0)
    np.testing.assert_array_equal(torques[:, :2], 0.0)
    np.testing.assert_allclose(speeds[-1, 2], -(8e-3 - 5e-3) / WHEEL * 1.0, rtol=1e-12)  # after 1 s


def test_bearings_keep_the_angular_momentum():
    """About the corner, without gravity: what the wheels lose the body gets."""
    scenario = load("cubli_physical", {
        "plant.gravity": 1e-12, "plant.disturbance_amplitude": 0.0, "plant.initial_wheel_speed": [30.0, -20.0, 10.0],
        "plant.wheel_viscous": 5e-4, "plant.wheel_coulomb": 1e-3, "plant.on_lift_off": "hold", "duration_s": 20,
        "controller.torque_limit": 1e-15, "controller.rearm": True})
    recording = CompiledRun(scenario).run()
    truth = recording["cubli/truth"]
    attitude = SITE_FROM_BALANCE * Rotation.from_quat(recording["cubli/truth/attitude"]["orientation"])
    momentum = attitude.apply(truth["rates"] @ THETA + WHEEL * truth["wheel_speed"])
    assert abs(truth["wheel_speed"][-1]).max() < 5.0 and abs(truth["rates"]).max() > 0.1
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=1e-6 * WHEEL * 30.0)


def test_a_drive_that_runs_away_heeds_its_limit_only():
    _, torques = spin_down(1, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3), wheel_runaway=[5e-3, 0.0, -0.5], torque_limit=0.02)
    np.testing.assert_array_equal(torques[0], [5e-3, 1e-3, -0.02])


def test_a_weak_motor_gives_a_part_and_a_drive_without_power_nothing():
    _, torques = spin_down(1, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3), wheel_effectiveness=[0.5, 1.0, 0.0])
    np.testing.assert_array_equal(torques[0], [5e-4, 1e-3, 0.0])
    _, torques = spin_down(1, (0.0, 10.0, 0.0), (1e-3, 1e-3, 1e-3), Vec3(1.0, 0.0, 1.0), wheel_runaway=[0.0, 5e-3, 0.0],
                           wheel_viscous=1e-5)
    np.testing.assert_array_equal(torques[0], [1e-3, 1e-4, 1e-3])  # the bearing of the second still brakes it


@pytest.mark.parametrize("timeout", [0.05, 0.2])
def test_drives_that_hear_nothing_give_no_torque(timeout):
    run = Run("plant <- command", "drop", {"plant.command_timeout": timeout}, 20.0, from_s=10.0)
    t, torque = run.t("truth"), np.abs(run["truth"]["torque"]).max(axis=1)
    still = (t > 10.0) & (t <= 9.995 + timeout)  # the torque at t was held over the period before
    assert (torque[still] > 0.0).all() and not torque[t > 10.015 + timeout].any()


def test_a_tracker_is_blind_within_the_angle():
    rng = np.random.default_rng(1)
    p = made(StarTrackerParameters, boresight=[0.0, 2.0, 0.0], blinding_direction=[1.0, -1.0, 3.0], blinding_angle=0.7)
    turns = Rotation.random(400, rng)
    angles = np.arccos(turns.apply([0.0, 1.0, 0.0]) @ np.array([1.0, -1.0, 3.0]) / math.sqrt(11.0))
    found = [plain(is_blinded)(p, Quaternion(*q)) for q in turns.as_quat()]
    np.testing.assert_array_equal(found, angles <= 0.7)
    assert any(found) and not all(found)
    assert not plain(is_blinded)(made(StarTrackerParameters), Quaternion(0.0, 0.0, 0.0, 1.0))
