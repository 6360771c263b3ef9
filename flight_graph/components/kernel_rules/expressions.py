"""Reading expressions: the kind of each, from the kinds of its parts."""

import ast
import types

import numpy as np

from flight_graph.components.findings import nearest
from flight_graph.components.kernel_rules import calls, library, subscripts
from flight_graph.components.kernel_rules.arithmetic import operation
from flight_graph.components.kernel_rules.kinds import (
    NUMBER,
    TRUTH,
    UNKNOWN,
    Array,
    Items,
    Kind,
    Number,
    Object,
    Partly,
    Range,
    Record,
    Text,
    Value,
    join,
    whole,
)
from flight_graph.components.kernel_rules.scope import Scope
from flight_graph.components.sources import MISSING
from flight_math.values.classes import Value as FlightValue
from flight_math.values.classes import no_attribute

_DISPLAYS = {
    ast.List: "a list", ast.Dict: "a dict", ast.Set: "a set", ast.ListComp: "a list", ast.DictComp: "a dict",
    ast.SetComp: "a set", ast.GeneratorExp: "a generator",
}
_LETTERS = "xyzw"


def kind_of(scope: Scope, node: ast.AST) -> Kind:
    """The kind of an expression; mistakes in it are reported."""
    method = _READERS.get(type(node))
    if method is not None:
        return method(scope, node)
    if type(node) in _DISPLAYS:
        instead = "a tuple (...) where its length is fixed, or " if isinstance(node, (ast.List, ast.ListComp)) else ""
        return scope.report(node, f"{_DISPLAYS[type(node)]} allocates memory, which no kernel may; write {instead}"
                                  f"{library.SCRATCH}")
    if isinstance(node, (ast.JoinedStr, ast.FormattedValue)):
        return scope.report(node, f"an f-string makes a text, {library.NO_TEXT}")
    if isinstance(node, ast.Lambda):
        return scope.report(node, "a kernel defines no function inside; put it beside the kernel, under @kernel")
    if isinstance(node, (ast.Yield, ast.YieldFrom, ast.Await)):
        return scope.report(node, "a kernel neither yields nor waits: it runs to its end at every firing")
    for part in ast.iter_child_nodes(node):
        if isinstance(part, ast.expr):
            kind_of(scope, part)
    return UNKNOWN


def truth(scope: Scope, node: ast.AST) -> None:
    """An expression as a condition."""
    kind = kind_of(scope, node)
    if isinstance(kind, (Value, Array)):
        scope.report(node, f"{ast.unparse(node)} is {kind}, several truths and not one; write any(...) or all(...)")


def augmented(scope: Scope, node: ast.AugAssign) -> Kind:
    """The kind of ``target += value``."""
    return _binary(scope, node, node.target, node.value)


def field(scope: Scope, node: ast.Attribute, record: Record) -> Kind:
    """The kind of a record's field."""
    if node.attr in record.fields:
        return record.fields[node.attr]
    return scope.report(node, _no_field(scope, node, record))


def thing(scope: Scope, node: ast.AST, value, name: str) -> Kind:
    """The kind of an object that stands outside of the kernel."""
    if isinstance(value, (bool, np.bool_)):
        return TRUTH
    if isinstance(value, int):
        return whole(value)
    if isinstance(value, (float, np.number)):
        return Number(float if isinstance(value, (float, np.floating)) else int)
    if isinstance(value, str):
        return Text(value)
    if isinstance(value, FlightValue):
        return Value(type(value))
    if isinstance(value, tuple):
        return Items(tuple(thing(scope, node, item, name) for item in value), getattr(value, "_fields", ()))
    if isinstance(value, np.ndarray):
        return Array(value.shape, "constant")
    if isinstance(value, (list, dict, set, bytearray)):
        kind = type(value).__name__
        return scope.report(node, f"{name} is a {kind}, which may change while the machine code keeps what it was; write "
                                  + ("a tuple: (...)" if kind != "dict" else "names of their own, or parameters"))
    return Object(value, name)


# -- readers ---------------------------------------------------------------------------------------------------------
def _constant(scope, node):
    if isinstance(node.value, str):
        return Text(node.value)
    if isinstance(node.value, (bool, int, float)):
        return thing(scope, node, node.value, "")
    return UNKNOWN


