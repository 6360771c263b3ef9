"""Machine code of parts: bounds, errors that are raised, what may not be called, the cache, compiling here and elsewhere."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from flight_graph.engines import cache, compilation, part_calls, parts
from flight_graph.engines.compiled import CompiledRun
from flight_graph.errors import FlightError, RunStopped
from flight_graph.graphs.scenario import Scenario
from tests.graph import toy

pytestmark = pytest.mark.xdist_group("executors")
ROOT = Path(__file__).resolve().parents[2]
HEAD = '''
from flight_graph.components.component import Component
from flight_graph.components.records import Array, Parameters, State, field
from flight_math import Vec3, kernel, stack_array
from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, named_vector

OUT = named_vector("part/out", "part", {"value": Quantity(None, "1"), "three": Quantity(3, "1")}, Role.TELEMETRY)


class PartParameters(Parameters):
    last: int = field(2)


class PartState(State):
    count: int
    table: Array(3, 3)


class Part(Component):
    """One number."""

    parameters, state, outputs = PartParameters, PartState, {"out": OUT}
    faults = {7: "the count is {count}"}
    kernel = %s
'''


def component(tmp_path, name: str, kernel: str, decorator="@kernel"):
    """A scenario of one component whose kernel has this body."""
    path = tmp_path / f"{name}.py"
    head, tail = HEAD.split("class PartParameters")
    path.write_text(f"{head}\n\n{decorator}\ndef fire(t_ns, p, x, out):\n{kernel}\n\n\nclass PartParameters{tail % 'fire'}")
    return {"name": "n", "title": "t", "duration_s": 0.05, "components": {"part": {"use": f"{path}:Part"}}}


COUNTING = """    for i in range(p.last + 1):
        x.table[0, i] = 1.0
    x.count += 1
    out.value = x.count
"""


def test_an_index_beyond_the_end_stops_a_run_that_checks(tmp_path):
    data = component(tmp_path, "beyond", COUNTING)
    assert CompiledRun(Scenario(data, "n.yaml"), check_bounds=True).run()["part/out"]["value"].tolist() == [1, 2, 3, 4, 5]
    data["components"]["part"]["parameters"] = {"last": 3}
    with pytest.raises(RunStopped, match=r"part stopped at t = 0 s: its kernel raised IndexError: index is out of bounds "
                       r"\(.*beyond.py, line 1[0-9]\)") as stop:
        CompiledRun(Scenario(data, "n.yaml"), check_bounds=True).run()
    line = int(str(stop.value).rpartition("line ")[2].rstrip(")"))
    assert "x.table[0, i] = 1.0" in (tmp_path / "beyond.py").read_text().splitlines()[line - 1]
    assert stop.value.reason == "fault" and stop.value.t_ns == 0


def test_checked_code_has_a_key_of_its_own(tmp_path):
    used = CompiledRun(Scenario(component(tmp_path, "keys", COUNTING), "n.yaml")).components
    for one in used.values():
        assert parts.key(one, "kernel") != parts.key(one, "kernel", check_bounds=True)


def test_what_the_compiled_code_raises_stops_the_run(tmp_path):
    body = "    for i in range(0, 3, 2 - x.count):\n        x.table[0, 0] += i\n    x.count += 1\n    out.value = x.count\n"
    with pytest.raises(RunStopped, match=r"part stopped at t = 0.02 s: its kernel raised ValueError: range\(\) arg 3 must "
                       "not be zero") as stop:
        CompiledRun(Scenario(component(tmp_path, "raises", body), "n.yaml")).run()
    assert stop.value.recording["part/out"]["value"].tolist() == [1.0, 2.0]
    assert stop.value.recording.stopped == str(stop.value)


def test_a_fault_leaves_what_was_recorded(tmp_path):
    body = "    x.count += 1\n    out.value = x.count\n    if x.count == 4:\n        x.fault = 7\n"
    with pytest.raises(RunStopped, match="part stopped at t = 0.03 s: the count is 4") as stop:
        CompiledRun(Scenario(component(tmp_path, "faults", body), "n.yaml")).run()
    track = stop.value.recording.tracks[0]
    assert track.records["value"].tolist() == [1, 2, 3] and track.stamps_ns.tolist() == [0, 10_000_000, 20_000_000]


def test_allocation_is_refused(tmp_path):
    body = "    a = np.zeros(3)\n    a[p.last] = 1.0\n    out.value = a[x.count]\n"
    data = component(tmp_path, "allocates", body, "import numpy as np\n\n\n@kernel")
    with pytest.raises(FlightError, match="memory|np.zeros") as refused:
        CompiledRun(Scenario(data, "n.yaml")).compile()
    assert len(str(refused.value).splitlines()) == 1


def test_views_of_arrays_need_no_reference_counts(tmp_path):
    body = "    row = x.table[1]\n    row[2] = 5.0\n    rest = row[1:]\n    out.value = rest[1]\n"
    assert CompiledRun(Scenario(component(tmp_path, "slices", body), "n.yaml")).run()["part/out"]["value"][0] == 5.0


def test_nothing_is_typed_when_the_code_is_there(tmp_path):
    """A second process runs from the cache with numba's compiler taken away."""
    code = """
import sys
from numba.core import compiler
def never(*arguments, **options):
    raise AssertionError("numba compiles")
compiler.compile_extra = compiler.compile_ir = never
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from tests.graph import toy
print(len(CompiledRun(Scenario(toy.scenario(), "toy.yaml")).run().tracks))
"""
    CompiledRun(Scenario(toy.scenario(), "toy.yaml")).compile()
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120,
                          env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert done.stdout.strip() == "4", done.stderr


