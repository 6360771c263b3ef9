"""Reading calls: kernels are read in turn, functions of `flight_math` say what they give, everything else is judged."""

import ast
import inspect
import math
from types import BuiltinFunctionType, FunctionType

import numpy as np
from numba import config

from flight_graph.components.kernel_rules import library
from flight_graph.components.kernel_rules.arithmetic import kind_of_object, sampled
from flight_graph.components.kernel_rules.kinds import (
    NUMBER,
    REAL,
    TRUTH,
    UNKNOWN,
    WHOLE,
    Array,
    Items,
    Kind,
    Number,
    Object,
    Record,
    Value,
    is_several,
    whole,
    without_range,
)
from flight_graph.components.kernel_rules.scope import Scope
from flight_graph.components.places import is_own
from flight_graph.components.sources import is_decorated, source
from flight_math.errors import KernelError
from flight_math.kernel import plain
from flight_math.values.classes import ValueClass, mask_of

LARGEST_STACK_ARRAY = 32_768  # [numbers] 256 kB: threads of macOS have 512 kB
FOREIGN = "stands under another compiler's decorator than @kernel, which fixes the arithmetic; write @kernel above it"
_ELEMENTARY = frozenset("sin cos tan asin acos atan exp expm1 log log1p tanh cbrt sqrt".split())


def result(scope: Scope, node: ast.Call, callee: Object, kinds: list | None, named: dict) -> Kind:
    """The kind of a call. kinds: of its arguments in order, None where they cannot be told; named: of the keywords."""
    function, written = callee.value, callee.name
    if isinstance(function, ValueClass):
        return _construction(scope, node, function, kinds)
    if isinstance(function, type) and issubclass(function, tuple) and hasattr(function, "_fields"):
        return _named_tuple(scope, node, function, kinds, named)
    if is_kernel(function):
        return _kernel(scope, node, function, written, kinds, named)
    what = library.refusal(function, written)
    if what:
        if config.DISABLE_JIT and function in (print, breakpoint):
            return UNKNOWN
        always = library.origin(function)[0].partition(".")[0] in ("scipy", "time", "datetime", "builtins")
        return scope.report(node, what) if always else scope.forbid(node, what)
    package = library.origin(function)[0].partition(".")[0]
    if package in ("builtins", "math", "numpy"):
        return _of_numbers(scope, node, function, written, kinds)
    if package == "flight_math":
        return _of_flight_math(scope, node, function, kinds)
    return _stranger(scope, node, function, written)


def is_kernel(function) -> bool:
    """Whether a function stands under @kernel."""
    if hasattr(function, "py_func"):
        return True
    return bool(config.DISABLE_JIT) and isinstance(function, FunctionType) and is_decorated(function)


def is_foreign(function) -> bool:
    """Whether a function stands under a decorator of numba's with an arithmetic of its own."""
    options = getattr(getattr(function, "compiled", function), "targetoptions", {})
    return bool(options) and bool(options.get("fastmath") or options.get("error_model") != "numpy")


def _kernel(scope, node, function, written, kinds, named):
    if is_foreign(function):
        scope.report(node, f"{written} {FOREIGN}")
    if kinds is None:
        return UNKNOWN
    try:
        bound = inspect.signature(plain(function)).bind(*kinds, **named)
    except TypeError:
        return scope.report(node, _miscounted(function, written, kinds, named))
    except ValueError:
        return UNKNOWN
    if library.origin(plain(function))[0].startswith("flight_math"):
        return _of_flight_math(scope, node, function, [*kinds, *named.values()])
    bound.apply_defaults()
    arguments = [value if isinstance(value, Kind) else kind_of_object(value) for value in bound.arguments.values()]
    values = [kind for kind in arguments if isinstance(kind, Value)] if hasattr(function, "compiled") else []
    if values:  # @elementwise: once for each component
        arguments = [REAL if isinstance(kind, Value) else kind for kind in arguments]
    found = scope.walk.kernel(function, [without_range(kind) for kind in arguments], (scope, node.lineno))
    return _lifted(found, values[0]) if values else found


