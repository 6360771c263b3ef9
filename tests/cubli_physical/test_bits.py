"""The physical plant gives the same bits compiled and as plain Python, through standing, sliding and flying."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = {"plant.largest_step": 0.01, "plant.on_slip": "slide", "duration_s": 2}
SITE = {"plant.latitude": 0.3, "duration_s": 0.2}


def digest(scenario, settings):
    recording = CompiledRun(load(scenario, settings)).run()
    return [hashlib.sha256(track.records.tobytes()).hexdigest() for track in recording.tracks]


def both():
    return digest("cubli_physical", SETTINGS) + digest("cubli_bennu", SITE)


def test_compiled_equals_plain_python():
    contact = CompiledRun(load("cubli_physical", SETTINGS)).run()["cubli/truth/contact"]
    assert (contact["sliding"] == 1.0).any()
    assert (contact["phase"] == 1.0).any()
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    program = "from tests.cubli_physical.test_bits import both; print(*both())"
    plain = subprocess.run([sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, text=True)
    assert plain.returncode == 0, plain.stderr
    assert plain.stdout.split() == both()
