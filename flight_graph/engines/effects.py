"""What faults do to records, at their addresses: one source for machine code and plain Python.

An effect is one fault at one record. It is looked at once a firing of its component: `is_active` decides by time, by its
condition, by chance and by count; what it does then stands in `_alter` for numbers and in `deliver` for messages. All that
it remembers between firings is in arrays of the run.
"""

import numpy as np

from flight_graph.engines.addresses import (
    byte_at,
    compiled,
    copy,
    double_at,
    half_at,
    row,
    set_byte_at,
    set_double_at,
    set_single_at,
    set_word_at,
    single_at,
    word_at,
)
from flight_graph.engines.condition_steps import SECOND, holds, table
from flight_math.noise import gaussian, uniform

EFFECT = table("op begin end every span when* when_end* key each ticks bit target* width count stamp* buffer* memory* "
               "acts* cause again",
               "value ramp chance")  # times [ns]
MEMORY = table("active onset latched since counted head filled")
CHANNEL = table("origin* record* length visible* effects* effects_end* delivered")
PLACEMENT = table("begin end record*")  # times [ns]
# Of a firing; first: of the component's first part, in its second.
OWN = table("ends* ends_end* effects* effects_end* channels* channels_end* placements* placements_end* parameters* "
            "nominal* parameters_size state* fresh* state_size first* is_down")
EFFECT_SIZE, CHANNEL_SIZE, PLACEMENT_SIZE = EFFECT.itemsize, CHANNEL.itemsize, PLACEMENT.itemsize
PLACED = PLACEMENT.fields["record"][1]  # [bytes] into a row: there stands what the part ``place`` takes

FLAG, BIAS, SCALE, DRIFT, STUCK, HOLD, NOISE, QUANTISE, SATURATE, BIT_FLIP = range(10)
ACT, REQUEST = 10, 11  # of monitors
SET = 21  # of events: all parameters anew
DROP, DELAY, DUPLICATE, FREEZE, STALE, ON_CHANGE, LOSE = range(12, 19)
DOWN, RESTART = 19, 20
GOES_ON, IS_DOWN, BEGINS_ANEW = range(3)  # of a component
_WHOLE = 4503599627370496.0  # 2^52: every larger float64 is a whole number

@compiled
def _is_open(effect, memory, t_ns):
    """Whether an effect may act at t by its window and its condition."""
    now = effect.begin <= t_ns < effect.end
    if now and effect.when != 0:
        now = holds(effect.when, effect.when_end, t_ns)
        if effect.span != 0:  # from each onset for a time
            if memory.latched == 0:
                if now:
                    memory.latched, memory.since = 1, t_ns
            elif t_ns - memory.since >= effect.span and not now:
                memory.latched = 0
            now = memory.latched != 0 and t_ns - memory.since < effect.span
    elif now and effect.every != 0:
        now = (t_ns - effect.begin) % effect.every < effect.span
    return now


@compiled
def is_active(effect, t_ns):
    """Whether an effect acts in the firing at t."""
    memory = row(effect.memory, MEMORY)
    return _chosen(effect, memory, _is_open(effect, memory, t_ns), t_ns)


@compiled
def _chosen(effect, memory, now, t_ns):
    """Whether an effect that may act does, by chance and by count."""
    if now and effect.chance < 1.0:
        now = uniform(effect.key, t_ns, 0) < effect.chance
    if now and effect.each > 1:
        memory.counted += 1
        now = memory.counted % effect.each == 0
    if now and memory.active == 0:
        memory.onset = t_ns
    memory.active = 1 if now else 0
    return now


@compiled
def _rounded(value):
    """The nearest whole number, halves away from zero."""
    if not abs(value) < _WHOLE:
        return value
    whole = float(np.int64(value))
    rest = value - whole
    if rest >= 0.5:
        return whole + 1.0
    if rest <= -0.5:
        return whole - 1.0
    return whole


@compiled
def _altered(effect, value, seconds, t_ns, index):
    """A number under an active effect, ``seconds`` after its onset."""
    op, size = effect.op, effect.value
    part = 1.0 if seconds >= effect.ramp else seconds / effect.ramp
    if op == BIAS:
        return value + size * part
    if op == SCALE:
        return value * (1.0 + (size - 1.0) * part)
    if op == DRIFT:
        return value + size * seconds
    if op == STUCK or op == FLAG:
        return size
    if op == HOLD:
        return double_at(effect.buffer + 8 * index)
    if op == NOISE:
        return value + size * gaussian(effect.key, t_ns, 1 + index)
    if op == QUANTISE:
        return size * _rounded(value / size)
    if op == SATURATE:
        return size if value > size else -size if value < -size else value
    return value


@compiled
def _act(effect, t_ns):
    """An actionpoint: count how often its condition has held in a row; the number is how often it has acted."""
    memory = row(effect.memory, MEMORY)
    if not holds(effect.when, effect.when_end, t_ns):
        memory.counted = 0
    else:
        memory.counted += 1
        if memory.counted == effect.each and (memory.head == 0 or effect.again != 0):
            memory.head += 1
    set_double_at(effect.target, float(memory.head))


@compiled
def _request(effect):
    """Ask for a mode when an actionpoint has acted: the numbers stay in the record that nobody else writes."""
    memory = row(effect.memory, MEMORY)
    acted = np.int64(double_at(effect.acts))
    if acted > memory.head:
        memory.head = acted
        kept = effect.buffer
        set_double_at(kept, effect.value)
        set_double_at(kept + 8, double_at(kept + 8) + 1.0)
        set_double_at(kept + 16, float(effect.cause))
        copy(effect.target, kept, 24)


