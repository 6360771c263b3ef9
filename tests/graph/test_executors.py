"""The compiled loop against an executor written from the rules; plain Python against machine code; the cache; noise."""

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flight_graph.engines import cache, part_calls, parts
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario, load
from flight_math import noise
from flight_math.kernel import fingerprint
from tests.graph import toy
from tests.graph.reference_executor import ReferenceExecutor

pytestmark = pytest.mark.xdist_group("executors")
ROOT = Path(__file__).resolve().parents[2]


def logs(recording) -> dict:
    return {(track.node, track.port): [
        (int(t), row.tobytes()) for t, row in zip(track.stamps_ns, track.signal.payloads(track.records))]
        for track in recording.tracks}


RATES = [  # rates of plant, sensor, controller, watcher, and which edges are delayed
    ({}, {}),
    ({"plant": 100, "sensor": 100, "controller": 100, "watcher": 100}, {}),
    ({"plant": 50, "sensor": 200, "controller": 25, "watcher": 50}, {}),
    ({"plant": 100, "sensor": 40, "controller": 100, "watcher": 20}, {}),
    ({"plant": 500, "sensor": 125, "controller": 40, "watcher": 10}, {"controller.imu": {"from": "sensor.imu", "delay": 1}}),
    ({"plant": 200, "sensor": 200, "controller": 100, "watcher": 50}, {
        "plant.command": {"from": "controller.command", "delay": 1}, "sensor.truth": {"from": "plant.truth", "delay": 1}}),
    ({"plant": 80, "sensor": 100, "controller": 64, "watcher": 50}, {"watcher.command": "controller.command"}),
]


@pytest.mark.parametrize("rates, edges", RATES)
def test_multi_rate_and_delays_follow_the_rules(rates, edges):
    """Byte for byte, for every topic. The kernels' sines are those of libm in both."""
    data = toy.scenario(duration_s=1.0)
    for name, rate in rates.items():
        data["components"][name]["rate_hz"] = rate
    data["connect"].update(edges)
    scenario = Scenario(data, "toy.yaml")
    expected = ReferenceExecutor(scenario).run()
    found = logs(CompiledRun(scenario).run())
    assert found.keys() == expected.keys()
    for key in expected:
        assert [t for t, _ in found[key]] == [t for t, _ in expected[key]], key
        assert found[key] == expected[key], key


def test_thinned_recording_takes_every_nth_message():
    whole = CompiledRun(Scenario(toy.scenario(), "toy.yaml")).run()
    thinned = CompiledRun(Scenario(toy.scenario(record={"max_rate_hz": 60, "topics": ["toy/imu", "toy/watch"]}), "t")).run()
    assert {track.topic for track in thinned.tracks} == {"toy/imu", "toy/watch"}
    assert logs(thinned)["sensor", "imu"] == logs(whole)["sensor", "imu"][::4]  # 200 Hz: every 4th is the first below 60 Hz
    assert logs(thinned)["watcher", "seen"] == logs(whole)["watcher", "seen"]


