"""The one loop that runs any graph: the schedule as tables of addresses, walked by code that is compiled once.

The functions here are compiled by `flight_graph.engines.compiler` into the same cache as the parts of components, and
called by address. A row of a table says when it is due next and how many ticks lie between.
"""

import ctypes
from pathlib import Path

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from flight_graph.engines import effects
from flight_graph.engines.addresses import address, compiled, copy, half_at, row, set_word_at, word_at
from flight_graph.engines.called import Called
from flight_graph.engines.condition_steps import holds, table
from flight_graph.engines.effects import BEGINS_ANEW, IS_DOWN
from flight_graph.engines.fault_tables import FaultTables
from flight_graph.engines.reductions import REDUCTION, feed
from flight_graph.engines.schedule import Schedule, finite_runs, stamp_offset
from flight_graph.engines.stops import FAULT, NONFINITE
from flight_graph.engines.tape import Reels

_WORD = "<i8"

CONTROL = table("tick end epoch_ns base_ns stop who holds* holds_end* firings* firings_end* fire when* when_end*")
HOLD = table("next period target* origin* size ticks")  # ticks: of the messages of a tape, one behind the other at origin
FIRING = table("next period part parameters* state* records* fault* outputs* outputs_end* own* start place")
OUTPUT = table("next period stamp* record* size runs* runs_end* visible* log* log_next log_period channel* times* "
               "reductions* reductions_end*")
RUN = table("offset count is_double")  # of floats that must be finite: bytes of a record
_HOLD_SIZE, _FIRING_SIZE, _OUTPUT_SIZE, _RUN_SIZE = (table.itemsize for table in (HOLD, FIRING, OUTPUT, RUN))
_EXPONENT, _EXPONENT_4 = 0x7FF0000000000000, 0x7F800000  # all ones in inf and NaN


@intrinsic
def call(typing, part, t_ns, parameters, state, records):
    """Call a part: at its address, where code has one (`flight_graph.engines.object_code`)."""
    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * 5)
        builder.call(cgutils.get_or_insert_function(builder.module, kind, "flight_part"), args)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), codegen


@intrinsic
def call_fire(typing, fire_at, firing_at, tick, t_ns, stamp):
    """Call `fire` at its address: its machine code, with all that faults do, exists once."""
    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.IntType(64), [ir.IntType(64)] * 5)
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, "flight_fire"), args)

    return types.int64(*[types.int64] * 5), codegen


@compiled
def is_finite(record, runs, runs_end):
    """Whether the floats of these runs are finite. No branch for a number: the processor looks at several at once."""
    found = 0
    while runs < runs_end:
        run = row(runs, RUN)
        begin = record + run.offset
        if run.is_double != 0:
            for i in range(run.count):
                found |= word_at(begin + 8 * i) & _EXPONENT == _EXPONENT
        else:
            for i in range(run.count):
                found |= half_at(begin + 4 * i) & _EXPONENT_4 == _EXPONENT_4
        runs += _RUN_SIZE
    return found == 0


@compiled
def stamp_word(stamp_ns):
    """The eight bytes of a ROS stamp: sec (int32), nanosec (uint32)."""
    sec = stamp_ns // 1000000000
    return sec | ((stamp_ns - sec * 1000000000) << 32)


@compiled
def publish(output_at, tick, t_ns):
    """Check an output, show it to readers, log and reduce it: once, or as often as its faults let it. Returns 0 or a code
    of `stops`.
    """
    output = row(output_at, OUTPUT)
    count = 1
    if output.channel != 0:
        count = effects.deliver(output.channel, t_ns)
    if count > 0:
        if not is_finite(output.record, output.runs, output.runs_end):
            return NONFINITE
        if output.visible != 0:
            copy(output.visible, output.record, output.size)
    if tick == output.log_next:
        output.log_next += output.log_period
        for _ in range(count):
            if output.log != 0:
                copy(output.log, output.record, output.size)
                output.log += output.size
            if output.times != 0:
                set_word_at(output.times, tick)
                output.times += 8
            feed(output.reductions, output.reductions_end, output.record, 1, 0)
    return 0


