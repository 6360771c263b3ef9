"""The classical Runge-Kutta scheme of fourth order, over a state of values.

    x.angles, x.rates = rk4(slope, held, t, (x.angles, x.rates), h)

``slope(given, t, state)`` is a kernel that returns the rate of the state, in the state's form: a number, a value, or a
tuple (a NamedTuple) of those. ``given`` is whatever it needs besides: the parameters' view, held torques, a tuple of both.
"""

from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from flight_math.errors import refuse
from flight_math.kernel import kernel
from flight_math.values.arrays import stack_array
from flight_math.values.classes import Value, described
from flight_math.values.compiled_types import ValueType, packed, type_name, unpacked
from flight_math.values.operators import by_component
from flight_math.values.refusals import refuse_compiled


def _reached(state, h, rate):
    return state + h * rate


def _summed(state, h, *rates):
    first, second, third, fourth = rates
    return state + h * (first + 2.0 * second + 2.0 * third + fourth)


@kernel
def rk4(slope, given, t, state, h):
    """The state one step h [s] after t [s]."""
    return rk4_between(slope, given, (t, t + 0.5 * h, t + h), state, h)


@kernel
def rk4_between(slope, given, samples, state, h):
    """One step h [s] where what varies with time is known: samples, at its begin, middle and end, in the place of t."""
    begin, middle, end = samples
    first = slope(given, begin, state)
    second = slope(given, middle, reached(state, 0.5 * h, first))
    third = slope(given, middle, reached(state, 0.5 * h, second))
    fourth = slope(given, end, reached(state, h, third))
    return summed(state, h / 6.0, first, second, third, fourth)


@kernel
def rk4_array(slope, given, t, state, h):
    """The same in place for a state that is an array (n,); ``slope(given, t, state, rate)`` writes the rate (n,)."""
    size = state.shape[0]
    rate, total, stage = stack_array(size), stack_array(size), stack_array(size)
    for i in range(size):
        stage[i] = state[i]
    for part in range(4):
        time = t if part == 0 else t + h if part == 3 else t + 0.5 * h
        slope(given, time, stage, rate)
        weight = 1.0 if part == 0 or part == 3 else 2.0
        reach = h if part == 2 else 0.5 * h
        for i in range(size):
            total[i] += weight * rate[i]
            stage[i] = state[i] + reach * rate[i]
    for i in range(size):
        state[i] += h / 6.0 * total[i]


# -- sums of states ----------------------------------------------------------------------------------------------------
def reached(state, h, rate):
    """state + h rate, for numbers, values and tuples of them."""
    return _combined(_reached, state, h, rate)


def summed(state, h, first, second, third, fourth):
    """state + h (first + 2 second + 2 third + fourth), summed from left to right."""
    return _combined(_summed, state, h, first, second, third, fourth)


def _combined(formula, state, h, *rates):
    if isinstance(state, tuple) and not isinstance(state, Value):
        if any(not isinstance(rate, tuple) or isinstance(rate, Value) or len(rate) != len(state) for rate in rates):
            refuse(_unlike(described((state,)), described(rates[:1])))
        parts = [_combined(formula, *row) for row in zip(state, [h] * len(state), *rates)]
        return type(state)(*parts) if hasattr(state, "_fields") else tuple(parts)
    if any(isinstance(part, Value) and type(part) is not type(state) for part in (*rates, state)):
        refuse(_unlike(described((state,)), described(rates[:1])))
    return formula(state, h, *rates)


def _unlike(state, rate) -> str:
    return f"the slope returns {rate} for a state {state}: the rate has the form of the state"


def _teach(function, formula):
    """The compiled form of a sum of states."""
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            state, h, *rates = args
            kind = result_type(state)
            if not all(_like(kind, rate) for rate in rates) or not isinstance(h, types.Number):
                refuse_compiled(_unlike(type_name(state), type_name(rates[0])))
            return signature(kind, state, types.float64, *rates)

    def lower(context, builder, sig, args):
        return _emit(context, builder, formula, sig.return_type, sig.args, args)

    infer_global(function, types.Function(type("Template", (Template,), {"key": function})))
    lower_builtin(function, types.VarArg(types.Any))(lower)


def result_type(state):
    """Type of a state after a step: whole numbers become float64."""
    if isinstance(state, types.BaseNamedTuple):
        return state
    if isinstance(state, types.BaseTuple):
        return types.BaseTuple.from_types([result_type(part) for part in state])
    return types.float64 if isinstance(state, types.Number) else state


def _like(state, rate) -> bool:
    if isinstance(state, types.BaseTuple):
        return isinstance(rate, types.BaseTuple) and len(rate) == len(state) and all(map(_like, state, rate))
    return rate == state if isinstance(state, ValueType) else isinstance(rate, types.Number)


def _emit(context, builder, formula, result, kinds, args):
    if isinstance(result, types.BaseTuple):
        (state_kind, h_kind, *rate_kinds), (state, h, *rates) = kinds, args
        parts = [_emit(context, builder, formula, result[i],
                       [state_kind[i], h_kind, *(kind[i] for kind in rate_kinds)],
                       [builder.extract_value(state, i), h, *(builder.extract_value(rate, i) for rate in rates)])
                 for i in range(len(result))]
        return context.make_tuple(builder, result, parts)
    if not isinstance(result, ValueType):
        args = [context.cast(builder, part, kind, types.float64) for part, kind in zip(args, kinds)]
        kinds = [types.float64] * len(args)
    symbols = [unpacked(builder, kind, part) for kind, part in zip(kinds, args)]
    whole = by_component(formula) if isinstance(result, ValueType) else formula
    return packed(context, builder, result, whole(*symbols))


_teach(reached, _reached)
_teach(summed, _summed)
