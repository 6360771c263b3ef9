"""Nothing that is computed before a run begins hangs on the C library or on NumPy's own mathematics.

Parameters and first states are made by plain Python (`resolve`, gravity of a body, geometry). Here the functions of math,
NumPy and numpy.linalg that are not exactly rounded give the next number up: no bit of any parameter or state may move.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.portable.scenario_digests import scenarios

ROOT = Path(__file__).resolve().parents[2]
PROBE = """
import hashlib, json, math, sys
import numba, numpy as np
from numba.np import npyimpl
numba.njit(lambda x: x + np.sin(x))(1.0)  # numba's tables are made before anything is replaced

def replace(module, name):
    true = getattr(module, name)
    def shifted(*arguments, **keywords):
        found = true(*arguments, **keywords)
        return np.nextafter(found, np.inf) if isinstance(found, (float, np.ndarray)) else found
    setattr(module, name, shifted)

if sys.argv[1] == "shifted":
    for name in "sin cos tan asin acos atan atan2 sinh cosh tanh exp expm1 log log1p log2 log10 hypot pow cbrt".split():
        replace(math, name)
    for name in "sin cos tan arcsin arccos arctan arctan2 sinh cosh tanh exp expm1 log log1p hypot power cbrt".split():
        replace(np, name)
    for name in "norm inv solve det cholesky svd eigh eigvalsh lstsq".split():
        replace(np.linalg, name)
from flight_graph.graphs.scenario import load
found = {}
for name in sys.argv[2:]:
    found[name] = {}
    for node in load(name).graph.nodes.values():
        parts = node.component.parameters.record(node.values, node.name), node.component.initial_state(node.values)
        for kind, record in zip(("parameter", "state"), parts):
            for field in record.dtype.names:
                found[name][f"{node.name}: {kind} {field}"] = hashlib.sha256(record[field].tobytes()).hexdigest()
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def probe():
    def run(how):
        done = subprocess.run([sys.executable, "-c", PROBE, how, *scenarios()], cwd=ROOT, capture_output=True,
                              encoding="utf-8", env={**os.environ, "PYTHONPATH": str(ROOT)})
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)
    return run("as it is"), run("shifted")


@pytest.mark.parametrize("name", scenarios())
def test_parameters_and_first_states(probe, name):
    before, shifted = (found[name] for found in probe)
    assert [what for what in before if before[what] != shifted[what]] == []