@compiled
def _alter(effect, t_ns):
    """Let an effect act on its numbers, if it does at t."""
    before = row(effect.memory, MEMORY).active
    if not is_active(effect, t_ns):
        return
    if effect.op == SET:
        copy(effect.target, effect.buffer, effect.count)
        return
    if effect.op == BIT_FLIP:
        at = effect.target + effect.bit // 8
        set_byte_at(at, byte_at(at) ^ (1 << (effect.bit % 8)))
        return
    seconds = (t_ns - row(effect.memory, MEMORY).onset) / SECOND
    for index in range(effect.count):
        at = effect.target + index * effect.width
        value = double_at(at) if effect.width == 8 else float(single_at(at))
        if effect.op == HOLD and before == 0:
            set_double_at(effect.buffer + 8 * index, value)
        value = _altered(effect, value, seconds, t_ns, index)
        if effect.width == 8:
            set_double_at(at, value)
        else:
            set_single_at(at, np.float32(value))


@compiled
def _is_new(record, kept, size, stamp):
    """Whether a message differs from another one, but for the stamp."""
    for at in range(0, size, 4):
        if (record + at < stamp or record + at >= stamp + 8) and half_at(record + at) != half_at(kept + at):
            return True
    return False


@compiled
def _repeat(effect, record, size):
    """A frozen or stale message: the one of the onset again."""
    stamp = word_at(effect.stamp)
    copy(record, effect.buffer, size)
    if effect.op == FREEZE:
        set_word_at(effect.stamp, stamp)


@compiled
def _delayed(effect, memory, record, size):
    """Put a message into the queue and take the one from ``ticks`` firings ago out; whether there is one."""
    length = effect.ticks + 1
    copy(effect.buffer + memory.head * size, record, size)
    memory.head = (memory.head + 1) % length
    if memory.filled < effect.ticks:
        memory.filled += 1
        return False
    copy(record, effect.buffer + memory.head * size, size)
    return True


@compiled
def _is_lost(effect, t_ns):
    """Whether the message at an input is lost: decided when it comes, for as long as it is the newest one."""
    memory, stamp = row(effect.memory, MEMORY), word_at(effect.stamp)
    now = _is_open(effect, memory, t_ns)
    if stamp != memory.head:
        memory.head = stamp
        memory.filled = 1 if _chosen(effect, memory, now, t_ns) else 0
    return memory.filled != 0


@compiled
def _messages(effect, record, size, count, t_ns):
    """How many messages of ``count`` are left by an effect on whole messages, whose content it may change."""
    memory = row(effect.memory, MEMORY)
    op, before = effect.op, memory.active
    if op == ON_CHANGE:
        if memory.filled != 0 and not _is_new(record, effect.buffer, size, effect.stamp):
            return 0
        memory.filled = 1
        copy(effect.buffer, record, size)
        return count
    if op == LOSE:
        return 0 if _is_lost(effect, t_ns) else count
    if not is_active(effect, t_ns):
        memory.filled = 0
        return count
    if op == DROP:
        return 0
    if op == DUPLICATE:
        return 2
    if op == DELAY:
        return count if _delayed(effect, memory, record, size) else 0
    if before == 0:
        copy(effect.buffer, record, size)
    else:
        _repeat(effect, record, size)
    return count


@compiled
def deliver(channel_at, t_ns):
    """Pass a record through the effects on it; return how often the message is delivered."""
    channel = row(channel_at, CHANNEL)
    copy(channel.record, channel.origin, channel.length)
    at, count = channel.effects, 1
    while at < channel.effects_end:
        effect = row(at, EFFECT)
        if effect.op < ACT:
            _alter(effect, t_ns)
        elif effect.op == ACT:
            _act(effect, t_ns)
        elif effect.op == REQUEST:
            _request(effect)
        elif count > 0:
            count = _messages(effect, channel.record, channel.length, count, t_ns)
        at += EFFECT_SIZE
    if count > 0 and channel.visible != 0:
        copy(channel.visible, channel.record, channel.length)
    channel.delivered = count
    return count


@compiled
def prepare(own_at, t_ns):
    """What faults do to a component itself before it fires.

    Returns GOES_ON, IS_DOWN (it does not fire), or BEGINS_ANEW (state and parameters are fresh: the caller runs its start).
    The caller goes on with `alter`, unless it is down.
    """
    own = row(own_at, OWN)
    if own.first != 0:
        own.is_down = row(own.first, OWN).is_down
        return IS_DOWN if own.is_down != 0 else GOES_ON
    down, anew, at = 0, 0, own.ends
    while at < own.ends_end:
        effect = row(at, EFFECT)
        before = row(effect.memory, MEMORY).active
        if is_active(effect, t_ns):
            down = 1
        elif effect.op == RESTART and before != 0:
            anew = 1
        at += EFFECT_SIZE
    own.is_down = down
    if down != 0:
        return IS_DOWN
    if own.parameters_size != 0:
        copy(own.parameters, own.nominal, own.parameters_size)
    if anew != 0:
        copy(own.state, own.fresh, own.state_size)
        return BEGINS_ANEW
    return GOES_ON


@compiled
def alter(own_at, t_ns):
    """What faults do to parameters, state and inputs before a firing."""
    own = row(own_at, OWN)
    at = own.effects
    while at < own.effects_end:
        _alter(row(at, EFFECT), t_ns)
        at += EFFECT_SIZE
    at = own.channels
    while at < own.channels_end:
        deliver(at, t_ns)
        at += CHANNEL_SIZE