def _lifted(kind, value):
    """What @elementwise makes of the result of numbers."""
    if isinstance(kind, Items):
        return Items(tuple(_lifted(item, value) for item in kind.items))
    if not isinstance(kind, Number) or kind.of is None:
        return UNKNOWN
    return Value(mask_of(value.value.count)) if kind.of is bool else value


def _miscounted(function, written, kinds, named):
    """The sentence for arguments that do not fit a kernel's own."""
    parameters = inspect.signature(plain(function)).parameters
    strangers = [name for name in named if name not in parameters]
    if strangers:
        return f"{written} has no argument '{strangers[0]}'; it is {written}({', '.join(parameters)})"
    given, wanted = len(kinds) + len(named), len(parameters)
    return f"{written}({', '.join(parameters)}) takes {wanted} argument{'s' if wanted != 1 else ''}; {given or 'none'} " \
           f"{'is' if given == 1 else 'are'} given"


def _construction(scope, node, function, kinds):
    if kinds is None or not all(isinstance(kind, (Number, Value)) for kind in kinds):
        if kinds and isinstance(kinds[0], Items):
            scope.report(node, f"{ast.unparse(node)}: {function.title} takes its {function.count} numbers one by one")
        return Value(function)
    found = sampled(function, tuple(map(without_range, kinds)))
    if isinstance(found, str):
        scope.report(node, f"{ast.unparse(node)}: {found}")
    return Value(function)


def _named_tuple(scope, node, function, kinds, named):
    if kinds is None:
        return UNKNOWN
    try:
        bound = inspect.signature(function).bind(*kinds, **named)
    except TypeError as error:
        return scope.report(node, f"{function.__name__} has the fields {', '.join(function._fields)}: {error}")
    return Items(tuple(bound.arguments.get(name, UNKNOWN) for name in function._fields), function._fields)


def _of_numbers(scope, node, function, written, kinds):
    """A function of numbers that a kernel may call."""
    module, name = library.origin(function)
    kinds = kinds or []
    if name == "len" and kinds:
        return _length(scope, node, kinds[0])
    if name in ("abs", "any", "all") and kinds and isinstance(kinds[0], Value):
        found = sampled(function, (kinds[0],))
        return scope.report(node, f"{ast.unparse(node)}: {found}") if isinstance(found, str) else found
    if name in ("min", "max"):
        return _extreme(scope, node, name, kinds)
    if name in library.MATH | library.NUMPY | {"float", "int", "round", "bool"}:
        for kind, argument in zip(kinds, node.args):
            if isinstance(kind, Array) and module == "numpy":
                return scope.forbid(argument, f"{written} of an array allocates memory, which no kernel may; write a loop")
            if isinstance(kind, (Value, Array, Items, Record)):
                return scope.report(argument, f"{written} takes numbers; {ast.unparse(argument)} is {kind}")
    if name == "round" and len(kinds) > 1:
        return scope.report(node, f"{ast.unparse(node)}: to digits Python and machine code round differently; write "
                                  "round(x) of one number")
    if name in library.TRUTHS:
        return TRUTH
    if name in library.WHOLE:
        return WHOLE
    if name == "abs":
        return Number(kinds[0].of) if kinds and isinstance(kinds[0], Number) else NUMBER
    if name in ("float", "float64", "sqrt", "fabs", "copysign"):
        return REAL
    return UNKNOWN if name in ("enumerate", "zip", "reversed", "tuple", "divmod") else NUMBER


def _length(scope, node, kind):
    """len(kind)"""
    if isinstance(kind, (Number, Record)):
        return scope.report(node, f"{ast.unparse(node)}: {ast.unparse(node.args[0])} is {kind}; it has no length")
    length = len(kind.items) if isinstance(kind, Items) else kind.shape[0] if is_several(kind) else None
    return WHOLE if length is None else whole(length)


