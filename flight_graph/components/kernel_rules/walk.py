"""Reading a component: each of its parts, and every kernel that it calls, with the kinds of what is passed."""

import sys

from flight_graph.components.findings import Finding, shown
from flight_graph.components.kernel_rules import statements
from flight_graph.components.kernel_rules.kinds import UNKNOWN, Kind
from flight_graph.components.kernel_rules.scope import Scope
from flight_graph.components.places import is_own
from flight_graph.components.sources import Source, source
from flight_math.kernel import plain


class Walk:
    """All that is read for one part of a component. findings: what was found; sources: of what was read."""

    def __init__(self, component, part: str):
        self.component, self.part = component, part
        self.module = sys.modules[component.__module__]
        self.findings: list[Finding] = []
        self.sources: list[Source] = []
        self._results, self._said, self._under_way = {}, set(), []

    def kernel(self, function, kinds: list, caller=None) -> Kind:
        """Read a kernel with arguments of these kinds, once; return the kind of its result."""
        key = (plain(function), *kinds)
        if plain(function) in self._under_way:
            scope, line = caller
            self.report(scope, line, f"{function.__name__} calls itself, which no kernel may; write a loop over a range")
            return UNKNOWN
        if key not in self._results:
            self._results[key] = UNKNOWN
            found = source(function)
            if found is not None:
                self.sources.append(found)
            if found is not None and len(found.arguments) == len(kinds):
                scope = Scope(self, found, dict(zip(found.arguments, kinds)), caller)
                self._under_way.append(plain(function))
                statements.read(scope, found.tree.body)
                self._under_way.pop()
                self._results[key] = scope.result
        return self._results[key]

    def report(self, scope: Scope, line: int, what: str) -> None:
        """Note a mistake at the innermost line in the user's files."""
        path, inner = scope.source.path, ""
        while not is_own(self.component, path) and scope.caller is not None:
            if not inner:
                inner = f"in {scope.source.function.__name__} ({shown(path)}:{line}): "
            scope, line = scope.caller
            path = scope.source.path
        finding = Finding(path, line, f"{self.component.__name__}.{self.part}", inner + what)
        if (path, what) not in self._said:  # once is enough, also where it is written often
            self._said.add((path, what))
            self.findings.append(finding)
