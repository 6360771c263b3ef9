"""The loop that runs a graph for eight runs at once: the schedule as tables of addresses.

A firing is wide (its part works on woven records) or single: then the usual driver fires it for one lane after the other,
over the lane's own records, and what others need is woven or unwoven around it.
"""

from pathlib import Path

from numba import types

from flight_graph.engines import driver
from flight_graph.engines.addresses import (
    byte_at,
    compiled,
    copy,
    half_at,
    row,
    set_byte_at,
    set_half_at,
    set_word_at,
    word_at,
)
from flight_graph.engines.called import Called
from flight_graph.engines.condition_steps import table
from flight_graph.engines.driver import RUN, call, call_fire, is_finite
from flight_graph.engines.reductions import feed
from flight_graph.engines.stops import FAULT, NONFINITE
from flight_graph.lanes.operations import LANES

CONTROL = table("tick end epoch_ns base_ns alive stopped next_firing holds holds_end firings firings_end fire")
HOLD = table("next period target origin size single singles")  # single: rows of lanes (target, origin) of `size` bytes
FIRING = table("next period part parameters state records fault outputs outputs_end transfers transfers_end singles stops")
OUTPUT = table("next period stamp record size runs runs_end leaves leaves_end visible logs log_next log_period "
               "reductions reductions_size")  # reductions: of the lanes, where those of each begin
TRANSFER = table("woven leaves leaves_end lanes inward")  # lanes: addresses of the records; inward: they are woven
_EXPONENT, _EXPONENT_4 = 0x7FF0000000000000, 0x7F800000  # all ones in inf and NaN
OWN_FIRING = driver.FIRING
LEAF = table("offset count width")
_HOLD, _FIRING, _OUTPUT, _TRANSFER, _LEAF, _RUN = (one.itemsize for one in (HOLD, FIRING, OUTPUT, TRANSFER, LEAF, RUN))


@compiled
def unwoven(woven, record, leaf_at, end, lane):
    """Write the numbers of one lane into its record."""
    while leaf_at < end:
        leaf = row(leaf_at, LEAF)
        origin, target = woven + LANES * leaf.offset, record + leaf.offset
        if leaf.width == 8:
            for i in range(leaf.count):
                set_word_at(target + 8 * i, word_at(origin + 8 * (LANES * i + lane)))
        elif leaf.width == 4:
            for i in range(leaf.count):
                set_half_at(target + 4 * i, half_at(origin + 4 * (LANES * i + lane)))
        else:
            for i in range(leaf.count):
                for k in range(leaf.width):
                    set_byte_at(target + leaf.width * i + k, byte_at(origin + leaf.width * (LANES * i + lane) + k))
        leaf_at += _LEAF


@compiled
def wove(woven, record, leaf_at, end, lane):
    """Write the numbers of a record into one lane."""
    while leaf_at < end:
        leaf = row(leaf_at, LEAF)
        target, origin = woven + LANES * leaf.offset, record + leaf.offset
        if leaf.width == 8:
            for i in range(leaf.count):
                set_word_at(target + 8 * (LANES * i + lane), word_at(origin + 8 * i))
        elif leaf.width == 4:
            for i in range(leaf.count):
                set_half_at(target + 4 * (LANES * i + lane), half_at(origin + 4 * i))
        else:
            for i in range(leaf.count):
                for k in range(leaf.width):
                    set_byte_at(target + leaf.width * (LANES * i + lane) + k, byte_at(origin + leaf.width * i + k))
        leaf_at += _LEAF


@compiled
def transfer(at, end, lanes):
    """Weave and unweave records of some lanes (bits)."""
    while at < end:
        one = row(at, TRANSFER)
        for lane in range(LANES):
            if lanes >> lane & 1:
                record = word_at(one.lanes + 8 * lane)
                if one.inward != 0:
                    wove(one.woven, record, one.leaves, one.leaves_end, lane)
                else:
                    unwoven(one.woven, record, one.leaves, one.leaves_end, lane)
        at += _TRANSFER
    return 0


