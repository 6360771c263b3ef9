"""One component outside of a graph, fired from Python: what a node and a replay run. The parts are those of the engines."""

from types import SimpleNamespace

import numba
import numpy as np

from flight_graph.components.component import Component
from flight_graph.engines import compilation, driver, fault_schedule
from flight_graph.engines.addresses import address, same
from flight_graph.engines.checkpoint import is_kept
from flight_graph.engines.part_calls import fired, plain_arguments, ports
from flight_graph.engines.plain_driver import PlainTables
from flight_graph.engines.schedule import Firing, Publication, Schedule
from flight_graph.engines.stops import FAULT, Records, stop_sentence
from flight_graph.faults.fault_set import FaultSet
from flight_graph.timebase import SECOND, stamp_parts


class SingleComponent:
    """A component over records that somebody else fills and reads.

    parameters, state: (1,) records; inputs, outputs: port -> (1,) record. Their memory is used as it is and must stay.
    output_periods: port -> period [ns] at which it is published, and checked. epoch_ns: stamp of t = 0.
    faults: those of its graph; watched: (node, port) -> (1,) record of each signal that conditions of its faults read.
    """

    def __init__(self, name: str, use: str, component: type[Component], parameters: np.ndarray, state: np.ndarray,
                 inputs: dict, outputs: dict, output_periods: dict, epoch_ns: int, check_bounds: bool = False,
                 faults: FaultSet | None = None, watched: dict | None = None):
        self.name, self.component, self._epoch_ns = name, component, epoch_ns
        self._fresh = same(state)
        period_ns = round(float(parameters["period"][0]) * SECOND)
        self._faults = fault_schedule.of(faults, SimpleNamespace(name=name, component=component, period_ns=period_ns))
        self._numbers = {part: i for i, part in enumerate(fired(component))}
        schedule = Schedule(None, {}, firings=[self._firing(part, output_periods) for part in self._numbers])
        self._channels = {made.port: made.channel for firing in schedule.firings for made in firing.publications}
        self._arrays = self._memory(schedule, parameters, state, inputs, outputs, watched or {})
        self._records = Records(self._arrays[f"P_{name}"], state, dict(outputs))
        self._codes = None
        if numba.config.DISABLE_JIT:
            self._tables = PlainTables(schedule, self._arrays, {name: component}, epoch_ns)
        else:
            self._codes = compilation.load({use: component}, check_bounds)[use]
            self._tables = driver.Tables(schedule, self._arrays, {name: self._codes}, epoch_ns)
            self._fire, self._row = driver.CODE.function("fire"), address(self._tables.firings)
            self._slower = [(number, output_periods[port]) for number, port in enumerate(self._published())
                            if port in component.output_rate_hz]
            self._tables.outputs["period"] = 0  # due at every firing, but for the slower ones

    def _published(self):
        return [port for part in self._numbers for port in ports(self.component, part)[1]]

    def _firing(self, part, periods):
        (inputs, outputs), faults, name = ports(self.component, part), self._faults, self.name
        ways = {port: faults.input(port, f"I_{name}.{port}") if faults else None for port in inputs}
        out = {port: faults.output(port, f"O_{name}.{port}", f"E_{name}.{port}") if faults else None for port in outputs}
        own = faults.own(part, f"P_{name}", f"X_{name}", tuple(filter(None, ways.values()))) if faults else None
        seen = [way.visible if way else f"I_{name}.{port}" for port, way in ways.items()]
        return Firing(name, part, 1, f"P_{name}", f"X_{name}", (*seen, *(f"O_{name}.{port}" for port in outputs)), tuple(
            Publication(port, self.component.outputs[port], periods[port], f"{'E' if way else 'O'}_{name}.{port}",
                        None, None, 0, f"O_{name}.{port}", way) for port, way in out.items()), own)

    def _memory(self, schedule, parameters, state, inputs, outputs, watched):
        """The arrays of the schedule: those that are given, and those that faults put between."""
        name, component = self.name, self.component
        arrays = {f"P_{name}": parameters, f"X_{name}": state, **{f"I_{name}.{port}": inputs[port] for port in inputs},
                  **{f"O_{name}.{port}": outputs[port] for port in outputs},
                  **{fault_schedule.watched(name, *signal): record for signal, record in watched.items()}}
        made = fault_schedule.memory(schedule.firings, {name: component}, arrays)
        for port, way in self._channels.items():
            if way is not None:  # what is published stands behind the faults
                arrays[f"O_{name}.{port}"], made[way.record] = component.outputs[port].new()[1], outputs[port]
        if f"N_{name}" in made:
            arrays[f"P_{name}"], made[f"N_{name}"] = same(parameters), parameters
        return arrays | made

    def kept(self) -> dict[str, bytes]:
        """Its part of a checkpoint, by the names of arrays."""
        return {name: array.tobytes() for name, array in self._arrays.items() if is_kept(name)}

    def restore(self, arrays: dict[str, bytes]) -> None:
        """Go on with the memory of a checkpoint of its graph."""
        for name, array in self._arrays.items():
            if is_kept(name):
                array.view("u1").reshape(-1)[:] = np.frombuffer(arrays[name], "u1")

    def take_over(self, earlier: "SingleComponent") -> None:
        """Go on where another one of the same component stood, with other faults: what was remembered is remembered."""
        self._fresh = earlier._fresh
        for name, array in self._arrays.items():
            kept = earlier._arrays.get(name)
            if name[:2] == "Z_":
                array[:] = self._fresh
            elif name[:2] in ("F_", "S_") and kept is None:
                array[:] = self._arrays[f"I_{name[2:]}"]
            elif name[:2] in ("A_", "B_", "F_", "S_", "O_", "P_") and kept is not None and kept is not array:
                array[:] = kept

    def delivered(self, port: str) -> int:
        """How many messages of an output its last firing delivered: one, but for faults."""
        channel = self._channels[port]
        return 1 if channel is None else self._tables.faults.delivered(channel)

    def count_from(self, epoch_ns: int) -> None:
        """Let t = 0 have another stamp from now on."""
        self._epoch_ns = epoch_ns

    def call(self, part: str, t_ns: int, stamp_ns: int | None = None, span_ns: int = 1) -> str:
        """Run one part at t, its outputs stamped, where the component has it; the sentence of a stop, or nothing.

        stamp_ns: stamp of the outputs, where it is not that of t. span_ns: time since the firing before, where ticks may
        be left out: a slower output is due when a multiple of its period lies in it.
        """
        if part == "start":
            return self._start() if self.component.start is not None else ""
        number = self._numbers.get(part)
        if number is None:
            return ""
        if self._codes is None:
            return self._call_plainly(part, number, t_ns, stamp_ns)
        for slower, period in self._slower:
            self._tables.outputs["next"][slower] = 0 if t_ns % period < span_ns else -1
        sec, nanosec = stamp_parts(self._epoch_ns + t_ns if stamp_ns is None else stamp_ns)
        code = self._fire(self._row + number * driver.FIRING.itemsize, 0, t_ns, sec | nanosec << 32)
        return self._sentence(part, code, t_ns) if code else ""

    def _start(self):
        parameters, state = self._arrays[f"P_{self.name}"], self._records.state
        self._tables.start(self.name, parameters, state)
        return self._sentence("start", FAULT, 0) if state["fault"][0] else ""

    def place(self, record: np.ndarray, t_ns: int) -> str:
        """Put it elsewhere between two firings, before the one at t; the sentence of a stop, or nothing.

        record: (1,) of a `flight_graph.components.placement.Placement`.
        """
        parameters, state = self._arrays[f"P_{self.name}"], self._records.state
        if self._codes is None:
            with np.errstate(all="ignore"):
                self.component.place(*plain_arguments(self.component, "place", [parameters, state, record]))
        else:
            io = np.array([address(record)], "<i8")
            driver.part_function(self._codes["place"].address)(0, address(parameters), address(state), address(io))
        return self._sentence("place", FAULT, t_ns) if state["fault"][0] else ""

    def take_motion(self, other: "SingleComponent") -> None:
        """Be where another one of the same component stands: its parameters and its state, as they are now."""
        self._arrays[f"P_{self.name}"][:] = other._arrays[f"P_{self.name}"]
        self._records.state[:] = other._records.state

    def _call_plainly(self, part, number, t_ns, stamp_ns):
        stamp_ns = self._epoch_ns + t_ns if stamp_ns is None else stamp_ns
        with np.errstate(all="ignore"):
            code = self._tables.firings[number].fire(t_ns, t_ns, stamp_parts(stamp_ns))
        return self._sentence(part, code, t_ns) if code else ""

    def _sentence(self, part, code, t_ns):
        errors = self._codes[part].errors if self._codes else None
        return stop_sentence(self.name, part, self.component, code, self._records, t_ns / SECOND, errors)
