"""Reading the statements of a kernel, one after the other; branches are joined, loops are read until nothing changes."""

import ast

from flight_graph.components.kernel_rules import expressions, stores
from flight_graph.components.kernel_rules.kinds import (
    NUMBER,
    UNKNOWN,
    WHOLE,
    Array,
    Items,
    Kind,
    Number,
    Partly,
    Range,
    Record,
    Value,
    join,
    whole,
)
from flight_graph.components.kernel_rules.scope import Scope, names_in

_FAULT = "set x.fault to a code of the class's faults, which stops the run with its sentence"
_NOT_RAISED = "nothing is raised in one (a division by zero gives inf or NaN); test the numbers"
_REFUSED = {
    ast.Raise: f"a kernel raises nothing; {_FAULT}",
    ast.Assert: f"a kernel asserts nothing; {_FAULT}",
    ast.Try: f"a kernel catches nothing: {_NOT_RAISED}",
    ast.TryStar: f"a kernel catches nothing: {_NOT_RAISED}",
    ast.With: "a kernel has no 'with': it opens nothing and raises nothing",
    ast.Global: "a kernel keeps nothing in globals, which engines and nodes do not share; put it into the state x",
    ast.Nonlocal: "a kernel keeps nothing outside of the state x",
    ast.Import: "a kernel imports nothing; import at the top of the file",
    ast.ImportFrom: "a kernel imports nothing; import at the top of the file",
    ast.Delete: "a kernel deletes nothing",
    ast.FunctionDef: "a kernel defines no function inside; put it beside the kernel, under @kernel",
    ast.ClassDef: "a kernel defines no class",
    ast.Match: "a kernel has no 'match'; write if and elif",
    ast.AsyncFor: "a kernel is not asynchronous", ast.AsyncWith: "a kernel is not asynchronous",
    ast.AsyncFunctionDef: "a kernel is not asynchronous",
}


def read(scope: Scope, body: list) -> bool:
    """Read statements in order; return whether control never comes to their end."""
    for statement in body:
        if _statement(scope, statement):
            return True
    return False


def _statement(scope, node) -> bool:
    what = _REFUSED.get(type(node))
    if what is not None:
        scope.report(node, what)
        for inner in getattr(node, "body", []) if isinstance(node, (ast.Try, ast.With)) else ():
            _statement(scope, inner)
        return isinstance(node, ast.Raise)
    if isinstance(node, ast.Assign):
        kind = expressions.kind_of(scope, node.value)
        for target in node.targets:
            stores.store(scope, target, kind)
    elif isinstance(node, ast.AnnAssign) and node.value is not None:
        stores.store(scope, node.target, expressions.kind_of(scope, node.value))
    elif isinstance(node, ast.AugAssign):
        stores.store(scope, node.target, expressions.augmented(scope, node))
    elif isinstance(node, ast.Expr):
        if not isinstance(node.value, ast.Constant):
            expressions.kind_of(scope, node.value)
    elif isinstance(node, ast.Return):
        if node.value is not None:
            scope.returns.append(expressions.kind_of(scope, node.value))
        return True
    elif isinstance(node, ast.If):
        return _branch(scope, node)
    elif isinstance(node, (ast.For, ast.While)):
        _loop(scope, node)
    return isinstance(node, (ast.Break, ast.Continue))


def _branch(scope, node):
    expressions.truth(scope, node.test)
    before = dict(scope.names)
    with scope.under(node.test):
        ends = read(scope, node.body)
        taken, scope.names = scope.names, before
        other_ends = read(scope, node.orelse)
    if ends or other_ends:
        scope.bounded |= names_in(node.test)
        if ends and other_ends:
            return True
        scope.names = scope.names if ends else taken
        return False
    scope.names = _joined(taken, scope.names, lambda kind: Partly(kind, node.lineno, scope.depth))
    return False


def _joined(a, b, partly=None):
    """What holds of all names after one branch or the other. partly: what a name is that one of them alone has."""
    joined = {}
    for name in {**a, **b}:
        if name in a and name in b:
            joined[name] = join(a[name], b[name])
        else:
            kind = a.get(name, b.get(name))
            joined[name] = kind if partly is None or isinstance(kind, Partly) else partly(kind)
    return joined


def _loop(scope, node):
    target = _target(scope, node) if isinstance(node, ast.For) else None
    test = node.test if isinstance(node, ast.While) else None
    leaves = any(isinstance(part, (ast.Break, ast.Continue, ast.Return)) for part in ast.walk(node))
    with scope.quiet():
        before = dict(scope.names)
        _body(scope, node, target, test, leaves)
        scope.names = _joined(before, scope.names)
    before = dict(scope.names)
    if test is not None:
        expressions.truth(scope, test)
    _body(scope, node, target, test, leaves)
    scope.names = _joined(before, scope.names)
    read(scope, node.orelse)


def _body(scope, node, target, test, leaves):
    """Read a loop's body once. leaves: it may end early, so that its index need not run to the end."""
    with scope.under(test):
        if target is not None:
            stores.store(scope, node.target, target)
            if leaves:
                scope.bounded |= names_in(node.target)
        read(scope, node.body)


def _target(scope, node) -> Kind:
    """The kind of a loop's variable."""
    over = expressions.kind_of(scope, node.iter)
    if isinstance(over, Range):
        if over.low is None or over.high is None or over.high < over.low:
            return WHOLE
        return whole(over.low, over.high, frozenset([id(node)]))
    if isinstance(over, Items) and over.items:
        kind = over.items[0]
        for item in over.items[1:]:
            kind = join(kind, item)
        return kind
    if isinstance(over, (Number, Value, Record)):
        length = over.shape[0] if isinstance(over, Value) else "n"
        return scope.report(node.iter, f"{ast.unparse(node.iter)} is {over}; a loop runs over range({length})")
    if isinstance(over, Array):
        return NUMBER if len(over.shape) == 1 else UNKNOWN
    return UNKNOWN
