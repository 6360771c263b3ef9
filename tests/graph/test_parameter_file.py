"""ROS parameter files as overrides: sections are matched as rcl matches them, and what fits nowhere is said."""

import pytest

from flight_graph.components.parameter_file import overrides
from flight_graph.errors import FlightError

COMPONENTS = {"plant": ("sim_nodes/cubli_plant", None), "law": ("cubli_ros/appc_controller", None),
              "other": ("cubli_ros/appc_controller", None)}


def read(tmp_path, text):
    path = tmp_path / "params.yaml"
    path.write_text(text)
    return overrides(path, COMPONENTS)


@pytest.mark.parametrize(("section", "meant"), [
    ("/**", ["law", "other"]), ("/*", ["law", "other"]), ("law", ["law"]), ("/law", ["law"]), ("/**/law", ["law"]),
    ("/rover/law", ["law"]), ("appc_controller", ["law", "other"]), ("/*/law", []), ("/**/*", ["law", "other"])])
def test_sections(tmp_path, section, meant):
    text = f"{section}:\n  ros__parameters: {{k_a: 0.5}}\nplant:\n  ros__parameters: {{mass: 1.0}}\n"
    found, remarks = read(tmp_path, text)
    assert found == {"plant.mass": 1.0, **{f"{name}.k_a": 0.5 for name in meant}}
    assert len(remarks) == (0 if meant else 1)


def test_later_sections_win_and_other_keys(tmp_path):
    found, _ = read(tmp_path, "/**:\n  ros__parameters: {k_a: 0.5, use_sim_time: true, rate_hz: 50.0}\n"
                              "law:\n  ros__parameters: {k_a: 0.7}\n")
    assert found == {"law.k_a": 0.7, "other.k_a": 0.5, **{f"{name}.rate_hz": 50.0 for name in COMPONENTS}}


def test_namespaces_around_nodes_and_what_every_node_has(tmp_path):
    found, _ = read(tmp_path, "/**:\n  law:\n    ros__parameters:\n      k_a: 0.5\n      qos_overrides:\n"
                              "        /x: {publisher: {depth: 3}}\n/rover:\n  arm:\n    other:\n"
                              "      ros__parameters: {k_a: 0.7}\n")
    assert found == {"law.k_a": 0.5, "other.k_a": 0.7}


def test_a_misspelt_section_is_named(tmp_path):
    found, remarks = read(tmp_path, "law:\n  ros__parameters: {k_a: 0.5}\nlav:\n  ros__parameters: {k_a: 1.0}\n")
    assert found == {"law.k_a": 0.5} and "no component called 'lav'; did you mean 'law'" in remarks[0]


@pytest.mark.parametrize(("text", "sentence"), [
    ("law:\n  ros__parameters: {k_aa: 0.5}\n", "law: no parameter called 'k_aa'; did you mean 'k_a'"),
    ("/**:\n  ros__parameters: {nowhere: 0.5}\n", "no parameter called 'nowhere'"),
    ("lav:\n  ros__parameters: {k_a: 0.5}\n", "none of its sections"), ("[1, 2]", "no ROS parameter file"),
    ("law:\n  ros_parameters: {k_a: 0.5}\n", "law/ros_parameters holds no ros__parameters"),
    ("other:\n  ros__parameters: {k_a: 0.5}\nlaw: {k_a: 0.5}\n", "law holds no ros__parameters"),
    ("a: &a [*a]", "stands for nothing, or for a value that it is in"), ("{", "this is no YAML")])
def test_what_is_refused(tmp_path, text, sentence):
    with pytest.raises(FlightError, match=sentence.replace("(", r"\(")):
        read(tmp_path, text)
