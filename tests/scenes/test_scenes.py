"""Scenes over bags: markers against the bodies' own equations, motion against the messages, and what is not there."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import read_bag
from flight_graph.bags.writer import BagWriter
from flight_graph.components.findings import ComponentMistake
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario, load
from flight_graph.recordings.recording import write_recording
from flight_graph.runs import simulate
from flight_graph.scenes.finding import component_scene, scene_of, scene_of_bag
from flight_graph.scenes.motion import arrows_at, frames_of, poses_at, tracks
from flight_graph.scenes.scene import Box, Cone, Cylinder, Frame, Pose, Scene, Shape, Sphere
from flight_graph.scenes.triangles import triangles
from msg_schemas.definitions import TYPESTORE
from msg_schemas.qos import Role
from sim_nodes.cubli.plant import CubliPlant
from sim_nodes.gravity.mesh import require_closed, volume
from tests.graph import toy

BAGS = Path(__file__).resolve().parents[2] / "bags"


def markers(name: str) -> dict:
    """The markers of a golden bag by name, read by rosbags."""
    with AnyReader([BAGS / name]) as reader:
        (connection, _, raw), = reader.messages([one for one in reader.connections if one.topic == "/scene"])
        return {marker.ns: marker for marker in reader.deserialize(raw, connection.msgtype).markers}


def points(marker) -> np.ndarray:
    return np.array([(point.x, point.y, point.z) for point in marker.points])


# -- what is drawn -----------------------------------------------------------------------------------------------------
def test_ground_and_body_of_the_lander_are_where_its_plant_has_them():
    plant, shown = load("lander_nominal").graph.nodes["plant"].values, markers("lander_nominal")
    scale = shown["asteroid"].scale
    assert [scale.x, scale.y, scale.z] == [2 * axis for axis in plant["semi_axes"]]
    bag = read_bag(BAGS / "lander_nominal")
    scene = scene_of_bag(bag)
    placed = poses_at(scene, tracks(scene, bag), bag.stamps_ns("/tf")[:1], seen_in="asteroid")
    origin, turn = placed["landing_site"]
    ground = Rotation.from_quat(turn[0]).apply(points(shown["ground"])) + origin
    off = (np.linalg.norm(ground / plant["semi_axes"], axis=1) - 1.0) * np.linalg.norm(ground, axis=1)
    assert shown["ground"].header.frame_id == "landing_site" and np.abs(off).max() < 2e-3  # [m]; corners are at millimetres
    x, y, z = points(shown["keep_out_funnel"]).T
    alpha, beta, gamma, rho = (plant[f"funnel_{key}"] for key in ("alpha", "beta", "gamma", "rho_0"))
    wall = (alpha * (x**2 + beta * y**2 + rho**2)) ** gamma - (alpha * rho**2) ** gamma - plant["funnel_z_0"]
    np.testing.assert_allclose(z, wall, atol=2e-3)
    cone = points(shown["view"])
    angles = np.arccos(cone[cone[:, 2] > 0][:, 2] / np.linalg.norm(cone[cone[:, 2] > 0], axis=1))
    np.testing.assert_allclose(angles, plant["view_half_angle"], atol=1e-12)
    assert shown["view"].header.frame_id == "site_camera_optical" and all(one.frame_locked for one in shown.values())


def test_the_camera_looks_at_the_goal_as_the_truth_says():
    """The angle between the camera's z and the goal is the view angle of the truth, less what its seat on the hull makes."""
    bag = read_bag(BAGS / "lander_nominal")
    scene = scene_of_bag(bag)
    stamps = bag.stamps_ns("/tf")
    position, turn = poses_at(scene, tracks(scene, bag), stamps)["site_camera_optical"]
    boresight = Rotation.from_quat(turn).apply([0.0, 0.0, 1.0])
    seen = np.arccos(np.sum(-position / np.linalg.norm(position, axis=1)[:, None] * boresight, axis=1))
    truth = bag["/lander/truth"]["position"][:, bag.constants("/lander/truth")["name"].index("view_angle")]
    np.testing.assert_allclose(seen, truth, atol=0.5 * 1.5 / np.linalg.norm(position, axis=1).min())


