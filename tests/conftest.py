"""What all tests share: a ROS domain of its own for every worker, discovery on this machine alone, and no window."""

import os
import zlib

for variable in ("COLUMNS", "LINES"):  # of who started the tests; pytest-xdist sets them for its workers
    os.environ.pop(variable, None)


def pytest_configure(config):
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")
    session = os.environ.get("PYTEST_XDIST_TESTRUNUID", str(os.getpid()))
    os.environ["ROS_DOMAIN_ID"] = str(10 + (zlib.crc32(session.encode()) + int(worker)) % 80)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"


def pytest_sessionfinish(session):
    """Tests that kill nodes leave the middleware's shared memory behind: remove what nobody uses any more."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        from flight_graph.ros import shared_memory
        shared_memory.clean()
