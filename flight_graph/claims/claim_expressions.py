"""Expressions of the claims tables: arithmetic over ``run.metric``.

Allowed are numbers, ``run.metric``, + - * /, comparisons, and, or, not, and the functions abs, min, max, mean, count. A
metric of a run that was made several times (cases of a sweep) is a `Several`: arithmetic works on each of its values,
min, max, mean and count (how many are true) reduce it to one. A metric that is not there is ``None``, and so is
everything that would need it.
"""

import ast
import operator

from flight_graph.errors import FlightError, unknown
from flight_graph.syntax import parse


class Several(dict):
    """One value for each case: label of the case -> value."""


_BINARY = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
_COMPARE = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
            ast.NotEq: operator.ne}
_FUNCTIONS = {"abs": abs, "min": min, "max": max, "mean": lambda *values: sum(values) / len(values),
              "count": lambda *values: sum(map(bool, values))}


def names(expression: str) -> set[str]:
    """The runs that an expression names."""
    return {node.value.id for node in ast.walk(_parse(expression))
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)}


def evaluate(expression: str, results: dict):
    """The value of an expression over results: run -> {metric: value}, or run -> Several of {metric: value}."""
    try:
        return _value(_parse(expression).body, results, expression)
    except (TypeError, ZeroDivisionError):
        return None  # arithmetic with what is missing


def _parse(expression):
    try:
        return parse(expression.strip(), mode="eval")
    except SyntaxError:
        raise FlightError(f"claims: '{expression}' is no expression") from None


def _value(node, results, text):
    match node:
        case ast.Constant(value=bool() | int() | float() | None):
            return node.value
        case ast.Attribute(value=ast.Name(id=run), attr=metric):
            return _metric(results[run], metric, text)
        case ast.BinOp() if type(node.op) in _BINARY:
            return _apply(_BINARY[type(node.op)], _value(node.left, results, text), _value(node.right, results, text))
        case ast.UnaryOp(op=ast.USub()):
            return _apply(operator.neg, _value(node.operand, results, text))
        case ast.UnaryOp(op=ast.Not()):
            return _apply(operator.not_, _value(node.operand, results, text))
        case ast.BoolOp():
            both = all if isinstance(node.op, ast.And) else any
            return _apply(lambda *parts: both(parts), *[_value(part, results, text) for part in node.values])
        case ast.Compare():
            sides = [_value(part, results, text) for part in [node.left, *node.comparators]]
            tests = [_COMPARE[type(op)] for op in node.ops if type(op) in _COMPARE]
            if len(tests) == len(node.ops):
                return _apply(lambda *values: all(test(a, b) for test, a, b in zip(tests, values, values[1:])), *sides)
        case ast.Call(func=ast.Name(id=name), keywords=[]) if name in _FUNCTIONS:
            return _call(_FUNCTIONS[name], [_value(part, results, text) for part in node.args])
    raise FlightError(f"claims: '{text}': allowed are numbers, run.metric, + - * /, comparisons, and, or, not, "
                      f"{', '.join(_FUNCTIONS)}")


def _call(function, arguments):
    if function is not abs and len(arguments) == 1:
        several = arguments[0]
        return function(*(several.values() if isinstance(several, Several) else [several]))
    return _apply(function, *arguments)


def _apply(function, *operands):
    several = [operand for operand in operands if isinstance(operand, Several)]
    if not several:
        return function(*operands)
    found = Several()
    for label in several[0]:
        try:
            found[label] = function(*(one[label] if isinstance(one, Several) else one for one in operands))
        except (TypeError, ZeroDivisionError):
            found[label] = None
        except KeyError:
            raise FlightError(f"claims: runs with different cases cannot be combined; '{label}' is missing") from None
    return found


def _metric(found, metric, text):
    if not isinstance(found, Several):
        return _of_one(found, metric, text)
    made = [one for one in found.values() if not one.get("stopped")]
    if made and not any(metric in one for one in made):
        raise unknown("metric", metric, made[0], f"claims: {text}")
    return Several({label: one.get(metric) for label, one in found.items()})


def _of_one(found, metric, text):
    if metric not in found and not found.get("stopped"):
        raise unknown("metric", metric, found, f"claims: {text}")
    return found.get(metric)