def _extreme(scope, node, name, kinds):
    """min and max: of numbers, or of one tuple of numbers."""
    several = next((kind for kind in kinds if isinstance(kind, (Value, Array))), None)
    if several is not None:
        meant = {"min": ("smallest", "minimum"), "max": ("largest", "maximum")}[name][len(kinds) > 1]
        return scope.report(node, f"{name} takes numbers; of vectors write {meant}, from flight_math")
    record = next((number for number, kind in enumerate(kinds) if isinstance(kind, Record)), None)
    if record is not None:
        return scope.report(node, f"{name} takes numbers; {ast.unparse(node.args[record])} is {kinds[record]}")
    known = {kind.of for kind in kinds if isinstance(kind, Number)}
    return Number(known.pop()) if len(known) == 1 and len(kinds) > 1 else NUMBER


def _of_flight_math(scope, node, function, kinds):
    """What a function of the library gives, by its own rule where it has one."""
    name = getattr(function, "__name__", "")
    if kinds is None:
        return UNKNOWN
    if name == "stack_array":
        lengths = [kind.low if isinstance(kind, Number) and kind.low == kind.high else None for kind in kinds]
        if None not in lengths and math.prod(lengths) > LARGEST_STACK_ARRAY:
            scope.report(node, f"{ast.unparse(node)} does not fit on the stack; it holds {LARGEST_STACK_ARRAY} numbers at "
                               "most; declare an Array(...) in the state")
        return Array(tuple(lengths))
    values = [kind for kind in kinds if isinstance(kind, Value)]
    if name in _ELEMENTARY and kinds:
        return values[0] if values else REAL
    if name == "sincos" and kinds:
        kind = values[0] if values else REAL
        return Items((kind, kind))
    resolve = getattr(function, "resolve", None)
    if resolve is None or not all(isinstance(kind, (Value, Number)) for kind in kinds):
        return UNKNOWN
    return _ruled(scope, node, function, kinds)


def _ruled(scope, node, function, kinds):
    found = function.resolve(tuple(kind.value if isinstance(kind, Value) else bool if kind.of is bool else float
                                   for kind in kinds))
    if found is not None:
        return _kind_of_class(found[0])
    if any(isinstance(kind, Number) and kind.of is None for kind in kinds):
        return UNKNOWN
    try:
        function(*(kind.value.of([1.0] * kind.value.count) if isinstance(kind, Value) else
                   True if kind.of is bool else 1.0 for kind in kinds))
    except KernelError as error:
        return scope.report(node, f"{ast.unparse(node)}: {error.sentence}")
    return UNKNOWN


def _kind_of_class(found):
    if isinstance(found, tuple):
        return Items(tuple(map(_kind_of_class, found)))
    return Value(found) if isinstance(found, ValueClass) else Number(found)


def _stranger(scope, node, function, written):
    """A function or class that is neither a kernel nor known."""
    if isinstance(function, type):
        return scope.report(node, f"{written}(...) makes an object, which no kernel may; write {library.SCRATCH}")
    if isinstance(function, FunctionType):
        if known_to_numba(function):
            return UNKNOWN
        if source(function) is not None and is_own(scope.walk.component, function.__code__.co_filename):
            return scope.report(node, f"{written} is a plain function; write @kernel above it "
                                      f"(line {function.__code__.co_firstlineno})")
        return scope.report(node, f"{written} is a plain function of {function.__module__}, no kernel; a kernel calls "
                                  "kernels, functions of flight_math and those of numbers in math")
    if isinstance(function, BuiltinFunctionType) or callable(function):
        if isinstance(function, np.ufunc) or known_to_numba(function):
            return UNKNOWN
        return scope.report(node, f"{written} is no kernel; a kernel calls kernels, functions of flight_math and those of "
                                  "numbers in math")
    return scope.report(node, f"{written} is {type(function).__name__}, which cannot be called")


def known_to_numba(function) -> bool:
    """Whether numba was taught this function (an overload, an intrinsic)."""
    from numba.core.registry import cpu_target
    try:
        return cpu_target.typing_context.resolve_value_type(function) is not None
    except Exception:  # whatever it says, it does not know it
        return False