def _name(scope, node):
    if node.id in scope.source.local_names:
        kind = scope.names.get(node.id, UNKNOWN)
        if isinstance(kind, Partly):
            scope.names[node.id] = kind.kind
            if scope.depth <= kind.depth:
                scope.report(node, f"'{node.id}' has a value only where the condition of line {kind.line} holds; give it "
                                   "one before")
            return kind.kind
        return kind
    value = scope.source.meaning(node.id)
    if value is MISSING:
        instead = library.ours(node.id)
        known = {*scope.source.local_names, *scope.source.function.__globals__}
        return scope.report(node, f"there is no name '{node.id}' here; "
                            + (f"write {instead} at the top of the file" if instead
                               else nearest(node.id, known, "known are")))
    return thing(scope, node, value, node.id)


def _attribute(scope, node):
    base = kind_of(scope, node.value)
    if isinstance(base, Record):
        return field(scope, node, base)
    if isinstance(base, Value):
        return _component(scope, node, base)
    if isinstance(base, Array):
        return _of_array(scope, node, base)
    if isinstance(base, Items) and base.fields:
        if node.attr in base.fields:
            return base.items[base.fields.index(node.attr)]
        return scope.report(node, f"{ast.unparse(node.value)} has no '{node.attr}'; {nearest(node.attr, base.fields)}")
    if isinstance(base, Number):
        return scope.report(node, f"{ast.unparse(node.value)} is {base}; it has no '.{node.attr}'")
    if isinstance(base, Text) and node.attr in ("format", "join"):
        return scope.report(node, f"str.{node.attr} makes a text, {library.NO_TEXT}")
    if isinstance(base, Object) and isinstance(base.value, types.ModuleType):
        value = getattr(base.value, node.attr, MISSING)
        if value is MISSING:
            return scope.report(node, f"{base.name} has no '{node.attr}'; {nearest(node.attr, dir(base.value))}")
        return thing(scope, node, value, f"{base.name}.{node.attr}")
    return UNKNOWN


def _component(scope, node, base):
    kind = base.value
    if node.attr in kind.letters:
        return NUMBER
    if kind.halves is not None and node.attr in ("real", "dual"):
        return Value(kind.halves)
    return scope.report(node, f"{ast.unparse(node)}: {no_attribute(kind, node.attr)}")


def _of_array(scope, node, base):
    if node.attr == "shape":
        return Items(tuple(NUMBER if n is None else whole(n) for n in base.shape))
    if node.attr in ("size", "ndim"):
        return NUMBER
    refused = library.method_refusal(ast.unparse(node), node.attr)
    if refused:
        return scope.forbid(node, refused)
    letter = _LETTERS.find(node.attr) if len(node.attr) == 1 else -1
    if 0 <= letter < 4 and len(base.shape) == 1:
        name, length = ast.unparse(node.value), base.shape[0]
        fits = length is None or letter < length
        return scope.report(node, f"{ast.unparse(node)}: {name} is {base}; "
                            + (f"write {name}[{letter}]" if fits else f"its indices are 0 to {length - 1}"))
    return UNKNOWN


def _no_field(scope, node, record):
    name = ast.unparse(node.value)
    component = scope.walk.component
    if record.role == "parameters":
        if node.attr in record.texts:
            return f"{name}.{node.attr} is a text, which the kernel does not see; turn it into numbers in resolve"
        if node.attr in component.state.entries:
            return f"{name} has no parameter '{node.attr}'; it is in the state: x.{node.attr}"
        if not record.fields.keys() - {"period"}:
            return _undeclared(scope, name, node.attr, "parameters", "Parameters")
        return f"{name} has no parameter '{node.attr}' ({record.title}); {nearest(node.attr, record.fields)}"
    if record.role == "state":
        if node.attr in component.parameters.entries:
            return f"{name} has no entry '{node.attr}'; it is a parameter: p.{node.attr}"
        if not record.fields.keys() - {"fault"}:
            return _undeclared(scope, name, node.attr, "state", "State")
        return f"{name} has no entry '{node.attr}' (state {record.title}); {nearest(node.attr, record.fields)}"
    return f"{name} has no field '{node.attr}' ({record.title}); {nearest(node.attr, record.fields)}"


