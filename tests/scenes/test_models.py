"""The URDF in the golden bags, read by pinocchio: masses, inertias, axes, placements of the dynamics' own parameters; and
the frames that the bags' transforms give are those of its kinematics."""

import json
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from flight_graph.bags.reader import read_bag
from flight_graph.graphs.scenario import load
from flight_graph.scenes.finding import scene_of, scene_of_bag
from flight_graph.scenes.motion import poses_at, tracks
from flight_graph.scenes.urdf import urdf
from msg_schemas import cubli, spacerobot
from sim_nodes.spacerobot.plant import SpaceRobotPlant
from spacerobot_ros.urdf import load_urdf

pinocchio = pytest.importorskip("pinocchio")

ROOT = Path(__file__).resolve().parents[2]
ROVERS = ("cubli_asteroid", "cubli_bennu")


def recorded(name: str) -> tuple[dict, object, dict]:
    """Messages of a golden bag by topic, its model, and the parameters of its plant; nothing of it read by us."""
    found = {}
    with AnyReader([ROOT / "bags" / name]) as reader:
        for connection, stamp, raw in reader.messages():
            found.setdefault(connection.topic, []).append((stamp, reader.deserialize(raw, connection.msgtype)))
    scenario = json.loads(read_bag(ROOT / "bags" / name).attachments["scenario.json"].data)
    (_, text), = found["/robot_description"]
    return (found, pinocchio.buildModelFromXML(text.data, pinocchio.JointModelFreeFlyer()),
            scenario["components"]["plant"]["parameters"])


def ten_parameters(inertia) -> np.ndarray:
    """pi of a pinocchio inertia: about the origin of its frame."""
    about = inertia.inertia - inertia.mass * np.linalg.matrix_power(pinocchio.skew(inertia.lever), 2)
    return np.concatenate([about[np.triu_indices(3)], inertia.mass * inertia.lever, [inertia.mass]])


def axis(model, joint: str) -> np.ndarray:
    """Axis of a joint in the axes of the body that it carries."""
    data, number = model.createData(), model.getJointId(joint)
    pinocchio.computeJointJacobians(model, data, pinocchio.neutral(model))
    column = pinocchio.getJointJacobian(model, data, number, pinocchio.LOCAL)[:, model.joints[number].idx_v]
    assert not column[:3].any()
    return column[3:]


def configuration(model, pose, joints) -> np.ndarray:
    """pinocchio's q of a pose of the base and a JointState."""
    q = pinocchio.neutral(model)
    q[:7] = [getattr(part, key) for part, keys in ((pose.position, "xyz"), (pose.orientation, "xyzw")) for key in keys]
    for name, angle in zip(joints.name, joints.position):
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q:joint.idx_q + joint.nq] = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
    return q


def test_space_robot_is_the_dynamics():
    _, model, plant = recorded("spacerobot_payload")
    pi = np.reshape(plant["pi"], (-1, 10))
    joints = spacerobot.MINI.joint_state.fixed["name"]
    assert list(model.names)[2:] == joints
    for k, inertia in enumerate(list(model.inertias)[1:]):
        np.testing.assert_allclose(ten_parameters(inertia), pi[k], rtol=1e-12, atol=1e-14)
    for k, name in enumerate(joints):
        place = model.jointPlacements[model.getJointId(name)]
        np.testing.assert_allclose(axis(model, name), plant["axis"][k], atol=1e-12)
        np.testing.assert_allclose(place.translation, plant["offset"][k], atol=1e-12)
        np.testing.assert_allclose(place.rotation.ravel(), np.ravel(plant["fixed_rotation"][k]), atol=1e-12)
        start = model.joints[model.getJointId(name)].idx_q
        assert model.lowerPositionLimit[start] == plant["lower"][k] and model.upperPositionLimit[start] == plant["upper"][k]


