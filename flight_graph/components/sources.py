"""The syntax tree of a kernel, and what its names stand for."""

import ast
import builtins
import linecache
from dataclasses import dataclass
from functools import cached_property
from types import FunctionType

from flight_graph.syntax import parse
from flight_math.kernel import plain

MISSING = object()
_TREES = {}  # file -> (its lines, first line of a function -> the function's tree)


@dataclass(frozen=True)
class Source:
    """One function: its tree, its file, and the objects that its global names mean."""

    function: FunctionType
    tree: ast.FunctionDef

    @property
    def path(self) -> str:
        return self.function.__code__.co_filename

    @property
    def arguments(self) -> list[str]:
        return [argument.arg for argument in (*self.tree.args.posonlyargs, *self.tree.args.args)]

    @cached_property
    def local_names(self) -> frozenset:
        code = self.function.__code__
        return frozenset((*code.co_varnames, *code.co_cellvars))

    def meaning(self, name: str):
        """The object behind a name that is not local; MISSING when there is none."""
        code = self.function.__code__
        if name in code.co_freevars:
            try:
                return self.function.__closure__[code.co_freevars.index(name)].cell_contents
            except ValueError:
                return MISSING
        return self.function.__globals__.get(name, getattr(builtins, name, MISSING))


def source(function) -> Source | None:
    """The source of a kernel (compiled or plain); None where there is no file to read it from."""
    function = plain(function)
    if not isinstance(function, FunctionType):
        return None
    code = function.__code__
    tree = _functions(code.co_filename).get(code.co_firstlineno)
    return Source(function, tree) if tree is not None and tree.name == function.__name__ else None


def tree(path: str) -> ast.Module | None:
    """The syntax tree of a file; None when it cannot be read."""
    try:
        return parse("".join(linecache.getlines(path)))
    except SyntaxError:
        return None


def is_decorated(function) -> bool:
    """Whether a plain function stands under a decorator in its file."""
    found = source(function)
    return found is not None and bool(found.tree.decorator_list)


def _functions(path):
    lines = linecache.getlines(path)
    if path not in _TREES or _TREES[path][0] is not lines:
        found, whole = {}, tree(path)
        for node in ast.walk(whole) if whole else ():
            if isinstance(node, ast.FunctionDef):
                found[min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])] = node
        _TREES[path] = lines, found
    return _TREES[path][1]