@compiled
def silence(firing, tick):
    """Publish nothing: the component does not fire."""
    at = firing.outputs
    while at < firing.outputs_end:
        output = row(at, OUTPUT)
        row(output.channel, effects.CHANNEL).delivered = 0
        if tick == output.next:
            output.next += output.period
            if tick == output.log_next:
                output.log_next += output.log_period
        at += _OUTPUT_SIZE


@compiled
def put(firing_at, t_ns):
    """Put the body elsewhere, where a placement is due at t. Returns 0 or a code of `stops`."""
    firing = row(firing_at, FIRING)
    own = row(firing.own, effects.OWN)
    at = own.placements
    while at < own.placements_end:
        placement = row(at, effects.PLACEMENT)
        if placement.begin <= t_ns < placement.end:
            call(firing.place, 0, firing.parameters, firing.state, at + effects.PLACED)
            if word_at(firing.fault) != 0:
                return FAULT
        at += effects.PLACEMENT_SIZE
    return 0


@compiled
def fire(firing_at, tick, t_ns, stamp):
    """One firing: stamp the outputs, call the part, check and publish what is due. Returns 0 or a code of `stops`."""
    firing = row(firing_at, FIRING)
    if firing.own != 0:
        answer = effects.prepare(firing.own, t_ns)
        if answer == IS_DOWN:
            silence(firing, tick)
            return 0
        if answer == BEGINS_ANEW and firing.start != 0:
            call(firing.start, 0, firing.parameters, firing.state, 0)
            if word_at(firing.fault) != 0:
                return FAULT
        effects.alter(firing.own, t_ns)
        if put(firing_at, t_ns) != 0:
            return FAULT
    at, end = firing.outputs, firing.outputs_end
    while at < end:
        set_word_at(row(at, OUTPUT).stamp, stamp)
        at += _OUTPUT_SIZE
    call(firing.part, t_ns, firing.parameters, firing.state, firing.records)
    if word_at(firing.fault) != 0:
        return FAULT
    at = firing.outputs
    while at < end:
        output = row(at, OUTPUT)
        if tick == output.next:
            output.next += output.period
            code = publish(at, tick, t_ns)
            if code != 0:
                return code
        at += _OUTPUT_SIZE
    return 0


@compiled
def run(control_at):
    """Run from control.tick to control.end. Returns 0, 1 when a firing stopped it (control.stop and .who), or 2 at the
    first tick before which the condition control.when holds, where there is one.
    """
    control = row(control_at, CONTROL)
    while control.tick < control.end:
        tick = control.tick
        t_ns = tick * control.base_ns
        stamp = stamp_word(control.epoch_ns + t_ns)
        at = control.holds
        while at < control.holds_end:
            hold = row(at, HOLD)
            if tick == hold.next:
                copy(hold.target, hold.origin, hold.size)
                if hold.ticks == 0:
                    hold.next += hold.period
                else:
                    hold.origin += hold.size
                    hold.ticks += 8
                    hold.next = word_at(hold.ticks)
            at += _HOLD_SIZE
        at = control.firings
        while at < control.firings_end:
            firing = row(at, FIRING)
            if tick == firing.next:
                firing.next += firing.period
                code = call_fire(control.fire, at, tick, t_ns, stamp)
                if code != 0:
                    control.stop = code
                    control.who = (at - control.firings) // _FIRING_SIZE
                    return 1
            at += _FIRING_SIZE
        control.tick = tick + 1
        if control.when != 0 and holds(control.when, control.when_end, t_ns + control.base_ns):
            return 2
    return 0


# -- as machine code ---------------------------------------------------------------------------------------------------
FIRE = types.int64(*[types.int64] * 4)
CODE = Called("driver", {"run": (run, types.int64(types.int64)), "fire": (fire, FIRE)},
              [Path(__file__).with_name(f"{name}.py")
               for name in ("driver", "effects", "reductions", "condition_steps", "addresses")])


