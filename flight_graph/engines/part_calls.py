"""How generated source calls a component's part: with records, or with views where the part is written with values."""

import inspect

from flight_graph.components.component import kinds_of
from flight_math.kernel import plain


def takes_views(function) -> bool:
    """Whether a part was made with `flight_math.kernel.kernel`."""
    return getattr(function, "takes_views", False)


def bundles(function) -> tuple[bool, bool]:
    """Whether a part takes its inputs, its outputs, as one named tuple each: arguments called inputs, outputs."""
    names = inspect.signature(plain(function)).parameters
    return "inputs" in names, "outputs" in names


def part_call(component, part, prefix, parameters, state, inputs, outputs) -> str:
    """The arguments of a part as text. inputs, outputs: (port, text of its record)."""
    function = getattr(component, part)
    time = ["t"] if part != "start" else []
    if not takes_views(function):
        return ", ".join([*time, parameters, state, *(record for _, record in inputs + outputs)])
    arguments = [*time, f"view({parameters}, KP_{prefix})", f"view({state}, KX_{prefix})"]
    for ports, bundled, kind in zip((inputs, outputs), bundles(function), ("I", "O")):
        views = [f"view({record}, K{kind}_{prefix}_{port})" for port, record in ports]
        arguments += [f"N{kind}_{prefix}_{part}({', '.join(views)})"] if bundled else views
    return ", ".join(arguments)


def kinds_lines(use, component, part, prefix) -> list[str]:
    """The lines that define the constants of `part_call`; their text tells kinds apart. ``use``: the component as text."""
    function = getattr(component, part)
    if not takes_views(function):
        return []
    sides = {"I": component.inputs if part in ("kernel", "update") else {},
             "O": component.outputs if part in ("kernel", "output") else {}}
    lines = ["from collections import namedtuple", "from flight_graph.components.component import kinds_of",
             "from flight_math.values import view",
             f"KP_{prefix} = {use}.parameters.kinds  # {component.parameters.kinds!r}",
             f"KX_{prefix} = {use}.state.kinds  # {component.state.kinds!r}"]
    for kind, ports in sides.items():
        name = {"I": "inputs", "O": "outputs"}[kind]
        for port, signal in ports.items():
            lines.append(f"K{kind}_{prefix}_{port} = kinds_of({use}.{name}[{port!r}])  # {kinds_of(signal)!r}")
    for kind, bundled in zip("IO", bundles(function)):
        if bundled:
            lines.append(f"N{kind}_{prefix}_{part} = namedtuple('N{kind}_{prefix}_{part}', {list(sides[kind])!r})")
    return lines
