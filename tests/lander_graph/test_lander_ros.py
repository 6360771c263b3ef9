"""The nominal landing as ROS nodes in lockstep leaves the bag of the compiled loop, byte for byte."""

import pytest

pytest.importorskip("rclpy")

from tests.ros.processes import flight  # noqa: E402
from tests.ros.test_lockstep import assert_equal, messages  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("lockstep")]


def test_first_120_s_of_the_nominal_landing(tmp_path):
    for name, more in (("compiled", ()), ("ros", ("--engine", "ros"))):
        done = flight(
            "run", "lander_nominal", "--duration", 120, *more, "--out", tmp_path / name, "--json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert_equal(tmp_path / "compiled", tmp_path / "ros")
    counts = {topic: len(found) for topic, found in messages(tmp_path / "ros").items()}
    assert counts["/lander/cmd_wrench"] == 1200 and counts["/diagnostics"] == 240
    assert counts["/tf"] == 1200 and counts["/tf_static"] == 1  # what moves at 10 Hz; the site once
