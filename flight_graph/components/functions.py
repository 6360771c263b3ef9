"""Functions that a text names: ``module:function``, or ``file.py:function`` beside the scenario.

Only a function that its module itself defines is one; nothing of Python's own library is.
"""

import importlib.machinery
import inspect
import re
import sys
from pathlib import Path

from flight_graph.components import component_file, registry
from flight_graph.errors import FlightError, unknown
from flight_graph.text_files import short

_WORD = "[A-Za-z_][A-Za-z0-9_]{0,99}"
_NAME = re.compile(rf"({_WORD}(\.{_WORD}){{0,9}}|[^:\0]{{1,1000}}\.py):{_WORD}")


def check_name(name: str, where: str) -> None:
    """Refuse what can be no function, without importing anything. Raises FlightError."""
    if not _NAME.fullmatch(name):
        raise FlightError(f"{where}: '{short(name)}' names no function; allowed: module:function, or file.py:function")
    source = name.rpartition(":")[0]
    if not source.endswith(".py") and source.partition(".")[0] in sys.stdlib_module_names:
        raise FlightError(f"{where}: '{name}' is of Python's own library, whose functions are not called from here; name a "
                          "function of a package, or file.py:function")


def check_there(name: str, where: str) -> None:
    """Refuse a function of a package that is not there, without importing anything. Raises FlightError."""
    check_name(name, where)
    source = name.rpartition(":")[0]
    package = source.partition(".")[0]
    if not source.endswith(".py") and package not in sys.modules and not _is_there(package):
        raise FlightError(f"{where}: '{name}' cannot be loaded: there is no module '{package}'")


def load(name: str, where: str, folder: Path | None = None):
    """The function called ``name``. Raises FlightError.

    folder: where a relative file starts.
    """
    check_name(name, where)
    source, _, attribute = name.rpartition(":")
    try:
        if source.endswith(".py"):
            module = component_file.load(registry.absolute(name, folder).rpartition(":")[0])
        else:
            module = component_file.imported(source, name)
    except FlightError as error:
        raise FlightError(f"{where}: '{name}' cannot be loaded: {error}") from None
    found = getattr(module, attribute, None)
    if found is None:
        known = [key for key, value in vars(module).items() if _is_own(value, module) and not key.startswith("_")]
        raise FlightError(f"{where}: '{name}' cannot be loaded: {unknown('function', attribute, known, source)}")
    if not _is_own(found, module):
        raise FlightError(f"{where}: '{name}' is no function that {source} defines")
    return found


def _is_own(value, module) -> bool:
    """Whether a value is a function of the module's own package."""
    package = module.__name__.partition(".")[0]
    return inspect.isfunction(value) and (value.__module__ or "").partition(".")[0] == package


def _is_there(package) -> bool:
    try:
        return importlib.machinery.PathFinder.find_spec(package) is not None
    except (ImportError, ValueError):
        return False
