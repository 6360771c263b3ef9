"""Machine code is loaded where it works, however crowded the address space of the process is."""

import subprocess
import sys

import pytest


@pytest.mark.skipif(sys.platform != "linux", reason="takes addresses by Linux's mmap")
def test_code_and_its_constants_find_each_other_in_a_crowded_process():
    done = subprocess.run([sys.executable, "-m", "tests.graph.crowded"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
