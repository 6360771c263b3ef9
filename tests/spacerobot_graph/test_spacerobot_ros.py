"""Least squares on the harmonics as ROS nodes in lockstep leaves the bag of the compiled loop, byte for byte."""

import pytest

pytest.importorskip("rclpy")

from tests.ros.processes import flight  # noqa: E402
from tests.ros.test_lockstep import assert_equal, messages  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("lockstep")]


def test_first_10_s_with_50_parameters_at_50_hz(tmp_path):
    for name, more in (("compiled", ()), ("ros", ("--engine", "ros"))):
        done = flight("run", "spacerobot_harmonic_rls", "--duration", 10, *more, "--out", tmp_path / name, "--json",
                      cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert_equal(tmp_path / "compiled", tmp_path / "ros")
    counts = {topic: len(found) for topic, found in messages(tmp_path / "ros").items()}
    assert counts["/spacerobot/parameters"] == 500 and counts["/diagnostics"] == 10
