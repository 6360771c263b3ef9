"""The state of reading one kernel: what its names are, and where its mistakes are reported."""

import ast
from contextlib import contextmanager
from dataclasses import dataclass, field

from flight_graph.components.kernel_rules.kinds import NOTHING, UNKNOWN, Kind, join
from flight_graph.components.sources import Source


@dataclass
class Scope:
    """One kernel that is read with given kinds of its arguments. walk: the whole reading; caller: who calls it, where."""

    walk: object
    source: Source
    names: dict
    caller: tuple | None = None  # (Scope, line)
    returns: list = field(default_factory=list)
    bounded: set = field(default_factory=set)  # names whose range a condition narrows
    depth: int = 0  # of conditions
    _quiet: int = 0

    def report(self, node: ast.AST, what: str) -> Kind:
        """A mistake at ``node``; what follows from it is unknown."""
        if not self._quiet:
            self.walk.report(self, node.lineno, what)
        return UNKNOWN

    def forbid(self, node: ast.AST, what: str | None) -> Kind:
        """A mistake, if there is one, against a rule of arithmetic."""
        return self.report(node, what) if what else UNKNOWN

    @property
    def result(self) -> Kind:
        """What the kernel returns."""
        if not self.returns:
            return NOTHING
        kind = self.returns[0]
        for other in self.returns[1:]:
            kind = join(kind, other)
        return kind

    @contextmanager
    def quiet(self):
        """Read without reporting."""
        self._quiet += 1
        returns = list(self.returns)
        yield
        self._quiet -= 1
        self.returns = returns

    @contextmanager
    def under(self, test: ast.AST | None):
        """Read what a condition governs: the names in it may have narrower ranges there."""
        before = set(self.bounded)
        self.bounded |= names_in(test)
        self.depth += 1
        yield
        self.depth -= 1
        self.bounded = before


def names_in(node: ast.AST | None) -> set:
    """All names that an expression reads."""
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name)} if node is not None else set()