def new(tmp_path):
    """A line that makes a kernel one that no cache knows: the same source has the same key wherever it stands."""
    return f"    # {tmp_path} {time.time_ns()}\n"


def test_spoiled_code_is_not_loaded_but_made_anew(tmp_path):
    data = component(tmp_path, "spoiled", COUNTING + new(tmp_path))
    used = CompiledRun(Scenario(data, "n.yaml")).components
    compilation.compile_missing(used)
    path = cache.cache_folder("objects") / f"{parts.key(*used.values(), 'kernel')}.o"
    whole = path.read_bytes()
    path.write_bytes(whole[:-20] + bytes(20))
    assert parts.load(*used.values()) is None
    assert CompiledRun(Scenario(data, "n.yaml")).run()["part/out"]["value"][-1] == 5.0
    assert len(path.read_bytes()) == len(whole) and parts.load(*used.values())


def test_a_spoiled_driver_is_made_anew(tmp_path, monkeypatch):
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(tmp_path / "cache"))  # the driver of the others stays as it is
    data = component(tmp_path, "driven", COUNTING)
    CompiledRun(Scenario(data, "n.yaml")).compile()
    code = f"""
from flight_graph.engines import cache, driver
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
path = cache.cache_folder("objects") / f"{{driver.CODE.key}}_run.o"
path.write_bytes(path.read_bytes()[:-20] + bytes(20))
print(CompiledRun(Scenario({data!r}, "n.yaml")).run()["part/out"]["value"][-1])
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120,
                          env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}"})
    assert done.stdout.strip() == "5.0", done.stderr


def test_a_cache_that_cannot_be_written_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(tmp_path))
    (cache.cache_folder("objects") / "key.o").mkdir()
    with pytest.raises(FlightError, match="key.o' cannot be written: .*FLIGHT_CACHE_DIR"):
        cache.write("key", b"code", {})


def test_compiling_here_gives_the_same_code_and_leaves_kernels_callable(tmp_path, monkeypatch):
    """Bytes equal to those of another process; afterwards a kernel is called from Python again."""
    used = CompiledRun(Scenario(component(tmp_path, "here", COUNTING + new(tmp_path)), "n.yaml")).components
    (one,) = used.values()
    compilation.compile_missing(used)
    elsewhere = cache.read(parts.key(one, "kernel"))
    cache.remove(parts.key(one, "kernel"))
    monkeypatch.setenv(compilation.HERE, "1")
    compilation.compile_missing(used)
    assert cache.read(parts.key(one, "kernel"))[0] == elsewhere[0]
    x, out = one.state.record(), one.outputs["out"].new()[1]
    one.kernel(0, one.parameters.record()[0], x[0], out[0])
    assert x["count"][0] == 1 and out["value"][0] == 1.0


def test_a_progress_names_what_is_compiled(tmp_path):
    used = CompiledRun(Scenario(component(tmp_path, "progress", COUNTING + new(tmp_path)), "n.yaml")).components
    told = []
    assert compilation.compile_missing(used, progress=lambda *what: told.append(what)) == 1
    assert told[0] == (0, 1, next(iter(used))) and told[-1] == (1, 1, "")
    assert compilation.compile_missing(used, progress=lambda *what: told.append(what)) == 0


def test_the_users_own_file_comes_first(tmp_path):
    used = CompiledRun(Scenario(component(tmp_path, "first", COUNTING + "    out.three = Vec3(0.0, 0.0, 1.0)\n"), "n.yaml")).components
    use, one = next(iter(used.items()))
    cub = "cubli_ros/appc_controller"
    from flight_graph.components import registry
    missing = {cub: registry.component(cub), use: one}
    assert [task.name for task in compilation._tasks(missing, check_bounds=True)][0] == use


# -- the folder ----------------------------------------------------------------------------------------------------------
def test_the_cache_folder_is_no_link(tmp_path, monkeypatch):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(tmp_path / "link"))
    with pytest.raises(FlightError, match="link' is a link, and machine code from it is run; name the real folder"):
        cache.cache_folder()


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no users here")
def test_the_cache_folder_is_the_users_own(tmp_path, monkeypatch):
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    with pytest.raises(FlightError, match="belongs to another user"):
        cache.cache_folder()


def test_a_folder_that_cannot_be_made(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(tmp_path / "file" / "below"))
    with pytest.raises(FlightError, match="cannot be made .*FLIGHT_CACHE_DIR"):
        cache.cache_folder()


def test_code_is_written_in_one_step(tmp_path, monkeypatch):
    monkeypatch.setenv("FLIGHT_CACHE_DIR", str(tmp_path))
    cache.write("key", b"code\nwith lines\0", {"symbol": "f", "errors": {}})
    assert cache.read("key")[0] == b"code\nwith lines\0" and cache.read("key")[1]["symbol"] == "f"
    assert [path.name for path in (tmp_path / "objects").iterdir()] == ["key.o"]
    assert json.loads((tmp_path / "objects/key.o").read_bytes().partition(b"\n")[0])["sha256"]
    assert cache.read("other") is None


def test_every_part_of_a_component_is_known():
    assert part_calls.parts(toy.Plant) == ["start", "output", "update"]
    assert [dtype for dtype, _ in part_calls.records(toy.Plant, "update")] == [
        toy.Plant.parameters.dtype, toy.Plant.state.dtype, toy.COMMAND.dtype]
    assert isinstance(part_calls.records(toy.Plant, "start")[0][0], np.dtype)