@pytest.mark.parametrize("name", ROVERS)
def test_rover_is_the_dynamics(name):
    """The whole about the corner, as equation (9)'s jump condition and the physical plant take it; each wheel's own."""
    _, model, plant = recorded(name)
    mass, length, data = plant["mass"], plant["length"], model.createData()
    matrix = pinocchio.crba(model, data, pinocchio.neutral(model))
    matrix = np.triu(matrix) + np.triu(matrix, 1).T
    to_corner = pinocchio.SE3(np.eye(3), np.full(3, -0.5 * length)).toActionMatrix()
    about_corner = (to_corner.T @ matrix[:6, :6] @ to_corner)[3:, 3:]
    np.testing.assert_allclose(about_corner, mass * length**2 * (11 / 12 * np.eye(3) - np.full((3, 3), 0.25) + 0.0),
                               atol=1e-12)
    np.testing.assert_allclose(matrix[:3, :3], mass * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(matrix[6:, 6:], plant["wheel_inertia"] * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(matrix[3:6, 6:], plant["wheel_inertia"] * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(matrix[:3, 3:], 0.0, atol=1e-12)
    for k, wheel in enumerate(cubli.WHEELS):
        np.testing.assert_allclose(axis(model, wheel), np.eye(3)[k], atol=1e-12)


def test_lander_is_the_dynamics():
    _, model, plant = recorded("lander_nominal")
    whole = model.inertias[1]
    assert whole.mass == plant["mass"] and not whole.lever.any()
    np.testing.assert_array_equal(whole.inertia, plant["inertia"])


@pytest.mark.parametrize("name", ["cubli_asteroid", "spacerobot_payload"])
def test_a_bag_s_joint_states_and_its_transforms_are_one_motion(name):
    """pinocchio's kinematics of the recorded model, base pose and joint angles: every link where /tf puts it, so where
    the scene functions do; in the rover the parent is at the site, in the space robot at the inertial frame."""
    found, model, _ = recorded(name)
    bag = read_bag(ROOT / "bags" / name)
    scene = scene_of_bag(bag)
    pose_topic = next(topic for topic in found if topic.endswith("/truth/pose"))
    stamps = [stamp for stamp, _ in found["/joint_states"]]
    placed = poses_at(scene, tracks(scene, bag), np.array(stamps))
    data = model.createData()
    for row, ((stamp, joints), (same, pose)) in enumerate(zip(found["/joint_states"], found[pose_topic], strict=True)):
        assert stamp == same
        pinocchio.framesForwardKinematics(model, data, configuration(model, pose.pose, joints))
        for link in scene.links:
            there = pinocchio.XYZQUATToSE3(np.concatenate([placed[link][0][row], placed[link][1][row]]))
            gap = data.oMf[model.getFrameId(link)].actInv(there)
            assert np.linalg.norm(pinocchio.log6(gap).vector) < 1e-9, (link, stamp)


def test_our_own_reader_takes_the_model_too():
    plant = load("spacerobot_harmonic").graph.nodes["plant"].values
    robot = load_urdf(urdf(scene_of(load("spacerobot_harmonic"))))
    np.testing.assert_allclose(robot.pi, plant["pi"], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(robot.axis, plant["axis"], atol=1e-15)


def test_a_tree_with_turned_placements_and_no_limits():
    """Placements that are no right angles, an axis that is none of the frame's, and the gimbal of roll and yaw."""
    values = dict(load("spacerobot_harmonic").graph.nodes["plant"].values)
    random = np.random.default_rng(3)
    turns = [pinocchio.Quaternion(*(q / np.linalg.norm(q))).matrix() for q in random.normal(size=(3, 4))]
    turns.append(pinocchio.rpy.rpyToMatrix(0.4, np.pi / 2, -1.1))
    axes = random.normal(size=(4, 3))
    values |= {"fixed_rotation": [turn.ravel().tolist() for turn in turns], "lower": [-1e9] * 4, "upper": [1e9] * 4,
               "axis": (axes / np.linalg.norm(axes, axis=1)[:, None]).tolist()}
    model = pinocchio.buildModelFromXML(urdf(SpaceRobotPlant.scene(values)), pinocchio.JointModelFreeFlyer())
    for k, name in enumerate(spacerobot.MINI.joint_state.fixed["name"]):
        np.testing.assert_allclose(axis(model, name), values["axis"][k], atol=1e-12)
        np.testing.assert_allclose(model.jointPlacements[model.getJointId(name)].rotation, turns[k], atol=1e-12)
        assert model.joints[model.getJointId(name)].nq == 2  # continuous
