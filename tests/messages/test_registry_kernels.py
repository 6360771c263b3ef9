"""Every kernel of the packages keeps the rules that users' kernels are held to, and those of the house."""

import ast

import pytest

from flight_graph.components import kernel_rules, registry
from flight_math import plain

NOT_YET_CONVERTED = ("sim_nodes", "flight_graph")  # packages with kernels of the old form
MOST_ARGUMENTS = 7
COMPONENTS = sorted(registry.components())


def package_of(source) -> str:
    return source.function.__module__.partition(".")[0]


@pytest.mark.parametrize("name", COMPONENTS)
def test_nothing_is_found_in_a_kernel(name):
    assert [str(finding) for finding in kernel_rules.findings(registry.find(name))] == []


@pytest.mark.parametrize("name", COMPONENTS)
def test_kernels_are_written_with_values_and_say_what_they_do(name):
    """The rules on arithmetic hold for kernels of values alone, so nothing else may be left in a converted package."""
    component = registry.find(name)
    parts = [plain(part) for part in component.kernels()]
    for source in kernel_rules.reached(component):
        if package_of(source) in NOT_YET_CONVERTED:
            continue
        place = f"{source.path}:{source.tree.lineno} {source.tree.name}"
        assert source.takes_views, f"{place}: @kernel of flight_math"
        assert len(source.arguments) <= MOST_ARGUMENTS, f"{place}: {len(source.arguments)} arguments"
        assert source.function in parts or ast.get_docstring(source.tree), f"{place}: no docstring"


def test_no_package_is_called_unconverted_that_is_not():
    old = {package_of(source) for name in COMPONENTS for source in kernel_rules.reached(registry.find(name))
           if not source.takes_views or len(source.arguments) > MOST_ARGUMENTS}
    assert set(NOT_YET_CONVERTED) <= old, "take the converted packages out of NOT_YET_CONVERTED"
