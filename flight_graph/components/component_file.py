"""Loading a user's file: what is wrong with it is a sentence with its line."""

import importlib
import importlib.machinery
import importlib.util
import os
import re
import sys
import threading
from pathlib import Path
from types import ModuleType

from flight_graph.components.component import Component
from flight_graph.components.findings import nearest, shown
from flight_graph.components.kernel_rules import library
from flight_graph.components.places import innermost, said
from flight_graph.errors import FlightError


class _Source(importlib.machinery.SourceFileLoader):
    """Compiles what stands in the file: a compiled form beside it (``__pycache__``) may be of another content."""

    def get_code(self, fullname):
        return self.source_to_code(importlib.util.decode_source(self.get_data(self.path)), self.path)


_loading = threading.RLock()  # a module stands among the others before it is whole


def load(source: str):
    """The module of a Python file. Raises FlightError."""
    with _loading:
        return _loaded(Path(source).resolve())


def _loaded(path):
    if not os.path.isfile(path):
        raise FlightError(f"there is no file '{path}'")
    for module in list(sys.modules.values()):
        if getattr(module, "__file__", None) == str(path):
            return module
    if path.stem in sys.modules:
        raise FlightError(f"{path}: a module called '{path.stem}' is loaded already; rename the file")
    spec = importlib.util.spec_from_file_location(path.stem, path, loader=_Source(path.stem, str(path)))
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    try:
        spec.loader.exec_module(module)
    except FlightError:
        del sys.modules[path.stem]
        raise
    except (Exception, SystemExit) as error:  # it is the user's own code
        names = vars(sys.modules.pop(path.stem))
        raise FlightError(_sentence(error, path, names)) from error
    return module


def classes(module) -> list[str]:
    """The names of the components that a module defines."""
    return [name for name, value in vars(module).items() if isinstance(value, type) and issubclass(value, Component)
            and value is not Component and value.__module__ == module.__name__]


def imported(source: str, name: str):
    """The module called ``source`` of the component ``name``. Raises FlightError."""
    try:
        return importlib.import_module(source)
    except FlightError:
        raise
    except ModuleNotFoundError as error:
        if error.name and (source == error.name or source.startswith(f"{error.name}.")):
            raise FlightError(f"'{name}': there is no module '{error.name}'") from None
        raise FlightError(f"'{name}': {_sentence(error, _file_of(source), {})}") from error
    except Exception as error:  # it is the user's own code
        raise FlightError(f"'{name}': {_sentence(error, _file_of(source), {})}") from error


def _file_of(source):
    """The file of a module that could not be loaded."""
    try:
        return Path(importlib.util.find_spec(source).origin)
    except (ImportError, AttributeError, TypeError, ValueError):
        return Path.cwd() / source


def _sentence(error, path, names):
    if isinstance(error, UnicodeDecodeError):
        line = error.object.count(b"\n", 0, error.start) + 1
        return f"{shown(str(path))}:{line}: this is no text in {error.encoding}; save the file as UTF-8"
    if isinstance(error, SystemExit):
        file, line = innermost(error, path.parent)
        return f"{shown(file)}:{line}: it ends the program while it is loaded; put that below if __name__ == '__main__':"
    if isinstance(error, SyntaxError):
        text = f": {error.text.strip()}" if error.text and error.text.strip() else ""
        return f"{shown(error.filename or str(path))}:{error.lineno or 1}: this is no Python ({error.msg}){text}"
    file, line = innermost(error, path.parent)
    place = f"{shown(file)}:{line}: " if file else f"{shown(str(path))}: "
    if isinstance(error, ModuleNotFoundError):
        near = nearest(error.name or "", sys.modules, "")
        return f"{place}there is no module '{error.name}'" + (f"; {near}" if near.startswith("did you mean") else "")
    if isinstance(error, ImportError):
        return place + _no_name(error)
    if isinstance(error, NameError) and error.name:
        instead = library.ours(error.name)
        near = nearest(error.name, names, "")
        hint = f"; write {instead} at the top of the file" if instead else (
            f"; {near}" if near.startswith("did you mean") else "")
        return f"{place}there is no name '{error.name}' here{hint}"
    if isinstance(error, AttributeError) and isinstance(error.obj, ModuleType):
        return f"{place}{error.obj.__name__} has no '{error.name}'; {nearest(error.name, dir(error.obj))}"
    return place + said(error)


def _no_name(error):
    """The sentence for ``from module import name`` of a name that is not there."""
    found = re.match(r"cannot import name '(\w+)'", str(error))
    module = sys.modules.get(error.name or "")
    if found is None or module is None:
        return said(error)
    return f"{error.name} has no '{found[1]}'; {nearest(found[1], dir(module))}"
