"""Runs on a graphics processor: the same bytes in numba's simulator; PTX in which nothing is contracted; what is said
where there is none."""

import os
import re
import shutil
import subprocess
import sys

import pytest

from flight_graph.campaigns.folder import Campaign
from flight_graph.cuda import devices, modules
from flight_graph.engines.compiled import CompiledRun
from flight_graph.engines.part_calls import compiled_arguments, parts
from flight_graph.errors import FlightError
from tests.commands import runner
from tests.cuda import device_runs
from tests.sweep.sweep_scenarios import campaign_file

pytestmark = pytest.mark.xdist_group("device")
SIMULATED = {**os.environ, devices.SIMULATED: "1"}


def ends(*words) -> int:
    """How many ticks there are at which runs stopped in a process that compares them."""
    done = subprocess.run([sys.executable, "-m", "tests.cuda.device_runs", *map(str, words)], env=SIMULATED,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return int(re.search(r"runs stopped at (\d+) ticks\n", done.stdout)[1])


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    measures = {"high": {"largest": "plant.truth.angle", "of": "norm"}, "last": {"final": "plant.truth.angle[0]"}}
    return campaign_file(tmp_path_factory.mktemp("scenario") / "toy.yaml", measures=measures, metrics=None,
                         faults=device_runs.FAULTS)


def test_runs_and_campaigns_have_the_bytes_of_those_here(file, tmp_path, monkeypatch, capsys):
    """More runs than a block has threads; with faults, restarts, early ends; a campaign by its command; in numba's
    simulator.
    """
    assert ends("by_simulator", file, tmp_path / "there") > 3
    command = runner(monkeypatch, capsys)
    assert command("sweep", file, "--trust", "--workers", 1, "--out", tmp_path / "here")[0] == 0
    digests = [[one.read_part(number).digest for number in one.manifest.chunks]
               for one in map(Campaign.at, (tmp_path / "there", tmp_path / "here"))]
    assert digests[0] == digests[1] and len(digests[0]) > 1


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here")
def test_the_ptx_has_the_bytes_of_runs_alone():
    """What the PTX says, instruction by instruction done by this processor, through all calls of a driver of CUDA."""
    assert ends("by_ptx") > 3


@pytest.fixture(scope="module")
def ptx():
    """Of the toy with faults."""
    run = CompiledRun(device_runs.case(0))
    flight = run.start(1)
    return modules.load({name: (node.use, node.component) for name, node in run.graph.nodes.items()}, flight.codes).ptx


def test_nothing_is_contracted(ptx):
    """Products, sums, quotients and roots are rounded to nearest one by one, and say so: what does not may be fused later."""
    operations = re.findall(r"\b(add|sub|mul|div|sqrt|fma|mad|rcp|rsqrt|sin|cos|ex2|lg2)\.([a-z0-9.]*)\b(f64|f32)\b", ptx)
    assert {name for name, _, _ in operations} == {"add", "sub", "mul", "div", "sqrt"}
    assert {rounding for _, rounding, _ in operations} == {"rn."} and len(operations) > 500
    assert not re.search(r"\.ftz|\.approx|\.sat\b", ptx)
    assert "call" in ptx and not re.search(r"^\s*\.extern|__nv_|vprintf", ptx, re.M)


def test_a_thread_is_a_run(ptx):
    """The number of a run is block times threads of a block plus thread; the entry takes four whole numbers."""
    entry = ptx[ptx.index(".visible .entry flight("):]
    assert ptx.count(".entry") == 1 and entry.count(".param .u64") == 4
    assert [name in entry for name in ("%ctaid.x", "%ntid.x", "%tid.x")] == [True] * 3


def test_numbers_are_read_at_once():
    """Records on a device are known to lie at multiples of eight bytes: no number is read byte by byte."""
    from tests.graph import toy
    for component in (toy.Plant, toy.Sensor, toy.Controller, toy.Watcher):
        for part in parts(component):
            views = [kind for kind in compiled_arguments(component, part, aligned=True) if hasattr(kind, "record")]
            assert all(view.record.aligned for view in views) and views


def test_where_there_is_no_device(file, tmp_path, monkeypatch, capsys):
    try:
        devices.Graphics()
        pytest.skip("there is a device")
    except FlightError:
        pass
    command = runner(monkeypatch, capsys)
    status, out, err = command("sweep", file, "--trust", "--on", "cuda", "--out", tmp_path / "there")
    assert status == 2 and out == "" and not (tmp_path / "there").exists()
    assert "--on cuda: " in err and ("pip install 'cuda-bindings" in err or "no graphics processor" in err)
    status, _, err = command("sweep", file, "--trust", "--on", "cuda", "--workers", 2)
    assert status == 2 and "--workers and --on: allowed: one of them" in err
    status, _, err = command("sweep", file, "--trust", "--chunk", "0", "--workers", 2)
    assert status == 2 and "--chunk: chunks run in this process" in err
    status, _, err = command("sweep", file, "--trust", "--on", "gpu")
    assert status == 2 and "allowed: cuda, or dask:ADDRESS" in err


def test_on_a_real_device():
    try:
        device = devices.Graphics()
    except FlightError as error:
        pytest.skip(str(error))
    assert device_runs.compare(device) > 0
