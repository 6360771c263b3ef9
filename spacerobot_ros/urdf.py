"""A robot model from a URDF file: links become bodies, revolute joints joints, fixed joints weld their links.

The XML is read with the standard library: the model needs five elements of the format (link/inertial, joint/origin,
axis, limit, parent/child). Of the parsers on the package index, yourdfpy brings a mesh stack of two dozen packages and
urdf_parser_py's release carries no licence statement and reports errors by printing.
"""

from pathlib import Path

import numpy as np

from flight_graph import xml_text
from flight_graph.errors import FlightError
from flight_graph.text_files import read_bytes, short
from spacerobot_ros.inertial_parameters import ModelError, body_parameters, tensor
from spacerobot_ros.model import SpaceRobot, model_from_mapping, rotation_from_rpy

MOST_LINKS = 256  # links, and joints, of a file


def load_urdf(source) -> SpaceRobot:
    """Read a URDF given as a path or as the XML text itself. Raises `ModelError` with a sentence.

    Link names are kept, so are the frames: parameters are about each link's frame origin, in its axes. Joint types
    allowed: revolute, continuous, fixed. Inertias of welded links are added to the link that carries them.
    """
    text = str(source)
    where = "URDF"
    if not text.lstrip().startswith("<"):
        where = f"URDF {text}"
    try:
        content = read_bytes(Path(text), where, xml_text.LARGEST) if where != "URDF" else text
        root = xml_text.parse(content, where)
    except FlightError as error:
        raise ModelError(str(error)) from None
    if root.tag != "robot":
        raise ModelError(f"{where}: the root element is <{root.tag}>; it must be <robot>")
    try:
        return model_from_mapping(_mapping(root), where)
    except ModelError as error:
        message = str(error)
        raise ModelError(message if message.startswith(where) else f"{where}: {message}") from None


def _mapping(root) -> dict:
    for kind in ("link", "joint"):
        if len(root.findall(kind)) > MOST_LINKS:
            raise ModelError(f"there are more than {MOST_LINKS} elements <{kind}>, which is more than is read")
    links = {_name(link): _inertial(link) for link in root.findall("link")}
    joints = [_joint(joint, links) for joint in root.findall("joint")]
    children = [joint["child"] for joint in joints]
    for child in children:
        if children.count(child) > 1:
            raise ModelError(f"link '{child}' is the child of two joints; a tree is needed, not a loop")
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        found = ", ".join(roots) or "none: the joints form a loop"
        raise ModelError(f"exactly one link must be no joint's child (the base); found {found}")
    _check_reached(roots[0], links, joints)
    _weld(joints, links)
    moving = [joint for joint in joints if joint["type"] != "fixed"]
    return {
        "name": root.get("name") or "robot",
        "base": _body(roots[0], links[roots[0]]),
        "joints": [
            {
                "name": joint["name"],
                "parent": joint["parent"],
                "origin": {"xyz": joint["offset"].tolist(), "rotation": joint["rotation"].tolist()},
                "axis": joint["axis"].tolist(),
                "limits": joint["limits"],
                "body": _body(joint["child"], links[joint["child"]]),
            }
            for joint in moving
        ],
    }


def _check_reached(base, links, joints) -> None:
    reached = {base}
    for _ in joints:
        reached |= {joint["child"] for joint in joints if joint["parent"] in reached}
    lost = [name for name in links if name not in reached]
    if lost:
        raise ModelError(f"joints form a loop: links {', '.join(lost)} are not connected to the base '{base}'")


def _weld(joints, links) -> None:
    """Move the inertia of every fixed joint's link, and the joints on it, to the link that carries it; in place."""
    fixed = {joint["child"]: joint for joint in joints if joint["type"] == "fixed"}
    for joint in joints:
        seen = set()
        while joint["type"] != "fixed" and joint["parent"] in fixed and joint["parent"] not in seen:
            seen.add(joint["parent"])
            weld = fixed[joint["parent"]]
            joint["offset"] = weld["offset"] + weld["rotation"] @ joint["offset"]
            joint["rotation"] = weld["rotation"] @ joint["rotation"]
            joint["parent"] = weld["parent"]
    for child, weld in fixed.items():
        offset, rotation, carrier = weld["offset"], weld["rotation"], weld["parent"]
        seen = {child}
        while carrier in fixed and carrier not in seen:
            seen.add(carrier)
            outer = fixed[carrier]
            offset = outer["offset"] + outer["rotation"] @ offset
            rotation = outer["rotation"] @ rotation
            carrier = outer["parent"]
        mass, center, inertia = links[child]
        links[carrier] = _together(links[carrier], (mass, offset + rotation @ center, rotation @ inertia @ rotation.T))


