"""Reading operators: whole numbers keep their range, values follow the rules of `flight_math`, arrays have none."""

import ast
import operator
from functools import cache

import numpy as np

from flight_graph.components.kernel_rules import library
from flight_graph.components.kernel_rules.kinds import (
    NOTHING,
    NUMBER,
    TRUTH,
    UNKNOWN,
    Array,
    Items,
    Kind,
    Number,
    Record,
    Text,
    Value,
)
from flight_graph.components.kernel_rules.scope import Scope
from flight_math.errors import KernelError

_OPERATORS = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.MatMult: operator.matmul, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.BitAnd: operator.and_, ast.BitOr: operator.or_,
    ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Invert: operator.invert,
}
_SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.MatMult: "@", ast.Pow: "**", ast.Mod: "%",
          ast.FloorDiv: "//"}


_NOT_OF_TRUTHS = (ast.Add, ast.Sub, ast.USub, ast.UAdd, ast.LShift, ast.RShift, ast.FloorDiv, ast.Mod)


def operation(scope: Scope, node: ast.AST, sign: ast.AST, *kinds: Kind) -> Kind:
    """The kind of an operator's result."""
    sign = type(sign)
    if sign in (ast.Is, ast.IsNot) and all(isinstance(kind, (Number, Value, Array, Record)) for kind in kinds):
        instead = "==" if sign is ast.Is else "!="
        return scope.report(node, f"{ast.unparse(node)}: 'is' tells no numbers apart; write {instead}")
    if any(isinstance(kind, Text) for kind in kinds) and UNKNOWN not in kinds:
        return _texts(scope, node, sign, kinds)
    if any(isinstance(kind, Record) for kind in kinds) and sign not in (ast.Is, ast.IsNot):
        record = next(kind for kind in kinds if isinstance(kind, Record))
        return scope.report(node, f"{ast.unparse(node)}: {record} is no number; compute with its fields")
    if any(kind == NOTHING for kind in kinds):
        return scope.report(node, f"{ast.unparse(node)}: one of the two is a kernel that returns nothing")
    if sign is ast.Pow:
        _power(scope, node, kinds)
    if any(isinstance(kind, Array) for kind in kinds):
        return _arrays(scope, node, sign, kinds)
    if any(isinstance(kind, Value) for kind in kinds):
        return _values(scope, node, sign, kinds)
    if all(isinstance(kind, Number) for kind in kinds):
        if sign in _NOT_OF_TRUTHS and all(kind.of is bool for kind in kinds):
            return scope.report(node, f"{ast.unparse(node)}: a truth is no number to compute with, and differs there "
                                      "between compiled and plain Python; write int(...) of it")
        return _numbers(sign, kinds)
    return TRUTH if issubclass(sign, ast.cmpop) else UNKNOWN


def _texts(scope, node, sign, kinds):
    if issubclass(sign, ast.cmpop):
        choice = next((kind for kind in kinds if isinstance(kind, Number) and kind.words), None)
        text = next(kind.text for kind in kinds if isinstance(kind, Text))
        if choice is not None:
            numbers = ", ".join(f"{number} '{word}'" for number, word in enumerate(choice.words))
            return scope.report(node, f"a Choice is the number of its word in a kernel ({numbers}); compare with that")
        return scope.report(node, f"a kernel compares no texts ('{text}'); it has numbers alone")
    return scope.report(node, f"{ast.unparse(node)} makes a text, {library.NO_TEXT}")


def _power(scope, node, kinds):
    exponent = kinds[-1]
    if isinstance(exponent, Number) and all(isinstance(kind, Number) and kind.of is int for kind in kinds):
        return
    scope.forbid(node, library.libm_operator(ast.unparse(node)))


def _arrays(scope, node, sign, kinds):
    written = ast.unparse(node)
    if sign is ast.MatMult and all(isinstance(kind, (Array, Value)) for kind in kinds):
        return scope.forbid(node, f"{written} calls BLAS on arrays, whose order of sums differs between machines; make "
                                  "values of them first: mat3(a) @ vec3(b), from flight_math")
    if all(isinstance(kind, (Array, Number, Value)) for kind in kinds):
        return scope.forbid(node, f"{written}: an operation on a whole array allocates memory, which no kernel may; make "
                                  "values of arrays first: vec3(a), mat3(a), from flight_math, or write a loop")
    return UNKNOWN


def _numbers(sign, kinds):
    if issubclass(sign, ast.cmpop):
        return TRUTH
    types = {kind.of for kind in kinds}
    if sign is ast.Div:
        return Number(float)
    known = Number(float) if float in types and None not in types else Number(int) if types == {int} else NUMBER
    if types != {int} or any(kind.low is None for kind in kinds):
        return known
    if sign is ast.USub:
        return Number(int, -kinds[0].high, -kinds[0].low, kinds[0].loops)
    if len(kinds) != 2 or kinds[0].loops & kinds[1].loops or sign not in (ast.Add, ast.Sub, ast.Mult):
        return known
    ends = [_OPERATORS[sign](a, b) for a in (kinds[0].low, kinds[0].high) for b in (kinds[1].low, kinds[1].high)]
    return Number(int, min(ends), max(ends), kinds[0].loops | kinds[1].loops)


def _values(scope, node, sign, kinds):
    """The operator applied to samples, in plain Python: the library itself knows its rules and its sentences."""
    if not all(isinstance(kind, (Value, Number)) for kind in kinds):
        if any(isinstance(kind, Items) for kind in kinds):
            return scope.report(node, f"{ast.unparse(node)}: a tuple does not compute; make a value of it, Vec3(...)")
        return UNKNOWN
    function = _OPERATORS.get(sign)
    if function is None:
        if sign in _SIGNS:
            value = next(kind for kind in kinds if isinstance(kind, Value))
            return scope.report(node, f"{ast.unparse(node)}: {value} has no {_SIGNS[sign]}; it has + - * / @ and "
                                      "comparisons")
        return UNKNOWN
    result = sampled(function, kinds)
    if isinstance(result, str):
        return scope.report(node, f"{ast.unparse(node)}: {result}")
    return result


@cache
def sampled(function, kinds: tuple) -> Kind | str:
    """The kind that a function of values gives for these kinds, or the sentence with which it refuses them."""
    try:
        with np.errstate(all="ignore"):
            return kind_of_object(function(*map(_sample, kinds)))
    except KernelError as error:
        return error.sentence
    except Exception:  # a sample that the function was not made for tells nothing
        return UNKNOWN


def _sample(kind):
    if isinstance(kind, Value):
        return kind.value.of([1.0] * kind.value.count)
    return {bool: True, int: 1}.get(kind.of, 1.0)


def kind_of_object(value) -> Kind:
    """The kind of a result in plain Python."""
    if hasattr(type(value), "count") and hasattr(type(value), "title"):
        return Value(type(value))
    if isinstance(value, (bool, np.bool_)):
        return TRUTH
    if isinstance(value, (int, float, np.number)):
        return Number(float if isinstance(value, float) else int)
    if isinstance(value, tuple):
        return Items(tuple(map(kind_of_object, value)))
    return UNKNOWN
