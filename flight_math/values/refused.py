"""Functions of Python and NumPy that do not take values, and what to write instead."""

import builtins
import math
import operator

import numpy as np
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global

from flight_math.errors import refuse
from flight_math.values.classes import Value, described
from flight_math.values.compiled_types import ValueType, type_name
from flight_math.values.refusals import refuse_compiled

_SAME_NAME = ("sin", "cos", "tan", "exp", "expm1", "log", "log1p", "tanh", "sqrt")

INSTEAD = {
    operator.pow: ("**", "v * v, or power(v, n)"),
    operator.floordiv: ("//", "/"),
    operator.mod: ("%", "an @elementwise kernel"),
    operator.pos: ("+", "v itself"),
    builtins.max: ("max", "largest(v), or maximum(a, b) by component"),
    builtins.min: ("min", "smallest(v), or minimum(a, b) by component"),
    builtins.sum: ("sum", "total(v)"),
    builtins.round: ("round", "an @elementwise kernel"),
    builtins.float: ("float", "one component, v.x or v[i]"),
    builtins.int: ("int", "one component, v.x or v[i]"),
    builtins.tuple: ("tuple", "the components one by one"),
    math.asin: ("math.asin", "asin(v)"),
    math.acos: ("math.acos", "acos(v)"),
    math.atan: ("math.atan", "atan(v)"),
    math.atan2: ("math.atan2", "atan2(y, x)"),
    math.hypot: ("math.hypot", "norm(v)"),
    math.fabs: ("math.fabs", "abs(v)"),
    math.pow: ("math.pow", "power(v, n)"),
    math.isfinite: ("math.isfinite", "a comparison, all(abs(v) < limit)"),
    math.isnan: ("math.isnan", "any(v != v)"),
    np.dot: ("np.dot", "a @ b"),
    np.cross: ("np.cross", "cross(a, b)"),
    np.linalg.norm: ("np.linalg.norm", "norm(v)"),
    np.sum: ("np.sum", "total(v)"),
    np.clip: ("np.clip", "clip(v, low, high)"),
    np.where: ("np.where", "where(mask, a, b)"),
    np.any: ("np.any", "any(mask)"),
    np.all: ("np.all", "all(mask)"),
    np.abs: ("np.abs", "abs(v)"),
    np.sign: ("np.sign", "sign(v)"),
    np.minimum: ("np.minimum", "minimum(a, b)"),
    np.maximum: ("np.maximum", "maximum(a, b)"),
    np.outer: ("np.outer", "outer(a, b)"),
    np.array: ("np.array", "Vec3(x, y, z), or stack_array(n)"),
    **{getattr(math, name): (f"math.{name}", f"{name}(v) of flight_math") for name in _SAME_NAME},
    **{getattr(np, name): (f"np.{name}", f"{name}(v) of flight_math") for name in _SAME_NAME},
}
"""Function -> (its name, what to write instead)."""


def _refuse_values(function, name, instead):
    class Template(AbstractTemplate):
        key = function

        def generic(self, args, kws):
            if any(isinstance(argument, ValueType) for argument in args):
                refuse_compiled(f"{name} does not take values ({', '.join(map(type_name, args))}); write {instead}")

    infer_global(function, types.Function(Template))


def _refused(name, instead):
    def method(self, *others):
        refuse(f"{name} does not take values {described((self, *others))}; write {instead}")
    return method


for _function, _words in INSTEAD.items():
    _refuse_values(_function, *_words)
for _function in (operator.pow, operator.floordiv, operator.mod, operator.pos, builtins.float, builtins.int):
    setattr(Value, f"__{_function.__name__.strip('_')}__", _refused(*INSTEAD[_function]))
