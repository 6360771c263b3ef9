"""Robots with other than four joints: components from the factories, wired by a scenario of classes in a file."""

from pathlib import Path

import numpy as np
import pytest

from flight_graph.components.component import Component
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
from msg_schemas.spacerobot import topics
from sim_nodes.spacerobot.plant import plant
from sim_nodes.spacerobot.sensors import sensors
from spacerobot_ros.adaptation_monitor import monitor
from spacerobot_ros.adaptive_controller import controller
from spacerobot_ros.gradient_estimators import estimators
from spacerobot_ros.model import load_model
from spacerobot_ros.trajectory_generator import generator
from tests.spacerobot.spacerobot_cases import inertia_matrices

pytestmark = pytest.mark.xdist_group("two joints")  # compiled once

ROBOTS = Path(__file__).parent / "robots"


@pytest.fixture(scope="session")
def two_joints():
    return CompiledRun(load(str(ROBOTS / "two_joints_scenario.yaml"))).run()


def test_two_joints_conserve_momentum_and_energy(two_joints):
    truth = two_joints["two_joints/truth"]
    assert np.abs(truth["momentum"]).max() < 1e-11  # [kg m/s]
    balance = truth["angular_momentum"] - truth["angular_momentum"][0] - truth["impulse"]
    assert np.abs(balance).max() < 1e-11  # [N m s]
    assert np.abs(truth["angular_momentum"]).max() > 1e-3  # [N m s] the base is turned on purpose
    assert np.abs(truth["kinetic_energy"] - truth["kinetic_energy"][0] - truth["work"]).max() < 1e-12  # [J]
    assert truth["kinetic_energy"].max() > 1e-2  # [J]


def test_two_joints_centre_of_mass_stays_at_rest(two_joints):
    """The centre of mass from the bodies' places, worked out here from the model alone."""
    robot, truth = load_model(ROBOTS / "two_joints.yaml"), two_joints["two_joints/truth"]

    def turn(axis, angle):
        x = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        return np.eye(3) + np.sin(angle) * x + (1 - np.cos(angle)) * x @ x

    for row in truth[[0, 50, 99]]:
        v, s = row["attitude"][:3], row["attitude"][3]
        cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        axes, origin = np.eye(3) + 2 * s * cross + 2 * cross @ cross, row["position"].copy()
        moment = robot.pi[9] * origin + axes @ robot.pi[6:9]
        for i in range(2):
            origin = origin + axes @ robot.offset[i]
            axes = axes @ robot.fixed_rotation[i] @ turn(robot.axis[i], row["joints"][i])
            pi = robot.pi[10 * (i + 1):]
            moment = moment + pi[9] * origin + axes @ pi[6:9]
        assert np.abs(moment).max() < 1e-11  # [kg m]


def test_two_joints_learn_their_parameters(two_joints):
    """Five torques read NaN: skipped and counted. The estimate predicts a thousand times better than the prior."""
    assert two_joints["two_joints/parameters"]["pi"].shape == (100, 30)
    assert np.isnan(two_joints["two_joints/joint_states"]["effort"][:, 1]).sum() == 5
    telemetry = two_joints["two_joints/parameter_estimator"][-1]
    assert telemetry["skipped"] == 5 and telemetry["updates"] == 95
    assert np.isfinite(two_joints["two_joints/parameters"]["pi"]).all()
    resting = CompiledRun(load(str(ROBOTS / "two_joints_scenario.yaml"), {"estimator.learn": False})).run()
    prior, learnt = (run["two_joints/truth/prediction"]["prediction_error"][50:] for run in (resting, two_joints))
    assert np.sqrt(np.mean(learnt ** 2)) < 1e-3 * np.sqrt(np.mean(prior ** 2))


def test_branched_robot_of_five_joints():
    """Fingers on one wrist and a second arm: joints of different branches do not meet in the mass matrix."""
    robot = load_model(ROBOTS / "branched.yaml")
    assert robot.parent.tolist() == [0, 1, 2, 2, 0]
    full, reduced = inertia_matrices(robot, [0.3, -0.5, 0.7, 0.2, -0.4])
    joints = full[6:, 6:]
    apart = [(0, 4), (1, 4), (2, 4), (3, 4), (2, 3)]
    for i in range(5):
        for j in range(i + 1, 5):
            assert (joints[i, j] == 0.0) == ((i, j) in apart)
    assert np.linalg.eigvalsh(full).min() > 0.0 and np.linalg.eigvalsh(reduced).min() > 0.0


def test_components_of_the_branched_robot():
    robot = load_model(ROBOTS / "branched.yaml")
    signals = topics(list(robot.joint_names), ["bus", "left_upper", "left_fore", "finger_a", "finger_b", "right_arm"])
    lyapunov, natural = estimators(signals)
    for component in (plant(signals), generator(signals), controller(signals), lyapunov, natural, monitor(signals),
                      *sensors(signals)):
        assert issubclass(component, Component)
    values = natural.resolve({**natural.parameters.defaults(), "model": str(ROBOTS / "branched.yaml"),
                              "prior_eta": 0.2}, "natural")
    assert len(values["prior"]) == 60 and values["parent"] == [0, 1, 2, 2, 0]
