"""Conditions at the addresses of what they read: one source for machine code and plain Python.

A condition is a table of elementary steps (`flight_graph.faults.conditions`); each keeps its value for those behind it.
"""

import numpy as np

from flight_graph.engines.addresses import byte_at, compiled, double_at, row, single_at, word_at
from flight_graph.faults import conditions

ADDRESSES = {}  # table -> names of its addresses of data


def table(words: str, numbers: str = "") -> np.dtype:
    """A row of int64 and float64 fields; their names are no attributes of a NumPy record. An address of data has a star
    behind its name."""
    names = words.split()
    made = np.dtype([(name.rstrip("*"), "<i8") for name in names] + [(name, "<f8") for name in numbers.split()], align=True)
    ADDRESSES[made] = tuple(name.rstrip("*") for name in names if name.endswith("*"))
    return made


STEP = table("op a* b* address* kind width epoch_ns", "constant value")  # a, b: earlier steps
STEP_SIZE = STEP.itemsize
DOUBLE, SINGLE, SIGNED, UNSIGNED = range(4)  # kinds of a number that is read
_KINDS = {"<f8": DOUBLE, "<f4": SINGLE, "|b1": UNSIGNED}  # and whole numbers, by their letter
_WHOLE = {"i": SIGNED, "u": UNSIGNED}
SECOND = 1e9  # [ns] divided by, not multiplied with its inverse: 0.3 s is the number that a person writes

(_CONSTANT, _TIME, _READ, _ADD, _SUBTRACT, _MULTIPLY, _DIVIDE, _NEGATE, _ABS, _MIN, _MAX, _LESS, _LESS_EQUAL, _GREATER,
 _GREATER_EQUAL, _EQUAL, _UNEQUAL, _AND, _OR, _NOT, _AGE) = range(21)
assert _AGE == conditions.AGE


def number_kind(dtype: np.dtype) -> int:
    """How a number of a record is read."""
    return _KINDS.get(dtype.str, _WHOLE.get(dtype.kind))


@compiled
def number_at(address, kind, width):
    """A number of a record as a float64. width: of a whole number [bytes]."""
    if kind == DOUBLE:
        return double_at(address)
    if kind == SINGLE:
        return float(single_at(address))
    if width == 8:
        return float(word_at(address))
    word = 0
    for i in range(width):
        word |= byte_at(address + i) << (8 * i)
    if kind == SIGNED and word >= 1 << (8 * width - 1):
        word -= 1 << (8 * width)
    return float(word)


@compiled
def _two(op, a, b):
    """An elementary step of two values."""
    if op == _ADD:
        return a + b
    if op == _SUBTRACT:
        return a - b
    if op == _MULTIPLY:
        return a * b
    if op == _DIVIDE:
        return a / b if b != 0.0 else np.nan
    if op == _MIN:
        return a if a < b else b
    if op == _MAX:
        return a if a > b else b
    if op == _AND:
        return 1.0 if a != 0.0 and b != 0.0 else 0.0
    if op == _OR:
        return 1.0 if a != 0.0 or b != 0.0 else 0.0
    met = ((op == _LESS and a < b) or (op == _LESS_EQUAL and a <= b) or (op == _GREATER and a > b)
           or (op == _GREATER_EQUAL and a >= b) or (op == _EQUAL and a == b) or (op == _UNEQUAL and a != b))
    return 1.0 if met else 0.0


@compiled
def _age(stamp_at, epoch_ns, t_ns):
    """The age [s] of a message by its stamp (sec, nanosec); of one that never came, the time since the start."""
    word = word_at(stamp_at)
    if word == 0:
        return t_ns / SECOND
    sec, nanosec = word & 0xFFFFFFFF, word >> 32
    return (epoch_ns + t_ns - (sec * 1000000000 + nanosec)) / SECOND


@compiled
def holds(at, end, t_ns):
    """Whether a condition holds."""
    value = 0.0
    while at < end:
        step = row(at, STEP)
        op = step.op
        if op == _CONSTANT:
            value = step.constant
        elif op == _TIME:
            value = t_ns / SECOND
        elif op == _READ:
            value = number_at(step.address, step.kind, step.width)
        elif op == _AGE:
            value = _age(step.address, step.epoch_ns, t_ns)
        else:
            a = row(step.a, STEP).value
            if op == _NEGATE:
                value = -a
            elif op == _ABS:
                value = abs(a)
            elif op == _NOT:
                value = 1.0 if a == 0.0 else 0.0
            else:
                value = _two(op, a, row(step.b, STEP).value)
        step.value = value
        at += STEP_SIZE
    return value != 0.0
