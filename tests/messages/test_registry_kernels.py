"""Every kernel of the packages keeps the rules that users' kernels are held to, and those of the house."""

import ast

import pytest

from flight_graph.components import kernel_rules, registry
from flight_math import plain

MOST_ARGUMENTS = 7
COMPONENTS = sorted(registry.components())


@pytest.mark.parametrize("name", COMPONENTS)
def test_nothing_is_found_in_a_kernel(name):
    assert [str(finding) for finding in kernel_rules.findings(registry.find(name))] == []


@pytest.mark.parametrize("name", COMPONENTS)
def test_kernels_say_what_they_do_and_take_few_arguments(name):
    component = registry.find(name)
    parts = [plain(part) for part in component.kernels()]
    for source in kernel_rules.reached(component):
        place = f"{source.path}:{source.tree.lineno} {source.tree.name}"
        assert len(source.arguments) <= MOST_ARGUMENTS, f"{place}: {len(source.arguments)} arguments"
        assert source.function in parts or ast.get_docstring(source.tree), f"{place}: no docstring"
