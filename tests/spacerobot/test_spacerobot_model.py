"""Robot models: the YAML file, URDF against Pinocchio's reader, and a sentence for each model that cannot be."""

import copy
from pathlib import Path

import numpy as np
import pytest
import yaml

from spacerobot_ros.inertial_parameters import ModelError, prior, smallest_pseudo_inertia_eigenvalues
from spacerobot_ros.model import load_model, model_from_mapping
from spacerobot_ros.urdf import load_urdf
from tests.spacerobot.spacerobot_cases import random_mapping, random_robot
from tests.spacerobot.spacerobot_loop import MODEL, ROBOT

MAPPING = yaml.safe_load(Path(MODEL).read_text())


def broken(change):
    mapping = copy.deepcopy(MAPPING)
    change(mapping)
    with pytest.raises(ModelError) as caught:
        model_from_mapping(mapping, "robot.yaml")
    return str(caught.value)


def test_paper_robot():
    assert ROBOT.joints == 4 and ROBOT.pi.shape == (50,) and list(ROBOT.parent) == [0, 1, 2, 3]
    assert ROBOT.parameter_names[0] == "B0.Ixx" and ROBOT.parameter_names[49] == "B4.m"
    np.testing.assert_allclose(ROBOT.pi[9::10], [30.0, 1.2, 2.0, 1.6, 1.8])
    np.testing.assert_allclose(ROBOT.upper, np.pi)
    assert smallest_pseudo_inertia_eigenvalues(ROBOT.pi).min() > 0.0


def test_modified_denavit_hartenberg_is_the_product_of_elementary_transforms():
    alpha, a, d = np.pi / 2, 0.35, 0.0
    turn = np.array([[1, 0, 0], [0, np.cos(alpha), -np.sin(alpha)], [0, np.sin(alpha), np.cos(alpha)]])
    np.testing.assert_allclose(ROBOT.fixed_rotation[3], turn, atol=1e-15)
    np.testing.assert_allclose(ROBOT.offset[3], turn @ [a, 0, d], atol=1e-15)
    np.testing.assert_allclose(ROBOT.offset[0], [0.10, 0, 0.26])


def test_joints_in_any_order_are_sorted_outward():
    mapping = copy.deepcopy(MAPPING)
    mapping["joints"].reverse()
    robot = model_from_mapping(mapping)
    assert robot.joint_names == ROBOT.joint_names
    np.testing.assert_array_equal(robot.pi, ROBOT.pi)


@pytest.mark.parametrize("joints", [0, 1, 12])
def test_sizes(joints):
    robot = random_robot(np.random.default_rng(0), joints)
    assert robot.joints == joints and robot.pi.shape == (10 * (joints + 1),)
    assert np.all(robot.parent < np.arange(1, joints + 1))


def test_more_than_twelve_joints():
    with pytest.raises(ModelError, match="joints.*at most 12"):
        random_robot(np.random.default_rng(0), 13)


def test_loop():
    sentence = broken(lambda m: m["joints"][0].update(parent="B2"))
    assert "loop (B1 -> B2 -> B1)" in sentence and "robot.yaml" in sentence


def test_unknown_parent():
    sentence = broken(lambda m: m["joints"][1].update(parent="B9"))
    assert "'joint_2'" in sentence and "'B9' does not exist" in sentence and "B0, B1" in sentence


def test_body_carried_twice():
    assert "'B1' of joint 'joint_2' already exists" in broken(lambda m: m["joints"][1]["body"].update(name="B1"))


def test_massless_body():
    assert "body 'B3': mass is 0 kg" in broken(lambda m: m["joints"][2]["body"].update(mass=0.0))


@pytest.mark.parametrize("inertia", [{"xx": 1.0, "yy": 0.1, "zz": 0.1}, {"xx": 0.1, "yy": -0.1, "zz": 0.1}])
def test_inertia_that_no_body_has(inertia):
    sentence = broken(lambda m: m["joints"][3]["body"].update(inertia=inertia))
    assert "body 'B4': principal moment" in sentence


def test_not_a_number():
    assert "joints.0.body.mass" in broken(lambda m: m["joints"][0]["body"].update(mass=float("nan")))


def test_unknown_key_and_missing_key():
    assert "joints.0.colour" in broken(lambda m: m["joints"][0].update(colour="red"))
    assert "base.mass: field required" in broken(lambda m: m["base"].pop("mass"))


def test_limits_the_wrong_way_round():
    assert "lower limit 2 rad" in broken(lambda m: m["joints"][0].update(limits={"lower": 2.0, "upper": 1.0}))


@pytest.mark.parametrize("text", ["a: [", "just text", ""])
def test_files_that_are_no_model(tmp_path, text):
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    with pytest.raises(ModelError, match="robot.yaml"):
        load_model(path)


def test_missing_file(tmp_path):
    with pytest.raises(ModelError, match="cannot be read"):
        load_model(tmp_path / "none.yaml")


def test_priors_are_checked():
    with pytest.raises(ModelError, match="needs 50 parameters"):
        ROBOT.check_prior(np.ones(49))
    with pytest.raises(ModelError, match="'B0.Ixy' is not a finite number"):
        ROBOT.check_prior(np.where(np.arange(50) == 1, np.nan, 1.0))
    with pytest.raises(ModelError, match="eta"):
        prior(ROBOT.pi, -0.1, 1)
    with pytest.raises(ModelError, match="standard_deviation"):
        prior(ROBOT.pi, 0.1, 1, "median")


