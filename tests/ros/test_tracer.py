"""Forked nodes and the tracer of ROS 2: a child has the tracer's threads for its own, so that its exit ends no others."""

import json
import subprocess
import sys

import pytest

from flight_graph.ros.patience import at_least
from tests.ros.processes import ROOT, environment

pytestmark = pytest.mark.ros

SCRIPT = """
import json, os, sys, threading
from flight_graph.ros import tracer
from flight_graph.ros.environment import prepare_environment
prepare_environment()
import rclpy
found = tracer.follow_forks()
def threads():
    return len(os.listdir("/proc/self/task"))
before, (end, start) = threads(), os.pipe()
if os.fork() == 0:
    os.write(start, json.dumps([found, before, threads()]).encode())
    sys.exit(0)
print(os.read(end, 1000).decode())
sys.exit(os.waitstatus_to_exitcode(os.wait()[1]))
"""


def test_a_forked_child_has_the_threads_of_its_tracer():
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", SCRIPT], cwd=ROOT, capture_output=True, text=True,
                          env=environment(OPENBLAS_NUM_THREADS="1"), timeout=at_least(60.0))
    assert done.returncode == 0, done.stderr
    found, before, after = json.loads(done.stdout)
    if not found:
        pytest.skip("this ROS 2 was built without LTTng")
    assert after == before > 1
