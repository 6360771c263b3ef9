"""Python text as a syntax tree, from any thread: CPython 3.11 counts the depth of its parser once for all threads."""

import ast
import threading

_ONE_AT_A_TIME = threading.RLock()


def parse(text: str, mode: str = "exec") -> ast.AST:
    """`ast.parse`, one at a time. Raises SyntaxError and what it raises else."""
    with _ONE_AT_A_TIME:
        return ast.parse(text, mode=mode)
