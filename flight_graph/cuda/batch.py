"""Flights of one graph on a device, one thread each: how a campaign advances them with ``--on cuda``."""

from collections.abc import Callable
from weakref import WeakKeyDictionary

import numpy as np

from flight_graph.cuda import modules
from flight_graph.cuda.devices import Device
from flight_graph.cuda.packed import Packed
from flight_graph.engines.flight import Flight
from flight_graph.engines.memory import free_bytes
from flight_graph.engines.schedule import Schedule
from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import Scenario

WIDEST = 4096  # flights at a time
CHUNK = 2000  # [ticks] of a launch
_SHARE = 4  # part of the free memory that flights may take here: 1 / this
_OWN = 200_000  # [bytes] that a flight takes here besides its logs


class OnDevice:
    """Advances flights on a device, as many at a time as its memory holds; the bits of each are those of a run alone."""

    def __init__(self, device: Device):
        self.device, self._codes, self._packed = device, {}, WeakKeyDictionary()

    def advance(self, flights: list[Flight], ticks: int, watch: Callable | None = None) -> None:
        """Advance flights until before a tick, or until each stops. Raises FlightError.

        watch(): is called between launches; what it raises ends the work.
        """
        flying = [flight for flight in flights if not flight.stop and flight.tick < ticks]
        groups = {}
        for flight in flying:
            nodes = flight.schedule.graph.nodes
            groups.setdefault((flight.tick, *((name, node.use) for name, node in nodes.items())), []).append(flight)
        for alike in groups.values():
            code = self._code(alike[0])
            packed = [self._pack(flight, code) for flight in alike]
            stride, log_stride = max(one.size for one in packed), max(one.log_size for one in packed)
            most = int(self.device.free_bytes // 2 // (stride + log_stride))
            if most < 1:
                raise FlightError(f"--on cuda: a run needs {stride + log_stride} bytes of the device's memory, and half of "
                                  f"{self.device.free_bytes} is there; record less, or take measures in place of metrics")
            for first in range(0, len(packed), most):
                chosen = slice(first, first + most)
                self._fly(code, alike[chosen], packed[chosen], (stride, log_stride), ticks, watch)

    def _code(self, flight):
        nodes = flight.schedule.graph.nodes
        if flight.control is None or flight.bounds_checked:
            raise FlightError("--on cuda: plain Python and checked bounds run on this processor alone")
        key = tuple((name, node.use) for name, node in nodes.items())
        if key not in self._codes:
            components = {name: (node.use, node.component) for name, node in nodes.items()}
            self._codes[key] = modules.load(components, flight.codes)
        return self._codes[key]

    def _pack(self, flight, code):
        if flight not in self._packed:
            self._packed[flight] = Packed(flight, code.numbers)
        return self._packed[flight]

    def _fly(self, code, flights, packed, strides, ticks, watch):
        stride, log_stride = strides
        rows, logs = (np.zeros((len(packed), size), np.uint8) for size in strides)
        memory, log_memory = self.device.put(rows), self.device.put(logs)
        at, log_at = self.device.address(memory), self.device.address(log_memory)
        for number, (row, one) in enumerate(zip(rows, packed)):
            one.write(row[:one.size], logs[number], at + number * stride, log_at + number * log_stride)
        try:
            self.device.fill(memory, rows)
            self.device.fill(log_memory, logs)
            reached = flights[0].tick
            while reached < ticks:
                reached = min(ticks, reached + CHUNK)
                self.device.fly(code, at, stride, len(packed), reached)
                if watch:
                    watch()
            self.device.take(memory, rows)
            self.device.take(log_memory, logs)
        finally:
            for one in (memory, log_memory):
                self.device.free(one)
        for number, (flight, one) in enumerate(zip(flights, packed)):
            one.read(flight, rows[number][:one.size], logs[number], log_at + number * log_stride)


def width(scenario: Scenario) -> int:
    """How many flights of a scenario a batch takes at a time, by what they take here."""
    logs = 0
    if scenario.file.metrics:
        logs = Schedule.of(scenario.graph, scenario.recorded(), scenario.faults).log_bytes(scenario.ticks)
    return max(1, min(WIDEST, free_bytes() // _SHARE // (logs + _OWN)))
