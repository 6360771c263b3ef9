"""Runs of the toy on a device, in a process of its own: numba's simulator is chosen before numba is imported.

    NUMBA_ENABLE_CUDASIM=1 python -m tests.cuda.device_runs
"""

import ctypes
import sys
from types import SimpleNamespace

from flight_graph.cuda import devices, modules
from flight_graph.cuda.batch import OnDevice
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs.scenario import Scenario
from tests.graph import toy
from tests.lanes.test_lanes import FAULTS, assert_same

RUNS, TICKS = 70, 60  # more than the threads of a block
MEASURES = {"high": {"largest": "plant.truth.angle", "of": "norm"}, "settled": {"settling": "plant.truth.rate", "within": 0.2},
            "worn": {"integral": "controller.command.effort", "of": "squared"}, "crossed": {
                "first": "plant.truth.angle", "below": 0.0}}


def case(number, faults):
    """Angles, noise and laws differ; some leave the limit of the controller, at times of their own."""
    data = toy.scenario(duration_s=0.3, seed=3 + number, measures=MEASURES)
    data["components"]["plant"]["parameters"] = {"angle": [0.01 * number, 0.2, -0.3 + 0.01 * number]}
    data["components"]["controller"]["parameters"] = {"law": ["pd", "p"][number % 2], "angle_limit": [0.62, 100.0][number % 2]}
    return Scenario({**data, **({"faults": list(faults)} if faults else {})}, "toy.yaml")


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
    """Compare all memory, logs, stops and measures with those of runs alone; how many runs stopped early."""
    stopped = 0
    for faults in ((), FAULTS):
        scenarios = [case(number, faults) for number in range(0, RUNS, 1 if not faults else 9)]
        alone, there = flown(scenarios), flown(scenarios, device)
        assert_same(there, alone)
        assert [str(flight.reduced()) for flight in there] == [str(flight.reduced()) for flight in alone]
        stopped += sum(bool(flight.stop) for flight in there)
    return stopped


class FakeDriver:
    """The calls of a driver of CUDA that are made, over memory of this machine: a launch runs the twin, thread by thread."""

    def __init__(self):
        self.blocks, self.codes, self.calls = {}, {}, []

    def __getattr__(self, name):
        def called(*given):
            self.calls.append(name)
            return SimpleNamespace(name="CUDA_SUCCESS", __int__=None) if False else (0, *self._answer(name, *given))
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
            assert given[0].endswith(b"\0") and b".visible .entry flight(" in given[0]
        if name == "cuLaunchKernel":
            function, blocks, _, _, threads, _, _, shared, stream, (values, kinds), extra = given
            assert (function, shared, stream, extra) == ("flight", 0, 0, 0) and kinds == (ctypes.c_int64,) * 4
            for number in range(blocks * threads):
                self.twin(number, *values)
        return {"cuMemGetInfo": (1 << 30, 1 << 31), "cuModuleGetFunction": ("flight",), "cuDeviceGet": (0,),
                "cuModuleLoadData": ("module",), "cuDevicePrimaryCtxRetain": ("context",)}.get(name, ())


def of_fake_driver():
    """A device whose driver is none."""
    fake = FakeDriver()
    sys.modules["cuda"] = SimpleNamespace(bindings=SimpleNamespace(driver=fake))
    sys.modules["cuda.bindings"] = SimpleNamespace(driver=fake)
    device, load = devices.Graphics(), modules.load

    def loaded(*given):
        found = load(*given)
        fake.twin = found.twin
        return found
    modules.load = loaded
    return device, fake


if __name__ == "__main__":
    assert devices.is_simulated()
    stopped = compare(devices.opened())
    device, fake = of_fake_driver()
    assert compare(device) == stopped and not fake.blocks and fake.calls[-1] == "cuMemFree"
    print(f"{stopped} runs stopped early")