@compiled
def stamp(at, sec, nanosec):
    """Stamp a woven record."""
    for i in range(LANES // 2):
        set_word_at(at + 8 * i, sec | sec << 32)
        set_word_at(at + 4 * LANES + 8 * i, nanosec | nanosec << 32)


@compiled
def unlike_zero(at):
    """The lanes (bits) whose word of these is not zero."""
    found = 0
    for lane in range(LANES):
        if word_at(at + 8 * lane) != 0:
            found |= 1 << lane
    return found


@compiled
def not_finite(record, run_at, end):
    """The lanes (bits) that have a number that is not finite; most often none, which is_finite sees at once."""
    found = 0
    while run_at < end:
        run = row(run_at, RUN)
        for i in range(run.count):
            if run.is_double != 0:
                bad = word_at(record + run.offset + 8 * i) & _EXPONENT == _EXPONENT
            else:
                bad = half_at(record + run.offset + 4 * i) & _EXPONENT_4 == _EXPONENT_4
            if bad:
                found |= 1 << (i % LANES)
        run_at += _RUN
    return found


@compiled
def publish(at, tick, alive):
    """Check a woven output, show it to readers, log and reduce it. Returns the lanes (bits) whose numbers are not all
    finite.
    """
    output = row(at, OUTPUT)
    bad = 0
    if not is_finite(output.record, output.runs, output.runs_end):
        bad = not_finite(output.record, output.runs, output.runs_end) & alive
        alive &= ~bad
    if output.visible != 0:
        copy(output.visible, output.record, LANES * output.size)
    if tick == output.log_next:
        output.log_next += output.log_period
        for lane in range(LANES):
            if alive >> lane & 1:
                place = output.logs + 8 * lane
                log = word_at(place)
                if log != 0:
                    unwoven(output.record, log, output.leaves, output.leaves_end, lane)
                    set_word_at(place, log + output.size)
                if output.reductions_size != 0:
                    rows = word_at(output.reductions + 8 * lane)
                    feed(rows, rows + output.reductions_size, output.record, LANES, lane)
    return bad


@compiled
def stop(firing, lanes, code):
    """Note why lanes (bits) stop in a firing."""
    for lane in range(LANES):
        if lanes >> lane & 1:
            set_word_at(firing.stops + 8 * lane, code)


@compiled
def fire_singly(fire_one, firing, tick, t_ns, stamp_word, alive):
    """One firing for one lane after the other. fire_one: address of the usual driver's. Returns the lanes (bits) that stop.
    """
    stopped = 0
    for lane in range(LANES):
        if alive >> lane & 1:
            own = word_at(firing.singles + 8 * lane)
            row(own, OWN_FIRING).next += firing.period
            code = call_fire(fire_one, own, tick, t_ns, stamp_word)
            if code != 0:
                set_word_at(firing.stops + 8 * lane, code)
                stopped |= 1 << lane
    transfer(firing.transfers, firing.transfers_end, alive & ~stopped)
    return stopped


@compiled
def fire(fire_one, at, tick, t_ns, epoch_ns, alive):
    """One firing of the lanes that are alive. Returns those (bits) that stop."""
    firing = row(at, FIRING)
    sec = (epoch_ns + t_ns) // 1000000000
    nanosec = epoch_ns + t_ns - sec * 1000000000
    if firing.singles != 0:
        return fire_singly(fire_one, firing, tick, t_ns, sec | nanosec << 32, alive)
    output_at = firing.outputs
    while output_at < firing.outputs_end:
        stamp(row(output_at, OUTPUT).stamp, sec, nanosec)
        output_at += _OUTPUT
    call(firing.part, t_ns, firing.parameters, firing.state, firing.records)
    stopped = unlike_zero(firing.fault) & alive
    if stopped != 0:
        stop(firing, stopped, FAULT)
    output_at = firing.outputs
    while output_at < firing.outputs_end:
        output = row(output_at, OUTPUT)
        if tick == output.next:
            output.next += output.period
            bad = publish(output_at, tick, alive & ~stopped)
            if bad != 0:
                stop(firing, bad, NONFINITE)
                stopped |= bad
        output_at += _OUTPUT
    transfer(firing.transfers, firing.transfers_end, alive & ~stopped)
    return stopped


@compiled
def hold(control, tick):
    """Let the inputs with a delay take the newest messages."""
    at = control.holds
    while at < control.holds_end:
        one = row(at, HOLD)
        if tick == one.next:
            one.next += one.period
            if one.single == 0:
                copy(one.target, one.origin, LANES * one.size)
            else:
                for lane in range(LANES):
                    if control.alive >> lane & 1:
                        copy(word_at(one.singles + 16 * lane), word_at(one.singles + 16 * lane + 8), one.size)
        at += _HOLD


@compiled
def run(control_at):
    """Run from control.tick to control.end, or until a lane stops: then control.stopped has it, and the next call goes on
    with the other ones behind the firing that stopped it. Returns 0, or 1 when a lane stopped.
    """
    control = row(control_at, CONTROL)
    while control.tick < control.end and control.alive != 0:
        tick = control.tick
        t_ns = tick * control.base_ns
        if control.next_firing == control.firings:
            hold(control, tick)
        while control.next_firing < control.firings_end:
            at = control.next_firing
            control.next_firing += _FIRING
            firing = row(at, FIRING)
            if tick == firing.next:
                firing.next += firing.period
                stopped = fire(control.fire, at, tick, t_ns, control.epoch_ns, control.alive)
                if stopped != 0:
                    control.stopped = stopped
                    control.alive &= ~stopped
                    return 1
        control.next_firing = control.firings
        control.tick = tick + 1
    return 0


# -- as machine code -------------------------------------------------------------------------------------------------
CODE = Called("lane driver", {"run": (run, types.int64(types.int64)), "transfer": (
    transfer, types.int64(*[types.int64] * 3))}, [Path(__file__)], driver.CODE)
