"""Names of numbers as series, topics and fields: ROS's own rules for names hold, and no two share one."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flight_graph.bags.series import named_fields, of_names
from flight_graph.viewers.typed_topics import TypedTopic


def topics(topic, names, fields, units=None):
    """The typed topics of named numbers, two messages of them."""
    values = np.zeros(2, [(field, "<f8", len(names)) for field in fields])
    return [TypedTopic.of(one) for one in of_names(topic, values, names, fields, units or {}, np.zeros(2))]


def test_entries_with_numbers_are_one_topic_and_joints_are_fields():
    found = topics("/a/b", ["xi[0]", "xi[1]", "margin"], ["position"], {"/a/b:position[xi[0]]": "rad"})
    assert [(one.own_topic, one.count, one.fields, one.unit) for one in found] == [
        ("/a/b/xi", 2, ["value"], "rad"), ("/a/b/margin", 1, ["value"], "")]
    found = topics("/arm", ["Joint-1", "joint 2"], ["position", "velocity"])
    assert [(one.own_topic, one.fields, one.unit) for one in found] == [
        ("/arm/position", ["joint_1", "joint_2"], "rad or m"), ("/arm/velocity", ["joint_1", "joint_2"], "rad/s or m/s")]
    (found,) = topics("/two/joint_states", ["a", "b"], ["position"])
    assert (found.own_topic, found.fields) == ("/two/joint_states/position", ["a", "b"])


@settings(deadline=None)
@given(st.lists(st.text(min_size=1, max_size=12), min_size=1, max_size=6, unique=True))
def test_fields_are_names_that_ros_takes_whatever_the_joints_are_called(names):
    for one in topics("/arm", names, ["position", "velocity"]):
        assert len(set(one.fields)) == len(one.fields)
        assert all(re.fullmatch(r"[a-z](?:_?[a-z0-9])*", field) for field in one.fields), one.fields
        assert re.fullmatch(r"flight_graph/msg/[A-Z][A-Za-z0-9]*", one.type_name)


@pytest.mark.parametrize("names", [None, [], ["a", "a"], "a"])
def test_no_names_no_names_of_numbers(names):
    assert named_fields(np.dtype([("position", "<f8", 2)]), names) == []