# -- a schedule bound to the arrays of a run ---------------------------------------------------------------------------
class Tables:
    """A schedule over the arrays of one run, which live as long as this.

    arrays: name -> array, by the names of the schedule. codes: node -> part -> its machine code.
    """

    def __init__(self, schedule: Schedule, arrays: dict, codes: dict, epoch_ns: int = 0):
        self.arrays, self._codes = arrays, codes
        self.io = np.array([address(arrays[name]) for firing in schedule.firings for name in firing.records], _WORD)
        held = np.array([(0, hold.period, address(arrays[hold.target]), address(arrays[hold.origin]),
                          arrays[hold.target].nbytes, 0) for hold in schedule.holds], HOLD)
        self._reels = Reels(schedule.tapes, arrays, HOLD)
        self.holds = np.concatenate([held, self._reels.rows])
        self.faults = FaultTables(schedule, arrays, epoch_ns)
        made = [made for firing in schedule.firings for made in firing.publications]
        runs = [[(offset, count, size == 8) for offset, count, size in finite_runs(one.signal)]
                for one in made]
        self.runs = np.array([run for rows in runs for run in rows], RUN)
        ends = address(self.runs) + RUN.itemsize * np.cumsum([0, *map(len, runs)])
        reduced = [[one.row(stamp_offset(each.signal), arrays[one.memory], epoch_ns) for one in each.reductions]
                   for each in made]
        self.reductions = np.array([row for rows in reduced for row in rows], REDUCTION)
        reductions = address(self.reductions) + REDUCTION.itemsize * np.cumsum([0, *map(len, reduced)])
        self._logs = {one.log: (i, one.signal.dtype.itemsize) for i, one in enumerate(made) if one.log}
        self.outputs = np.array([(*self._output(one, *ends[i:i + 2]), *reductions[i:i + 2])
                                 for i, one in enumerate(made)], OUTPUT)
        rows, record, output = [], address(self.io), address(self.outputs)
        for firing in schedule.firings:
            state, after = arrays[firing.state], output + OUTPUT.itemsize * len(firing.publications)
            part, start, place = (codes[firing.node].get(name) for name in (firing.part, "start", "place"))
            rows.append((0, firing.period, part.address, address(arrays[firing.parameters]), address(state), record,
                         address(state) + state.dtype.fields["fault"][1], output, after,
                         self.faults.own(firing), start.address if start else 0, place.address if place else 0))
            record, output = record + 8 * len(firing.records), after
        self.firings = np.array(rows, FIRING)
        self._begin = [(table, table.copy()) for table in (self.holds, self.outputs, self.firings)]

    def _output(self, made, runs, runs_end):
        def place(name):
            return address(self.arrays[name]) if name else 0

        record = place(made.record)
        return (0, made.period, place(made.written) + stamp_offset(made.signal), record, made.signal.dtype.itemsize, runs,
                runs_end, place(made.visible), place(made.log), 0 if made.log_period else -1, made.log_period,
                self.faults.channel(made), place(made.times))

    def begin(self, tick: int) -> None:
        """Let everything be due at its first tick from this one on."""
        held = self.holds[:len(self.holds) - len(self._reels.rows)]
        for rows in (held, self.firings, self.outputs):
            rows["next"] = -(-tick // rows["period"]) * rows["period"]
        self._reels.begin(self.holds[len(held):], tick)
        logged = self.outputs["log_period"] > 0
        period = self.outputs["log_period"][logged]
        self.outputs["log_next"][logged] = -(-tick // period) * period

    def control(self, epoch_ns: int, base_ns: int) -> np.ndarray:
        """The record that the driver works on, at tick 0."""
        control = np.zeros(1, CONTROL)
        control["epoch_ns"], control["base_ns"], control["fire"] = epoch_ns, base_ns, CODE.address("fire")
        for name in ("holds", "firings"):
            table = getattr(self, name)
            control[name], control[f"{name}_end"] = address(table), address(table) + table.nbytes
        return control

    def all(self) -> list[np.ndarray]:
        """All tables, in an order that a schedule decides; ``io`` is one of addresses alone."""
        return [self.io, self.holds, self.runs, self.outputs, self.reductions, self.firings, *self.faults.all()]

    def rewind(self) -> None:
        """As before the first tick; faults remember what they remember."""
        for rows, begin in self._begin:
            rows[...] = begin

    def start(self, node: str, parameters: np.ndarray, state: np.ndarray) -> None:
        """Run the start of a node."""
        part_function(self._codes[node]["start"].address)(0, address(parameters), address(state), 0)

    def logged(self) -> dict[str, int]:
        """log -> number of rows that are filled."""
        return {log: (int(self.outputs[i]["log"]) - address(self.arrays[log])) // size
                for log, (i, size) in self._logs.items()}


def part_function(place: int):
    """The C function of a part at an address, to be called from Python."""
    return ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 4)(place)
