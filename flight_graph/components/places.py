"""Where in a user's file a declaration stands, or an exception came from."""

import ast
import linecache
import sys
import traceback
from pathlib import Path

from flight_graph.components.findings import ComponentMistake, shown
from flight_graph.components.sources import tree

_LIBRARY = ("flight_graph", "flight_math", "msg_schemas")
_PACKAGES = ("cubli_ros", "spacerobot_ros", "lander_ros", "sim_nodes")
_PYTHON = Path(ast.__file__).parent  # its own library


def refuse(cls: type, name: str, what: str) -> None:
    """Raise ComponentMistake for a declaration of a class: ``file:line: Class.name: what``."""
    path, line = declaration(cls, name)
    place = f"{shown(path)}:{line}: " if path else ""
    raise ComponentMistake(f"{place}{cls.__name__}{'.' if name else ''}{name}: {what}")


def declaration(cls: type, name: str = "") -> tuple[str, int]:
    """File and line of a class's entry, of the class itself where it has no such entry; ("", 0) without a file."""
    path = getattr(sys.modules.get(cls.__module__), "__file__", None) or ""
    linecache.checkcache(path)
    whole = tree(path) if path else None
    for node in ast.walk(whole) if whole else ():
        if isinstance(node, ast.ClassDef) and node.name == cls.__name__:
            return path, next((part.lineno for part in node.body if name in _declared(part)), node.lineno)
    return path, 1


def is_own(component: type, path: str) -> bool:
    """Whether a file is the user's: of a component of our packages any of theirs, of another one none of ours."""
    own, file = _folder(component.__module__.partition(".")[0]), Path(path)
    if own is not None and own in file.parents:
        return True
    foreign = _LIBRARY if component.__module__.partition(".")[0] in _PACKAGES else (*_LIBRARY, *_PACKAGES)
    folders = [_folder(name) for name in foreign]
    return (path != "" and not any(folder in file.parents for folder in folders if folder) and _PYTHON not in file.parents
            and not {"site-packages", "dist-packages"} & set(file.parts))


def _folder(package):
    """The folder of a package; None for a single file."""
    paths = list(getattr(sys.modules.get(package), "__path__", ()))
    return Path(paths[0]) if paths else None


def innermost(error: BaseException, folder: Path) -> tuple[str, int]:
    """File and line of the innermost frame of an exception whose file lies in a folder; ("", 0) where there is none."""
    found = "", 0
    for frame in traceback.extract_tb(error.__traceback__):
        path = Path(frame.filename)
        if path.is_absolute() and folder in path.parents and "site-packages" not in path.parts:
            found = frame.filename, frame.lineno
    return found


def said(error: BaseException) -> str:
    """An exception of a user's own code, in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _declared(node) -> set:
    """The names that a statement of a class's body declares."""
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        return {node.name}
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return {part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)}