def test_the_body_under_the_rover_touches_its_corner_within_the_thinning():
    """Bennu's mesh of 320 faces lies within a facet's sagging of the corner, whose ground leans as the plant's does."""
    bag, shown = read_bag(BAGS / "cubli_bennu"), markers("cubli_bennu")
    scene, plant = scene_of_bag(bag), load("cubli_bennu").graph.nodes["plant"].values
    origin, turn = poses_at(scene, tracks(scene, bag), [0])["asteroid"]
    body = Rotation.from_quat(turn[0]).apply(points(shown["asteroid"])) + origin
    nearest = np.linalg.norm(body, axis=1).min()
    assert nearest < 45.0 and np.linalg.norm(origin) == pytest.approx(250.0, rel=0.15)  # [m] edges are some 60 m long
    assert len(points(shown["asteroid"])) == 3 * 320
    tilt = shown["ground"].pose.orientation
    normal = Rotation.from_quat([tilt.x, tilt.y, tilt.z, tilt.w]).apply([0.0, 0.0, 1.0])
    lean = [np.sin(plant["tilt"]) * np.cos(plant["azimuth"]), np.sin(plant["tilt"]) * np.sin(plant["azimuth"]),
            np.cos(plant["tilt"])]
    np.testing.assert_allclose(normal, lean, atol=1e-12)


@pytest.mark.parametrize("geometry, exact", [
    (Box((1.0, 2.0, 3.0)), 6.0), (Cylinder(2.0, 3.0), 12 * np.pi), (Sphere((1.0, 2.0, 3.0)), 8 * np.pi)])
def test_triangles_are_closed_outward_and_inscribed(geometry, exact):
    mesh = triangles(geometry)
    require_closed(mesh.vertices, mesh.faces, "shape")
    assert 0.93 * exact < volume(mesh.vertices, mesh.faces) <= exact * (1 + 1e-12)


def test_a_cone_opens_along_z_and_is_seen_from_outside():
    mesh = triangles(Cone(1.0, 2.0))
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] < 0).all() and mesh.vertices[:, 2].max() == 2.0


# -- what moves --------------------------------------------------------------------------------------------------------
def test_wheels_turn_as_fast_as_they_say():
    """The angle is the integral of the speed, which is linear between messages of the plant's own rate."""
    run = simulate(load("cubli_asteroid", {"duration_s": 2}))
    speed, angle = run["cubli/wheel_state"]["velocity"], run["cubli/truth/frames"]["wheel_angle"]
    area = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 0.01, axis=0)])
    np.testing.assert_allclose(angle, area[::10], atol=1e-12)
    np.testing.assert_array_equal(run["cubli/truth/frames"]["wheel_speed"], speed[::10])


def test_arrows_are_the_vectors_of_the_topics():
    bag = read_bag(BAGS / "lander_nominal")
    scene = scene_of_bag(bag)
    stamps = bag.stamps_ns("/tf")
    placed = poses_at(scene, tracks(scene, bag), stamps)
    tail, tip = arrows_at(scene, bag, placed, stamps)["thrust"]
    names, pose = bag.constants("/lander/truth")["name"], bag["/lander/truth/pose"]["pose"]
    force = bag["/lander/truth"]["position"][:, [names.index(f"force[{i}]") for i in range(3)]]
    along = Rotation.from_quat(pose["orientation"]).apply(force)
    scale = next(arrow.scale for arrow in scene.arrows if arrow.name == "thrust")
    np.testing.assert_allclose(tail, pose["position"], atol=1e-6)
    np.testing.assert_allclose(tip - tail, scale * along, atol=1e-6)
    assert np.abs(along).max() > 1.0  # [N]


