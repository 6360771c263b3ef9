"""Numbers that a formula is written in: Python's floats, or registers of a kernel that is being compiled.

A formula of this package is a Python function of rows of numbers. Called with floats it computes; called with `Symbol`s
it emits one instruction for each operation, in the same order: the bits are the same by construction.
"""

import math

from llvmlite import ir

DOUBLE = ir.DoubleType()


class Symbol:
    """A float64 register of the kernel that ``builder`` writes."""

    __slots__ = ("builder", "value")

    def __init__(self, builder, value):
        self.builder, self.value = builder, value

    def _emit(self, instruction, left, right):
        return Symbol(self.builder, getattr(self.builder, instruction)(register(left), register(right)))

    def _compare(self, sign, other):
        compare = self.builder.fcmp_unordered if sign == "!=" else self.builder.fcmp_ordered
        return TruthSymbol(self.builder, compare(sign, self.value, register(other)))

    def __add__(self, other):
        return self._emit("fadd", self, other)

    def __sub__(self, other):
        return self._emit("fsub", self, other)

    def __mul__(self, other):
        return self._emit("fmul", self, other)

    def __radd__(self, other):
        return self._emit("fadd", other, self)

    def __rsub__(self, other):
        return self._emit("fsub", other, self)

    def __rmul__(self, other):
        return self._emit("fmul", other, self)

    def __neg__(self):
        return Symbol(self.builder, self.builder.fneg(self.value))

    def __lt__(self, other):
        return self._compare("<", other)

    def __le__(self, other):
        return self._compare("<=", other)

    def __gt__(self, other):
        return self._compare(">", other)

    def __ge__(self, other):
        return self._compare(">=", other)

    def __eq__(self, other):
        return self._compare("==", other)

    def __ne__(self, other):
        return self._compare("!=", other)

    __hash__ = None


class TruthSymbol:
    """A one-bit register of the kernel that ``builder`` writes."""

    __slots__ = ("builder", "value")

    def __init__(self, builder, value):
        self.builder, self.value = builder, value

    def __and__(self, other):
        return TruthSymbol(self.builder, self.builder.and_(self.value, other.value))

    def __or__(self, other):
        return TruthSymbol(self.builder, self.builder.or_(self.value, other.value))

    def __xor__(self, other):
        return TruthSymbol(self.builder, self.builder.xor(self.value, other.value))


def register(number):
    """The register of a Symbol; of a Python number, the constant."""
    return number.value if isinstance(number, Symbol) else ir.Constant(DOUBLE, float(number))


def quotient(a, b):
    """a / b as IEEE has it: inf or NaN where b is zero."""
    for number in (a, b):
        if isinstance(number, Symbol):
            return number._emit("fdiv", a, b)
    try:
        return a / b
    except ZeroDivisionError:
        return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _intrinsic(name, number):
    function = number.builder.module.declare_intrinsic(f"llvm.{name}", [DOUBLE])
    return Symbol(number.builder, number.builder.call(function, [number.value]))


def root(number):
    """The square root; NaN of a negative number."""
    if isinstance(number, Symbol):
        return _intrinsic("sqrt", number)
    if not isinstance(number, float):
        return number ** 0.5
    return math.sqrt(number) if number >= 0.0 else math.nan


def magnitude(number):
    """|number|"""
    return _intrinsic("fabs", number) if isinstance(number, Symbol) else abs(number)


def choose(truth, a, b):
    """a where the truth holds, b elsewhere."""
    if isinstance(truth, TruthSymbol):
        return Symbol(truth.builder, truth.builder.select(truth.value, register(a), register(b)))
    return a if truth else b


def opposite(truth):
    """Not the truth."""
    return TruthSymbol(truth.builder, truth.builder.not_(truth.value)) if isinstance(truth, TruthSymbol) else not truth


def how_many(truths):
    """The number of true ones, an int or an int64 register."""
    if not isinstance(truths[0], TruthSymbol):
        return sum(map(int, truths))
    builder, word = truths[0].builder, ir.IntType(64)
    total = ir.Constant(word, 0)
    for truth in truths:
        total = builder.add(total, builder.zext(truth.value, word))
    return total