@pytest.mark.parametrize("name", ["cubli_asteroid", "cubli_earth"])
def test_compiled_equals_plain_python_for_two_seconds(tmp_path, name):
    """The same schedule, compiled in this process and interpreted in another: equal bags, byte for byte."""
    code = """
import hashlib, json, sys
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import load
import numba
assert numba.config.DISABLE_JIT
run = CompiledRun(load(sys.argv[1], {"duration_s": 2.0})).run()
print(json.dumps({t.topic: [len(t.records), hashlib.sha256(t.signal.payloads(t.records).tobytes()).hexdigest()] for t in run.tracks}))
"""
    done = subprocess.run([sys.executable, "-c", code, name], cwd=ROOT, capture_output=True, text=True, timeout=200,
                          env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stderr
    recording = CompiledRun(load(name, {"duration_s": 2.0})).run()
    assert json.loads(done.stdout) == {
        track.topic: [len(track.records), hashlib.sha256(track.signal.payloads(track.records).tobytes()).hexdigest()]
        for track in recording.tracks}


@pytest.mark.parametrize("before, after", [
    ("class Pair(NamedTuple):\n    a: float\n    b: float\n", "class Pair(NamedTuple):\n    b: float\n    a: float\n"),
    ("GAIN = 1.0\n", "GAIN = 2.0\n"),
    ("TABLE = (first, second)\n", "TABLE = (second, first)\n"),
], ids=["fields of a named tuple", "default of an argument", "tuple of kernels"])
def test_fingerprint_sees_what_a_kernel_is_made_of(tmp_path, before, after):
    """Other fields, defaults or kernels behind the same source are another kernel; the same ones are the same kernel."""
    text = """from typing import NamedTuple
from flight_math.kernel import kernel
@kernel
def first(a):
    return a
@kernel
def second(a):
    return 2.0 * a
Pair, GAIN, TABLE = None, 0.0, ()
%s
@kernel
def law(a, gain=GAIN):
    return Pair(a, gain).a + TABLE[0](a)
"""
    found = []
    for number, middle in enumerate((before, before, after)):
        path = tmp_path / f"law_{number}.py"
        path.write_text(text % middle)
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        found.append(fingerprint(module.law))
    assert found[0] == found[1] != found[2]


def test_machine_code_is_found_again_and_follows_its_sources(tmp_path):
    """A fresh cache: compiled once, found by a second process; a changed kernel or constant of another module is noticed."""
    (tmp_path / "physics.py").write_text("from flight_math.kernel import kernel\nGAIN = 2.0\n\n\n@kernel\ndef law(x):\n"
                                         "    return GAIN * x\n")
    (tmp_path / "part.py").write_text(PART)
    code = """
import sys
from flight_graph.engines import parts
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
run = CompiledRun(Scenario({"name": "n", "title": "t", "duration_s": 0.02, "components": {
    "part": {"use": "part:Part"}}}, "n.yaml"))
warm = run.is_compiled()
print(warm, parts.key(run.components["part:Part"], "kernel"), run.run()["part/out"]["value"].tolist())
"""
    def start():
        done = subprocess.run([sys.executable, "-B", "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=120, env={
            **os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "FLIGHT_CACHE_DIR": str(tmp_path / "cache")})
        assert done.returncode == 0, done.stderr
        return done.stdout.split(maxsplit=2)

    first = start()
    assert first[0] == "False" and first[2].strip() == "[2.0, 2.0]"
    again = start()
    assert again[0] == "True" and again[1:] == first[1:]
    physics = (tmp_path / "physics.py").read_text()
    (tmp_path / "physics.py").write_text(physics.replace("GAIN = 2.0", "GAIN = 3.0"))
    constant = start()
    assert constant[0] == "False" and constant[1] != first[1] and constant[2].strip() == "[3.0, 3.0]"
    (tmp_path / "physics.py").write_text(physics.replace("GAIN * x", "GAIN * x + 1.0"))
    kernel = start()
    assert kernel[0] == "False" and kernel[1] not in (first[1], constant[1]) and kernel[2].strip() == "[3.0, 3.0]"
    (tmp_path / "physics.py").write_text(physics)
    assert start() == again


PART = '''
import physics
from flight_graph.components.component import Component
from flight_math.kernel import kernel
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector


@kernel
def fire(t_ns, p, x, out):
    out.value = physics.law(1.0)


class Part(Component):
    """One number."""

    outputs = {"out": named_vector("part/out", "part", {"value": Quantity(None, "1")}, Role.TELEMETRY)}
    kernel = fire
'''


def test_rates_and_parameters_share_machine_code():
    fast = toy.scenario()
    fast["components"]["controller"].update(rate_hz=50, parameters={"kp": 0.1})
    one, other = (CompiledRun(Scenario(data, "toy.yaml")) for data in (toy.scenario(), fast))
    for use, component in one.components.items():
        assert [parts.key(component, part) for part in part_calls.parts(component)] == [
            parts.key(other.components[use], part) for part in part_calls.parts(component)]


def test_fingerprint_sees_what_a_kernel_calls():
    assert fingerprint(toy.sense) != fingerprint(toy.control)
    assert fingerprint(toy.sense) == fingerprint(toy.sense)


def test_noise_of_a_component_does_not_depend_on_the_others():
    """Removing the watcher, renaming it, or changing another's rate leaves the sensor's draws; seed and name change them."""
    def draws(change=lambda data: None, name="sensor"):
        data = toy.scenario(duration_s=0.5)
        change(data)
        recording = CompiledRun(Scenario(data, "toy.yaml")).run()
        truth, sensed = recording["toy/truth"], recording["toy/imu"]
        return sensed["angular_velocity"] - truth["rate"]

    def without_watcher(data):
        del data["components"]["watcher"], data["connect"]["watcher.command"]

    def renamed(data):
        data["components"]["gyro"] = data["components"].pop("sensor")
    plain_run = draws()
    np.testing.assert_allclose(draws(without_watcher), plain_run, rtol=0, atol=1e-15)
    assert np.abs(draws(renamed) - plain_run).max() > 1e-4
    assert np.abs(draws(lambda data: data.update(seed=8)) - plain_run).max() > 1e-4
    assert 0.8e-3 < plain_run.std() < 1.2e-3 and abs(plain_run.mean()) < 3e-3 / np.sqrt(plain_run.size)


def test_a_draw_is_a_function_of_key_tick_and_index_alone():
    values = {(key, tick, index): noise.gaussian(key, tick, index)
              for key in (1, 2) for tick in (0, 5_000_000) for index in (0, 1)}
    assert all(noise.gaussian(*where) == values[where] for where in reversed(values))
    assert len(set(values.values())) == 8


def test_a_nonfinite_output_stops_the_run():
    data = toy.scenario()
    data["components"]["plant"]["parameters"] = {"inertia": 1e-300, "stiffness": 1e300}
    with pytest.raises(ValueError, match=r"plant stopped at t = [\d.]+ s: its output truth\.\w+(\[\d\])? is (nan|inf|-inf); only "
                       "finite numbers are published"):
        CompiledRun(Scenario(data, "toy.yaml")).run()


def test_cache_folder_is_settable(tmp_path, monkeypatch):
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(tmp_path / "here"))
    assert cache.cache_folder() == tmp_path / "here" and (tmp_path / "here").is_dir()
