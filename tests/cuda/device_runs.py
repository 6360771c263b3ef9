"""Runs of the toy on a device, in a process of its own: numba's simulator is chosen before numba is imported.

    NUMBA_ENABLE_CUDASIM=1 python -m tests.cuda.device_runs by_simulator SCENARIO FOLDER
    python -m tests.cuda.device_runs by_ptx
"""

import ctypes
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from flight_graph.cli import main
from flight_graph.cuda import devices
from flight_graph.cuda.batch import OnDevice
from flight_graph.cuda.packed import Packed
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from tests.cuda import ptx_in_c
from tests.graph import toy
from tests.lanes.test_lanes import FAULTS as COMMON
from tests.lanes.test_lanes import assert_same

RUNS, TICKS = 70, 60  # more than the threads of a block
FAULTS = [*COMMON, {"id": "grows", "at": "sensor.imu.linear_acceleration", "type": "drift", "value": 2.0}]
EVENTS = [{"at_s": 0.07, "set": {"controller.kp": 0.9, "plant.inertia": 3.0}}, {"at_s": 0.2, "set": {"controller.kp": 0.1}}]
MONITORS = {"rate_hz": 100, "watchpoints": [{"id": "fast", "when": "sensor.imu.angular_velocity[0] > 0.02"}],
            "actionpoints": [{"id": "note", "when": "fast", "in_a_row": 2, "level": "warn", "text": "fast"}]}
MEASURES = {"high": {"largest": "plant.truth.angle", "of": "norm"}, "settled": {"settling": "plant.truth.rate", "within": 0.2},
            "worn": {"integral": "controller.command.effort", "of": "squared"}, "crossed": {
                "first": "plant.truth.angle", "below": 0.0}}


def case(number):
    """Angles, noise and laws differ; some leave the limit of the controller, at times of their own."""
    data = toy.scenario(duration_s=0.3, seed=3 + number, measures=MEASURES, faults=FAULTS, events=EVENTS,
                        monitors=MONITORS)
    data["components"]["plant"]["parameters"] = {"angle": [0.009 * number, 0.2, -0.3 + 0.01 * number]}
    data["components"]["controller"]["parameters"] = {"law": ["pd", "p"][number % 2], "angle_limit": [0.6 + 0.005 * number, 100.0][number % 2]}
    return Scenario(data, "toy.yaml")


def assert_moved_whole():
    """Every address in a row is one of the row or of its logs, wherever they lie: none of this process is left."""
    flight = CompiledRun(case(9), reducing=True).start(TICKS)
    codes = [code.address for parts in flight.codes.values() for code in parts.values()]
    packed = Packed(flight, {address: number for number, address in enumerate(codes, 1)})
    row, logs, rows = np.zeros(packed.size, np.uint8), np.zeros(packed.log_size, np.uint8), []
    for place in (0x1111 << 32, 0x2222 << 32):
        packed.write(row, logs, place, place + (1 << 28))
        rows.append(row.view("<i8").copy())
    moved = rows[1] - rows[0]
    assert set(moved.tolist()) == {0, 0x1111 << 32} and (moved != 0).sum() > 50
    places = rows[0][moved != 0] - (0x1111 << 32)
    assert ((0 <= places) & (places <= packed.size) | (1 << 28 <= places) & (places <= (1 << 28) + packed.log_size)).all()
    here = [flight.arrays[name].ctypes.data for name in flight.arrays]
    assert not np.isin(rows[0], [*here, *codes]).any()


def flown(scenarios, device=None):
    """Flights that went to an end: alone, or on a device in two steps."""
    flights = [CompiledRun(scenario, reducing=True).start(TICKS) for scenario in scenarios]
    if device is None:
        for flight in flights:
            flight.advance(TICKS)
    else:
        batch = OnDevice(device)
        batch.advance(flights, 17)
        batch.advance(flights, TICKS)
    return flights


def compare(device) -> int:
    """Compare all memory, logs, stops and measures with those of runs alone; how many ticks ended some."""
    scenarios = [case(number) for number in range(RUNS)]
    alone, there = flown(scenarios), flown(scenarios, device)
    assert_same(there, alone)
    assert [str(flight.reduced()) for flight in there] == [str(flight.reduced()) for flight in alone]
    acts = [flight.logged()["monitors"]["note"][-1] for flight in there]
    assert min(acts) < max(acts)
    return len({flight.stop.t_ns for flight in there if flight.stop})


class FakeDriver:
    """The calls of a driver of CUDA that are made, over memory of this machine: a launch does what the PTX says, thread by
    thread (`tests.cuda.ptx_in_c`).
    """

    def __init__(self, folder):
        self.blocks, self.calls, self._folder = {}, [], folder

    def __getattr__(self, name):
        def called(*given):
            self.calls.append(name)
            return 0, *self._answer(name, *given)
        return called

    def _answer(self, name, *given):
        if name == "cuMemAlloc":
            block = ctypes.create_string_buffer(given[0] + 64)
            place = -(-ctypes.addressof(block) // 64) * 64
            self.blocks[place] = block
            return (place,)
        if name == "cuMemFree":
            del self.blocks[given[0]]
        if name in ("cuMemcpyHtoD", "cuMemcpyDtoH"):
            ctypes.memmove(*given)
        if name == "cuModuleLoadData":
            return (ptx_in_c.compiled(ctypes.string_at(given[0]).decode(), self._folder),)
        if name == "cuModuleGetFunction":
            return (given[0],) if given[1] == b"flight" else ()
        if name == "cuLaunchKernel":
            function, blocks, _, _, threads, _, _, shared, stream, (values, kinds), extra = given
            assert (shared, stream, extra) == (0, 0, 0) and kinds == (ctypes.c_int64,) * 4
            function(blocks, threads, *values)
        return {"cuMemGetInfo": (1 << 30, 1 << 31), "cuDeviceGet": (0,), "cuDevicePrimaryCtxRetain": ("context",)}.get(name, ())


def of_fake_driver(folder):
    """A device whose driver is none."""
    fake = FakeDriver(folder)
    sys.modules["cuda"] = SimpleNamespace(bindings=SimpleNamespace(driver=fake))
    sys.modules["cuda.bindings"] = SimpleNamespace(driver=fake)
    return devices.Graphics(), fake


def by_simulator(scenario, folder) -> int:
    """Numba's simulator, which runs the twin of the device's code; and a campaign there, by its command."""
    assert devices.is_simulated()
    assert_moved_whole()
    ends = compare(devices.opened())
    sys.argv = ["flight", "sweep", scenario, "--trust", "--on", "cuda", "--out", folder]
    try:
        status = main()
    except SystemExit as end:
        status = end.code
    assert not status
    return ends


def by_ptx() -> int:
    """The PTX, done by this processor."""
    with tempfile.TemporaryDirectory() as folder:
        device, fake = of_fake_driver(Path(folder))
        ends = compare(device)
    assert not fake.blocks and fake.calls[-1] == "cuMemFree"
    return ends


if __name__ == "__main__":
    print(f"runs stopped at {globals()[sys.argv[1]](*sys.argv[2:])} ticks")
