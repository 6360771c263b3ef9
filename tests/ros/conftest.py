"""Runs that several tests look at, made once a session, and the check that nothing stays in shared memory."""

import json
import time

import pytest

pytest.importorskip("rclpy")

from flight_graph.ros import shared_memory  # noqa: E402
from flight_graph.ros.environment import prepare_environment  # noqa: E402
from flight_graph.ros.patience import at_least  # noqa: E402
from tests.ros.processes import flight  # noqa: E402

prepare_environment()


@pytest.fixture(scope="session", autouse=True)
def nothing_stays_in_shared_memory():
    """Segments that nobody uses any more after the session, and did not before."""
    before = set(shared_memory.leftovers(0.0))
    yield
    deadline = time.monotonic() + at_least(60.0)  # [s] tests of another worker may be killing nodes, and clean up after them
    while left := set(shared_memory.leftovers(0.0)) - before:
        assert time.monotonic() < deadline, f"left in shared memory: {sorted(left)}"
        time.sleep(0.1)


class Runs:
    """Runs of scenarios by the command line, each made when it is first asked for: (json, bag folder)."""

    def __init__(self, folder):
        self.folder, self._made = folder, {}

    def __call__(self, name: str, *arguments):
        if name not in self._made:
            bag = self.folder / name
            done = flight("run", *arguments, "--out", bag, "--json", cwd=self.folder)
            assert done.returncode == 0, done.stderr
            self._made[name] = json.loads(done.stdout), bag
        return self._made[name]


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    return Runs(tmp_path_factory.mktemp("runs"))
