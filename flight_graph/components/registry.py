"""Where components are found: the executables of the installed packages, and a user's own file.

A component is named ``package/executable`` (``cubli_ros/appc_controller``), ``module:Class``, or ``path/file.py:Class``,
and inside a namespace ``NAME@namespace``.
"""

import importlib
from pathlib import Path

from flight_graph.components import component_file, kernel_rules, namespaces
from flight_graph.components.component import Component
from flight_graph.errors import FlightError, unknown

PACKAGES = ("cubli_ros", "spacerobot_ros", "lander_ros", "sim_nodes")


def executables(package: str) -> dict[str, str]:
    """The executables of a package: name -> ``module:attribute``. Raises FlightError with the nearest names."""
    if package not in PACKAGES:
        raise unknown("package", package, PACKAGES)
    return importlib.import_module(f"{package}.nodes").EXECUTABLES


def absolute(name: str, folder: Path | None) -> str:
    """``name`` with a relative ``path/file.py:Class`` made absolute; it starts in ``folder`` (the scenario's)."""
    source, _, attribute = name.rpartition(":")
    if not source.endswith(".py"):
        return name
    return f"{((folder or Path()) / source).resolve()}:{attribute}"


def component(name: str) -> type[Component]:
    """Return the component class called ``name``. Raises FlightError with the nearest names.

    A user's own component is read for mistakes first (`kernel_rules`); those of the packages when they are compiled.
    """
    plain, namespace = namespaces.split(name)
    return namespaces.within(_outside(plain), namespace)


def _outside(name: str) -> type[Component]:
    found = find(name)
    if ":" in name:
        kernel_rules.check(found)
    return found


def find(name: str) -> type[Component]:
    """The class called ``name``, as it is. Raises FlightError with the nearest names."""
    if ":" in name:
        source, _, attribute = name.rpartition(":")
        module = component_file.load(source) if source.endswith(".py") else component_file.imported(source, name)
        found = getattr(module, attribute, None)
        if not _is_component(found):
            known = component_file.classes(module)
            if found is None:
                raise unknown("component", attribute, known, source)
            raise FlightError(f"'{name}' is not a component (a subclass of flight_graph.components.component.Component)"
                              + (f"; {source} has {', '.join(known)}" if known else ""))
        return found
    if name.endswith(".py"):
        raise FlightError(f"'{name}' is a file; name the component in it: {name}:Class")
    package, _, executable = name.partition("/")
    if not package or not executable:
        raise FlightError(f"'{name}' names no component; write package/executable, module:Class or file.py:Class")
    table = executables(package)
    if executable not in table:
        raise unknown("executable", executable, table, package)
    source, _, attribute = table[executable].partition(":")
    found = getattr(component_file.imported(source, name), attribute)
    if not _is_component(found):
        raise FlightError(f"'{name}' is not a component (a subclass of flight_graph.components.component.Component)")
    return found


def components() -> dict[str, type[Component]]:
    """All components of the installed packages by ``package/executable``."""
    found = {}
    for package in PACKAGES:
        for executable, target in executables(package).items():
            source, _, attribute = target.partition(":")
            if source.startswith("flight_graph."):
                continue  # a program of this package, which may need rclpy
            value = getattr(importlib.import_module(source), attribute)
            if _is_component(value):
                found[f"{package}/{executable}"] = value
    return found


def _is_component(value) -> bool:
    return isinstance(value, type) and issubclass(value, Component) and value is not Component
