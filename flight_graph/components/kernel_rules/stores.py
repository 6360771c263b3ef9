"""Reading assignments: what may be written, and whether what is written fits."""

import ast

from flight_graph.components.kernel_rules import expressions
from flight_graph.components.kernel_rules.kinds import (
    NUMBER,
    UNKNOWN,
    Array,
    Items,
    Kind,
    Number,
    Record,
    Text,
    Value,
    is_several,
)
from flight_graph.components.kernel_rules.scope import Scope

_READ_ONLY = {
    "input": "{name} belongs to an input, which others read too; a kernel writes its outputs and its state x",
    "parameters": "{name} is a parameter, which a kernel does not change; keep what changes in the state x",
    "header": "{name} is in the header, which the engine writes before the kernel runs; leave it out",
    "constant": "{name} is a constant of the file, which a kernel does not change; keep what changes in the state x",
}


def store(scope: Scope, target: ast.AST, kind: Kind) -> None:
    """Assign a value of this kind to a target."""
    if isinstance(target, ast.Name):
        scope.names[target.id] = kind
    elif isinstance(target, (ast.Tuple, ast.List)):
        _unpack(scope, target, kind)
    elif isinstance(target, ast.Attribute):
        _field(scope, target, kind)
    elif isinstance(target, ast.Subscript):
        _element(scope, target, kind)


def _unpack(scope, target, kind):
    if any(isinstance(item, ast.Starred) for item in target.elts):
        scope.report(target, f"{ast.unparse(target)} = ...: a kernel has no * among names; name each of the values")
        return
    wanted, given = len(target.elts), None
    items = [UNKNOWN] * wanted
    if isinstance(kind, Items):
        given, items = len(kind.items), list(kind.items)
    elif isinstance(kind, Array) and len(kind.shape) == 1 and kind.shape[0] is not None:
        given, items = kind.shape[0], [NUMBER] * kind.shape[0]
    elif isinstance(kind, Value):
        scope.report(target, f"{kind} is not taken apart into names; read its components, {components(kind.value)}")
    elif isinstance(kind, (Number, Record)):
        scope.report(target, f"{kind} is taken apart into {wanted} names; it is one")
    if given is not None and given != wanted:
        scope.report(target, f"{wanted} names take {given} values")
        items = [UNKNOWN] * wanted
    for item, part in zip(target.elts, items):
        store(scope, item, part)


def components(kind: type) -> str:
    """How the components of a class of values are read."""
    known = [f".{letter}" for letter in kind.letters] + ([".real", ".dual"] if kind.halves else [])
    return ", ".join([*known, "[i, j]" if len(kind.shape) == 2 else "[i]"])


def _field(scope, target, kind):
    record = expressions.kind_of(scope, target.value)
    name = ast.unparse(target)
    if isinstance(record, Value):
        scope.report(target, f"{name}: {record} is a value, whose components cannot be set; make a new one and assign that")
    if not isinstance(record, Record):
        return
    if record.role in _READ_ONLY:
        scope.report(target, _READ_ONLY[record.role].format(name=name))
        return
    wanted = expressions.field(scope, target, record)
    what = misfit(wanted, kind)
    if what:
        scope.report(target, f"{name} {what}")


def misfit(wanted: Kind, kind: Kind) -> str | None:
    """Why a value of this kind cannot be stored in a field, as the end of a sentence."""
    if isinstance(wanted, Record):
        return "is a record; assign its fields"
    if isinstance(kind, Text):
        return "is given a text; a kernel has numbers alone"
    if isinstance(wanted, Number) and is_several(kind):
        return f"is a number and is given {kind}"
    if isinstance(wanted, Value):
        if isinstance(kind, Number):
            return f"is {wanted} and is given {kind}"
        if isinstance(kind, (Value, Items)) and kind != wanted:
            return f"is {wanted} and is given {kind}"
    if isinstance(wanted, Array) and isinstance(kind, Number):
        return f"is {wanted} and is given {kind}; assign its entries one by one"
    return None


def _element(scope, target, kind):
    base = expressions.kind_of(scope, target.value)
    name = ast.unparse(target.value)
    if isinstance(base, Value):
        scope.report(target, f"{name}[...] = ...: {base} is a value, whose components cannot be set; make a new one and "
                             f"assign that, {name} = ...")
        return
    if isinstance(base, Items):
        scope.report(target, f"{name}[...] = ...: a tuple cannot be changed")
        return
    if isinstance(base, Array) and base.role in _READ_ONLY:
        scope.report(target, _READ_ONLY[base.role].format(name=name))
        return
    wanted = expressions.kind_of(scope, target)
    if isinstance(wanted, Number) and is_several(kind):
        scope.report(target, f"{ast.unparse(target)} is a number and is given {kind}")