def test_each_of_several_vehicles_has_its_own_frames_and_arrows():
    """Two rovers and a lander below one map: poses are those of the pose messages in each namespace."""
    bag = read_bag(BAGS / "rovers_and_lander")
    scene, stamps = scene_of_bag(bag), bag.stamps_ns("/rover_a/cubli/truth/pose")
    placed = poses_at(scene, tracks(scene, bag), stamps)
    for rover in ("rover_a", "rover_b"):
        said = bag[f"/{rover}/cubli/truth/pose"]["pose"]["position"]
        np.testing.assert_allclose(placed[f"{rover}/cubli_base"][0], said, atol=1e-12)
    shown = arrows_at(scene, bag, placed, stamps)
    assert len(shown) == 3 + 3 + 2 == len(scene.arrows)
    tails = [shown[f"torque of wheel_x, {rover}"][0] for rover in ("rover_a", "rover_b")]
    assert np.linalg.norm(tails[0] - tails[1], axis=1).min() > 0.01  # [m]; they lean to different sides


def test_poses_between_messages_turn_at_a_steady_rate(tmp_path):
    """Half way between two messages a frame has turned by half, the short way round, and gone half the way."""
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.1], [0.0, 0.0, 1.3]]).as_quat() * [[1.0], [-1.0]]
    bag = transforms_bag(tmp_path / "two", [(k, "map", "b", (2.0 * k, 0.0, 0.0), turns[k]) for k in range(2)])
    scene = Scene("two", "b", (Frame("b", "map", None),))
    position, turn = poses_at(scene, tracks(scene, bag), np.array([-1, 250_000_000, 10**9, 5 * 10**9]))["b"]
    np.testing.assert_allclose(position[:, 0], [0.0, 0.5, 2.0, 2.0])
    np.testing.assert_allclose(Rotation.from_quat(turn).as_rotvec()[:, 2], [0.1, 0.4, 1.3, 1.3], atol=1e-12)


# -- what is not there -------------------------------------------------------------------------------------------------
def transforms_bag(folder, rows):
    """A bag with /tf alone: rows of (second, parent, child, translation, quaternion)."""
    types, writer = TYPESTORE.types, BagWriter(folder)
    topic = writer.add_topic("/tf", "tf2_msgs/msg/TFMessage", Role.TRUTH.qos)
    for second, parent, child, translation, turn in rows:
        header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](second, 0), parent)
        message = types["tf2_msgs/msg/TFMessage"]([types["geometry_msgs/msg/TransformStamped"](
            header, child, types["geometry_msgs/msg/Transform"](
                types["geometry_msgs/msg/Vector3"](*map(float, translation)),
                types["geometry_msgs/msg/Quaternion"](*map(float, turn))))])
        writer.write(topic, second * 10**9, bytes(TYPESTORE.serialize_cdr(message, "tf2_msgs/msg/TFMessage")))
    writer.close()
    return read_bag(folder)


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """A run of the rover that recorded its attitude and its wheels' command alone."""
    folder = tmp_path_factory.mktemp("bare") / "bag"
    data = load("cubli_asteroid").file.model_dump(by_alias=True, exclude_none=True)
    shown = Scenario({**data, "duration_s": 0.1, "record": {"topics": ["cubli/truth/attitude", "cubli/wheel_command"]}}, "s")
    write_recording(simulate(shown), folder, "compiled")
    return read_bag(folder)


def test_a_run_that_recorded_no_transforms_says_so(bare):
    scene = scene_of_bag(bare)
    with pytest.raises(BagError, match="it has no transforms on /tf and no odometry of the frames that move .cubli_base."):
        tracks(scene, bare)
    assert all(shape.frame in scene.tree for shape in scene.shapes)
    assert arrows_at(scene, bare, {}, np.zeros(1, np.int64)) == {}


def test_a_bag_without_anything_to_see_says_so(tmp_path):
    writer = BagWriter(tmp_path / "empty")
    writer.close()
    with pytest.raises(BagError, match="there is nothing to see in it"):
        scene_of_bag(read_bag(tmp_path / "empty"))


