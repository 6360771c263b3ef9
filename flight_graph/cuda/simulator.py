"""Numba's simulator of a graphics processor: threads of Python with the indices of a launch, over memory of this machine.

Each thread runs the twin of the device's code: the same intermediate code, compiled for this processor.
"""

from numba import cuda

from flight_graph.cuda.modules import THREADS


def thread(twin, controls, stride, count, end):
    """What a launch runs once for each thread."""
    twin(cuda.grid(1), controls, stride, count, end)


class Simulator:
    """See `flight_graph.cuda.devices.Device`."""

    free_bytes = 1 << 30

    def put(self, block):
        """See `Device`."""
        return cuda.to_device(block)

    def address(self, memory):
        """See `Device`."""
        return memory.ctypes.data

    def fill(self, memory, block):
        """See `Device`."""
        memory.copy_to_device(block)

    def fly(self, code, controls, stride, count, end):
        """See `Device`."""
        cuda.jit(thread)[-(-count // THREADS), THREADS](code.twin, controls, stride, count, end)

    def take(self, memory, block):
        """See `Device`."""
        memory.copy_to_host(block)

    def free(self, memory):
        """See `Device`."""
