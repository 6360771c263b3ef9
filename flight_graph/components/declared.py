"""Calling what a component's class defines in plain Python: an exception there is a sentence with its file and line."""

from pathlib import Path

from flight_graph.components.findings import ComponentMistake, nearest, shown
from flight_graph.components.places import declaration, innermost, said
from flight_graph.errors import FlightError


def call(component, name: str, *arguments):
    """``component.name(*arguments)``. Raises FlightErrors of the class's own; of any other exception ComponentMistake."""
    try:
        return getattr(component, name)(*arguments)
    except FlightError:
        raise
    except Exception as error:  # it is the user's own code
        path, line = declaration(component, name)
        path, line = max(innermost(error, Path(path).parent), (path, line), key=lambda place: place[0] != "")
        what = said(error)
        known = component.parameters.entries
        if isinstance(error, KeyError) and error.args and error.args[0] not in known:
            what = f"there is no parameter {error.args[0]!r}; {nearest(str(error.args[0]), known)}"
        place = f"{shown(path)}:{line}: " if path else ""
        raise ComponentMistake(f"{place}{component.__name__}.{name}: {what}") from error


def resolved(component, values: dict, where: str, folder: Path | None) -> dict:
    """The values that a run uses, in plain form: `Component.resolve`, then `Component.check`. Raises FlightError.

    values: checked ones, in plain form. where: what error texts call them; folder: where a relative file name starts.
    """
    found = _given_by_resolve(component, values, where, folder) if _defines(component, "resolve") else values
    if _defines(component, "check"):
        call(component, "check", found, where.removesuffix(".parameters"))
    return found


def _given_by_resolve(component, values, where, folder):
    found = call(component, "resolve", values, where, folder)
    if not isinstance(found, dict):
        raise _mistake(component, f"it returns {found!r}; it returns the values to run with: {{**values, ...}}")
    for name in found:
        if name not in component.parameters.entries:
            raise _mistake(component, f"it returns a parameter '{name}' that there is not; "
                                      f"{nearest(str(name), component.parameters.entries)}")
    missing = [name for name in component.parameters.entries if name not in found]
    if missing:
        raise _mistake(component, f"it leaves out {', '.join(missing)}; it returns all values: {{**values, ...}}")
    return component.parameters.validate(found, where)  # NumPy's numbers and arrays as plain ones, within their ranges


def _defines(component, name) -> bool:
    """Whether a component has a method of this name besides that of all."""
    return any(name in vars(cls) for cls in component.__mro__ if cls.__module__ != "flight_graph.components.component")


def _mistake(component, what) -> ComponentMistake:
    path, line = declaration(component, "resolve")
    return ComponentMistake(f"{shown(path)}:{line}: {component.__name__}.resolve: {what}")
