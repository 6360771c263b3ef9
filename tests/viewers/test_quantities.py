"""Names of numbers as topics and fields: ROS's own rules for names hold, and no two share one."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flight_graph.viewers.quantities import of_records, quantities


def test_entries_with_numbers_are_one_quantity_and_joints_are_fields():
    found = quantities("/a/b", ["xi[0]", "xi[1]", "margin"], ("position",), {"/a/b:position[xi[0]]": "rad"})
    assert [(one.own_topic, one.indices, one.fields, one.unit) for one in found] == [
        ("/a/b/xi", (0, 1), ["value"], "rad"), ("/a/b/margin", (2,), ["value"], "")]
    found = quantities("/arm", ["Joint-1", "joint 2"], ("position", "velocity"))
    assert [(one.own_topic, one.fields) for one in found] == [
        ("/arm/position", ["joint_1", "joint_2"]), ("/arm/velocity", ["joint_1", "joint_2"])]


@given(st.lists(st.text(min_size=1, max_size=12), min_size=1, max_size=6, unique=True))
def test_fields_are_names_that_ros_takes_whatever_the_joints_are_called(names):
    dtype = np.dtype([("position", "<f8", len(names)), ("velocity", "<f8", len(names))])
    for one in of_records("/arm", dtype, names):
        assert len(set(one.fields)) == len(one.fields)
        assert all(re.fullmatch(r"[a-z](?:_?[a-z0-9])*", field) for field in one.fields), one.fields
        assert re.fullmatch(r"flight_graph/msg/[A-Z][A-Za-z0-9]*", one.type_name)


@pytest.mark.parametrize("names", [None, [], ["a", "a"], "a"])
def test_no_names_no_quantities(names):
    assert of_records("/arm", np.dtype([("position", "<f8", 2)]), names) == []
