"""The tree of frames in the golden bags: whole, of one root, and saying the same as the messages beside it."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from flight_graph.graphs.scenario import load
from flight_graph.runs import simulate

FOLDER = Path(__file__).resolve().parents[2] / "bags"
BAGS = sorted(path.parent.name for path in FOLDER.glob("*/metadata.yaml"))


def messages(name: str) -> dict[str, list]:
    """topic -> (stamp, message) of each message of a golden bag, read by rosbags."""
    found = {}
    with AnyReader([FOLDER / name]) as reader:
        for connection, stamp, raw in reader.messages():
            found.setdefault(connection.topic, []).append((stamp, reader.deserialize(raw, connection.msgtype)))
    return found


def rotation(quaternion) -> Rotation:
    return Rotation.from_quat([quaternion.x, quaternion.y, quaternion.z, quaternion.w])


def turn(found, child: str, stamp: int) -> Rotation:
    """The rotation of a frame to the root at a stamp, link by link up the tree."""
    known = {one.child_frame_id: one for time, message in found["/tf"] if time == stamp for one in message.transforms}
    known |= {one.child_frame_id: one for _, message in found["/tf_static"] for one in message.transforms} \
        if "/tf_static" in found else {}
    turned = Rotation.identity()
    while child in known:
        turned, child = rotation(known[child].transform.rotation) * turned, known[child].header.frame_id
    return turned


@pytest.mark.parametrize("name", BAGS)
def test_every_frame_of_every_message_is_in_one_tree(name):
    found = messages(name)
    parents, times = {}, {}
    for topic in {"/tf", "/tf_static"} & found.keys():
        for stamp, message in found[topic]:
            for one in message.transforms:
                assert parents.setdefault(one.child_frame_id, one.header.frame_id) == one.header.frame_id
                times.setdefault((topic, one.child_frame_id), []).append(stamp)
    assert all(np.all(np.diff(stamps) > 0) for stamps in times.values()), "a frame is said twice at one stamp"
    assert all(len(stamps) == 1 for (topic, _), stamps in times.items() if topic == "/tf_static")
    roots = set(parents.values()) - parents.keys()
    assert len(roots) == 1, roots
    named = {message.header.frame_id for topic, heard in found.items() for _, message in heard
             if hasattr(message, "header")}
    named |= {message.child_frame_id for heard in found.values() for _, message in heard if hasattr(message, "child_frame_id")}
    signals = [signal for _, _, signal in load(name).graph.outputs()]
    named |= {signal.fixed.get(key) for signal in signals for key in ("header.frame_id", "child_frame_id")} - {None}
    assert named - {""} <= parents.keys() | roots


def test_the_rover_stands_as_its_attitude_says():
    found = messages("cubli_asteroid")
    attitude = dict(found["/cubli/truth/attitude"])
    assert {message.linear_acceleration_covariance[0] for message in attitude.values()} == {-1.0}
    for stamp, _ in found["/tf"]:
        up = turn(found, "cubli_balance", stamp).inv() * turn(found, "cubli_base", stamp)
        assert (up.inv() * rotation(attitude[stamp].orientation)).magnitude() < 1e-12
    assert turn(found, "cubli_balance", 0).apply(np.ones(3) / np.sqrt(3)) == pytest.approx([0, 0, 1], abs=1e-15)


def test_the_lander_s_star_tracker_measures_against_the_inertial_axes():
    """In 60 s the asteroid turns by 20 mrad, a hundred times the star tracker's noise about each axis."""
    run = simulate(load("lander_estimated", {"duration_s": 60}))
    frames, measured = run["lander/truth/frames"][::2], run["lander/star_tracker"]["quaternion"]  # at 10 and 5 Hz
    assert len(frames) == len(measured) == 300
    true = Rotation.from_quat(frames["inertial"]).inv() * Rotation.from_quat(frames["attitude"])
    errors = (true * Rotation.from_quat(measured).inv()).magnitude()
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(2e-4 * np.sqrt(3), rel=0.15)


def test_the_links_of_the_arm_turn_as_far_as_their_joints():
    """From one stamp to the next a link turns in its parent's axes by the change of its joint's angle."""
    found = messages("spacerobot_harmonic")
    joints = {stamp: [message.position[message.name.index(f"joints[{k}]")] for k in range(4)]
              for stamp, message in found["/spacerobot/truth"]}
    at = [stamp for stamp, _ in found["/tf"] if stamp in joints]
    links = [{one.child_frame_id: rotation(one.transform.rotation) for one in message.transforms}
             for stamp, message in found["/tf"] if stamp in joints]
    assert len(at) > 3
    for before, now, earlier, later in zip(links, links[1:], at, at[1:]):
        for k in range(4):
            angle = (before[f"spacerobot_B{k + 1}"].inv() * now[f"spacerobot_B{k + 1}"]).magnitude()
            assert angle == pytest.approx(abs(joints[later][k] - joints[earlier][k]), abs=1e-9)