def _together(first, second):
    """Mass, centre of mass and central inertia of two bodies welded together, both given in the same frame."""
    mass = first[0] + second[0]
    if mass == 0.0:
        return first
    pi = body_parameters(*first) + body_parameters(*second)
    center = pi[6:9] / mass
    return mass, center, tensor(pi[:6]) - mass * (center @ center * np.eye(3) - np.outer(center, center))


def _body(name, inertial) -> dict:
    mass, center, inertia = inertial
    elements = {a + b: float(inertia["xyz".index(a), "xyz".index(b)]) for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")}
    return {"name": name, "mass": float(mass), "center_of_mass": center.tolist(), "inertia": elements}


def _inertial(link):
    """(mass [kg], centre of mass (3,) [m], inertia (3, 3) about it [kg m^2]) of a <link>, in the link's axes."""
    element = link.find("inertial")
    if element is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    where = f"link '{_name(link)}'"
    center, turn = _origin(element, where)
    mass, moments = element.find("mass"), element.find("inertia")
    if mass is None or moments is None:
        raise ModelError(f"{where}: <inertial> needs <mass> and <inertia>")
    six = [_number(moments.get("i" + key), f"{where} inertia i{key}") for key in ("xx", "xy", "xz", "yy", "yz", "zz")]
    return _number(mass.get("value"), f"{where} mass"), center, turn @ tensor(six) @ turn.T


def _joint(joint, links) -> dict:
    name = _name(joint)
    where = f"joint '{name}'"
    kind = joint.get("type")
    if kind not in ("revolute", "continuous", "fixed"):
        raise ModelError(f"{where}: type '{kind}' is not allowed; allowed: revolute, continuous, fixed")
    if joint.find("mimic") is not None:
        raise ModelError(f"{where}: <mimic> is not allowed; every joint moves on its own")
    ends = {}
    for end in ("parent", "child"):
        element = joint.find(end)
        ends[end] = None if element is None else element.get("link")
        if ends[end] not in links:
            raise ModelError(f"{where}: {end} link '{ends[end]}' does not exist")
    offset, rotation = _origin(joint, where)
    axis = joint.find("axis")
    direction = _vector(axis.get("xyz"), f"{where} axis") if axis is not None else np.array([1.0, 0.0, 0.0])
    limits = {}
    element = joint.find("limit")
    if element is not None:
        keys = [("velocity", "velocity"), ("effort", "torque")]
        if kind == "revolute":
            keys += [("lower", "lower"), ("upper", "upper")]
        for key, ours in keys:
            if element.get(key) is not None:
                limits[ours] = _number(element.get(key), f"{where} limit {key}")
    return {
        "name": name, "type": kind, **ends, "offset": offset, "rotation": rotation, "axis": direction, "limits": limits,
    }  # fmt: skip


def _origin(element, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Translation (3,) [m] and rotation (3, 3) of an element's <origin>; none means zero."""
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), np.eye(3)
    xyz = _vector(origin.get("xyz", "0 0 0"), f"{where} origin xyz")
    return xyz, rotation_from_rpy(_vector(origin.get("rpy", "0 0 0"), f"{where} origin rpy"))


def _name(element) -> str:
    name = element.get("name")
    if not name:
        raise ModelError(f"a <{element.tag}> has no name")
    if len(name) > 200:
        raise ModelError(f"the name '{short(name, 40)}' of a <{element.tag}> has more than 200 letters")
    return name


def _number(text, what: str) -> float:
    try:
        return float(text)
    except (TypeError, ValueError):
        raise ModelError(f"{what} is {short(repr(text))}; a number is needed") from None


def _vector(text, what: str) -> np.ndarray:
    parts = (text or "").split()
    if len(parts) != 3:
        raise ModelError(f"{what} is {short(repr(text))}; three numbers are needed")
    return np.array([_number(part, what) for part in parts])
