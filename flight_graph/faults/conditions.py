"""Conditions over signals: ``plant.truth.rates[0] > 0.1 and t < 30``, as a list of elementary steps.

A step computes one float64 from earlier ones, so that a run in machine code and one in plain Python take the same road.
Allowed are numbers, fields of outputs (``component.output.field[i]``; ``output.field[i]`` where one component alone has
such an output), ``t`` [s], ``age(component.output)`` [s] of its newest message, + - * /, comparisons, and, or, not, abs,
min and max. A signal is read as it was before the tick: the newest message stamped before it.
"""

import ast
from dataclasses import dataclass

import numpy as np

from flight_graph.components import names
from flight_graph.errors import FlightError, unknown
from flight_graph.faults import places
from flight_graph.syntax import parse
from flight_graph.text_files import short

CONSTANT, TIME, READ, ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE, ABS, MIN, MAX = range(11)
LESS, LESS_EQUAL, GREATER, GREATER_EQUAL, EQUAL, UNEQUAL, AND, OR, NOT, AGE = range(11, 21)
_BINARY = {ast.Add: ADD, ast.Sub: SUBTRACT, ast.Mult: MULTIPLY, ast.Div: DIVIDE}
_COMPARE = {ast.Lt: LESS, ast.LtE: LESS_EQUAL, ast.Gt: GREATER, ast.GtE: GREATER_EQUAL, ast.Eq: EQUAL, ast.NotEq: UNEQUAL}
_FUNCTIONS = {"abs": (ABS, 1), "min": (MIN, 2), "max": (MAX, 2)}
_ALLOWED = ("numbers, component.output.field[i], t, age(component.output), + - * /, comparisons, and, or, not, abs, min, "
            "max")
MOST_STEPS = 200


@dataclass(frozen=True)
class Step:
    """One elementary step. a, b: numbers of earlier steps; constant: of CONSTANT; signal, field: of READ and AGE.

    signal: (node, port); None for a number of the record that the condition decides about.
    """

    op: int
    a: int = 0
    b: int = 0
    constant: float = 0.0
    signal: tuple[str, str] | None = None
    field: places.Field | None = None


@dataclass(frozen=True)
class Condition:
    """The steps of a condition; the last one's value decides. signals: the (node, port) that it reads."""

    text: str
    steps: tuple[Step, ...]

    @property
    def signals(self) -> list[tuple[str, str]]:
        return list(dict.fromkeys(step.signal for step in self.steps if step.signal))


def condition(text: str, nodes: dict, where: str, own: dict[str, places.Field] | None = None) -> Condition:
    """A condition over the outputs of a graph. nodes: name, as the text has it -> node; own: numbers of the record that it
    decides about, by name.

    Raises FlightError.
    """
    try:
        tree = parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FlightError(f"{where}: '{short(text)}' is no expression; allowed: {_ALLOWED}") from None
    maker = _Maker(nodes, where, text, own or {})
    maker.add(tree.body)
    return Condition(text, tuple(maker.steps))


