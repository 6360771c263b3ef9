"""A graphics processor: memory there, and a launch of so many threads. `flight_graph.cuda.simulator` stands in for one."""

import ctypes
import os
from typing import Protocol

import numpy as np

from flight_graph.cuda.modules import ENTRY, THREADS, DeviceCode
from flight_graph.errors import FlightError
from flight_graph.extras import install

SIMULATED = "NUMBA_ENABLE_CUDASIM"


class Device(Protocol):
    """What a batch asks of a device. free_bytes: memory that it has to give."""

    free_bytes: int

    def put(self, block: np.ndarray):
        """Memory of so many bytes there, which `fill` fills."""

    def address(self, memory) -> int:
        """Where memory lies, as code there sees it."""

    def fill(self, memory, block: np.ndarray) -> None:
        """Copy a block there."""

    def fly(self, code: DeviceCode, controls: int, stride: int, count: int, end: int) -> None:
        """Bring ``count`` runs until before the tick ``end``, one a thread, and wait for all."""

    def take(self, memory, block: np.ndarray) -> None:
        """Copy memory there into a block."""

    def free(self, memory) -> None:
        """Give memory back."""


def is_simulated() -> bool:
    """Whether numba's simulator stands in for a device (NUMBA_ENABLE_CUDASIM=1)."""
    return os.environ.get(SIMULATED, "") not in ("", "0")


def opened() -> Device:
    """The device of this machine. Raises FlightError where there is none."""
    if is_simulated():
        from flight_graph.cuda.simulator import Simulator
        return Simulator()
    return Graphics()


class Graphics:
    """A processor of CUDA, by its driver: the extra [cuda]. Raises FlightError where something is missing."""

    def __init__(self):
        try:
            from cuda.bindings import driver
        except ImportError:
            raise FlightError("--on cuda: what speaks to a graphics processor is not installed here; "
                              f"{install('cuda')} brings it ({SIMULATED}=1 stands in for one, slowly)") from None
        self._driver, self._functions = driver, {}
        try:
            self._asked(driver.cuInit(0))
            number, = self._asked(driver.cuDeviceGet(0))
            self._context, = self._asked(driver.cuDevicePrimaryCtxRetain(number))
            self.free_bytes = self._current(driver.cuMemGetInfo)[0]
        except Exception as error:  # without a driver's library the bindings raise what they like
            what = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise FlightError(f"--on cuda: no graphics processor of CUDA answers here ({what}); leave --on out, or set "
                              f"{SIMULATED}=1 for a simulated one") from None

    def _asked(self, answer):
        """The values of a call of the driver. Raises FlightError."""
        error, *values = answer
        if int(error):
            raise FlightError(f"the graphics processor answers {getattr(error, 'name', error)}")
        return values

    def _current(self, call, *given):
        """Call the driver, in whatever thread this is. Raises FlightError."""
        self._asked(self._driver.cuCtxSetCurrent(self._context))
        return self._asked(call(*given))

    def put(self, block):
        """See `Device`."""
        return self._current(self._driver.cuMemAlloc, max(block.nbytes, 1))[0]

    def address(self, memory):
        """See `Device`."""
        return int(memory)

    def fill(self, memory, block):
        """See `Device`."""
        if block.nbytes:
            self._current(self._driver.cuMemcpyHtoD, memory, block.ctypes.data, block.nbytes)

    def fly(self, code, controls, stride, count, end):
        """See `Device`."""
        if code.ptx not in self._functions:
            text = ctypes.create_string_buffer(code.ptx.encode())
            module, = self._current(self._driver.cuModuleLoadData, ctypes.addressof(text))
            self._functions[code.ptx] = self._current(self._driver.cuModuleGetFunction, module, ENTRY.encode())[0]
        given = (controls, stride, count, end), (ctypes.c_int64,) * 4
        blocks = -(-count // THREADS)
        self._current(self._driver.cuLaunchKernel, self._functions[code.ptx], blocks, 1, 1, THREADS, 1, 1, 0, 0, given, 0)
        self._current(self._driver.cuCtxSynchronize)

    def take(self, memory, block):
        """See `Device`."""
        if block.nbytes:
            self._current(self._driver.cuMemcpyDtoH, block.ctypes.data, memory, block.nbytes)

    def free(self, memory):
        """See `Device`."""
        self._current(self._driver.cuMemFree, memory)
