"""The arguments of a part: how many, which, in which order."""

import ast
import inspect

from flight_graph.components.component import kinds_of
from flight_graph.components.declarations import UNTIMED
from flight_graph.components.findings import Finding
from flight_graph.components.kernel_rules import calls, records
from flight_graph.components.kernel_rules.kinds import Record
from flight_graph.components.kernel_rules.walk import Walk
from flight_graph.components.sources import Source, source
from flight_math.kernel import plain

FIRST = ("t_ns", "p", "x")
GROUPS = {"kernel": "inputs, outputs", "output": "outputs", "update": "inputs"}
MOST_ARGUMENTS = 7  # a part with more takes its ports in named tuples


def expected(component, part: str, given=()) -> list[str]:
    """The arguments of a part, by name; one named tuple of all inputs (outputs) where ``given`` says inputs (outputs)."""
    if part in UNTIMED:
        return ["p", "x", *(["placement"] if part == "place" else [])]
    inputs = [] if part == "output" else list(component.inputs)
    outputs = [] if part == "update" else list(component.outputs)
    return [*FIRST, *(["inputs"] if "inputs" in given else inputs), *(["outputs"] if "outputs" in given else outputs)]


def reading(component, part: str) -> tuple[list[Finding], list[Source]]:
    """What is wrong with a part and with the kernels that it calls, and all of these kernels."""
    function = getattr(component, part)
    name = f"{component.__name__}.{part}"
    code = getattr(plain(function), "__code__", None)
    if code is None:
        return [Finding("", 0, name, f"{function!r} is no function; write a function under @kernel")], []

    def finding(what):
        return [Finding(code.co_filename, _line(function), name, what)], []

    if not calls.is_kernel(function):
        return finding(f"{function.__name__} lacks @kernel; write it above the def")
    if calls.is_foreign(function):
        return finding(f"{function.__name__} {calls.FOREIGN}")
    arguments = list(inspect.signature(plain(function)).parameters)
    wanted = expected(component, part, arguments)
    what = _misfit(function, arguments, wanted, part)
    if what:
        return finding(what)
    walk = Walk(component, part)
    walk.kernel(function, _kinds(component, part, wanted))
    return walk.findings or _returned(name, function), walk.sources


def _returned(name, function):
    """What is wrong with the returns of a part: nobody takes what it returns."""
    found = source(function)
    return [Finding(found.path, node.lineno, name, f"{ast.unparse(node)}: a part returns nothing; its results go into the "
                    "outputs and the state") for node in (ast.walk(found.tree) if found else ())
            if isinstance(node, ast.Return) and not (node.value is None or ast.unparse(node.value) == "None")]


def _misfit(function, arguments, wanted, part):
    """The sentence for arguments that are not those of the part."""
    form = f"{part}({', '.join(wanted)})"
    if len(wanted) > MOST_ARGUMENTS:
        form += f", or {part}(t_ns, p, x, {GROUPS[part]})"
    if len(arguments) != len(wanted):
        missing = [name for name in wanted if name not in arguments]
        more = [name for name in arguments if name not in wanted]
        hint = ""
        if len(arguments) < len(wanted) and missing:
            hint = f", missing: {', '.join(missing)}"
        elif more and len(arguments) > len(wanted):
            hint = f", too many: {', '.join(more)}"
        count = f"{len(arguments)} argument{'s' if len(arguments) != 1 else ''}"
        return f"{function.__name__} takes {count}, its ports ask for {form}{hint}"
    for name, port in zip(arguments, wanted):
        if name != port and name in wanted:
            return (f"{function.__name__}({', '.join(arguments)}) has '{name}' where '{port}' is passed; the order is "
                    f"{form}")
    return None


def _kinds(component, part, wanted):
    def port(name, role):
        signal = (component.inputs if role == "input" else component.outputs)[name]
        return records.message(signal, kinds_of(signal), role)

    kinds = []
    for name in wanted:
        if name == "t_ns":
            kinds.append(records.TIME)
        elif name == "p":
            kinds.append(records.parameters(component))
        elif name == "x":
            kinds.append(records.state(component))
        elif part == "place":
            kinds.append(records.placement())
        elif name in ("inputs", "outputs"):
            role = name.rstrip("s")
            kinds.append(Record(name, name, {key: port(key, role) for key in getattr(component, name)}))
        else:
            kinds.append(port(name, "input" if name in component.inputs else "output"))
    return kinds


def _line(function):
    found = source(function)
    return found.tree.lineno if found else plain(function).__code__.co_firstlineno