def test_frames_of_strangers_are_shown_and_what_is_not_finite_is_left_out(tmp_path):
    rows = [(1, "/odom", "base", (1, 2, 3), (0, 0, 0, 1)), (2, "odom", "base", (np.nan, 0, 0), (0, 0, 0, 1)),
            (3, "odom", "base", (2, 2, 3), (0, 0, 0, 0)), (3, "odom", "base", (4, 2, 3), (0, 0, 0, 2)),
            (1, "base", "laser", (0, 0, 1), (0, 0, 0, 1))]
    bag = transforms_bag(tmp_path / "odd", rows)
    scene = scene_of_bag(bag)
    assert {frame.name: frame.parent for frame in frames_of(bag)} == {"base": "odom", "laser": "base", "odom": "map"}
    placed = poses_at(scene, tracks(scene, bag), [10**9, 3 * 10**9], seen_in="odom")
    np.testing.assert_allclose(placed["laser"][0], [[1, 2, 4], [4, 2, 4]])
    with pytest.raises(BagError, match="the frame 'nowhere' has no place in this bag; there are map, "):
        poses_at(scene, tracks(scene, bag), [0], seen_in="nowhere")


def test_transforms_in_a_circle_say_so(tmp_path):
    bag = transforms_bag(tmp_path / "loop", [(1, "a", "b", (0, 0, 0), (0, 0, 0, 1)), (1, "b", "a", (0, 0, 0), (0, 0, 0, 1))])
    with pytest.raises(FlightError, match="form a loop; all hang below map"):
        scene_of_bag(bag)


@pytest.mark.parametrize("wrong, sentence", [
    ({"frames": (Frame("a", "b"), Frame("b", "a"))}, "form a loop; all hang below map"),
    ({"frames": (Frame("base", "nowhere"),)}, "the parent 'nowhere' of frame 'base' is no frame; the root is map"),
    ({"frames": (Frame("base", "map"), Frame("base", "map"))}, "two frames share a name"),
    ({"shapes": (Shape("s", "nose", Box((1, 1, 1))),)}, "the shape s is in a frame 'nose' that there is not; there are map, base"),
])
def test_a_scene_that_cannot_be_says_why(wrong, sentence):
    with pytest.raises(FlightError, match=sentence):
        replace(Scene("s", "base", (Frame("base", "map"),)), **wrong)


def test_scenes_of_two_components_are_one_unless_they_disagree():
    one = Scene("one", "base", (Frame("base", "map", None),))
    camera = Scene("camera", "eye", (Frame("base", "map", None), Frame("eye", "base")), shapes=(Shape("s", "eye", Cone(1, 1)),))
    assert [frame.name for frame in one.joined(camera).frames] == ["base", "eye"]
    with pytest.raises(FlightError, match="scenes one and other place the frame 'base' differently"):
        one.joined(Scene("other", "base", (Frame("base", "map", Pose((1.0, 0.0, 0.0))),)))


def test_a_scene_of_one_s_own_that_is_none_or_fails_is_told_with_its_line():
    class Wrong(CubliPlant):
        @classmethod
        def scene(cls, values):
            return "a cube"

    class Failing(CubliPlant):
        @classmethod
        def scene(cls, values):
            return values["masss"]

    values = load("cubli_asteroid").graph.nodes["plant"].values
    with pytest.raises(ComponentMistake, match="Wrong.scene: it returns str; needed is a Scene"):
        component_scene(Wrong, values)
    with pytest.raises(ComponentMistake, match=r"test_scenes.py:\d+: Failing.scene: there is no parameter 'masss'"):
        component_scene(Failing, values)


def test_a_scenario_without_a_scene_says_so():
    with pytest.raises(FlightError, match="none of its components declares a scene"):
        scene_of(Scenario(toy.scenario(), "toy"))
