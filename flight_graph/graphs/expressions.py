"""Parameters that follow from other components: ``gravity: "= plant.gravity"`` in a scenario or behind ``--set``.

What stands behind the equals sign is arithmetic (+ - * / **), the functions and pi below, lists, and parameters of
other components, ``component.parameter`` or ``component.parameter[0]``, of a vehicle's ``rover_a.plant.gravity``. It is
worked out once, before the run, from the other component's final values; the bag carries the number.
"""

import ast
import math
import operator
from functools import lru_cache

from flight_graph.components import names
from flight_graph.errors import FlightError, unknown
from flight_graph.syntax import parse
from flight_graph.text_files import short
from flight_math import elementary
from flight_math.uncompiled import uncompiled

LONGEST = 1000  # characters of an expression
_WHOLE_BITS = 64  # of a power that stays a whole number


def _power(base, exponent):
    """base^exponent, the same on every machine; whole numbers stay whole."""
    whole = isinstance(base, int) and isinstance(exponent, int) and abs(exponent) * base.bit_length() <= _WHOLE_BITS
    return base**exponent if whole else uncompiled(elementary.power)(float(base), float(exponent))


FUNCTIONS = {"sqrt": math.sqrt,
             **{name: uncompiled(getattr(elementary, name)) for name in ("sin", "cos", "tan", "atan", "exp")},
             "radians": math.radians, "abs": abs, "min": min, "max": max}
_OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
              ast.Pow: _power, ast.USub: operator.neg, ast.UAdd: operator.pos}


def is_expression(value) -> bool:
    """Whether a parameter's value is to be worked out."""
    return isinstance(value, str) and value.lstrip().startswith("=")


def references(text: str, components, where: str) -> set[str]:
    """Names of the components that an expression reads. components: the names that there are."""
    paths = {path for node in ast.walk(_parsed(text, where)) if (path := _path(node)) and "." in path}
    return {names.split(path, components)[0] for path in paths
            if not any(other.startswith(f"{path}.") for other in paths)}


def evaluate(text: str, components: dict[str, dict], where: str):
    """The expression's value: a number or a list. components: name -> parameters in plain form."""
    try:
        found = _value(_parsed(text, where).body, components, where)
        if not all(math.isfinite(value) for value in (found if isinstance(found, list) else [found])
                   if isinstance(value, float)):
            raise ValueError("it is not finite")
        return found
    except (ArithmeticError, ValueError, TypeError, IndexError, OverflowError, RecursionError) as error:
        if isinstance(error, FlightError):
            raise
        raise FlightError(f"{where}: '{short(text)}' has no value: {short(str(error))}") from None


@lru_cache(1000)
def _parsed(text, where):
    try:
        if len(text) > LONGEST:
            raise ValueError
        return parse(text.lstrip().removeprefix("=").strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FlightError(f"{where}: '{short(text)}' is no expression of at most {LONGEST} characters; write for example "
                          "'= 2 * plant.gravity'") from None


def _path(node) -> str:
    """``a.b.c`` of words with dots between them; nothing of anything else."""
    if isinstance(node, ast.Name):
        return node.id
    above = _path(node.value) if isinstance(node, ast.Attribute) else ""
    return f"{above}.{node.attr}" if above else ""


def _number(node, components, where):
    """A value that arithmetic takes: a list is taken apart first, ``plant.inertia[0]``."""
    found = _value(node, components, where)
    if type(found) not in (int, float):
        raise TypeError(f"'{short(ast.unparse(node), 40)}' is {type(found).__name__} and no number; of a list name the "
                        "entry, as in plant.inertia[0]")
    return found


def _value(node, components, where):
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return node.value
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.List):
        return [_value(item, components, where) for item in node.elts]
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_number(node.operand, components, where))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_number(node.left, components, where), _number(node.right, components, where))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in FUNCTIONS:
            raise unknown("function", node.func.id, FUNCTIONS, where)
        return FUNCTIONS[node.func.id](*[_value(item, components, where) for item in node.args])
    if isinstance(node, ast.Subscript):
        return _value(node.value, components, where)[_value(node.slice, components, where)]
    if isinstance(node, ast.Attribute) and (path := _path(node)):
        name, parameter = names.split(path, components)
        if name not in components:
            raise unknown("component", name, components, where)
        if parameter not in components[name]:
            raise unknown("parameter", parameter, components[name], f"{where}: {name}")
        return components[name][parameter]
    raise FlightError(f"{where}: '{short(ast.unparse(node))}' is not allowed in an expression; allowed: numbers, + - * / "
                      f"**, {', '.join(FUNCTIONS)}, pi, lists and component.parameter")