def _undeclared(scope, name, wanted, declaration, base):
    """The class declares no parameters, or no state: name the class that is meant."""
    component = scope.walk.component
    classes = [value for value in vars(scope.walk.module).values() if isinstance(value, type)
               and wanted in getattr(value, "entries", {}) and base in [parent.__name__ for parent in value.__mro__]]
    meant = classes[0].__name__ if classes else f"a class of {base} that has it"
    return (f"{name}.{wanted}: {component.__name__} declares no {declaration}; write '{declaration} = {meant}' in the class"
            if classes else f"{name}.{wanted}: {component.__name__} declares no {declaration}; write {meant}, and "
                            f"'{declaration} = ...' in the class")


def _subscript(scope, node):
    base = kind_of(scope, node.value)
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    indices = [None if isinstance(part, ast.Slice) else kind_of(scope, part) for part in parts]
    for part in parts:
        if isinstance(part, ast.Slice):
            kind_of(scope, part)
    return subscripts.element(scope, node, base, indices)


def _binary_operator(scope, node):
    return _binary(scope, node, node.left, node.right)


def _binary(scope, node, left, right):
    return operation(scope, node, node.op, kind_of(scope, left), kind_of(scope, right))


def _unary(scope, node):
    if isinstance(node.op, ast.Not):
        truth(scope, node.operand)
        return TRUTH
    return operation(scope, node, node.op, kind_of(scope, node.operand))


def _compare(scope, node):
    left = kind_of(scope, node.left)
    result = TRUTH
    for sign, comparator in zip(node.ops, node.comparators):
        right = kind_of(scope, comparator)
        result = operation(scope, node, sign, left, right)
        left = right
    return result


def _boolean(scope, node):
    kinds = []
    for value in node.values:
        kind = kind_of(scope, value)
        if isinstance(kind, (Value, Array)):
            sign = "&" if isinstance(node.op, ast.And) else "|"
            return scope.report(value, f"{ast.unparse(value)} is {kind}, several truths and not one; join Masks by {sign}, "
                                       "or write any(...) or all(...)")
        kinds.append(kind)
    return TRUTH if all(kind == TRUTH for kind in kinds) else NUMBER


def _conditional(scope, node):
    truth(scope, node.test)
    with scope.under(node.test):
        return join(kind_of(scope, node.body), kind_of(scope, node.orelse))


def _tuple(scope, node):
    if any(isinstance(item, ast.Starred) for item in node.elts):
        return UNKNOWN
    return Items(tuple(kind_of(scope, item) for item in node.elts))


def _named(scope, node):
    scope.names[node.target.id] = kind_of(scope, node.value)
    return scope.report(node, f"({ast.unparse(node)}): give '{node.target.id}' its value in a line of its own")


def _call(scope, node):
    callee = kind_of(scope, node.func)
    spread = any(isinstance(argument, ast.Starred) for argument in node.args)
    kinds = [kind_of(scope, argument) for argument in node.args]
    named = {keyword.arg: kind_of(scope, keyword.value) for keyword in node.keywords}
    if not isinstance(callee, Object):
        if isinstance(callee, (Number, Value, Array, Record, Items)):
            return scope.report(node, f"{ast.unparse(node.func)} is {callee}, which cannot be called")
        return UNKNOWN
    if callee.value is range:
        return _range(kinds)
    return calls.result(scope, node, callee, None if spread or None in named else kinds, named)


def _range(kinds):
    """range(n), range(a, b) of constants."""
    bounds = [kind.low for kind in kinds if isinstance(kind, Number) and kind.low is not None and kind.low == kind.high]
    if len(bounds) != len(kinds) or len(bounds) not in (1, 2):
        return Range()
    low, high = (0, bounds[0]) if len(bounds) == 1 else bounds
    return Range(low, high - 1)


_READERS = {
    ast.Constant: _constant, ast.Name: _name, ast.Attribute: _attribute, ast.Subscript: _subscript,
    ast.BinOp: _binary_operator, ast.UnaryOp: _unary, ast.Compare: _compare, ast.BoolOp: _boolean,
    ast.IfExp: _conditional, ast.Tuple: _tuple, ast.NamedExpr: _named, ast.Call: _call,
}