@pytest.mark.parametrize("eta, share", [(0.1, 0.785), (0.4, 0.992)])
def test_share_of_priors_with_an_impossible_body(eta, share):
    """Share of 1000 priors with at least one impossible body, by an independent count."""
    bad = sum(smallest_pseudo_inertia_eigenvalues(prior(ROBOT.pi, eta, s)).min() <= 0.0 for s in range(1000))
    assert bad / 1000 == pytest.approx(share, abs=0.012)


def urdf_of(mapping, welded):
    """URDF text of a random robot's mapping; every body in ``welded`` hangs on a fixed joint."""
    links, joints = [], []
    for body in [mapping["base"]] + [j["body"] for j in mapping["joints"]]:
        c = " ".join(map(repr, body["center_of_mass"]))
        moments = " ".join(f'i{k}="{v!r}"' for k, v in body["inertia"].items())
        links.append(
            f'<link name="{body["name"]}"><inertial><origin xyz="{c}" rpy="0.3 -0.2 0.1"/>'
            f'<mass value="{body["mass"]!r}"/><inertia {moments}/></inertial></link>'
        )
    for j in mapping["joints"]:
        kind = "fixed" if j["body"]["name"] in welded else "revolute"
        joints.append(
            f'<joint name="{j["name"]}" type="{kind}"><parent link="{j["parent"]}"/><child link="{j["body"]["name"]}"/>'
            f'<origin xyz="{" ".join(map(repr, j["origin"]["xyz"]))}" rpy="{" ".join(map(repr, j["origin"]["rpy"]))}"/>'
            f'<axis xyz="{" ".join(map(repr, j["axis"]))}"/>'
            '<limit lower="-1.5" upper="2" velocity="0.5" effort="3"/></joint>'
        )
    return f'<robot name="random">{"".join(links + joints)}</robot>'


@pytest.mark.parametrize("seed", range(6))
def test_urdf_against_pinocchio(seed):
    pin = pytest.importorskip("pinocchio", reason="Pinocchio, the reference of this test, is not here: make develop")
    rng = np.random.default_rng(seed)
    mapping = random_mapping(rng, 6)
    for joint in mapping["joints"]:
        joint["axis"] = (np.array(joint["axis"]) / np.linalg.norm(joint["axis"])).tolist()
    welded = {"link_2", "link_4"} if seed % 2 else set()
    text = urdf_of(mapping, welded)
    robot = load_urdf(text)
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    assert set(model.names[2:]) == set(robot.joint_names)
    model.gravity = pin.Motion.Zero()
    for body in range(robot.joints + 1):
        ours = robot.pi[10 * body : 10 * (body + 1)]
        joint = 1 if body == 0 else model.getJointId(robot.joint_names[body - 1])
        theirs = model.inertias[joint].toDynamicParameters()[[4, 5, 7, 6, 8, 9, 1, 2, 3, 0]]
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-11 * np.abs(theirs).max())
    for i, name in enumerate(robot.joint_names):
        placement = model.jointPlacements[model.getJointId(name)]
        np.testing.assert_allclose(robot.fixed_rotation[i], placement.rotation, atol=1e-12)
        np.testing.assert_allclose(robot.offset[i], placement.translation, atol=1e-12)
    assert robot.lower[0] == -1.5 and robot.upper[0] == 2.0
    assert robot.velocity_limit[0] == 0.5 and robot.torque_limit[0] == 3.0


LINK = (
    '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    "</inertial></link>"
)


def joint(name, parent, child, kind="revolute"):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/></joint>'


@pytest.mark.parametrize(
    "body, sentence",
    [
        ("<robot", "is not XML"),
        ("<sdf/>", "must be <robot>"),
        (f'<robot name="r">{LINK.format("a")}{LINK.format("b")}</robot>', "found a, b"),
        (
            f'<robot name="r">{LINK.format("a")}{LINK.format("b")}{joint("j", "a", "b")}{joint("k", "b", "a")}</robot>',
            "loop",
        ),
        (
            f'<robot name="r">{LINK.format("a")}{LINK.format("b")}{LINK.format("c")}'
            f"{joint('j', 'a', 'c')}{joint('k', 'b', 'c')}</robot>",
            "child of two joints",
        ),
        (
            f'<robot name="r">{LINK.format("a")}{LINK.format("b")}{LINK.format("c")}'
            f"{joint('j', 'b', 'c', 'fixed')}{joint('k', 'c', 'b', 'fixed')}</robot>",
            "links b, c are not connected to the base 'a'",
        ),
        (f'<robot name="r">{LINK.format("a")}<link name="b"/>{joint("j", "a", "b")}</robot>', "'b': mass is 0 kg"),
        (f'<robot name="r">{LINK.format("a")}{joint("j", "a", "z")}</robot>', "child link 'z' does not exist"),
        (
            f'<robot name="r">{LINK.format("a")}{LINK.format("b")}{joint("j", "a", "b", "prismatic")}</robot>',
            "type 'prismatic' is not allowed",
        ),
    ],
)
def test_urdf_errors(body, sentence):
    with pytest.raises(ModelError) as caught:
        load_urdf(body)
    assert sentence in str(caught.value)
