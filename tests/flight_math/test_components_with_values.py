"""Parts written with values in the compiled engine and in plain Python; records that declare kinds; fingerprints."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from flight_graph.components.component import kinds_of
from flight_graph.components.records import Array, DualQuaternion, DualVector, Mat, Parameters, Vec, field
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from flight_math import Quaternion, Vec3, fingerprint, kernel
from tests.flight_math import value_toy

ROOT = Path(__file__).resolve().parents[2]


def digest(recording) -> str:
    """SHA-256 of all tracks."""
    found = hashlib.sha256()
    for track in sorted(recording.tracks, key=lambda track: track.topic):
        found.update(track.topic.encode() + track.signal.payloads(track.records).tobytes())
    return found.hexdigest()


def run():
    """The recording of the toy."""
    return CompiledRun(Scenario(value_toy.scenario(), "values.yaml")).run()


def test_compiled_and_plain_python_give_equal_bits():
    code = ("from tests.flight_math.test_components_with_values import digest, run\nprint(digest(run()))")
    plain = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True,
                           env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)})
    assert plain.stdout.strip() == digest(run())


def test_the_motion_is_that_of_its_equations():
    """Against the same equations in NumPy, within rounding; the quaternion stays of norm one."""
    recording = run()
    tracks = {track.topic: track.records for track in recording.tracks}
    inertia = np.array([[0.5, 0.0, 0.01], [0.0, 0.4, 0.0], [0.01, 0.0, 0.3]])
    angle, rate, effort = np.array([0.1, 0.2, -0.3]), np.zeros(3), np.zeros(3)
    for tick, row in enumerate(tracks["toy/truth"]):
        np.testing.assert_allclose(row["angle"], angle, rtol=1e-12, atol=1e-15)
        if tick % 2 == 0:
            effort = np.clip(-np.array([0.5, 1.0, 2.0]) * angle - 0.1 * rate, -0.2, 0.2)
        for _ in range(4):
            rate = rate + 0.25 * 0.005 * (inertia @ (effort - angle))
            angle = angle + 0.25 * 0.005 * rate
    attitudes = tracks["toy/pose"]["pose"]["orientation"]
    np.testing.assert_allclose(np.linalg.norm(attitudes, axis=1), 1.0, rtol=1e-15)
    assert tracks["toy/seen"]["row"][-1].tolist() == [100.0] * 5


def test_records_know_their_kinds():
    class Declared(Parameters):
        a: Vec3 = field((1.0, 2.0, 3.0))
        b: Vec(7)
        c: Mat(2, 6)
        d: DualQuaternion
        e: DualVector
        f: Array(3)
        g: Quaternion
        h: float

    assert Declared.kinds.by_name == {"a": Vec3, "b": Vec(7), "c": Mat(2, 6), "d": DualQuaternion, "e": DualVector,
                                      "g": Quaternion}
    assert [Declared.dtype[name].shape for name in "abcdefgh"] == [(3,), (7,), (2, 6), (8,), (6,), (3,), (4,), ()]


def test_signals_know_their_kinds():
    kinds = kinds_of(value_toy.POSE)
    assert kinds.by_name["pose"].by_name == {"position": Vec3, "orientation": Quaternion}
    assert kinds_of(value_toy.SEEN).by_name == {"error": Vec3, "row": Vec(5)}


def test_fingerprint_sees_classes_and_the_library():
    def made(kind):
        def function(a):
            return kind(a)
        return function

    assert fingerprint(made(Vec(4))) != fingerprint(made(Vec(5)))
    assert fingerprint(kernel(made(Vec(4)))) == fingerprint(made(Vec(4)))
