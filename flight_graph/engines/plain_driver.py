"""The schedule walked in plain Python: the engine ``python``, for debuggers. The same order, the same bits.

Kernels are plain functions here (NUMBA_DISABLE_JIT=1), and see the same memory through NumPy's records.
"""

import numpy as np

from flight_graph.engines import effects
from flight_graph.engines.addresses import address, row
from flight_graph.engines.fault_tables import FaultTables
from flight_graph.engines.part_calls import plain_arguments
from flight_graph.engines.reductions import REDUCTION, feed
from flight_graph.engines.schedule import Schedule, finite_runs, stamp_offset
from flight_graph.engines.stops import FAULT, NONFINITE


class PlainFiring:
    """One firing bound to arrays."""

    def __init__(self, component, arrays: dict, firing, faults: FaultTables, epoch_ns: int):
        self._own = faults.own(firing)
        self._start = plain_arguments(component, "start", [arrays[firing.parameters], arrays[firing.state]]) if (
            component.start is not None) else None
        self._placements = [(one.begin_ns, one.end_ns, plain_arguments(component, "place", [
            arrays[firing.parameters], arrays[firing.state], arrays[one.array]]))
            for one in (firing.own.placements if firing.own else ())]
        self._component = component
        self._function = getattr(component, firing.part)
        names = [firing.parameters, firing.state, *firing.records]
        self._arguments = plain_arguments(component, firing.part, [arrays[name] for name in names])
        self._fault = arrays[firing.state]["fault"]
        self.outputs = [PlainOutput(made, arrays, faults.channel(made), epoch_ns) for made in firing.publications]

    def fire(self, tick: int, t_ns: int, stamp: tuple[int, int], around=None) -> int:
        """One firing. Returns 0 or a code of `stops`. around(function, *arguments): calls the kernel in its place."""
        if self._own:
            answer = effects.prepare(self._own, t_ns)
            if answer == effects.IS_DOWN:
                for output in self.outputs:
                    output.silence()
                return 0
            if answer == effects.BEGINS_ANEW and self._start is not None:
                self._component.start(*self._start)
                if self._fault[0]:
                    return FAULT
            effects.alter(self._own, t_ns)
            for begin, end, arguments in self._placements:
                if begin <= t_ns < end:
                    self._component.place(*arguments)
                    if self._fault[0]:
                        return FAULT
        for output in self.outputs:
            output.stamp[0], output.stamp[1] = stamp
        if around is None:
            self._function(t_ns, *self._arguments)
        else:
            around(self._function, t_ns, *self._arguments)
        if self._fault[0]:
            return FAULT
        for output in self.outputs:
            if tick % output.period == 0 and not output.publish(tick, t_ns):
                return NONFINITE
        return 0


class PlainOutput:
    """What follows a firing, for one output."""

    def __init__(self, made, arrays, channel: int, epoch_ns: int):
        record = arrays[made.record]
        self._body, self._channel = record.view("u1").reshape(-1), channel
        offset = stamp_offset(made.signal)
        self.stamp = arrays[made.written].view("u1").reshape(-1)[offset:offset + 8].view("<u4")
        self.period, self._log_period = made.period, made.log_period
        self._runs = [self._body[start:start + count * size].view(f"<f{size}")
                      for start, count, size in finite_runs(made.signal)]
        self._visible = arrays[made.visible].view("u1").reshape(-1) if made.visible else None
        self._log = arrays[made.log].view("u1").reshape(-1, record.dtype.itemsize) if made.log else None
        self._times = arrays[made.times] if made.times else None
        self.log, self.logged = made.log, 0
        rows = [one.row(offset, arrays[one.memory], epoch_ns) for one in made.reductions]
        self._reductions, self._record = np.array(rows, REDUCTION), address(record)

    def publish(self, tick, t_ns) -> bool:
        """Show the record to readers, log and reduce it, as often as its faults let it; whether it is finite."""
        count = effects.deliver(self._channel, t_ns) if self._channel else 1
        if count == 0:
            return True
        if not all(np.isfinite(run).all() for run in self._runs):
            return False
        if self._visible is not None:
            self._visible[:] = self._body
        if self._log_period and tick % self._log_period == 0:
            for _ in range(count):
                if self._log is not None:
                    self._log[self.logged] = self._body
                if self._times is not None:
                    self._times[self.logged] = tick
                self.logged += 1
                begin = address(self._reductions)
                feed(begin, begin + self._reductions.nbytes, self._record, 1, 0)
        return True

    def silence(self):
        """Publish nothing: the component does not fire."""
        row(self._channel, effects.CHANNEL).delivered = 0


class PlainTables:
    """A schedule over the arrays of one run. components: node -> component."""

    def __init__(self, schedule: Schedule, arrays: dict, components: dict, epoch_ns: int = 0):
        self._components = components
        self._tapes, self._arrays = schedule.tapes, arrays
        self._holds = [(hold.period, arrays[hold.target], arrays[hold.origin]) for hold in schedule.holds]
        self.faults = FaultTables(schedule, arrays, epoch_ns)
        self.firings = [PlainFiring(components[firing.node], arrays, firing, self.faults, epoch_ns)
                        for firing in schedule.firings]

    def begin(self, tick: int) -> None:
        """Nothing to do: what is due follows from the tick."""

    def start(self, node: str, parameters: np.ndarray, state: np.ndarray) -> None:
        """Run the start of a node."""
        component = self._components[node]
        component.start(*plain_arguments(component, "start", [parameters, state]))

    def hold(self, tick: int) -> None:
        """Let the inputs with a delay take the newest messages, then the tapes go on."""
        for period, target, origin in self._holds:
            if tick % period == 0:
                target[:] = origin
        for tape in self._tapes:
            tape.play(tick, self._arrays)

    def logged(self) -> dict[str, int]:
        """log -> number of rows that are filled."""
        return {output.log: output.logged for firing in self.firings for output in firing.outputs if output.log}
