"""A flight that can stop between two firings, be put to any checkpoint, and stop where a condition holds."""

import numpy as np

from flight_graph.engines import driver
from flight_graph.engines.addresses import address
from flight_graph.engines.checkpoint import Checkpoint
from flight_graph.engines.condition_steps import STEP, holds
from flight_graph.engines.fault_tables import fill
from flight_graph.engines.flight import Flight
from flight_graph.engines.schedule import Firing
from flight_graph.faults.conditions import Condition
from flight_graph.timebase import stamp_parts

SHORT = 64  # [ticks]


class SteppedFlight(Flight):
    """``fired``: how many firings of the tick are over; 0: none, the flight stands between two ticks."""

    def __init__(self, *arguments):
        self.fired, self._number, self._steps, self._when = 0, 0, None, None
        super().__init__(*arguments)

    def due(self, tick: int) -> list[int]:
        """The numbers of the schedule's firings at a tick."""
        return [number for number, firing in enumerate(self._schedule.firings) if tick % firing.period == 0]

    @property
    def upcoming(self) -> tuple[int, Firing]:
        """(tick, firing) that comes next."""
        tick, number = self._tick, self._number
        while not (left := [one for one in self.due(tick) if one >= number]):
            tick, number = min((tick // firing.period + 1) * firing.period for firing in self._schedule.firings), 0
        return tick, self._schedule.firings[left[0]]

    def restore(self, checkpoint: Checkpoint) -> None:
        """Stand where a checkpoint of this graph was taken. Raises FlightError."""
        checkpoint.restore(self.arrays, self.shape, self._run.scenario.origin)
        self.stop, self.fired, self._number = None, 0, 0
        self._seek(checkpoint.tick)

    def fire(self, around=None) -> None:
        """One firing. around(function, *arguments): calls the kernel in its place (plain Python alone)."""
        tick, firing = self.upcoming
        if tick != self._tick:
            self._seek(tick)
        if not self._number:
            self._hold()
        number = self._schedule.firings.index(firing)
        code = self._fire_one(number, around)
        if code:
            self._stopped(firing.node, firing.part, code)
        if self.stop:
            return
        self.fired, self._number = self.fired + 1, number + 1
        if not any(one > number for one in self.due(tick)):
            self.fired = self._number = 0
            self._seek(tick + 1)

    def _hold(self):
        for hold in self._schedule.holds:
            if self._tick % hold.period == 0:
                self.arrays[hold.target].view("u1")[:] = self.arrays[hold.origin].view("u1")
        for tape in self._schedule.tapes:
            tape.play(self._tick, self.arrays)

    def _fire_one(self, number, around) -> int:
        t_ns = self._tick * self._graph.base_ns
        sec, nanosec = stamp_parts(self._run.scenario.epoch_ns + t_ns)
        if self._codes is not None:
            row = address(self._tables.firings) + number * driver.FIRING.itemsize
            return driver.CODE.function("fire")(row, self._tick, t_ns, sec | nanosec << 32)
        firing, bound = self._schedule.firings[number], self._tables.firings[number]
        with np.errstate(all="ignore"):
            return self._guarded(firing.node, firing.part, bound.fire, self._tick, t_ns, (sec, nanosec), around)

    def advance(self, tick: int) -> None:
        """Run until before a tick, a stop, or where the condition holds that is watched for."""
        while self.fired and not self.stop:
            self.fire()
            if not self.fired and self.is_met():
                return
        if not self.stop:
            super().advance(tick)

    def watch(self, condition: Condition | None) -> None:
        """Watch for a condition, at each tick before it fires; None: for nothing."""
        self._steps = when = when_end = None
        if condition is not None:
            self._steps = np.zeros(len(condition.steps), STEP)
            when, when_end = fill(self._steps, condition,
                                  lambda step: address(self.arrays[self._schedule.shown(*step.signal)]),
                                  self._run.scenario.epoch_ns)
        self._when = (when, when_end) if condition is not None else None
        if self._codes is not None:
            self._control["when"], self._control["when_end"] = self._when or (0, 0)

    def is_met(self) -> bool:
        """Whether the condition that is watched for holds before this tick."""
        with np.errstate(all="ignore"):
            return self._when is not None and bool(holds(*self._when, self._tick * self._graph.base_ns))

    def _stopped(self, name, part, code):
        super()._stopped(name, part, code)
        self._stand_at(name, part)

    def _guarded(self, node, part, call, *arguments):
        answer = super()._guarded(node, part, call, *arguments)
        if self.stop:
            self._stand_at(node, part)
        return answer

    def _stand_at(self, node, part):
        """A firing stopped the run: those before it are over."""
        for number in self.due(self._tick):
            firing = self._schedule.firings[number]
            if (firing.node, firing.part) == (node, part):
                self.fired, self._number = self.due(self._tick).index(number), number

    def _plain_tick(self, t_ns) -> bool:
        return super()._plain_tick(t_ns) or self.is_met()

    def _drive(self) -> int:
        """A few ticks need no thread of their own."""
        if int(self._control["end"][0]) - self._tick <= SHORT:
            return driver.CODE.function("run")(address(self._control))
        return super()._drive()
