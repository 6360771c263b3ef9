"""Operators of values: component by component with an equal kind or a number, ``@`` for products, ``*`` of quaternions."""

import builtins
import functools
import operator

from flight_math.values.classes import (
    DualQuaternion,
    Mat,
    Quaternion,
    Value,
    Vec,
    is_mask,
    is_matrix,
    is_vector,
    kind_name,
    kind_of,
    mask_of,
)
from flight_math.values.operation import computed, register, resolver
from flight_math.values.symbols import magnitude, opposite, quotient

COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")


# -- formulas --------------------------------------------------------------------------------------------------------------
def rows(*arguments):
    """Arguments of a formula as rows of one length: a number stands for each component."""
    count = max(len(argument) for argument in arguments if isinstance(argument, (tuple, list)))
    return [argument if isinstance(argument, (tuple, list)) else (argument,) * count for argument in arguments]


def by_component(function):
    """The formula that applies a function of numbers to each component."""
    return lambda *arguments: tuple(map(function, *rows(*arguments)))


def hamilton(a, b):
    """Product of two quaternions."""
    return (a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
            a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
            a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
            a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2])


def dual_hamilton(a, b):
    """Product of two dual quaternions: a b + eps (a b' + a' b)."""
    turned, moved = hamilton(a[:4], b[4:]), hamilton(a[4:], b[:4])
    return (*hamilton(a[:4], b[:4]), *(first + second for first, second in zip(turned, moved)))


def dot_product(a, b):
    """Sum of products, from the first component to the last."""
    total = a[0] * b[0]
    for i in range(1, len(a)):
        total = total + a[i] * b[i]
    return total


def matrix_product(columns: int, width: int):
    """The formula of a matrix of ``columns`` columns times a matrix of ``width`` columns, or a vector (1)."""
    def product(a, b):
        return tuple(dot_product(a[i:i + columns], b[j::width]) for i in range(0, len(a), columns) for j in range(width))
    return product


# -- rules -----------------------------------------------------------------------------------------------------------------
def linear(a, b):
    """An equal kind, or a number beside a value: the kind of the result."""
    if is_mask(a) or is_mask(b) or bool in (a, b) or None in (a, b):
        return None
    return a if a is b or b is float else b if a is float else None


def _product(a, b):
    """*: vectors by component, quaternions by Hamilton's product, a number with anything."""
    if a is b and not is_vector(a):
        formula = {Quaternion: hamilton, DualQuaternion: dual_hamilton}.get(a)
        return (a, formula) if formula else None
    return (linear(a, b), by_component(operator.mul)) if linear(a, b) else None


def _quotient(a, b):
    return None if a is b and not is_vector(a) else linear(a, b)


def _matrix_product(a, b):
    if is_vector(a) and a is b:
        return float, dot_product
    if is_matrix(a) and is_vector(b) and a.shape[1] == b.count:
        return Vec(a.shape[0]), matrix_product(b.count, 1)
    if is_matrix(a) and is_matrix(b) and a.shape[1] == b.shape[0]:
        return Mat(a.shape[0], b.shape[1]), matrix_product(*b.shape)
    return None


def _comparison(a, b):
    kind = a if is_vector(a) else b
    return mask_of(kind.count) if is_vector(kind) and {a, b} <= {kind, float} else None


def _masks(a, b):
    return a if is_mask(a) and a is b else None


def _signed(a):
    return None if is_mask(a) else a


def _reduced(a):
    return bool if is_mask(a) else None


# -- sentences -------------------------------------------------------------------------------------------------------------
def advice(sign: str, kinds) -> str:
    """What is allowed in place of an operation that was refused."""
    known = next(kind for kind in kinds if is_mask(kind) or is_vector(kind) or hasattr(kind, "letters"))
    if is_mask(known):
        return "allowed with truths: & | ~, any(...), all(...), count(...), where(...)"
    if sign == "@":
        return "allowed are Vec3 @ Vec3 (the dot product), Mat3 @ Vec3, Mat3 @ Mat3, and Mat(n, m) with what fits it"
    if sign in COMPARISONS:
        return "compared are vectors of one kind, or a vector and a number"
    if sign == "*" and any(map(is_matrix, kinds)):
        return "a product of matrices is written @; allowed with * is a number"
    if sign == "*" and Quaternion in kinds and any(map(is_vector, kinds)):
        return "a vector is turned by rotate(q, v); allowed with a Quaternion are a Quaternion and a number"
    other = "a number" if sign == "/" and not is_vector(known) else f"another {kind_name(known)} and a number"
    return f"allowed with a {kind_name(known)}: {other}"


def mismatch(sign: str, names, kinds) -> str:
    """The sentence for operands that do not go together."""
    written = f" {sign} ".join(names) if len(names) > 1 else f"{sign}({names[0]})"
    return f"{written} is not defined; {advice(sign, kinds)}"


# -- the operators ---------------------------------------------------------------------------------------------------------
def _operator(sign, name, rule, formula=None, inplace=None):
    """Give Python's classes and numba an operator."""
    resolve = resolver(rule, formula)
    keys = [getattr(operator, name), *([getattr(operator, inplace)] if inplace else [])]
    register(keys, resolve, lambda names, kinds: mismatch(sign, names, kinds), False)

    def forward(*args):
        return computed(resolve, args, lambda names: mismatch(sign, names, tuple(map(kind_of, args))))

    method = name.strip("_")
    setattr(Value, f"__{method}__", forward)
    if inplace and sign not in COMPARISONS:
        setattr(Value, f"__r{method}__", lambda self, other: forward(other, self))


for _sign, _name, _rule, _formula in (
        ("+", "add", linear, by_component(operator.add)), ("-", "sub", linear, by_component(operator.sub)),
        ("*", "mul", _product, None), ("/", "truediv", _quotient, by_component(quotient)),
        ("@", "matmul", _matrix_product, None)):
    _operator(_sign, _name, _rule, _formula, f"i{_name}")
for _sign, _name in zip(COMPARISONS, ("lt", "le", "gt", "ge", "eq", "ne")):
    _operator(_sign, _name, _comparison, by_component(getattr(operator, _name)))
for _sign, _name in (("&", "and_"), ("|", "or_")):
    _operator(_sign, _name, _masks, by_component(getattr(operator, _name)))
_operator("-", "neg", _signed, by_component(operator.neg))
_operator("~", "invert", lambda a: a if is_mask(a) else None, by_component(opposite))


def _builtin(function, name, rule, formula):
    """Give numba one of Python's functions of one value."""
    resolve = resolver(rule, formula)

    def refusal(names, kinds):
        return mismatch(name, names, kinds)
    register([function], resolve, refusal, False)
    return lambda value: computed(resolve, (value,), lambda names: refusal(names, (kind_of(value),)))


def _conjunction(a):
    return functools.reduce(operator.and_, a)


def _disjunction(a):
    return functools.reduce(operator.or_, a)


Value.__abs__ = _builtin(abs, "abs", _signed, by_component(magnitude))
_builtin(builtins.any, "any", _reduced, _disjunction)
_builtin(builtins.all, "all", _reduced, _conjunction)
