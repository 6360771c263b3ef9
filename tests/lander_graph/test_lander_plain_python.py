"""The same source without the compiler gives the same bits: sensors, filter, law, plant and monitor of one landing."""

from tests.ros.processes import flight
from tests.ros.test_lockstep import assert_equal


def test_plain_python_run(tmp_path):
    for engine in ("compiled", "python"):
        done = flight("run", "lander_estimated", "--duration", 4, "--engine", engine, "--out",
                      tmp_path / engine, "--json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert_equal(tmp_path / "compiled", tmp_path / "python")
