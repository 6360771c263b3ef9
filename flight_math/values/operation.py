"""One operation, written once: a formula on numbers and a rule on kinds, for plain Python and for the compiler.

    @operation(lambda a, b: Vec3 if a is b is Vec3 else None, "needed are two Vec3")
    def cross(a, b):
        return a[1] * b[2] - a[2] * b[1], ...

The rule takes the kinds of the arguments (classes of values, float, bool) and returns the kind of the result, or None: then
the call is refused with a sentence. The formula takes a row of numbers for each value. Where it depends on the kinds, the
rule returns (kind, formula).
"""

import functools
import inspect

import numpy as np
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from flight_math.errors import refuse
from flight_math.values.classes import Value, kind_name, kind_of
from flight_math.values.compiled_types import ValueType, kind_of_type, packed, type_name, type_of_kind, unpacked
from flight_math.values.refusals import refuse_compiled


def operation(rule, allowed: str):
    """Make a function of values of a formula; ``allowed`` ends the sentence of a refusal.

    ``function.resolve(kinds)`` gives (kind of the result, formula), or None, for who reads kernels without compiling them.
    """
    def decorate(formula):
        resolve = resolver(rule, formula)

        def refusal(names):
            return f"{formula.__name__}({', '.join(names)}): {allowed}"

        @functools.wraps(formula)
        def function(*args):
            return computed(resolve, args, refusal)

        register([function], resolve, lambda names, kinds: refusal(names), True)
        function.resolve = resolve
        return function
    return decorate


def resolver(rule, formula=None):
    """resolve(kinds) -> (kind of the result, formula), or None where the rule has nothing for the kinds."""
    parameters = inspect.signature(rule).parameters.values()
    fixed = [parameter for parameter in parameters if parameter.kind != parameter.VAR_POSITIONAL]
    least, most = len(fixed), len(fixed) if len(fixed) == len(parameters) else None

    @functools.cache
    def resolve(kinds):
        if len(kinds) < least or (most is not None and len(kinds) > most):
            return None
        found = rule(*kinds)
        given = isinstance(found, tuple) and inspect.isfunction(found[1])
        return found if found is None or given else (found, formula)

    resolve.arguments = most
    return resolve


# -- plain Python --------------------------------------------------------------------------------------------------------
def computed(resolve, args, refusal):
    """The result of an operation in plain Python; ``refusal(names of kinds)`` is the sentence where there is none."""
    kinds = tuple(map(kind_of, args))
    found = resolve(kinds)
    if found is None:
        refuse(refusal(list(map(kind_name, kinds))))
    kind, formula = found
    return finished(kind, formula(*map(numbers, args)))


def numbers(argument):
    """What a formula takes of an argument."""
    if isinstance(argument, Value):
        return argument.parts()
    return bool(argument) if isinstance(argument, (bool, np.bool_)) else Value.item(argument)


def finished(kind, result):
    """What the caller gets of a formula's result."""
    if isinstance(kind, tuple):
        return tuple(map(finished, kind, result))
    if kind is float:
        return np.float64(result) if isinstance(result, float) else result
    return kind(result) if kind in (bool, int) else kind.of(result)


# -- compiled ------------------------------------------------------------------------------------------------------------
def register(keys, resolve, refusal, always: bool):
    """Teach numba an operation under its keys; unless ``always``, only where a value is among the arguments."""
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            if not always and not any(isinstance(argument, ValueType) for argument in args):
                return None
            kinds = tuple(map(kind_of_type, args))
            found = resolve(kinds) if not kws else None
            if found is None:
                refuse_compiled(refusal(list(map(type_name, args)), kinds))
            return signature(type_of_kind(found[0]), *map(type_of_kind, kinds))

    def lower(context, builder, signature, args):
        _, formula = resolve(tuple(map(kind_of_type, signature.args)))
        symbols = [unpacked(builder, kind, part) for kind, part in zip(signature.args, args)]
        return packed(context, builder, signature.return_type, formula(*symbols))

    if always:
        patterns = [(types.VarArg(types.Any),)]
    elif resolve.arguments == 1:
        patterns = [(ValueType,)]
    else:
        patterns = [(ValueType, ValueType), (ValueType, types.Float), (types.Float, ValueType)]
    for key in keys:
        infer_global(key, types.Function(type("Template", (Template,), {"key": key})))
        for pattern in patterns:
            lower_builtin(key, *pattern)(lower)
