"""Layouts: every path in them is a number of the messages; those that ship are those that are made."""

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader

from flight_graph.cli.layout import text_of
from flight_graph.graphs.scenario import load

ROOT = Path(__file__).resolve().parents[2]
VEHICLES = {"cubli_asteroid": "cubli_ros", "spacerobot_harmonic": "spacerobot_ros", "lander_estimated": "lander_ros"}
ENDINGS = {"foxglove": "foxglove.json", "plotjuggler": "plotjuggler.xml", "rviz": "rviz"}


@pytest.fixture(scope="module", params=list(VEHICLES))
def name(request):
    return request.param


@pytest.fixture(scope="module")
def seen(name):
    """topic -> its first message, as another library reads it."""
    found = {}
    with AnyReader([ROOT / "bags" / name]) as reader:
        for connection, _, raw in reader.messages():
            if connection.topic not in found:
                found[connection.topic] = reader.deserialize(raw, connection.msgtype)
    return found


def number(seen, path):
    """What a path of Foxglove's stands for."""
    topic = max((topic for topic in seen if path.startswith(f"{topic}.")), key=len)
    value = seen[topic]
    for part in path[len(topic) + 1:].split("."):
        part, _, index = part.partition("[")
        value = getattr(value, part)
        value = value[int(index[:-1])] if index else value
    return float(value)


def test_what_ships_is_what_is_made(name):
    for viewer, ending in ENDINGS.items():
        path = ROOT / "config" / VEHICLES[name] / f"{name}.{ending}"
        assert path.read_text(encoding="utf-8") == text_of(load(name), viewer), (
            f"make it anew: rm {path}; flight layout {name} --for {viewer} --out {path}")


def test_foxglove_shows_numbers_that_are_there_each_once_in_its_topic_and_no_panel_is_lost(name, seen):
    found = json.loads(text_of(load(name), "lichtblick"))
    plots = {key: panel["paths"] for key, panel in found["configById"].items() if key.startswith("Plot!")}
    assert all(np.isfinite(number(seen, path["value"])) or True for paths in plots.values() for path in paths)
    by_topic = [path["value"] for key, paths in plots.items() if "overview" not in key for path in paths]
    assert len(by_topic) == len(set(by_topic)) and max(map(len, plots.values())) <= 12
    for path in by_topic:
        if path.rpartition(".")[2].startswith("position["):
            topic, index = path.rpartition(".")[0], int(path[path.rindex("[") + 1:-1])
            label = next(one["label"] for paths in plots.values() for one in paths if one["value"] == path)
            assert label == seen[topic].name[index]

    def places(tree):
        return [tree] if isinstance(tree, str) else places(tree["first"]) + places(tree["second"])
    tabs = found["configById"][found["layout"]]["tabs"]
    placed = [one for tab in tabs for one in places(tab["layout"])]
    assert sorted([*placed, found["layout"]]) == sorted(found["configById"])
    assert found["configById"]["3D!picture"]["topics"].keys() <= seen.keys() | {"/scene"}


def test_models_of_several_vehicles_have_the_prefix_of_their_frames():
    """The links of each URDF, behind the prefix that the layout gives them, are frames of the bag's tf."""
    with AnyReader([ROOT / "bags/rovers_and_lander"]) as reader:
        said = {connection.topic: [] for connection in reader.connections}
        for connection, _, raw in reader.messages():
            if connection.topic.endswith(("/tf", "/tf_static", "/robot_description")):
                said[connection.topic].append(reader.deserialize(raw, connection.msgtype))
    frames = {one.child_frame_id for topic in ("/tf", "/tf_static") for message in said[topic] for one in message.transforms}
    scenario = load("rovers_and_lander")
    layers = json.loads(text_of(scenario, "foxglove"))["configById"]["3D!picture"]["layers"]
    models = [(one["topic"], one["framePrefix"]) for one in layers.values() if one["layerId"] == "foxglove.Urdf"]
    shown = yaml.safe_load(text_of(scenario, "rviz"))["Visualization Manager"]["Displays"]
    assert models == [(one["Description Topic"]["Value"], one["TF Prefix"] + "/") for one in shown if "TF Prefix" in one]
    assert len(models) == 3
    for topic, prefix in models:
        links = [link.get("name") for link in ElementTree.fromstring(said[topic][0].data).iter("link")]
        assert {prefix + link for link in links} <= frames, (topic, links)


def test_plotjuggler_has_the_curves_that_its_parser_makes(name, seen):
    root = ElementTree.fromstring(text_of(load(name), "plotjuggler"))
    curves = {curve.get("name") for curve in root.iter("curve")}
    made = set()  # as PlotJuggler's own parser of JointState names them: topic/joint/field
    for topic, message in seen.items():
        for field in ("position", "velocity", "effort"):
            if hasattr(message, "name"):
                made |= {f"{topic}/{joint}/{field}" for joint, _ in zip(message.name, getattr(message, field))}
    joints = {curve for curve in curves if any(curve.startswith(f"{topic}/") and hasattr(message, "name")
                                               for topic, message in seen.items()) and curve.endswith(
        ("/position", "/velocity", "/effort"))}
    assert joints and joints <= made
    for splitter in root.iter("DockSplitter"):  # it reads as many children as it says
        assert len(splitter) == int(splitter.get("count")) == len(splitter.get("sizes").split(";"))
        assert splitter.get("orientation") in ("-", "|")


def test_rviz_looks_for_what_is_said_once_and_in_a_frame_that_there_is(name, seen):
    found = yaml.safe_load(text_of(load(name), "rviz"))["Visualization Manager"]
    topics = {display["Class"].rpartition("/")[2]: display.get("Topic") or display.get("Description Topic")
              for display in found["Displays"]}
    assert topics["RobotModel"]["Value"] in seen and topics["RobotModel"]["Durability Policy"] == "Transient Local"
    frames = {one.header.frame_id for topic in ("/tf", "/tf_static") if topic in seen for one in seen[topic].transforms}
    frames |= {one.child_frame_id for topic in ("/tf", "/tf_static") if topic in seen for one in seen[topic].transforms}
    assert found["Global Options"]["Fixed Frame"] in frames
