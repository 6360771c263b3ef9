"""The same scenarios in plain Python, in a process of its own that serves a whole test run."""

import atexit
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

from flight_graph.errors import RunStopped

ROOT = Path(__file__).resolve().parents[2]


def digest(recording) -> dict:
    """Topic -> hash of all stamps and messages of a recording."""
    return {track.topic: hashlib.sha256(track.stamps_ns.astype("<i8").tobytes() + track.signal.payloads(track.records).tobytes()).hexdigest()
            for track in recording.tracks}


def fly(data: dict) -> dict:
    """Run a scenario here: its digests, and the sentence of its end."""
    from flight_graph.engines.compiled import CompiledRun
    from flight_graph.graphs.scenario import Scenario
    try:
        return digest(CompiledRun(Scenario(data, "chain.yaml")).run())
    except RunStopped as stop:
        return digest(stop.recording) | {"stopped": str(stop)}


class _Plainly:
    """``plainly(data)``: as `fly`, by the engine ``python``."""

    digest = staticmethod(digest)

    def __init__(self):
        self._process = None

    def __call__(self, data: dict) -> dict:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-c", "from tests.faults.engines import serve; serve()"], cwd=ROOT, text=True, stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)})
            atexit.register(self._end)
        self._process.stdin.write(json.dumps(data) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def _end(self):
        self._process.stdin.close()
        self._process.wait(30)


plainly = _Plainly()


def serve() -> None:
    """Scenarios in, digests out, line by line."""
    import numba
    assert numba.config.DISABLE_JIT
    for line in sys.stdin:
        print(json.dumps(fly(json.loads(line))), flush=True)