class _Maker:
    def __init__(self, nodes, where, text, own):
        self._nodes, self._where, self._text, self._own, self.steps, self._depth = nodes, where, text, own, [], 0

    def _refuse_longer(self, steps):
        if steps > MOST_STEPS:
            raise FlightError(f"{self._where}: '{short(self._text)}' takes more than {MOST_STEPS} steps")

    def _step(self, *arguments, **options) -> int:
        self._refuse_longer(len(self.steps) + 1)
        self.steps.append(Step(*arguments, **options))
        return len(self.steps) - 1

    def add(self, node) -> int:
        """Add the steps of a node; return the number of the one that has its value."""
        self._depth += 1
        self._refuse_longer(self._depth)
        try:
            return self._add(node)
        finally:
            self._depth -= 1

    def _add(self, node) -> int:
        match node:
            case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
                return self._constant(node.value)
            case ast.Name(id="t"):
                return self._step(TIME)
            case ast.Name() if self._own:
                if node.id not in self._own:
                    raise unknown("watchpoint", node.id, self._own, self._where)
                return self._step(READ, field=self._own[node.id])
            case ast.Call(func=ast.Name(id="age"), args=[ast.Attribute() as message], keywords=[]):
                return self._age(ast.unparse(message))
            case ast.BinOp() if type(node.op) in _BINARY:
                return self._two(_BINARY[type(node.op)], node.left, node.right)
            case ast.UnaryOp(op=ast.USub()):
                return self._step(NEGATE, self.add(node.operand))
            case ast.UnaryOp(op=ast.Not()):
                return self._step(NOT, self.add(node.operand))
            case ast.BoolOp():
                return self._chain(AND if isinstance(node.op, ast.And) else OR, [self.add(part) for part in node.values])
            case ast.Compare() if all(type(op) in _COMPARE for op in node.ops):
                sides = [self.add(part) for part in [node.left, *node.comparators]]
                return self._chain(AND, [self._step(_COMPARE[type(op)], a, b)
                                         for op, a, b in zip(node.ops, sides, sides[1:])])
            case ast.Call(func=ast.Name(id=name), keywords=[]) if name in _FUNCTIONS:
                op, count = _FUNCTIONS[name]
                if len(node.args) < count or (count == 1 and len(node.args) > 1):
                    raise FlightError(f"{self._where}: {name} takes {'one value' if count == 1 else 'two or more values'}")
                return self._chain(op, [self.add(part) for part in node.args]) if count > 1 else self._step(
                    op, self.add(node.args[0]))
            case ast.Attribute() | ast.Subscript():
                return self._read(ast.unparse(node))
        raise FlightError(f"{self._where}: '{short(ast.unparse(node))}' is not allowed in a condition; allowed: {_ALLOWED}")

    def _constant(self, value):
        try:
            number = float(value)
        except OverflowError:
            number = float("inf")
        if not np.isfinite(number):
            raise FlightError(f"{self._where}: {short(str(value))} is no finite number")
        return self._step(CONSTANT, constant=number)

    def _two(self, op, left, right):
        a = self.add(left)
        return self._step(op, a, self.add(right))

    def _chain(self, op, parts):
        last = parts[0]
        for part in parts[1:]:
            last = self._step(op, last, part)
        return last

    def _read(self, text):
        text = text.replace(" ", "")
        node, port, path = self._signal(text)
        where = f"{self._where}: {node}.{port}"
        if not path:
            raise FlightError(f"{where}: this is a message; name a number of it")
        field = places.entry(self._nodes[node].component.outputs[port].dtype, path, where)
        if field.count != 1:
            raise FlightError(f"{where}: {path} has {field.count} numbers; name one: {path}[0]")
        if field.dtype.str == "<u8":
            raise FlightError(f"{where}: {path} is a whole number of 64 bits without sign, which no float64 holds")
        return self._step(READ, signal=(self._nodes[node].name, port), field=field)

    def _age(self, text):
        node, port, path = self._signal(text)
        if path:
            raise FlightError(f"{self._where}: age is of messages; write age({node}.{port})")
        signal = self._nodes[node].component.outputs[port]
        stamp = places.entry(signal.dtype, f"{signal.stamp_path}.sec", self._where)
        return self._step(AGE, signal=(self._nodes[node].name, port), field=stamp)

    def _signal(self, text):
        first, rest = names.split(text, self._nodes)
        port, _, path = rest.partition(".")
        if first in self._nodes:
            outputs = self._nodes[first].component.outputs
            if port not in outputs:
                raise unknown("output", port, outputs, f"{self._where}: {first}")
            return first, port, path
        owners = [name for name, node in self._nodes.items() if first in node.component.outputs]
        if len(owners) == 1:
            return owners[0], first, rest
        known = {*self._nodes, *(port for node in self._nodes.values() for port in node.component.outputs)}
        if owners:
            raise FlightError(f"{self._where}: {' and '.join(owners)} have an output {first}; write {owners[0]}.{text}")
        raise unknown("signal", first, known, self._where)
